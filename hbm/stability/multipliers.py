"""Floquet multipliers of the points of a curve.

A disturbance of a periodic motion lives in the slow modes of the stuck system and in the sliders;
the other modes follow statically (`tipdamp.hbm.time.poles`), and a contact that sticks through the
cycle adds nothing. The law tells what its forces do with a disturbance between the events of the
cycle (`tipdamp.hbm.laws.variation`), and the period map follows from that without differences.

A slider that never moves, and a motion that nothing holds, have a multiplier of exactly 1:
solutions beside each other, no loss of stability. They are left out. A slider that touches its
limit and does not slip counts as one that never moves: what drags it leaves it further inside.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import expm

from tipdamp.hbm.balance.aft import sample_grid
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.laws.records import Contacts
from tipdamp.hbm.stability.disturbed import DisturbedCycle, segments_of, turns_of
from tipdamp.hbm.stability.intervals import divided_between_events, first_half, joined
from tipdamp.hbm.stability.kernels import Carried, Poles, Segments, monodromy
from tipdamp.hbm.stability.slow_poles import (
    as_poles,
    eigenvalues,
    of_poles,
    receptance_at,
    springs_alone,
    system,
    without_springs,
)
from tipdamp.hbm.time.poles import poles, split

if TYPE_CHECKING:
    from tipdamp.hbm.laws.variation import Smooth


@dataclass(frozen=True)
class StabilitySettings:
    """massless_above : modes above this many times the frequency follow statically, where they stay
        above it without the springs of the contacts, too
    slow : poles that keep their mass however fast
    doubled, of_distance, further : change of the leading multipliers, by modulus, and by their
        distance from the unit circle, by the next faster modes, up to twice as far, or so many
        times as far where there are none; where it is larger they keep their mass, too. Looked at
        once, and wherever twice as many components act; 2e-4 on the rig
    foreign_share : as in `IntegrationSettings`
    steps, per_mode : of a period at first, and for each period of the fastest mode; no fewer than
        half the events, which are instants in any case
    halved, settled : change of the leading multipliers, and of all, by modulus and relative to
        those above 1, between half the steps and all of them; what is larger takes twice as many: a
        contact that opens or slips and would be stiff where it sticks needs more, and errors fall
        by 16
    margin, unchecked : where that change is this much smaller than allowed, so many of the next
        points, as long as the same components act between as many events, take these steps as they
        are
    alike : relative difference of the tangents of two halves of a period that are the same
    turn : rad of the motion of a contact in an interval between events, which twice as many steps
        leave as it is
    doublings, work : at most so many, and so many intervals times the square of the components
        that act, which takes seconds; what still changes is not known
    kept : leading multipliers
    neutral : distance from 1 within which a multiplier is that of a slider that rests, or of a
        motion that nothing holds, where there are any
    free : of the frequency: a pole below is that of such a motion
    """

    massless_above: float = 5.0
    slow: int = 24
    doubled: float = 1e-3
    of_distance: float = 0.1
    further: float = 8.0
    foreign_share: float = 0.02
    steps: int = 24
    per_mode: int = 2
    halved: float = 1e-4
    settled: float = 0.02
    margin: float = 0.1
    unchecked: int = 3
    alike: float = 1e-9
    turn: float = 0.5
    doublings: int = 6
    work: float = 3e8
    kept: int = 4
    neutral: float = 1e-7
    free: float = 1e-4


SETTINGS = StabilitySettings()
SYSTEMS = 32  # stuck systems that are kept: every point has its own where a parameter changes them


class Stability:
    """Of the points of one branch; its stuck systems are made once."""

    def __init__(self, settings: StabilitySettings = SETTINGS) -> None:
        self.settings = settings
        self._known: dict[tuple, tuple] = {}
        self._times = 1.0  # as far up as `massless_above` and `slow` say
        self._acting = 0  # components at which it was looked at last
        self._neutral = True  # whether there may be multipliers of 1 that are left out
        self._pattern: tuple = ()  # at which the steps had a margin, and of how many points more
        self._unchecked = 0

    def multipliers(
        self,
        here: Linearisation,
        w: float,
        contacts: Contacts | None = None,
        motion: np.ndarray | None = None,
    ) -> np.ndarray:
        """(kept,) complex, the largest first; NaN where there are no more, or where the law does
        not tell how its force follows a disturbance.

        here : a solved point, at w rad/s; contacts : their settings, where they vary; motion (P,
        nd, nh') of the contacts, with more orders than those of the point
        """
        found = np.full(self.settings.kept, np.nan, dtype=complex)
        leading = self._leading(self._of(here, w, contacts, motion))
        found[: len(leading)] = leading
        return found

    def _leading(self, every: np.ndarray) -> np.ndarray:
        """At most `kept` of the multipliers (n,), the largest first, without the neutral ones."""
        if self._neutral:
            every = every[np.abs(every - 1) > self.settings.neutral]
        return every[np.lexsort((-every.imag, -np.abs(every)))][: self.settings.kept]

    def _of(
        self,
        here: Linearisation,
        w: float,
        contacts: Contacts | None,
        motion: np.ndarray | None,
    ) -> np.ndarray:
        """All of them; none where the law does not tell, or structural damping has no motion in
        time."""
        balance, self._neutral = here.balance, True
        if balance.problem.structural is not None:
            return np.empty(0)
        contacts = balance.problem.contacts if contacts is None else contacts
        u = here.x.reshape(len(contacts), balance.nd, -1) if motion is None else motion
        grid = sample_grid((u.shape[2] - 1) // 2, balance.grid.samples)
        law = balance.problem.law
        variation = law.variation(contacts, u, balance.start, grid, w)
        if variation is None:
            return np.empty(0)
        if variation.of_velocity and variation.smooth:
            return self._of_velocity(variation.smooth, variation.steps, balance, w)
        cycle = DisturbedCycle(balance, w, variation)
        if not cycle.acts.any():  # all stick: the poles alone
            return of_poles(
                poles(receptance_at(springs_alone(balance), np.empty(0, dtype=int))).s, w
            )

        def of(slow: Poles, half: int = 0) -> tuple[np.ndarray, int]:
            slowest = np.abs(slow.s).min(initial=np.inf)
            self._neutral = law.sliders > 0 or slowest < self.settings.free * w
            return self._by_steps(cycle, slow, half)

        return self._with_modes(of, balance, w, cycle.acts, cycle.opened)

    def _by_steps(self, cycle: DisturbedCycle, slow: Poles, half: int) -> tuple[np.ndarray, int]:
        """(the multipliers of a cycle by the poles that keep their mass, the steps of its half with
        which they have settled); half : these, where they are given."""
        w, variation, moved = cycle.w, cycle.variation, cycle.place >= 0
        if not moved.any():
            return of_poles(slow.s, w), 1
        # faster ones follow what acts on them, which a step resolves
        fastest = min(np.abs(slow.s).max() / w, 2 * self.settings.massless_above)
        steps = max(
            self.settings.steps,
            variation.steps,
            int(np.ceil(self.settings.per_mode * fastest)),
            len(variation.events) // 2,
        )
        pattern = cycle.place.tobytes(), len(variation.events), len(slow.s)
        turns = turns_of(cycle.coarse, moved, cycle.balance.springs, slow) / (
            w * self.settings.turn
        )

        def after(half: int, least: bool) -> np.ndarray | None:
            instants = joined(np.linspace(0, 2 * np.pi, half + 1), variation.events)
            instants = divided_between_events(instants, half, cycle.looked, turns)
            if not least and len(instants) * float(moved.sum()) ** 2 > self.settings.work:
                return None
            return self._after(cycle, instants, slow)

        return self._settled(after, 2 * -(-steps // 4), half, pattern)

    def _with_modes(
        self,
        of: Callable[..., tuple[np.ndarray, int]],
        balance: HarmonicBalance,
        w: float,
        acts: np.ndarray,
        opened: np.ndarray,
    ) -> np.ndarray:
        """The multipliers by the poles that keep their mass, with as many of these as they need.

        of(poles, steps) : the multipliers, and the steps with which they have settled; with as many
        as are given, if any
        acts, opened (P, nd) : as of `_poles`
        """
        slow, count = self._poles(balance, w, acts, opened, self._times), int(acts.sum())
        found, steps = of(slow)
        if count < 2 * self._acting:
            return found
        self._acting, tried = count, self._times
        while len(found) and tried < self.settings.further * self._times:
            tried *= 2
            more = self._poles(balance, w, acts, opened, tried)
            if len(more.s) == len(slow.s):
                continue
            leading = self._leading(found)
            if self._stay(leading, of(more, steps)[0]):
                break
            wider, more_steps = of(more)
            if not len(wider):
                break
            self._times, slow, found, steps = tried, more, wider, more_steps
        return found

    def _stay(self, leading: np.ndarray, every: np.ndarray) -> bool:
        """Whether the leading multipliers are as large as those of `every`, by more poles."""
        now, then = np.abs(leading), np.abs(self._leading(every))
        n = min(len(now), len(then))
        allowed = self.settings.of_distance * np.abs(now[:n] - 1)
        allowed = np.maximum(self.settings.doubled, allowed)
        return bool((np.abs(now[:n] - then[:n]) <= allowed).all())

    def _settled(
        self,
        after: Callable[[int, bool], np.ndarray | None],
        half: int,
        given: int = 0,
        pattern: tuple = (),
    ) -> tuple[np.ndarray, int]:
        """(the multipliers that twice as many steps leave as they are, these steps); none where
        none are. given : steps that are taken as they are, if any

        after(steps, least) : those with so many, or None where that is too much; least : of the
        first two, which are not to be refused
        pattern : of the cycle; of points with the same one after another not all are checked
        """
        none = np.empty(0), 0
        if given:
            every = after(given, True)
            return none if every is None else (every, given)
        if pattern and pattern == self._pattern and self._unchecked:
            self._unchecked -= 1
            every = after(2 * half, True)
            return none if every is None else (every, 2 * half)
        before = np.empty(0)
        for doubling in range(self.settings.doublings + 2):
            steps = half * 2**doubling
            every = after(steps, doubling < 2)
            if every is None:
                break
            change = self._change(every, before)
            if change <= 1:
                margin = doubling == 1 and change <= self.settings.margin
                self._pattern = pattern if margin else ()
                self._unchecked = self.settings.unchecked
                return every, steps
            before = every
        self._pattern = ()
        return none

    def _change(self, every: np.ndarray, before: np.ndarray) -> float:
        """Of the multipliers between two numbers of steps, in units of what is allowed."""
        if not len(every) or len(every) != len(before):
            return np.inf
        # one that steps damp away in error may lead in truth
        now, then = self._leading(every), self._leading(before)
        n = min(len(now), len(then))
        return max(
            _change(every, before) / self.settings.settled,
            _change(now[:n], then[:n]) / self.settings.halved,
        )

    def _after(self, cycle: DisturbedCycle, instants: np.ndarray, slow: Poles) -> np.ndarray:
        """All multipliers, with the tangents between the instants; none where they overflow, or
        where contacts make the system singular."""
        tangents, place = cycle.variation.between(instants), cycle.place
        segments = segments_of(tangents, instants / cycle.w, place, cycle.balance.springs, cycle.w)
        rests, turning = tangents.captured.any(axis=0) & (tangents.memory[0] != 0), tangents.turning
        rests[turning.of] = turning.memory[0, 0].any(axis=2)
        half = first_half(segments, self.settings.alike)
        # laid out alike, whatever the law: compiled once for all
        turns = Carried._make(map(np.ascontiguousarray, (half or segments).turning))
        alike = Segments._make((*map(np.ascontiguousarray, (half or segments)[:-1]), turns))
        try:
            found = eigenvalues(monodromy(slow, alike, place[rests]), slow)
        except np.linalg.LinAlgError:
            return np.empty(0)
        return found**2 if half else found

    def _of_velocity(
        self, smooth: "Smooth", steps: int, balance: HarmonicBalance, w: float
    ) -> np.ndarray:
        """All multipliers under forces of the velocity, without memory; faster modes follow their
        disturbance without a velocity of their own."""
        acts = np.zeros(balance.springs.shape, dtype=bool)
        for tangents in smooth(np.linspace(0, 2 * np.pi, 65)):
            acts |= tangents.any(axis=(0, 2)) | tangents.any(axis=(0, 3))

        def of(slow: Poles, half: int = 0) -> tuple[np.ndarray, int]:
            def after(half: int, _: bool) -> np.ndarray:
                return _smooth_map(smooth, acts, balance.springs, slow, w, half)

            return self._settled(after, max(self.settings.steps, steps) // 2, half)

        return self._with_modes(of, balance, w, acts, np.zeros_like(acts))

    def _poles(
        self,
        balance: HarmonicBalance,
        w: float,
        acts: np.ndarray,
        opened: np.ndarray,
        times: float,
    ) -> Poles:
        """Of the stuck system, without the springs of those components that are `opened` through
        the cycle, at the others that act; kept for frequencies up to half an octave apart. times :
        as far up as the settings say."""
        receptance, octave = balance.receptance, int(np.ceil(2 * np.log2(w)))
        key = id(receptance), octave, times, acts.tobytes(), opened.tobytes()
        if key not in self._known:
            balance = springs_alone(balance)
            rows = np.flatnonzero(acts.ravel())
            seen, every = receptance_at(balance, rows), np.eye(len(rows))
            speeds = np.sort(np.abs(poles(seen).s))[: self.settings.slow]
            limit = self.settings.massless_above * 2.0 ** (octave / 2)
            found = split(
                seen,
                every,
                balance.springs.ravel()[rows],
                times * max(limit, 1.001 * speeds[-1]),
                self.settings.foreign_share,
                limit,
            )
            slow = as_poles(found.s, found.out, found.into.T, found.flexibility(every))
            if opened.any():
                slow = without_springs(slow, opened.ravel()[rows], balance.springs.ravel()[rows])
            if len(self._known) == SYSTEMS:
                self._known.clear()
            self._known[key] = receptance, slow  # held, so that its id stays its own
        return self._known[key][1]


def _smooth_map(
    smooth: "Smooth", acts: np.ndarray, springs: np.ndarray, slow: Poles, w: float, steps: int
) -> np.ndarray:
    """Multipliers of z' = A(t) z under forces of motion and velocity, by Magnus' expansion to the
    fourth order [Blanes et al., Phys. Rep. 470 (2009), eq. 253]; none where it overflows.

    dg = gamma du + delta dv with du = out z - static dg and dv = out s z - out into dg.
    """
    h, root = 2 * np.pi / steps, np.sqrt(3) / 6
    middle = h * (np.arange(steps) + 0.5)
    P, nd = acts.shape
    rows = np.flatnonzero(acts.ravel())
    s = system(slow)
    across = slow.out @ slow.into

    def rate(instants: np.ndarray) -> np.ndarray:
        """(steps, 2n, 2n) A."""
        gamma, delta = smooth(instants)
        gamma[..., np.arange(nd), np.arange(nd)] -= springs
        dense = np.zeros((2, len(instants), P, nd, P, nd))
        each = np.arange(P)
        dense[:, :, each, :, each] = np.moveaxis(np.array([gamma, delta]), 2, 0)
        G, D = dense.reshape(2, len(instants), P * nd, P * nd)[:, :, rows][..., rows]
        closed = np.eye(len(rows)) + G @ slow.static + D @ across
        return s - slow.into @ np.linalg.solve(closed, G @ slow.out + D @ (slow.out @ s))

    first, last = rate(middle - root * h), rate(middle + root * h)
    h /= w
    each = 0.5 * h * (first + last) + np.sqrt(3) / 12 * h**2 * (last @ first - first @ last)
    if not np.isfinite(each).all():
        return np.empty(0)
    whole = np.eye(len(s))
    for step in expm(each):
        whole = step @ whole
    return eigenvalues(whole, slow)


def _change(every: np.ndarray, before: np.ndarray) -> float:
    """Largest change of multipliers (n,), by modulus and relative to those above 1."""
    now, then = (np.sort(np.abs(some)) for some in (every, before))
    return float((np.abs(now - then) / np.maximum(now, 1.0)).max(initial=0.0))
