"""The branch over the level of the force at one frequency, for the curves of several levels at
once.

It starts from the smallest motion of the lowest curve. Where it crosses the level of a curve at a
motion that this curve does not hold there lies a further solution: of a branch that comes back over
a fold, such as a detached resonance. Its steps are long and its points rough, as only what is new
is solved to the tolerance.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Level
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.arc import metric_at, on_cubic
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.closed import follow_one_way
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.follow import BudgetExceeded
from tipdamp.hbm.continuation.point import size
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.guess import of_orders
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.search.beside import JUST_BELOW, growth, motion_weights

ROUGH = replace(DEFAULT, aim=0.1, largest_error=2.0, largest_step=2.0, tolerance=1e-4)
MOST_POINTS = 300  # of a branch
NEAR = 0.1  # of a motion: between points, rough or drawn, motions that are nearer are one


@dataclass(frozen=True)
class AtLevel:
    """What the branch over the level at one frequency holds for one curve.

    value : of the parameter of the curve; further : (n,) unknowns of each solution that the curve
    may not hold; reach : up to how many times the force of the curve the branch was followed;
    calls : evaluations of the residual, of the whole branch
    """

    value: float
    further: tuple[np.ndarray, ...]
    reach: float
    calls: int

    @property
    def reached(self) -> bool:
        """Whether the branch was followed beyond the level of the curve."""
        return self.reach > 1.0


def places(curve: ForcedResponse, equation: Equation, count: int) -> list[float]:
    """So many values of the parameter spread over the band of a curve, one of them where its
    outputs are largest inside it: first those where its motion grows faster than the force, as a
    fold lies ahead, else far from each other."""
    low, high = float(curve.parameter.min()), float(curve.parameter.max())
    shares = (np.arange(count) + 0.5) / count
    values = (low + shares[_far_apart(count)] * (high - low)).tolist()

    def grows(value: float) -> float:
        balance, w = equation.balance_at(equation.parameter.scale * value)
        return growth(balance, w, min(_held(curve, value), key=np.linalg.norm))

    found = np.array(sorted(values, key=grows, reverse=True))
    if low < (top := _highest(curve)) < high:
        found[np.abs(found - top).argmin()] = top
    return found.tolist()


def _highest(curve: ForcedResponse) -> float:
    """The value at which the outputs are largest, each by its own highest point."""
    height = np.where(curve.converged[:, None], curve.amplitude(), 0.0)
    share = height / np.maximum(height.max(axis=0), np.finfo(float).tiny)
    return float(curve.parameter[share.sum(axis=1).argmax()])


def _far_apart(count: int) -> list[int]:
    """Places 0..count-1 in an order in which those that follow each other are far apart, from the
    middle on: by their binary digits reversed."""
    digits = max(count - 1, 1).bit_length()
    order = sorted(range(count), key=lambda i: int(f"{i:0{digits}b}"[::-1], 2))
    return [(i + count // 2) % count for i in order]


def over_levels(
    curves: Sequence[ForcedResponse], problem: AnyProblem, value: float, top: float, calls: int
) -> list[AtLevel]:
    """What lies beside each of some curves of one pattern of forces, of rising levels, at a value
    of their parameter.

    top : up to so many times the highest level the branch is followed, in at most that many calls
    of the residual
    """
    finest = max(curves, key=lambda one: (one.H, _force(one)))
    balance, w = _balance_at(finest, problem, value)
    levels = [_force(one) / _force(finest) for one in curves]
    branch, used = _followed(balance, w, _smallest(curves[0], value, balance), levels, top, calls)
    reached = max((float(point.parameter) for point in branch.points), default=0.0)
    found = []
    for curve, level in zip(curves, levels, strict=True):
        strange = _strange(branch, level, balance, [*_held(curve, value)], curve.H)
        own = balance if curve.H == balance.H else _balance_at(curve, problem, value)[0]
        factor = level if own is balance else 1.0
        further = _solved(strange, own, w, factor)
        found.append(AtLevel(value, further, reached / level, used))
    return found


def _followed(
    balance: HarmonicBalance,
    w: float,
    x: np.ndarray,
    levels: Sequence[float],
    top: float,
    calls: int,
) -> tuple[Branch, int]:
    """(the branch from near x (n,) at the lowest level, residual calls); without points where no
    solution was found there."""
    equation, used = Equation(balance, Level(), w / (2 * np.pi)), 0

    def count() -> None:
        nonlocal used
        used += 1
        if used > calls:
            raise BudgetExceeded

    balance.on_call = count
    try:
        start = solve_fixed(equation.evaluate, x, levels[0], balance.weights, DEFAULT)
        if not start.converged:
            return Branch([]), used
        band = JUST_BELOW * levels[0], top * levels[-1]
        branch = follow_one_way(equation.evaluate, start, band, balance.weights, ROUGH, MOST_POINTS)
        return branch, used
    except BudgetExceeded:  # before the first point
        return Branch([]), used
    finally:
        balance.on_call = None


def _strange(
    branch: Branch, level: float, balance: HarmonicBalance, held: list[np.ndarray], H: int
) -> list[np.ndarray]:
    """(n,) motions of the branch at a level, in H harmonics, each of which is none of those that
    are held; each of these stands for one of the branch."""
    weights = of_orders(motion_weights(balance), balance.n_components, H)

    def away(x: np.ndarray, other: np.ndarray) -> float:
        return size(weights * (x - other)) / max(size(weights * other), 1e-300)

    found = []
    for a, b in zip(branch.points[:-1], branch.points[1:], strict=True):
        if not min(a.parameter, b.parameter) <= level < max(a.parameter, b.parameter):
            continue
        there = on_cubic(a, b, level, metric_at(a, balance.weights))
        x = of_orders(there, balance.n_components, H)
        distances = [away(x, one) for one in held]
        if min(distances, default=np.inf) < NEAR:
            del held[int(np.argmin(distances))]
        else:
            found.append(x)
    return found


def _solved(
    guesses: Sequence[np.ndarray], balance: HarmonicBalance, w: float, level: float
) -> tuple[np.ndarray, ...]:
    """(n,) unknowns of the solutions at a level near motions (n,)."""
    evaluate = Equation(balance, Level(), w / (2 * np.pi)).evaluate
    points = [solve_fixed(evaluate, x, level, balance.weights, DEFAULT) for x in guesses]
    return tuple(point.x for point in points if point.converged)


def _balance_at(
    curve: ForcedResponse, problem: AnyProblem, value: float
) -> tuple[HarmonicBalance, float]:
    """(the balance of a curve at a value of its parameter, w in rad/s)."""
    equation, _ = restored(curve, problem)
    return equation.balance_at(equation.parameter.scale * value)


def _force(curve: ForcedResponse) -> float:
    return float(np.linalg.norm(curve.forces))


def _held(curve: ForcedResponse, value: float) -> Iterator[np.ndarray]:
    """(n,) unknowns of each motion of a curve at a value, linear between its points."""
    parameter, x = curve.parameter, curve.unknowns
    for i, (a, b) in enumerate(pairwise(parameter)):
        if (a - value) * (b - value) <= 0 and a != b and curve.converged[i : i + 2].all():
            share = (value - a) / (b - a)
            yield (1 - share) * x[i] + share * x[i + 1]


def _smallest(curve: ForcedResponse, value: float, balance: HarmonicBalance) -> np.ndarray:
    """(n,) unknowns of the smallest motion of a curve at a value, in the harmonics of a balance."""
    x = min(_held(curve, value), key=np.linalg.norm)
    return of_orders(x, balance.n_components, balance.H)
