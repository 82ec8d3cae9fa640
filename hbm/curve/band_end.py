"""At the ends of a band: solutions there that the branch does not reach inside it.

A hardening resonance may lie beyond the end, with its fold. The branch then ends at its upper
solution as if that were the only one, while the lower one lies inside the band too, and between the
two an unstable one that leaves through the same end. Newton's method from the linear response leads
to the lower one in three or four evaluations. Where it does, the branch is followed to its fold.

Where the band begins or ends between two folds the branch may be on the lower solution there, to
which the linear response leads, too. Followed outwards it comes to the fold over which it returns
into the band.

What is not found so stays unknown: a curve knows its own branch alone.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.beyond import fold_ahead, return_ahead
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point, size
from tipdamp.hbm.continuation.settings import Settings


@dataclass(frozen=True)
class EndSettings:
    """How far is looked for what lies beyond the ends of a band."""

    calls: int = 40  # of the residual, for another solution there, which takes four
    differs: float = 1e-2  # of the motion; nearer ones may differ in an undetermined mean alone
    fold_calls: int = 1000  # of the residual, up to the fold: a lightly damped one takes some 200
    reach: float = 2.0  # times the parameter at the end, or divided by it: limit for the fold
    outside_calls: int = 200  # of the residual, to a fold outside and back: a Duffing takes 130


SETTINGS = EndSettings()


@dataclass(frozen=True)
class BandEnds:
    """further : solutions at the ends of the band that the branch does not reach inside it, in
    words; empty where none was found
    confirmed : whether the solution to which the linear response leads at the last end is that of
        the branch: followed back from there it would be the same
    """

    further: str = ""
    confirmed: bool = False


def band_ends(
    equation: Equation, branch: Branch, last: float, beyond: float | None, settings: Settings
) -> BandEnds:
    """What is known of solutions at the ends of the band.

    beyond : up to which value the branch was followed past its end; None looks for its fold here
    """
    if branch.end != "end" or not branch.points[-1].converged:
        return BandEnds()
    first, end = branch.points[0], branch.points[-1]
    onwards = np.sign(last - first.parameter)
    begin, _ = _at_an_end(equation, branch, first, -onwards, None, settings)
    begin = begin or _folds_outside(equation, branch, first, -onwards, settings)
    there, confirmed = _at_an_end(equation, branch, end, onwards, beyond, settings)
    there = there or _folds_outside(equation, branch, end, onwards, settings)
    return BandEnds("; ".join(words for words in (begin, there) if words), confirmed)


def _folds_outside(
    equation: Equation, branch: Branch, point: Point, outwards: float, settings: Settings
) -> str:
    """Words on the fold over which the branch comes back into the band, followed outwards from one
    of its ends; empty where that is not found with few calls."""
    if not (point.converged and _elastic(point)):
        return ""
    most = SETTINGS.outside_calls
    fold, _ = _followed(equation, branch, point, outwards, (return_ahead, most), settings)
    if fold is None:
        return ""
    name = equation.parameter.named
    scale = equation.parameter.scale
    return (
        f"the branch folds outside the band, near {name(fold / scale)}, and comes back to "
        f"{name(point.parameter / scale)}: more solutions may lie inside, and a larger resonance "
        "among them; a band that reaches past the fold holds them"
    )


def _elastic(point: Point) -> bool:
    """Whether forces without memory act. Friction is left out: it folds a branch through lift-off
    alone, and its curves would take twice as long."""
    detail = point.detail
    alternating = detail.forces.g[:, :, 1:]  # of stuck springs none; a resumed curve knows g alone
    return detail.balance.problem.law.states == 0 and bool(alternating.any())


def _at_an_end(
    equation: Equation,
    branch: Branch,
    end: Point,
    outwards: float,
    beyond: float | None,
    settings: Settings,
) -> tuple[str, bool]:
    """(words on the solution at an end of the branch to which Newton's method leads from the linear
    response, empty where the branch has it; whether it has it)"""
    value = end.parameter
    known = [point for point in branch.points if point.converged and point.parameter == value]
    other = _from_linear_response(equation, value, settings)
    branch.calls += other.iterations
    if not other.converged:
        return "", False
    if any(_alike(other, point, equation.weights) for point in known):
        return "", True
    fold = None
    looked = beyond
    if beyond is None:
        most = SETTINGS.fold_calls
        fold, looked = _followed(equation, branch, end, outwards, (fold_ahead, most), settings)
    parameter = equation.parameter
    named = (
        None if one is None else parameter.named(one / parameter.scale) for one in (fold, looked)
    )
    said = _at_the_begin if end is branch.points[0] else _at_the_end
    return said(parameter.named(value / parameter.scale), *named), False


def _at_the_end(value: str, fold: str | None, looked: str | None) -> str:
    """fold, looked : where the branch folds beyond the end, how far it was followed, or None."""
    found = f"another solution at {value}, where the band ends"
    if fold is not None:
        return (
            f"the branch leaves the band before its fold, near {fold}: there is {found}, and "
            "more may lie inside; a band that ends beyond the fold holds them, as does the "
            "option `beyond` in Python"
        )
    where = f", and no fold was found up to {looked}" if looked is not None else ""
    return (
        f"there is {found}, to which the branch does not lead inside the band{where}: more may "
        "lie inside; another end of the band, or the other direction, may hold them"
    )


def _at_the_begin(value: str, fold: str | None, looked: str | None) -> str:
    """As `_at_the_end`, where the branch begins."""
    found = f"another solution at {value}, where the band begins"
    if fold is not None:
        return (
            f"the branch begins past a fold, near {fold}: there is {found}, and more may lie "
            "inside; a band that begins beyond the fold, or the other direction, holds them"
        )
    where = f", and no fold was found back to {looked}" if looked is not None else ""
    return (
        f"there is {found}, to which the branch does not lead inside the band{where}: more may "
        "lie inside; another begin of the band, or the other direction, may hold them"
    )


def _from_linear_response(equation: Equation, last: float, settings: Settings) -> Point:
    """The solution to which Newton's method leads from there, as a point of the branch."""

    def way(balance: HarmonicBalance, w: float) -> Iterator[Point]:
        linear = balance.linear(w)
        yield solve_fixed(balance.evaluate, linear, w, balance.weights, settings, SETTINGS.calls)

    return next(equation.solutions(last, way, settings))


def _alike(a: Point, b: Point, weights: np.ndarray) -> bool:
    apart = size(weights * (a.x - b.x))
    return apart <= SETTINGS.differs * max(size(weights * a.x), size(weights * b.x))


def _followed(
    equation: Equation,
    branch: Branch,
    point: Point,
    sense: float,
    to: tuple[Callable, int],
    settings: Settings,
) -> tuple[float | None, float | None]:
    """(where the branch folds on from a point in a sense of the parameter or None, how far it was
    followed or None); over the frequency alone: other parameters may have no meaning there.

    to : how it is followed, and with how many residual calls
    """
    if not np.isnan(equation.hz):
        return None, None
    limit = point.parameter * SETTINGS.reach**sense
    start = solve_fixed(equation.evaluate, point.x, point.parameter, equation.weights, settings)
    branch.calls += start.iterations
    if not start.converged:
        return None, None
    ahead, most = to
    fold, looked, calls = ahead(
        equation.evaluate, start, limit, equation.weights, replace(settings, max_points=most), most
    )
    branch.calls += calls
    return fold, looked
