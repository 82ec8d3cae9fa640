"""Whether the springs that hold a motion are soft enough: peak and mean reactions at ten times
their stiffness."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.peaks import Output
from tipdamp.hbm.hold.rigid_motion import HOLD
from tipdamp.hbm.result import ForcedResponse


class Stiffer(NamedTuple):
    """What ten times the stiffness of the springs changes: the largest relative change of the
    highest amplitude and, as a share of the excitation, of the mean reactions there; and that of
    reactions that follow the stiffness, since contacts that stick carry them, as a share of their
    own size.

    0 where no spring holds a motion, NaN where the stiffer problem was not solved.
    """

    change: float = 0.0
    of_reaction: float = 0.0


def stiffer_change(
    equation: Equation, branch: Branch, outputs: Outputs, settings: Settings
) -> Stiffer:
    """What stiffer springs change at the highest amplitude of the outputs."""
    problem = equation.balance.problem
    solved = [point for point in branch.points if point.converged]
    if all(one.mean for one in problem.held):
        return Stiffer()
    if not solved:
        return Stiffer(np.nan, np.nan)
    heights = outputs.amplitudes(solved)[0]
    i, j = np.unravel_index(heights.argmax(), heights.shape)
    flanks = [solved[k] for k in _flanks(heights[:, j], int(i))]
    ways = (_followed(equation, flanks, steps, settings) for steps in HOLD.stiffer_steps)
    found = next((way for way in ways if all(point.converged for point in way[1])), None)
    if found is None:
        return Stiffer(np.nan, np.nan)
    stiffer, again = found
    output = Output(stiffer, Branch(again), Outputs(outputs.rows[[j]]), settings)
    after = output.outputs.amplitudes(again)[0][:, 0]
    top, height = again[int(after.argmax())], after.max()
    if len(again) == 3:
        best, _ = output.largest(0, after, np.full(3, True))
        top, height = best.point, best.value
    return _compared(equation, (solved[i], top), height / max(heights[i, j], np.finfo(float).tiny))


def _compared(equation: Equation, points: tuple[Point, Point], ratio: float) -> Stiffer:
    """points : at the highest amplitude, before and after; ratio : of their heights."""
    before, after = (np.abs(_mean_reactions(point)) for point in points)
    change = np.abs(_mean_reactions(points[1]) - _mean_reactions(points[0]))
    applied = points[0].detail.balance.forces.values()
    force = np.linalg.norm([np.linalg.norm(F) for F in applied])
    excitation = np.array([force * one.extent for one in equation.balance.problem.held])
    follows = (after > HOLD.follows * before) & (after > HOLD.no_reaction * excitation)
    beside = change / np.maximum(np.maximum(before, excitation), np.finfo(float).tiny)
    own = change / np.maximum(after, np.finfo(float).tiny)
    return Stiffer(
        float(max(abs(ratio - 1), beside.max(where=~follows, initial=0.0))),
        float(own.max(where=follows, initial=0.0)),
    )


def hold_in_words(curve: ForcedResponse, problem: ContactProblem) -> Iterator[str]:
    """Sentences where the springs that hold motions are not known to be soft, where contacts that
    stick carry what they seem to, and where a body has moved out of small displacements."""
    held = ", ".join(curve.held)
    if not curve.held_change <= HOLD.hold_differs:
        found = (
            f"the peak or the mean reaction changes by {curve.held_change:.2g}"
            if curve.held_change > 0
            else "no solution was found"
        )
        yield (
            f"with ten times the stiffness of what holds {held}, {found}: contacts or inertia "
            "compete with it; try another stiffness, or mean = true"
        )
    if curve.held_reaction_change > 0:
        yield (
            f"with ten times the stiffness of what holds {held}, its mean force changes by "
            f"{100 * curve.held_reaction_change:.0f} % of itself: sticking contacts carry the "
            "mean force, and the spring takes a share of it that its stiffness decides; mean = "
            "true gives what a stop would take"
        )
    for one, reaction in zip(problem.held, np.moveaxis(curve.reaction, 1, 0), strict=True):
        if one.mean or not np.isfinite(reaction).any():
            continue
        moved = np.nanmax(np.abs(reaction).sum(axis=1)) / one.stiffness
        if moved > one.small:
            unit = "m" if one.unit == "N" else "rad"
            mean = np.nanmax(np.abs(reaction[:, 0])) / one.stiffness
            yield (
                f"{one.name}: moves by up to {moved:.2g} {unit}, of which the mean is {mean:.2g} "
                f"{unit}, on a hold of {one.stiffness:.3g} {one.unit}/{unit}; equations for small "
                f"displacements hold up to about {one.small:.2g} {unit}: give a larger stiffness, "
                "or mean = true"
            )


def _flanks(heights: np.ndarray, i: int) -> tuple[int, ...]:
    """Indices of the highest point i and of one clearly lower on each side; i alone at an end."""
    low = np.flatnonzero(heights < (1 - HOLD.hold_flank) * heights[i])
    before, after = low[low < i], low[low > i]
    return (int(before[-1]), i, int(after[0])) if len(before) and len(after) else (i,)


def _followed(
    equation: Equation, points: Sequence[Point], steps: int, settings: Settings
) -> tuple[Equation, list[Point]]:
    """The equation with the stiffer springs and the points there, in so many steps of the
    stiffness."""
    problem = equation.balance.problem
    there = equation
    found = list(points)
    for factor in np.geomspace(1.0, HOLD.stiffer, steps + 1)[1:]:
        before = there.balance.problem
        there = replace(
            equation,
            balance=equation.balance.rebuilt(
                problem.with_stiffer_holds(factor), equation.balance.forces
            ),
        )
        found = [_again(there, point, before, settings) for point in found]
        if not all(point.converged for point in found):
            break
    return there, found


def _again(stiffer: Equation, point: Point, before: ContactProblem, settings: Settings) -> Point:
    """The point with the stiffer springs, from where the same mean force moves the body less."""
    rest = _mean_reactions(point)
    back = sum(
        (
            (one.stiffness / new.stiffness - 1) * rest[k] / one.stiffness * one.motion
            for k, (one, new) in enumerate(
                zip(before.held, stiffer.balance.problem.held, strict=True)
            )
            if not one.mean
        ),
        np.zeros(len(before.K)),
    )
    x = point.x.reshape(-1, stiffer.balance.nh).copy()
    x[:, 0] += before.B @ back
    return solve_fixed(stiffer.evaluate, x.ravel(), point.parameter, stiffer.weights, settings)


def _mean_reactions(point: Point) -> np.ndarray:
    """(h,) N or N m."""
    return (point.detail.balance.reaction_rows @ point.detail.modal)[:, 0].real
