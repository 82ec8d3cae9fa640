"""Coulomb friction of each tangent on its own, behind a spring kt, under a normal load: the formula
and the laws.

Their cycle is event-driven: stick, slip and lift-off are located in time (`events`) and integrated
in closed form (`integrals`), so that the forces do not depend on the number of samples.
"""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.piecewise import PiecewiseLinear, slider_table
from tipdamp.hbm.laws.records import ContactForces, Contacts, Motion, SampleGrid, SliderStart
from tipdamp.hbm.laws.uncoupled import breaks, events, integrals, tangents
from tipdamp.hbm.laws.variation import CycleTangents, Variation


@dataclass(frozen=True)
class CoulombFriction(ContactLaw):
    """Sliders held by mu N, under a unilateral normal spring or a constant normal load.

    |T| <= mu N with N = max(0, preload + kn u_n), or N = max(0, preload) without a normal
    component; T = kt (u - w) with the slider at w, which follows the motion while the contact is
    open [Yang, Menq 1998; Petrov, Ewins 2003; Siewert 2010]. State: the sliders and, where there is
    a normal component, the motion before, so that a contact which closes within a step takes up its
    sliders where the motion was then.
    """

    @property
    def states(self) -> int:  # type: ignore[override]  # a number in most laws
        """Sliders and, where there is a normal component, the motion before."""
        return self.sliders + len(self.components) * (self.sliders > 0 and self._normal)

    @property
    def _normal(self) -> bool:
        return self.components[-1:] == ("n",)

    def doubt(self, contacts: Contacts) -> str:
        """Of a constant normal load: negative ones never close."""
        open_ = np.flatnonzero(contacts.preload < 0)
        if self._normal or not len(open_):
            return ""
        return (
            f"law {self.name}: the normal load is constant, and {contacts.preload[open_[0]]:g} N "
            f"at contact {open_[0]}: {len(open_)} of {len(contacts)} are open for good and give no "
            "friction; a preload that presses is positive"
        )

    def stuck_stiffness(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N/m: kt of the tangents, kn of the normal."""
        return np.stack([contacts.kt] * self.sliders + [contacts.kn] * self._normal, axis=1)

    def stuck_force(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N: the preload on the normal."""
        force = super().stuck_force(contacts)
        if self._normal:
            force[:, -1] = contacts.preload
        return force

    def initial_state(self, u: np.ndarray, start: SliderStart, contacts: Contacts) -> np.ndarray:
        """(P, ns) state at t = 0: the sliders, pulled along where the limit does not hold them, and
        the motion."""
        nt, kt = self.sliders, contacts.kt[:, None]
        w = u[:, :nt] if start.from_position else start.positions[:, :nt] + 0 * u[:, :nt]
        N = self._normal_load(u, contacts)
        T, slips = self.friction(kt * (u[:, :nt] - w), contacts.mu * np.where(N.real > 0, N, 0.0))
        w = np.where(slips, u[:, :nt] - np.divide(T, kt, out=np.zeros_like(T), where=kt > 0), w)
        return np.concatenate([w, u], axis=1)[:, : self.states]

    def start_at_rest(
        self,
        sticks: np.ndarray,
        u: np.ndarray,
        force: np.ndarray,
        start: SliderStart,
        contacts: Contacts,
    ) -> SliderStart:
        """Of contacts that stick, where the mean force has the sliders."""
        if start.from_position:
            return start
        positions, rests, nt = start.positions.copy(), sticks & (contacts.kt > 0), self.sliders
        positions[rests] = u[rests, :nt] - force[rests, :nt] / contacts.kt[rests, None]
        return start._replace(positions=positions)

    def step(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force (P, nd) N and state (P, ns): elastic trial force, returned to the friction
        limit."""
        u, nt = motion.u, self.sliders
        N = self._normal_load(u, contacts)
        closed, w = (N.real > 0)[:, None], state[:, :nt]
        load = np.where(closed, N[:, None], 0.0)
        if nt and self._normal:
            w = self._taken_up(w, state[:, nt:], u, N, contacts)
        kt = contacts.kt[:, None]
        T, slips = self.friction(kt * (u[:, :nt] - w), contacts.mu * load[:, 0])
        T = np.where(closed, T, 0.0)
        follows = u[:, :nt] - np.divide(T, kt, out=np.zeros_like(T), where=kt > 0)
        w = np.where(slips | ~closed, follows, w)
        force = np.concatenate([T, load], axis=1) if self._normal else T
        return force, np.concatenate([w, u], axis=1)[:, : self.states]

    def _normal_load(self, u: np.ndarray, contacts: Contacts) -> np.ndarray:
        """(P,) N, negative while open."""
        return contacts.preload + (contacts.kn * u[:, -1] if self._normal else 0.0 * u[:, 0])

    def _taken_up(
        self, w: np.ndarray, before: np.ndarray, u: np.ndarray, N: np.ndarray, contacts: Contacts
    ) -> np.ndarray:
        """Sliders of the step: of a contact that closes in it, the motion at contact, straight
        between its ends."""
        N0 = self._normal_load(before, contacts)
        closes = (N0.real <= 0) & (N.real > 0)
        share = np.divide(N0, N0 - N, out=np.zeros_like(N), where=closes)[:, None]
        touch = before + share * (u - before)
        return np.where(closes[:, None], touch[:, : w.shape[1]], w)

    def harmonics(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> ContactForces:
        """Forces of the event-driven cycle, exact for the harmonics of the motion."""
        law = self._sliders_of(contacts)
        x = np.ascontiguousarray(x)
        pieces, counts, active, shares = located(law, *_moving_orders(x, start, grid))
        forces = integrated(law, x, pieces, counts, active, shares)
        most = counts.max(initial=0)
        return replace(forces, events=(np.ascontiguousarray(pieces[:, :, :most]), counts))

    def _sliders_of(self, contacts: Contacts) -> breaks.Sliders:
        """What the compiled code asks of the contacts."""
        own = contacts.kt, contacts.kn, contacts.mu, contacts.preload
        return breaks.Sliders(self.sliders, self._normal, *own)

    def more_orders(
        self,
        contacts: Contacts,
        x: np.ndarray,
        start: SliderStart,
        grid: SampleGrid,
        omega: float,
        known: ContactForces,
    ) -> ContactForces:
        """With the events of the same motion."""
        if known.events is None:
            return self.harmonics(contacts, x, start, grid, omega)
        law = self._sliders_of(contacts)
        pieces, counts = known.events
        x = np.ascontiguousarray(x)
        return integrated(law, x, pieces, counts, known.active, known.shares)

    def variation(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> Variation | None:
        """From the pieces of the cycle, between which everything is linear."""
        law = self._sliders_of(contacts)
        x, start, grid = _moving_orders(np.ascontiguousarray(x), start, grid)
        pieces, counts, active, _ = located(law, x, start, grid)
        moving = np.flatnonzero(active.any(axis=1))
        edges = [
            pieces[p, d, : counts[p, d], (breaks.BEGIN, breaks.END)].ravel()
            for p in moving
            for d in range(self.sliders + 1)
        ]
        happens = np.concatenate([np.empty(0), *edges])

        def between(instants: np.ndarray) -> CycleTangents:
            P, nd, _ = x.shape
            found = CycleTangents.none(len(instants) - 1, P, nd)
            found.gamma[..., np.arange(nd), np.arange(nd)] = self.stuck_stiffness(contacts)
            own = found.gamma, found.memory, found.captured, found.capture
            tangents.fill(law, moving, pieces, counts, instants, *own)
            return found

        return Variation(1, happens[happens > 0], between)

    def by_friction(self, contacts: Contacts, x: np.ndarray, forces: ContactForces) -> np.ndarray:
        """(P, nd, nh) N: tangential forces depend on mu N alone, a factor on mu is one on preload
        and kn u_n."""
        rate = contacts.preload[:, None, None] * forces.by_preload
        if self._normal:
            rate[:, -1] = 0.0
            moving, nt = forces.contacts, self.sliders
            rate[moving, :nt] += np.einsum("adjk,ak->adj", forces.D[:, :nt, :, -1], x[moving, -1])
        return rate

    def by_stiffness(
        self, contacts: Contacts, x: np.ndarray, force: np.ndarray, forces: ContactForces
    ) -> tuple[np.ndarray, np.ndarray]:
        """kn enters by kn u_n alone; twice kn, kt and preload are twice the force, which leaves
        kt."""
        by_kn = np.zeros_like(force)
        if self._normal:
            moving = forces.contacts
            by_kn[moving] = np.einsum("adjk,ak->adj", forces.D[:, :, :, -1], x[moving, -1])
            by_kn[:, -1] += contacts.kn[:, None] * x[:, -1]
        by_preload = contacts.preload[:, None, None] * forces.by_preload
        by_preload[:, :, 0] += self.stuck_force(contacts)
        return by_kn, force - by_kn - by_preload

    def sticks_surely(self, contacts: Contacts, amplitude: np.ndarray) -> np.ndarray:
        """(P,) bool: neither slip nor lift-off within the amplitude."""
        least = contacts.preload - contacts.kn * (amplitude[:, -1] if self._normal else 0.0)
        force = contacts.kt * np.linalg.norm(amplitude[:, : self.sliders], axis=1)
        return (least > 0) & (force <= contacts.mu * least)

    def piecewise_linear(self, contacts: Contacts) -> PiecewiseLinear | None:
        """Table of the sliders for event-driven time integration."""
        return slider_table(contacts, self.sliders, self._normal)

    def default_samples(self, H: int) -> int:
        """Samples separate the events, which are located."""
        return max(64, 1 << int(np.ceil(np.log2(12 * max(H, 1)))))


def _moving_orders(
    x: np.ndarray, start: SliderStart, grid: SampleGrid
) -> tuple[np.ndarray, SliderStart, SampleGrid]:
    """x, start and grid without the orders above the highest one that moves: where the events are
    does not depend on them."""
    nh = x.shape[2]
    moving = x.any(axis=(0, 1)).nonzero()[0]
    used = min(nh, 1 + 2 * ((moving[-1] + 1) // 2)) if len(moving) else 1
    if used == nh:
        return x, start, grid
    lower = grid._replace(E=grid.E[:, :used], E_rate=grid.E_rate[:, :used])
    return np.ascontiguousarray(x[:, :, :used]), start, lower


def located(
    law: breaks.Sliders, x: np.ndarray, start: SliderStart, grid: SampleGrid
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """pieces, counts, active, shares of `events.find_pieces` at the motion x (P, nd, nh)."""
    (P, nd, nh), (tau, E, E_rate) = x.shape, grid
    pieces = np.empty((P, law.count + 1, 8 * nh + 64, 7))
    counts = np.empty((P, law.count + 1), np.int64)
    active, shares = np.empty((P, nd), dtype=bool), np.empty((P, 3))
    motion = x.reshape(P * nd, nh)
    wave = (motion @ E.T).reshape(P, nd, len(E))
    rate = (motion @ E_rate.T).reshape(P, nd, len(E))
    events.find_pieces(x, (tau, wave, rate), law, start, (pieces, counts, active, shares))
    return pieces, counts, active, shares


def integrated(
    law: breaks.Sliders,
    x: np.ndarray,
    pieces: np.ndarray,
    counts: np.ndarray,
    active: np.ndarray,
    shares: np.ndarray,
) -> ContactForces:
    """Forces of the pieces of a cycle, closed form over each."""
    (P, nd, nh), moving = x.shape, np.flatnonzero(active.any(axis=1))
    place = np.full(P, -1)
    place[moving] = np.arange(len(moving))
    g = np.empty(x.shape)
    by_preload = np.empty(x.shape)
    D = np.empty((len(moving), nd, nh, nd, nh))
    work = np.empty(P)
    integrals.add_forces(x, pieces, counts, law, place, (g, D, by_preload, work))
    return ContactForces(g, active, D, by_preload, None, shares, work)


@dataclass(frozen=True)
class Jenkins1D(CoulombFriction, tested=True):
    """One tangent, constant normal load: limit mu * preload. A spring kt in series with a slider
    [Griffin 1980].

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> little = damped.force(0, -4.9).solve_at(860, outputs={"tip": 0}, harmonics=1)
    >>> much = damped.solve_at(860, outputs={"tip": 0}, harmonics=1)
    >>> [bool(one.share_slip[0] > 0) for one in (little, much)]  # with 0.1 N and with 5 N
    [False, True]
    """

    components: ClassVar[tuple] = ("t1",)
    sliders: ClassVar[int] = 1


@dataclass(frozen=True)
class DryFriction1T(CoulombFriction, tested=True):
    """One tangent under a variable normal load, with slip and lift-off [Yang, Menq 1998].

    >>> from tipdamp.hbm.laws.base import Motion
    >>> contacts = Contacts(kn=1e6, kt=1e6, mu=0.5, preload=100)
    >>> pressed = Motion(u=np.array([[3e-3, 1e-4]]), v=np.zeros((1, 2)), dt=1.0)
    >>> force, _ = DryFriction1T().step(pressed, np.zeros((1, 3)), contacts)
    >>> print(force.round(6))  # N = 100 + 1e6 * 1e-4, and it slips at mu N
    [[100. 200.]]
    """

    components: ClassVar[tuple] = ("t1", "n")
    sliders: ClassVar[int] = 1


@dataclass(frozen=True)
class DryFriction2T(CoulombFriction, tested=True):
    """Two uncoupled tangents under one variable normal load, with slip and lift-off [Yang, Menq
    1998].

    >>> from tipdamp.hbm.laws.base import Motion
    >>> contacts = Contacts(kn=1e6, kt=1e6, mu=0.5, preload=100)
    >>> slid = Motion(u=np.array([[3e-3, 4e-3, 0.0]]), v=np.zeros((1, 3)), dt=1.0)
    >>> force, _ = DryFriction2T().step(slid, np.zeros((1, 5)), contacts)
    >>> print(force.round(6))  # each tangent has the whole limit of 50 N
    [[ 50.  50. 100.]]
    """

    components: ClassVar[tuple] = ("t1", "t2", "n")
    sliders: ClassVar[int] = 2


@dataclass(frozen=True)
class UnilateralSpring(CoulombFriction, tested=True):
    """Normal only: a spring with preload (positive) or gap -preload/kn (negative).

    >>> from tipdamp.hbm.laws.base import Motion
    >>> contacts = Contacts(kn=[1e6, 1e6], kt=0 * np.ones(2), mu=[0, 0], preload=[100, 100])
    >>> apart = Motion(u=np.array([[-5e-5], [-5e-4]]), v=np.zeros((2, 1)), dt=1.0)
    >>> force, _ = UnilateralSpring().step(apart, np.zeros((2, 0)), contacts)
    >>> print(force.ravel().round(6))  # the second has lifted off
    [50.  0.]
    """

    components: ClassVar[tuple] = ("n",)
    sliders: ClassVar[int] = 0
