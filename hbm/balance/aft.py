"""Alternating frequency-time: the samples of a cycle, where its sliders start, and the contact
forces over it."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.records import ContactForces, Contacts, SampleGrid, SliderStart
from tipdamp.hbm.validation import numbers

EPS = np.finfo(float).eps

STARTS = ("zero_force", "zero_slider")


def sample_grid(H: int, samples: int) -> SampleGrid:
    """Of H harmonics and as many samples."""
    tau = np.linspace(0.0, 2 * np.pi, samples + 1)
    return SampleGrid(tau, fourier.basis(tau[:-1], H), fourier.basis_rate(tau[:-1], H))


def slider_start(start: np.ndarray | str, P: int, sliders: int) -> SliderStart:
    """'zero_force', 'zero_slider' or positions (P, sliders) in m; InputError where it is none of
    these."""
    if isinstance(start, str) and start in STARTS:
        return SliderStart(np.zeros((P, sliders)), start == "zero_force")
    w = numbers(
        "start",
        start,
        f"must be 'zero_force', 'zero_slider' or slider positions ({P}, {sliders}) in m",
    )
    if w.shape != (P, sliders) or not np.isfinite(w).all():
        raise InputError(
            f"start: slider positions must be finite with shape ({P}, {sliders}), got {w.shape}"
        )
    return SliderStart(w, False)


@dataclass(frozen=True)
class Cycle:
    """Contacts and what their forces over a cycle are counted from.

    springs : (P, nd) N/m - stuck springs of the linear system; rest : (P, nd) N - force at rest
    start, grid : of `slider_start` and `sample_grid`
    """

    law: ContactLaw
    contacts: Contacts
    springs: np.ndarray
    rest: np.ndarray
    start: SliderStart
    grid: SampleGrid

    @cached_property
    def beyond_rest(self) -> np.ndarray:
        """(P, nd) N: what the stuck springs carry at rest beyond the force there."""
        return self.law.stuck_force(self.contacts) - self.rest

    @cached_property
    def further_springs(self) -> np.ndarray | None:
        """(P, nd) N/m: what the settings have beyond the springs of the linear system; None where
        they are these."""
        further = self.law.stuck_stiffness(self.contacts) - self.springs
        return further if further.any() else None

    def forces(
        self, u: np.ndarray, omega: float, known: ContactForces | None = None
    ) -> ContactForces:
        """Contact forces at the relative motion u (P, nd, nh) m and omega rad/s, as the deviation
        from the force at rest and the springs; known : those with fewer orders, where those that u
        has beyond are zero."""
        forces = evaluate(self.law, self.contacts, u, self.start, self.grid, omega, known)
        if self.beyond_rest.any():
            forces.g[:, :, 0] += self.beyond_rest
            # open at rest and through the cycle: nothing cancels, however wide the gap
            away = (forces.shares[:, 2] >= 1 - EPS) & ~self.rest.any(axis=1)
            forces.g[away] = -self.law.stuck_stiffness(self.contacts)[away, :, None] * u[away]
        return (
            forces if self.further_springs is None else forces.with_springs(self.further_springs, u)
        )

    def repeated(self, contacts: list[Contacts], rest: list[np.ndarray]) -> "Cycle":
        """These contacts several times over, each time with settings and forces at rest of their
        own."""
        n = len(contacts)
        at = np.tile(np.arange(len(self.contacts)), len(contacts))
        settings = (
            np.concatenate(columns)
            for columns in zip(*(vars(one).values() for one in contacts), strict=True)
        )
        positions = np.tile(self.start.positions, (n, 1))
        return replace(
            self,
            law=self.law.select(at),
            contacts=Contacts(*settings),
            rest=np.concatenate(rest),
            springs=np.tile(self.springs, (n, 1)),
            start=self.start._replace(positions=positions),
        )


def evaluate(
    law: ContactLaw,
    contacts: Contacts,
    x: np.ndarray,
    start: SliderStart,
    grid: SampleGrid,
    omega: float,
    known: ContactForces | None = None,
) -> ContactForces:
    """Contact forces of a law at the relative motion x (P, nd, nh) m and omega rad/s; grid from
    `sample_grid`; known : as in `Cycle.forces`.

    Of many contacts those that stick surely are passed over: they are springs, by their largest
    distance from where the sliders start.
    """
    # read-only, as of a curve: kernels would be compiled once more
    x = np.require(x, requirements=("C", "W"))
    P = len(contacts)
    if P <= DEFAULT.few_contacts or start.from_position or start.positions.any():
        return _of_law(law, contacts, x, start, grid, omega, known)
    moves = ~law.sticks_surely(contacts, np.abs(fourier.to_complex(x)).sum(axis=2))
    moves[:1] |= not moves.any()
    if moves.all():
        return _of_law(law, contacts, x, start, grid, omega, known)
    some = _of_law(
        law.select(moves),
        contacts.select(moves),
        x[moves],
        start._replace(positions=start.positions[moves]),
        grid,
        omega,
        known and replace(known, active=known.active[moves], shares=known.shares[moves]),
    )
    sticks = np.tile([1.0, 0.0, 0.0], (P, 1))
    sticks[moves] = some.shares
    of_contacts = ("g", "active", "by_preload", "by_omega", "work")
    among = {name: _among(moves, vars(some)[name]) for name in of_contacts}
    return replace(some, shares=sticks, **among)


def _of_law(
    law: ContactLaw,
    contacts: Contacts,
    x: np.ndarray,
    start: SliderStart,
    grid: SampleGrid,
    omega: float,
    known: ContactForces | None,
) -> ContactForces:
    if known is None:
        return law.harmonics(contacts, x, start, grid, omega)
    return law.more_orders(contacts, x, start, grid, omega, known)


def _among(moves: np.ndarray, part: Any) -> Any:
    """Of all contacts, zero but for those that move; None where it is not known."""
    if part is None:
        return None
    whole = np.zeros((len(moves), *part.shape[1:]), dtype=part.dtype)
    whole[moves] = part
    return whole
