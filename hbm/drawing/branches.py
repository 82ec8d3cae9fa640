"""What a curve looks like in every picture: unstable parts dashed, marks of named points, of
failures and of peaks, the band of the estimated error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tipdamp.hbm.drawing.figure import VERMILION, Band, Curve, Item, Marks
from tipdamp.hbm.named_point import Kind

if TYPE_CHECKING:
    from tipdamp.hbm.result import ForcedResponse

BIFURCATIONS = {  # symbol of each kind of named point
    "fold": "square",
    "symmetry breaking": "diamond",
    "branch point": "hexagram",
    "period doubling": "x",
    "Neimark-Sacker": "circle",
    "grazing": "cross",
}
CONTACTS = {"onset of slip": "triangle-up", "lift-off": "triangle-down", "separation": "star"}


class Place(NamedTuple):
    """Where a named point stands in a picture."""

    kind: Kind
    x: float
    y: float


def with_gaps(curve: ForcedResponse, *values: np.ndarray) -> list[np.ndarray]:
    """The parameter of the points of a curve and values (n,) there, with NaN wherever the branch
    does not lead from one point to the next."""
    at = np.flatnonzero(curve.jumps)
    gaps = (np.insert(np.asarray(value, dtype=float), at, np.nan) for value in values)
    return [np.insert(curve.parameter, at, curve.parameter[at]), *gaps]


def named_amplitudes(curve: ForcedResponse) -> np.ndarray:
    """(k, m) m, half of peak to peak of the outputs at the named points of a curve."""
    found = [one.amplitudes for one in curve.named_points]
    return np.reshape(np.array(found, dtype=float), (len(found), len(curve.output_names)))


def between_points(curve: ForcedResponse, amplitude: np.ndarray) -> np.ndarray:
    """(k,) at the named points of a curve of an amplitude (n,) that is known at its points alone:
    the mean of the two beside each."""
    beside = (amplitude[one.index : one.index + 2] for one in curve.named_points)
    return np.array([pair.mean() for pair in beside])


def branch_lines(
    curve: ForcedResponse,
    amplitude: np.ndarray,
    named: np.ndarray,
    name: str,
    color: str,
    width: float = 1.6,
) -> Iterator[Item]:
    """An amplitude (n,) along a curve, and (k,) at its named points: unstable parts dashed, each up
    to the named points at which stability changes, or to the points beside it where none is known;
    a gap where the branch does not lead on, and a dot for a point by itself."""
    gaps, turns = np.flatnonzero(curve.jumps), _changes(curve)
    turning = [curve.named_points[k] for k in turns]
    at = np.r_[gaps, [one.index + 1 for one in turning]].astype(int)
    x = np.insert(
        curve.parameter, at, np.r_[curve.parameter[gaps], [one.parameter for one in turning]]
    )
    drawn = np.insert(amplitude, at, np.r_[np.full(len(gaps), np.nan), named[turns]])
    unstable = np.insert(curve.unstable, at, False)
    yield Curve(x, np.where(unstable, np.nan, drawn), name, color, width=width)
    if unstable.any():
        dashed = np.where(unstable | _next_to(unstable), drawn, np.nan)
        yield Curve(x, dashed, "unstable", color, "dash", width)
    known = np.isfinite(drawn)
    alone = known & ~_next_to(known)
    if alone.any():
        yield Marks(x[alone], drawn[alone], "", color, size=2 * width)


def _next_to(points: np.ndarray) -> np.ndarray:
    """(n,) bool, before or after one of the points (n,) bool."""
    return np.r_[False, points[:-1]] | np.r_[points[1:], False]


def _changes(curve: ForcedResponse) -> list[int]:
    """Places in the named points of those at which a curve changes from stable to unstable or back:
    of several between two points the one next to the stable part."""
    stable, unstable = curve.stable, curve.unstable
    found = list[int]()
    for i in np.flatnonzero((stable[:-1] & unstable[1:]) | (unstable[:-1] & stable[1:])):
        here = [
            k
            for k, one in enumerate(curve.named_points)
            if one.index == i and one.kind in BIFURCATIONS
        ]
        found += here[:1] if stable[i] else here[-1:]
    return found


def error_band(curve: ForcedResponse, amplitude: np.ndarray, error: np.ndarray, color: str) -> Band:
    """Around an amplitude (n,): what the orders left out may change, by their estimate (n,); a gap
    where that is no estimate, or the branch does not lead on."""
    error = np.where(curve.doubtful, np.nan, error)
    x, low, high = with_gaps(curve, amplitude - error, amplitude + error)
    return Band(x, low, high, "estimated error", color, 0.4)


def named_marks(places: Sequence[Place], kinds: Mapping[str, str], color: str) -> Iterator[Item]:
    """Marks of the named points of some kinds {kind: symbol}, each kind an entry of the legend."""
    for kind, symbol in kinds.items():
        at = [(one.x, one.y) for one in places if one.kind == kind]
        if at:
            x, y = np.array(at).T
            yield Marks(x, y, kind, color, symbol, size=6.0)


def outermost(places: Iterable[Place]) -> list[Place]:
    """Of the points of contacts, the first and the last of each kind along the curve."""
    places = list(places)
    of_kind = ([one for one in places if one.kind == kind] for kind in CONTACTS)
    return [one for at in of_kind for one in ((at[0], at[-1]) if len(at) > 1 else at)]


def failures(curve: ForcedResponse, amplitude: np.ndarray, complete: bool) -> Iterator[Item]:
    """A mark on the gap of each failed point, at the height of its neighbours, and where a curve
    that is not complete stops early."""
    x, bad = curve.parameter, ~np.isfinite(amplitude)
    if not complete and not bad.all() and not (bad.any() and curve.reached_end):
        last = np.flatnonzero(~bad)[-1:]
        yield Marks(
            x[last], amplitude[last], "curve stops", VERMILION, "diamond", filled=False, size=10
        )
    if bad.any():
        at = np.arange(len(x))
        height = (
            np.interp(at[bad], at[~bad], amplitude[~bad]) if not bad.all() else np.zeros(bad.sum())
        )
        yield Marks(x[bad], height, "failed point", VERMILION, "x", size=9)


def peak_mark(hz: float, height: float, color: str) -> Marks:
    """A hollow circle."""
    return Marks(np.array([hz]), np.array([height]), "", color, filled=False)
