"""Whether the springs that hold a motion are soft enough: peak and mean reactions at ten times their stiffness."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from hbm.balance.settings import DEFAULT
from hbm.continuation.branch import Branch
from hbm.continuation.corrector import solve_fixed
from hbm.continuation.point import Point
from hbm.continuation.settings import Settings
from hbm.curve.trace import Outputs
from hbm.parameter import Equation
from hbm.peaks import Output
from hbm.problem import ContactProblem
from hbm.result import KINDS


def stiffer_change(equation: Equation, branch: Branch, rows: np.ndarray, settings: Settings) -> float:
    """Largest relative change of the highest amplitude and of the mean reactions there at ten times the stiffness.

    rows : (m, r) outputs. Reactions count beside the excitation, where that is larger. 0 where no spring holds a
    motion; NaN where the stiffer problem was not solved.
    """
    problem = equation.balance.problem
    solved = [point for point in branch.points if point.converged]
    if all(one.mean for one in problem.held):
        return 0.0
    if not solved:
        return float("nan")
    heights = Output(equation, branch, Outputs(rows), (KINDS[0], []), settings).heights(solved)
    i, j = np.unravel_index(heights.argmax(), heights.shape)
    stiffer = replace(equation, balance=equation.balance.rebuilt(problem.with_stiffer_holds(DEFAULT.stiffer),
                                                                 equation.balance.forces))
    again = [_again(stiffer, solved[k], problem, settings) for k in _flanks(heights[:, j], int(i))]
    if not all(point.converged for point in again):
        return float("nan")
    output = Output(stiffer, Branch(again), Outputs(rows[[j]]), (KINDS[0], []), settings)
    after = output.heights(again)[:, 0]
    top, height = again[int(after.argmax())], after.max()
    if len(again) == 3:
        best, _ = output.largest(0, after, np.full(3, True))
        top, height = best.point, best.value
    reactions = np.array([_mean_reactions(point) for point in (solved[i], top)])
    force = np.linalg.norm([np.linalg.norm(F) for F in equation.balance.forces.values()])
    sizes = [force * np.abs(one.motion).max() for one in problem.held]
    scale = np.maximum(np.maximum(np.abs(reactions[0]), sizes), 1e-300)
    change = np.abs(reactions[1] - reactions[0]) / scale
    return float(max(abs(height / max(heights[i, j], 1e-300) - 1), change.max()))


def change_in_words(change: float, held: Iterable[str]) -> str:
    """A sentence where the springs that hold motions are not known to be soft; empty where they are."""
    if change <= DEFAULT.hold_differs:
        return ""
    found = f"the peak or the mean reaction changes by {change:.2g}" if change > 0 else "no solution was found"
    return (f"with ten times the stiffness of what holds {', '.join(held)}, {found}: contacts or inertia compete with "
            "it; try another stiffness, or mean = true")


def _flanks(heights, i):
    """Indices of the highest point i and of one clearly lower on each side; i alone at an end."""
    low = np.flatnonzero(heights < (1 - DEFAULT.hold_flank) * heights[i])
    before, after = low[low < i], low[low > i]
    return (int(before[-1]), i, int(after[0])) if len(before) and len(after) else (i,)


def _again(stiffer: Equation, point: Point, problem: ContactProblem, settings: Settings) -> Point:
    """The point with the stiffer springs, from where the same mean force moves the body less."""
    rest = point.detail.balance.reaction_rows @ point.detail.modal
    back = sum(((1 / DEFAULT.stiffer - 1) * rest[k, 0].real / one.stiffness * one.motion
                for k, one in enumerate(problem.held) if not one.mean), np.zeros(len(problem.K)))
    x = point.x.reshape(-1, stiffer.balance.nh).copy()
    x[:, 0] += problem.B @ back
    return solve_fixed(stiffer.evaluate, x.ravel(), point.parameter, stiffer.weights, settings)


def _mean_reactions(point):
    """(h,) N or N m."""
    return (point.detail.balance.reaction_rows @ point.detail.modal)[:, 0].real
