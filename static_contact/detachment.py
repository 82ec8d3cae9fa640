"""Detachment: stuck frequencies of any set of pairs, and pairs detached from the middle until a target is met.

[Zucca 2016, sec. 8: "starting from the middle of the damper sides, contact pairs are progressively detached until
the resonance frequency of the model at full-stick matches"]
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel

MODES = 20          # computed at first; doubled until what is asked for is among them
ENOUGH = 0.9        # of the followed shape must lie in the modes that were computed


@dataclass(frozen=True)
class StuckModes:
    """hz : (m,) ascending; shapes : (r, m) mass-normalised; tracked - index of the followed mode
    mac - energy-weighted MAC of that mode and the followed shape, (follow' M phi)^2 over the whole assembly, 0..1
    """

    hz: np.ndarray
    shapes: np.ndarray
    tracked: int
    mac: float

    @property
    def tracked_hz(self) -> float:
        """Frequency of the followed mode, Hz."""
        return float(self.hz[self.tracked])


@dataclass(frozen=True)
class Step:
    """One set of kept stations and its stuck frequency; front counts the stations with the smaller coordinate;
    mac as in `StuckModes`."""

    front: int
    back: int
    hz: float
    mac: float


@dataclass(frozen=True)
class Detachment:
    """pairs - the table with weight 0 on detached pairs; chosen - the step nearest the target; history - all steps;
    target_hz - None where the stations were given."""

    pairs: ContactTable
    chosen: Step
    history: tuple[Step, ...]
    target_hz: float | None


@dataclass(frozen=True)
class DetachmentOptions:
    """springs(pairs) -> (m, r) extra rows that go with the carrying pairs (roll springs), or None
    at_least - stations that stay on each side; conserve - see `keep_ends`"""

    springs: Callable | None = None
    at_least: int = 2
    conserve: bool = False


DEFAULT = DetachmentOptions()


class StuckAssembly:
    """Stuck modes of one model for many sets of pairs: M is factored once.

    rows(model, pairs) -> (m, r) with b'b summing to the stuck stiffness; another one than `stuck_rows` where the pairs
    do not act on nodal dofs of the model.
    """

    def __init__(self, model: ReducedModel, rows: Callable | None = None):
        self.model, self.rows = model, rows or stuck_rows
        try:
            self.L = np.linalg.cholesky(model.M)
        except np.linalg.LinAlgError:
            raise InputError("the mass matrix is not positive definite: condense massless dofs first") from None
        half = sl.solve_triangular(self.L, model.K, lower=True)
        self.K = sl.solve_triangular(self.L, half.T, lower=True)

    def modes(self, pairs: ContactTable, follow: np.ndarray, *, above_hz: float = 0.0,
              extra: np.ndarray | None = None) -> StuckModes:
        """Lowest modes with every carrying pair stuck (kt, kt, kn).

        follow (r,): mass-normalised shape; the mode of the highest MAC with it, (follow' M phi)^2, is the tracked one.
        For a shape without damper this is the MAC of the blades times their part of the kinetic energy.
        extra : (m, r) rows e with springs e'e added to K (declared roll springs), or None.
        As many modes are computed as reach above_hz and hold most of the followed shape.
        """
        K = self.K
        rows = self.rows(self.model, pairs)
        if extra is not None:
            rows = np.vstack([rows, extra])
        if len(rows):
            half = sl.solve_triangular(self.L, rows.T, lower=True)
            K = K + half @ half.T
        K, count = (K + K.T) / 2, MODES
        while True:
            count = min(count, len(K))
            lam, y = sl.eigh(K, subset_by_index=(0, count - 1))
            shapes = sl.solve_triangular(self.L.T, y, lower=False)
            mac = (follow @ self.model.M @ shapes) ** 2
            hz = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
            if count == len(K) or (hz[-1] > above_hz and mac.sum() > ENOUGH):
                best = int(mac.argmax())
                return StuckModes(hz, shapes, best, float(mac[best]))
            count *= 2


def stuck_rows(model: ReducedModel, pairs: ContactTable) -> np.ndarray:
    """(3P, r) rows b with b'b summing to the stuck stiffness B' diag(kt, kt, kn) B."""
    pairs = pairs.select(pairs.carrying)
    B = relative_motion(model, pairs).toarray()
    k = np.column_stack([pairs.kt, pairs.kt, pairs.kn]) * pairs.weight[:, None]
    return B * np.sqrt(k.ravel())[:, None]


def conserve_total(pairs: ContactTable, whole: ContactTable) -> ContactTable:
    """The pairs with the stiffness of all pairs of their side that carry in `whole`, in the same proportions."""
    kn, kt = pairs.kn.copy(), pairs.kt.copy()
    for side in pairs.sides:
        mine, full = (pairs.side == side) & pairs.carrying, (whole.side == side) & whole.carrying
        for own, of_all in ((kn, whole.kn), (kt, whole.kt)):
            if mine.any() and own[mine].any():
                own[mine] *= of_all[full].sum() / own[mine].sum()
    return pairs.replace(kn=kn, kt=kt)


def keep_ends(pairs: ContactTable, front: int, back: int, *, conserve: bool = False) -> ContactTable:
    """Detach all but the first `front` and the last `back` stations of every side.

    conserve=False: the others keep their stiffness [Zucca 2016, sec. 7.1]; True: they take over that of all.
    """
    last = np.array([pairs.station[pairs.side == s].max() for s in pairs.side])
    kept = (pairs.station < front) | (pairs.station > last - back)
    detached = pairs.replace(weight=np.where(kept, pairs.weight, 0.0))
    return conserve_total(detached, pairs) if conserve else detached


def detach_until(assembly: StuckAssembly, pairs: ContactTable, target_hz: float, follow: np.ndarray,
                 options: DetachmentOptions = DEFAULT, progress: Callable | None = None) -> Detachment:
    """Detach stations from the middle, one at a time on all sides, and keep those whose tracked stuck frequency is
    nearest the target.

    follow (r,): mass-normalised shape of the tracked mode; progress(step, part done). All steps from every station to
    options.at_least are made: where two modes come close the tracked frequency may rise for a step. Raises InputError
    "not reachable: a..b Hz" when the target lies outside what they give.
    """
    stations, at_least = int(pairs.station.max()) + 1, options.at_least
    history = []
    for kept in range(stations, at_least - 1, -1):
        _, step = _kept(assembly, pairs, ((kept + 1) // 2, kept // 2), follow, options)
        history.append(step)
        if progress:
            progress(step, (stations - kept + 1) / (stations - at_least + 1))
    found = [s.hz for s in history]
    # half a step beyond the last set is still nearest to it
    reach = max(abs(a - b) for a, b in zip(found, found[1:], strict=False)) / 2 if len(found) > 1 else 0.0
    if not min(found) - reach <= target_hz <= max(found) + reach:
        raise InputError(f"target {target_hz:g} Hz is not reachable: {min(found):.0f}..{max(found):.0f} Hz with "
                         f"{at_least}..{stations} stations kept")
    chosen = min(history, key=lambda s: abs(s.hz - target_hz))
    return Detachment(keep_ends(pairs, chosen.front, chosen.back, conserve=options.conserve), chosen, tuple(history),
                      target_hz)


def keep_stations(assembly: StuckAssembly, pairs: ContactTable, ends: tuple[int, int], follow: np.ndarray,
                  options: DetachmentOptions = DEFAULT) -> Detachment:
    """Keep the given numbers of stations at both ends, (front, back). Raises InputError when there are not so many."""
    stations = int(pairs.station.max()) + 1
    if sum(ends) > stations:
        raise InputError(f"{ends[0]} + {ends[1]} stations are to be kept, the sides have {stations}")
    kept, step = _kept(assembly, pairs, ends, follow, options)
    return Detachment(kept, step, (step,), None)


def _kept(assembly, pairs, ends, follow, options):
    """The pairs with all but the two ends detached, and their step."""
    kept = keep_ends(pairs, *ends, conserve=options.conserve)
    if not kept.carrying.any():
        raise InputError("no contact pairs are left: a free damper needs some on both sides")
    modes = assembly.modes(kept, follow, extra=options.springs(kept) if options.springs else None)
    return kept, Step(*ends, modes.tracked_hz, modes.mac)
