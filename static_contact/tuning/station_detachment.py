"""Detachment: stations detached until the stuck frequency meets a target.

[Zucca 2016, sec. 8: "starting from the middle of the damper sides, contact pairs are progressively
detached until the resonance frequency of the model at full-stick matches"]. Pairs that are open at
rest do not stick.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np
from scipy.optimize import brentq

from tipdamp.hbm import tables
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.tuning.kept_stations import (
    KeptStations,
    conserve_total,
    ends_of,
    from_middle,
    halves,
    least_loaded,
)
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly
from tipdamp.static_contact.tuning.stuck_search import StuckSearch

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


class NotReachable(InputError):
    """No set of contacts has the target frequency; above - it is higher than all have."""

    def __init__(self, message: str, above: bool) -> None:
        super().__init__(message)
        self.above = above


@dataclass(frozen=True)
class Step:
    """One set of kept stations and its stuck frequency; front counts the stations with the smaller
    coordinate; mac as in `StuckModes`."""

    front: int
    back: int
    hz: float
    mac: float


@dataclass(frozen=True)
class GradedStation:
    """The station that keeps only a part (0..1) of its area: the factor on its kn and kt."""

    station: int
    part: float


@dataclass(frozen=True)
class StationWorth:
    """hz - what the stuck frequency would lose without this station (kept), or gain with it (not
    kept)."""

    station: int
    kept: bool
    hz: float


@dataclass(frozen=True)
class Detachment:
    """Stations kept where a stuck frequency meets its target.

    pairs - the table with weight 0 on detached pairs; chosen - the set nearest the target;
    history - all sets that were tried; stations - kept ones; graded - None where all are whole;
    worth - of every station, beside the chosen set of whole stations; equivalent - sets within the
    scatter of the target, the nearest first; target_hz - None where the stations were given.

    >>> model, pairs = two_blades(stations=3)
    >>> mode = sum(model.displacement_row("blade1", node, [0, 1, 0]) for node in (1, 2, 3))
    >>> mode /= np.sqrt(mode @ model.M @ mode)
    >>> found = detach_until(StuckAssembly(model), pairs, 1270.0, mode)
    >>> isinstance(found, Detachment), len(found.stations)
    (True, 2)
    """

    pairs: ContactTable
    chosen: Step
    history: tuple[Step, ...]
    target_hz: float | None
    stations: tuple[int, ...]
    worth: tuple[StationWorth, ...]
    graded: GradedStation | None = None
    equivalent: tuple[Step, ...] = ()
    passed_over: tuple[Step, ...] = ()

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each set that was tried: stations kept at both ends, stuck frequency in Hz,
        MAC. Raises InputError where pandas is not installed."""
        names = ("front", "back", "hz", "mac")
        return tables.frame({n: [vars(one)[n] for one in self.history] for n in names}, "set")

    def _repr_html_(self) -> str:
        rows = {
            "kept": f"{self.chosen.front} + {self.chosen.back} stations",
            "stuck frequency": f"{self.chosen.hz:.6g} Hz",
            "tried": f"{len(self.history)} sets",
        }
        target = "" if self.target_hz is None else f" to {self.target_hz:.6g} Hz"
        return tables.notebook_table(f"Detachment{target}", rows)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the stuck frequency over the number of kept stations, with target and choice.

        ax : axes of matplotlib to draw on; new ones without
        Returns the axes. Raises InputError where matplotlib is not installed.
        """
        steps = [*self.history, self.chosen]
        count = np.array([step.front + step.back for step in steps])
        hz = np.array([step.hz for step in steps])
        return pictures.sets_tried(count, hz, len(steps) - 1, self.target_hz, ax)


@dataclass(frozen=True)
class DetachmentOptions:
    """springs(pairs) -> RollSpring records that go with the carrying pairs, or None
    load : (P,) N - static normal force that each pair stands for; pairs without one do not stick.
    None: all do
    order : "from_middle": every number of stations at the two ends; "least_loaded": by the load of
    the stations
    graded : the last station keeps the part of its area with which the target is met
    scatter_hz : sets whose frequency is as near to the target fit equally well
    at_least - stations that stay on each side; conserve - see `keep_ends`
    allowed(weight (P,)) -> whether a set may be chosen, or None: any; asked of the sets that fit
    best
    tie_hz - sets nearer to each other than this, by rounding of mirrored ones, fit alike: the more
    even one is taken met_hz - how near a graded station must bring the frequency to the target"""

    springs: Callable | None = None
    load: np.ndarray | None = None
    order: Literal["from_middle", "least_loaded"] = "from_middle"
    graded: bool = False
    scatter_hz: float = 0.0
    at_least: int = 2
    conserve: bool = False
    allowed: Callable[[np.ndarray], bool] | None = None
    tie_hz: float = 1e-4
    met_hz: float = 0.1


DEFAULT = DetachmentOptions()


def detach_until(
    assembly: StuckAssembly,
    pairs: ContactTable,
    target_hz: float,
    follow: np.ndarray,
    options: DetachmentOptions = DEFAULT,
    progress: Callable | None = None,
) -> Detachment:
    """Detach stations on all sides and keep those whose tracked stuck frequency is nearest the
    target.

    follow (r,): mass-normalised shape of the tracked mode; progress(step, part done). All sets of
    the order are tried: where two modes come close the tracked frequency may rise as stations go.
    Raises InputError "not reachable: a..b Hz" when the target lies outside what they give, and
    where no set is allowed.

    >>> model, pairs = two_blades(stations=5)
    >>> mode = model.displacement_row("blade1", 3, [0, 1, 0])
    >>> for node in (1, 2, 4, 5):
    ...     mode += model.displacement_row("blade1", node, [0, 1, 0])
    >>> mode /= np.sqrt(mode @ model.M @ mode)  # the free blade along y
    >>> found = detach_until(StuckAssembly(model), pairs, 1270.0, mode)
    >>> found.stations, round(found.chosen.hz)
    ((0, 1, 3, 4), 1266)
    """
    search = search_of(assembly, pairs, follow, options)
    sets, history = _sets(search, options), list[Step]()
    for i, one in enumerate(sets):
        history.append(_step(search, one))
        if progress:
            progress(history[-1], (i + 1) / len(sets))
    _check_reach(history, target_hz, options, pairs.stations)
    best, passed_over = _best_allowed(sets, history, target_hz, pairs, options)
    weight, chosen, graded = _weights(sets[best], pairs), history[best], None
    worth = _worth(search, pairs, weight)
    if options.graded and chosen.hz != target_hz:
        weight, chosen, graded = _graded(search, sets, history, (best, target_hz, options))
    alike = (
        s
        for s, one in zip(history, sets, strict=True)
        if abs(s.hz - target_hz) <= options.scatter_hz and _may_be_chosen(one, pairs, options)
    )
    equal = sorted(alike, key=lambda s: _fit(s, target_hz, options.tie_hz))
    return Detachment(
        search.table(weight),
        chosen,
        tuple(history),
        target_hz,
        _stations(pairs, weight),
        worth,
        graded,
        tuple(equal),
        passed_over,
    )


def keep_stations(
    assembly: StuckAssembly,
    pairs: ContactTable,
    ends: tuple[int, int],
    follow: np.ndarray,
    options: DetachmentOptions = DEFAULT,
) -> Detachment:
    """Keep the given numbers of stations at both ends, (front, back). Raises InputError when there
    are not so many."""
    if sum(ends) > pairs.stations:
        raise InputError(
            f"{ends[0]} + {ends[1]} stations are to be kept, the sides have {pairs.stations}"
        )
    return keep_weights(
        assembly, pairs, np.where(ends_of(pairs, *ends), pairs.weight, 0.0), follow, options, ends
    )


def keep_weights(
    assembly: StuckAssembly,
    pairs: ContactTable,
    weight: np.ndarray,
    follow: np.ndarray,
    options: DetachmentOptions = DEFAULT,
    ends: tuple[int, int] | None = None,
) -> Detachment:
    """Keep pairs with the given weights (P,); ends - (front, back) stations, counted from the
    middle where None."""
    search = search_of(assembly, pairs, follow, options)
    front, back = ends or halves(pairs, weight > 0)
    step = Step(front, back, *search.find(weight))
    return Detachment(
        search.table(weight),
        step,
        (step,),
        None,
        _stations(pairs, weight),
        _worth(search, pairs, weight),
    )


def search_of(
    assembly: StuckAssembly, pairs: ContactTable, follow: np.ndarray, options: DetachmentOptions
) -> StuckSearch:
    """The stuck frequencies of sets of the pairs; those that carry no load do not stick."""
    closed = pairs.carrying if options.load is None else pairs.carrying & (options.load > 0)
    conserve = (lambda kept: conserve_total(kept, pairs)) if options.conserve else None
    return StuckSearch(assembly, pairs, closed, follow, options.springs, conserve)


def _sets(search: StuckSearch, options: DetachmentOptions) -> list[KeptStations]:
    if options.order == "from_middle":
        return list(from_middle(search.pairs, search.closed, options.at_least))
    return list(least_loaded(search.pairs, search.closed, options.load, options.at_least))


def _weights(one: KeptStations, pairs: ContactTable) -> np.ndarray:
    """(P,) with whole stations."""
    return np.where(one.kept, pairs.weight, 0.0)


def _step(search: StuckSearch, one: KeptStations) -> Step:
    return Step(one.front, one.back, *search.find(_weights(one, search.pairs)))


def _fit(step: Step, target_hz: float, tie_hz: float) -> tuple[int, int, int]:
    """Sorts sets: the nearest to the target, of those that fit alike the most even one."""
    return round(abs(step.hz - target_hz) / tie_hz), abs(step.front - step.back), -step.front


def _may_be_chosen(one: KeptStations, pairs: ContactTable, options: DetachmentOptions) -> bool:
    return options.allowed is None or options.allowed(_weights(one, pairs))


def _best_allowed(
    sets: Sequence[KeptStations],
    history: Sequence[Step],
    target_hz: float,
    pairs: ContactTable,
    options: DetachmentOptions,
) -> tuple[int, tuple[Step, ...]]:
    """The set that fits best of those that may be chosen, and those that fit better and may not."""
    passed_over: list[Step] = []
    for i in sorted(range(len(sets)), key=lambda i: _fit(history[i], target_hz, options.tie_hz)):
        if _may_be_chosen(sets[i], pairs, options):
            return i, tuple(passed_over)
        passed_over.append(history[i])
    raise InputError(
        f"target {target_hz:g} Hz: every set of stations leaves too large a moment of the preload; "
        'set [tune] preload = "resolved"'
    )


def _check_reach(
    history: Sequence[Step], target_hz: float, options: DetachmentOptions, stations: int
) -> None:
    found = np.sort([s.hz for s in history])
    # half a step beyond the last set is nearest to it; a graded station reaches not beyond the sets
    reach = 0.0 if options.graded or len(found) < 2 else np.diff(found).max() / 2
    if not found[0] - reach <= target_hz <= found[-1] + reach:
        raise NotReachable(
            f"target {target_hz:g} Hz is not reachable: {found[0]:.0f}..{found[-1]:.0f} Hz with "
            f"{options.at_least}..{stations} stations kept",
            above=bool(target_hz > found[-1]),
        )


def _graded(
    search: StuckSearch,
    sets: Sequence[KeptStations],
    history: Sequence[Step],
    goal: tuple[int, float, DetachmentOptions],
) -> tuple[np.ndarray, Step, GradedStation]:
    """(weight (P,), Step, GradedStation): between the chosen set and the next one on the other side
    of the target, the smallest difference and the most even set first."""
    pairs, (best, target_hz, options) = search.pairs, goal
    stuck = np.array([one.kept & search.closed for one in sets])
    above = history[best].hz > target_hz
    for other in _on_the_other_side(stuck, sets, history, best, target_hz):
        large, small = (best, other) if above else (other, best)
        last = stuck[large] & ~stuck[small]
        weight = partial(_with_part, pairs, last, _weights(sets[small], pairs))
        part = float(
            brentq(lambda a, of=weight: search.find(of(a))[0] - target_hz, 0.0, 1.0, xtol=1e-9)
        )
        if options.allowed is None or options.allowed(weight(part)):
            break
    else:
        raise InputError(
            f"target {target_hz:g} Hz: every part of a station leaves too large a moment of the "
            "preload; set [tune] graded = false"
        )
    hz, mac = search.find(weight(part))
    station = int(pairs.station[last][0])
    if abs(hz - target_hz) > options.met_hz:
        raise InputError(
            f"target {target_hz:g} Hz: the tracked mode jumps from one mode to another while "
            f"station {station} is graded, and no part of it meets the target "
            f"(nearest {hz:.1f} Hz); set [tune] graded = false"
        )
    step = replace(history[large], hz=hz, mac=mac)
    return weight(part), step, GradedStation(station, part)


def _on_the_other_side(
    stuck: np.ndarray,
    sets: Sequence[KeptStations],
    history: Sequence[Step],
    best: int,
    target_hz: float,
) -> list[int]:
    """Sets within the chosen one, or around it, whose frequency lies beyond the target."""
    own, above = stuck[best], history[best].hz > target_hz
    nested = (stuck <= own).all(axis=1) if above else (stuck >= own).all(axis=1)
    beyond = np.array([s.hz <= target_hz if above else s.hz >= target_hz for s in history])
    there = np.flatnonzero(nested & beyond)
    if not len(there):
        raise InputError(
            f"target {target_hz:g} Hz: no station beside the {history[best].front} + "
            f"{history[best].back} kept ones bridges it; set [tune] graded = false"
        )
    return sorted(
        there,
        key=lambda i: ((stuck[i] != own).sum(), abs(sets[i].front - sets[i].back), -sets[i].front),
    )


def _with_part(pairs: ContactTable, last: np.ndarray, base: np.ndarray, part: float) -> np.ndarray:
    """(P,) weights with a part of the pairs `last` (P,) beside the others."""
    return np.where(last, part * pairs.weight, base)


def _worth(
    search: StuckSearch, pairs: ContactTable, weight: np.ndarray
) -> tuple[StationWorth, ...]:
    """Of every station that has a closed pair, unless nothing would be left without it."""
    hz, found, beside = search.find(weight)[0], [], pairs.stops
    for station in np.unique(pairs.station[search.closed & ~beside]):
        mine = (pairs.station == station) & ~beside
        kept = bool((weight[mine & search.closed] > 0).any())
        other = np.where(mine, 0.0 if kept else pairs.weight, weight)
        if (other[search.closed] > 0).any():
            found.append(StationWorth(int(station), kept, abs(search.find(other)[0] - hz)))
    return tuple(found)


def _stations(pairs: ContactTable, weight: np.ndarray) -> tuple[int, ...]:
    return tuple(np.unique(pairs.station[(weight > 0) & ~pairs.stops]).tolist())
