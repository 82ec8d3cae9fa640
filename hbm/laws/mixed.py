"""Several laws in one model: every contact has its own.

law = MixedLaw((DryFriction2T(), UnilateralSpring()), of_pair=[0, 0, 1, 0])
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.base import ContactLaw, check_law
from tipdamp.hbm.laws.piecewise import PiecewiseLinear, merged_table
from tipdamp.hbm.laws.records import ContactForces, Contacts, Motion, SampleGrid, SliderStart
from tipdamp.hbm.laws.variation import CycleTangents, Variation


@dataclass(frozen=True)
class MixedLaw(ContactLaw):
    """Contact p follows laws[of_pair[p]]; components that its law does not know carry no force but
    the preload.

    laws : of any kind; parameters with one entry per contact count the contacts of that law alone
    of_pair : (P,) whole numbers, one for each pair of the contact table
    Raises InputError where of_pair does not name laws.

    >>> law = MixedLaw((DryFriction2T(), UnilateralSpring()), of_pair=[0, 1])
    >>> contacts = Contacts(kn=[3e6, 3e6], kt=[2e6, 2e6], mu=[0.5, 0.5], preload=[50, 50])
    >>> print(law.stuck_stiffness(contacts) / 1e6)  # the second has no friction
    [[2. 2. 3.]
     [0. 0. 3.]]
    """

    laws: tuple
    of_pair: tuple

    def __post_init__(self) -> None:
        of_pair = np.asarray(self.of_pair)
        if (
            of_pair.ndim != 1
            or of_pair.dtype.kind not in "iu"
            or not np.isin(of_pair, range(len(self.laws))).all()
        ):
            raise InputError(
                f"of_pair: must hold a whole number from 0 to {len(self.laws) - 1} for each pair"
            )
        object.__setattr__(self, "laws", tuple(check_law(law) for law in self.laws))
        object.__setattr__(self, "of_pair", tuple(of_pair.tolist()))

    @property
    def components(self) -> tuple[str, ...]:  # type: ignore[override]
        """Of a contact, and behind them the coordinates of forces that are none."""
        every = [name for law in self.laws for name in law.components]
        return tuple(dict.fromkeys([*ContactLaw.components, *every]))

    @property
    def states(self) -> int:  # type: ignore[override]
        """Of the law that needs most; the states of each law come first."""
        return max(law.states for law in self.laws)

    @property
    def sliders(self) -> int:  # type: ignore[override]
        """Of the law that has most."""
        return max(law.sliders for law in self.laws)

    @property
    def steps_together(self) -> int:  # type: ignore[override]
        """Of the law that takes fewest."""
        return min(law.steps_together for law in self.laws)

    def stuck_stiffness(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N/m of each law."""
        return self._joined(
            contacts, 0 * self._constant(contacts), lambda law, own: law.stuck_stiffness(own)
        )

    def stuck_force(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N of each law; the preload on a normal that it does not know."""
        return self._joined(
            contacts, self._constant(contacts), lambda law, own: law.stuck_force(own)
        )

    def _joined(
        self,
        contacts: Contacts,
        into: np.ndarray,
        of_law: Callable[[ContactLaw, Contacts], np.ndarray],
    ) -> np.ndarray:
        for law, at, place, _ in self._parts(len(contacts)):
            into[place] = of_law(law, contacts.select(at))
        return into

    def _constant(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N: preload on the normal that the law of a contact does not know."""
        force = np.zeros((len(contacts), len(self.components)))
        for law, at, *_ in self._parts(len(contacts)):
            force[at, 2] = 0.0 if "n" in law.components or is_own(law) else contacts.preload[at]
        return force

    def initial_state(self, u: np.ndarray, start: SliderStart, contacts: Contacts) -> np.ndarray:
        """(P, ns) state of each law at t = 0."""
        state = np.zeros((len(contacts), self.states), dtype=u.dtype)
        for law, at, place, _ in self._parts(len(contacts)):
            state[at, : law.states] = law.initial_state(
                u[place], _own(law, start, at), contacts.select(at)
            )
        return state

    def doubt(self, contacts: Contacts) -> str:
        """Of the first law that has one."""
        doubts = (law.doubt(contacts.select(at)) for law, at, *_ in self._parts(len(contacts)))
        return next(filter(None, doubts), "")

    def start_at_rest(
        self,
        sticks: np.ndarray,
        u: np.ndarray,
        force: np.ndarray,
        start: SliderStart,
        contacts: Contacts,
    ) -> SliderStart:
        """As in each law."""
        positions = start.positions.copy()
        for law, at, place, _ in self._parts(len(contacts)):
            positions[at, : law.sliders] = law.start_at_rest(
                sticks[at], u[place], force[place], _own(law, start, at), contacts.select(at)
            ).positions
        return start._replace(positions=positions)

    def step(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force (P, nd) N and state (P, ns) of each law."""
        kind = np.result_type(*motion, state)
        force, new = self._constant(contacts).astype(kind), state.astype(kind)
        for law, at, place, _ in self._parts(len(contacts)):
            own = motion._replace(u=motion.u[place], v=motion.v[place])
            force[place], new[at, : law.states] = law.step(
                own, state[at, : law.states], contacts.select(at)
            )
        return force, new

    def harmonics(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> ContactForces:
        """Forces of the cycle of each law."""
        P, nd, _ = x.shape
        g, by_preload, by_omega = np.zeros((3, *x.shape))
        active, shares, work = np.zeros((P, nd), dtype=bool), np.zeros((P, 3)), np.zeros(P)
        parts = []
        for law, at, place, columns in self._parts(P):
            f = law.harmonics(contacts.select(at), x[place], _own(law, start, at), grid, omega)
            g[place], active[place], shares[at] = f.g, f.active, f.shares
            work[at] = fourier.work(f.g, x[place]) if f.work is None else f.work
            for into, part in ((by_preload, f.by_preload), (by_omega, f.by_omega)):
                into[place] = 0.0 if part is None else part
            parts.append((f, at[f.contacts], columns))
        known = all(f.by_preload is not None for f, *_ in parts)
        rated = any(f.by_omega is not None for f, *_ in parts)
        return ContactForces(
            g,
            active,
            _derivatives(parts, active, x.shape),
            by_preload if known else None,
            by_omega if rated else None,
            shares,
            work,
        )

    def variation(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> Variation | None:
        """Of each law; None where one does not know, and of forces of the velocity beside those
        with a memory."""
        P, nd, _ = x.shape
        parts: list[tuple[Any, np.ndarray, Any]] = [
            (
                law.variation(contacts.select(at), x[place], _own(law, start, at), grid, omega),
                at,
                columns,
            )
            for law, at, place, columns in self._parts(P)
        ]
        if any(variation is None for variation, *_ in parts):
            return None
        of_velocity = any(one.of_velocity for one, *_ in parts)
        all_smooth = all(one.smooth for one, *_ in parts)
        if of_velocity and not all_smooth:
            return None

        def between(instants: np.ndarray) -> CycleTangents:
            found = CycleTangents.none(len(instants) - 1, P, nd)
            for variation, at, columns in parts:
                found = found.put(at, columns, variation.between(instants))
            return found

        def smooth(instants: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            both = np.zeros((2, len(instants), P, nd, nd))
            for variation, at, columns in parts:
                place = np.ix_(np.arange(2), np.arange(len(instants)), at, columns, columns)
                both[place] = variation.smooth(instants)
            return both[0], both[1]

        steps = max(one.steps for one, *_ in parts)
        events = np.concatenate([one.events for one, *_ in parts])
        return Variation(steps, events, between, smooth if all_smooth else None, of_velocity)

    def sticks_surely(self, contacts: Contacts, amplitude: np.ndarray) -> np.ndarray:
        """(P,) bool of each law."""
        sticks = np.zeros(len(contacts), dtype=bool)
        for law, at, place, _ in self._parts(len(contacts)):
            sticks[at] = law.sticks_surely(contacts.select(at), amplitude[place])
        return sticks

    def piecewise_linear(self, contacts: Contacts) -> PiecewiseLinear | None:
        """One table of those of the laws; None where a law has none."""
        parts: list[tuple[Any, np.ndarray, Any]] = [
            (law.piecewise_linear(contacts.select(at)), at, columns)
            for law, at, _, columns in self._parts(len(contacts))
        ]
        return (
            None
            if any(table is None for table, *_ in parts)
            else merged_table(parts, self._constant(contacts))
        )

    def default_samples(self, H: int) -> int:
        """Of the law that needs most."""
        return max(law.default_samples(H) for law in self.laws)

    def select(self, at: np.ndarray) -> "MixedLaw":
        """The mixture of some contacts, by a mask or by indices."""
        of_pair, at = np.asarray(self.of_pair, dtype=int), np.asarray(at)
        if at.dtype == bool:
            self._check_length(len(at))
            at = np.flatnonzero(at)
        rank = np.zeros(len(of_pair), dtype=int)  # of each contact among those of its law
        for i in range(len(self.laws)):
            rank[of_pair == i] = np.arange((of_pair == i).sum())
        return MixedLaw(
            tuple(law.select(rank[at[of_pair[at] == i]]) for i, law in enumerate(self.laws)),
            of_pair[at],  # type: ignore[arg-type]
        )

    def check(self, contacts: Contacts) -> None:
        """InputError where of_pair or the parameters of a law do not fit the contacts."""
        self._check_length(len(contacts))
        for law, at, *_ in self._parts(len(contacts)):
            law.check(contacts.select(at))

    def _check_length(self, P: int) -> None:
        if P != len(self.of_pair):
            raise InputError(f"of_pair has {len(self.of_pair)} entries for {P} pairs")

    def _parts(self, P: int) -> Iterator[tuple[ContactLaw, np.ndarray, Any, list[int]]]:
        """(law, its contacts, their place in its columns, these) of every law that has contacts."""
        self._check_length(P)
        yield from self._by_law.values()

    @cached_property
    def _by_law(self) -> dict[int, tuple[ContactLaw, np.ndarray, Any, list[int]]]:
        """What `_parts` gives, as a step asks for it."""
        of_pair, components, found = np.asarray(self.of_pair), self.components, {}
        for i, law in enumerate(self.laws):
            at = np.flatnonzero(of_pair == i)
            columns = [components.index(c) for c in law.components]
            if len(at):
                found[i] = law, at, np.ix_(at, np.array(columns)), columns
        return found


def _derivatives(
    parts: list[tuple[ContactForces, np.ndarray, list[int]]],
    active: np.ndarray,
    shape: tuple[int, ...],
) -> np.ndarray:
    """(a, nd, nh, nd, nh) of all laws, of which each has its active contacts and its columns."""
    (_, nd, nh), acts = shape, active.any(axis=1)
    row, D = np.cumsum(acts) - 1, np.zeros((acts.sum(), nd, nh, nd, nh))
    for f, at, columns in parts:
        D[np.ix_(row[at], columns, range(nh), columns, range(nh))] = f.D
    return D


def is_own(law: ContactLaw) -> bool:
    """Whether a law is no contact: its coordinates are none of the motion of one."""
    return not set(law.components) <= set(ContactLaw.components)


def _own(law: ContactLaw, start: SliderStart, at: np.ndarray) -> SliderStart:
    """Start of the contacts of a law."""
    return start._replace(positions=np.ascontiguousarray(start.positions[at, : law.sliders]))
