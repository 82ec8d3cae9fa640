"""Sets of stations that are kept while the others are detached, and in which order they leave."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.ties import SAME


@dataclass(frozen=True)
class KeptStations:
    """kept (P,) bool; front, back - number of its stations before and behind the middle."""

    front: int
    back: int
    kept: np.ndarray


def from_middle(pairs: ContactTable, closed: np.ndarray, at_least: int) -> Iterator[KeptStations]:
    """Every number of stations at the two ends, at least one at each; those that differ in open
    pairs alone once."""
    stations = pairs.stations
    yield KeptStations((stations + 1) // 2, stations // 2, pairs.carrying)
    front, back = (
        [
            n
            for n in range(1, stations)
            if n == 1 or (closed & ends_of(pairs, *ends(n)) & ~ends_of(pairs, *ends(n - 1))).any()
        ]
        for ends in (lambda n: (n, 0), lambda n: (0, n))
    )
    for count in range(stations - 1, max(at_least, 2) - 1, -1):
        for f in sorted(
            (f for f in front if count - f in back), key=lambda f: abs(2 * f - count - 0.5)
        ):
            if (closed & ~ends_of(pairs, f, count - f)).any():
                yield KeptStations(f, count - f, ends_of(pairs, f, count - f) & pairs.carrying)


def least_loaded(
    pairs: ContactTable, closed: np.ndarray, load: np.ndarray | None, at_least: int
) -> Iterator[KeptStations]:
    """Stations leave by their part of the side's load, summed over the sides; of equal ones the
    inner first."""
    beside = pairs.stops
    closed = closed & ~beside
    load = np.where(closed, 1.0 if load is None else load, 0.0)
    share = sum(
        (load / load[pairs.side == side].sum()) * (pairs.side == side)
        for side in pairs.sides
        if load[pairs.side == side].any()
    )
    stations = np.unique(pairs.station[closed])
    share = np.round(np.bincount(pairs.station, share)[stations] + SAME, 6)
    order = stations[np.lexsort((-np.abs(stations - (pairs.stations - 1) / 2), -share))]
    for count in range(len(order), at_least - 1, -1):
        kept = (np.isin(pairs.station, order[:count]) | beside) & pairs.carrying
        yield KeptStations(*halves(pairs, kept), kept)


def halves(pairs: ContactTable, kept: np.ndarray) -> tuple[int, int]:
    """(front, back): kept stations before and behind the middle."""
    stations = np.unique(pairs.station[kept & ~pairs.stops])
    front = int((stations <= (pairs.stations - 1) / 2).sum())
    return front, len(stations) - front


def ends_of(pairs: ContactTable, front: int, back: int) -> np.ndarray:
    """(P,) bool: the first `front` and the last `back` stations of every side, and all stops."""
    last = np.array([pairs.station[pairs.side == s].max() for s in pairs.side])
    return (pairs.station < front) | (pairs.station > last - back) | pairs.stops


def keep_ends(
    pairs: ContactTable, front: int, back: int, *, conserve: bool = False
) -> ContactTable:
    """Detach all but the first `front` and the last `back` stations of every side; stops to ground
    beside the damper stay.

    conserve=False: the others keep their stiffness [Zucca 2016, sec. 7.1]; True: they take over
    that of all."""
    detached = pairs.replace(weight=np.where(ends_of(pairs, front, back), pairs.weight, 0.0))
    return conserve_total(detached, pairs) if conserve else detached


def conserve_total(pairs: ContactTable, whole: ContactTable) -> ContactTable:
    """The pairs with the stiffness of all pairs of their side that carry in `whole`, in the same
    proportions."""
    kn, kt = pairs.kn.copy(), pairs.kt.copy()
    for side in pairs.sides:
        mine = (pairs.side == side) & pairs.carrying
        full = (whole.side == side) & whole.carrying
        for own, of_all in ((kn, whole.kn), (kt, whole.kt)):
            if mine.any() and own[mine].any():
                own[mine] *= of_all[full].sum() / own[mine].sum()
    return pairs.replace(kn=kn, kt=kt)
