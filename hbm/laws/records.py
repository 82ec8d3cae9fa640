"""What a contact law is given and what it returns: records of arrays, SI units."""

from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import LEAST, MOST, brief


class ContactState(IntEnum):
    """State of one tangent of a contact; forward and backward are the two directions of slip.

    >>> [state.name for state in ContactState]
    ['STICK', 'FORWARD', 'BACKWARD', 'OPEN']
    """

    STICK = 0
    FORWARD = 1
    BACKWARD = 2
    OPEN = 3


@dataclass(frozen=True)
class Contacts:
    """Settings of P contacts, each (P,).

    kn, kt : N/m, weight included; mu : friction coefficient; preload : N, negative = open
    Raises InputError where a value is not finite, kn, kt or mu is negative or of a size that double
    precision cannot carry, or the lengths differ.

    >>> contacts = Contacts(kn=[3e6, 3e6], kt=[2e6, 2e6], mu=[0.5, 0.5], preload=[40, -6])
    >>> closed = contacts.select(contacts.preload > 0)
    >>> len(contacts), len(closed)
    (2, 1)
    """

    kn: np.ndarray
    kt: np.ndarray
    mu: np.ndarray
    preload: np.ndarray

    def __post_init__(self) -> None:
        for name, given in list(vars(self).items()):
            try:
                values = np.atleast_1d(np.asarray(given, dtype=float))
            except (TypeError, ValueError):
                raise InputError(
                    f"{name} = {brief(given)}: must be one number per contact"
                ) from None
            object.__setattr__(self, name, values)
            bad = ~np.isfinite(values) | ((values < 0) & (name != "preload"))
            if bad.any():
                i = int(np.flatnonzero(bad)[0])
                allowed = "finite" if name == "preload" else "finite and not negative"
                raise InputError(f"contact {i}: {name} = {values[i]:g}, must be {allowed}")
            far = (values != 0) & ((values < LEAST) | (values > MOST)) & (name != "preload")
            if far.any():
                i = int(far.argmax())
                raise InputError(
                    f"contact {i}: {name} = {values[i]:g}, must be zero, or between {LEAST:g} "
                    f"and {MOST:g}, which double precision can carry"
                )
        if len({len(self.kn), len(self.kt), len(self.mu), len(self.preload)}) != 1:
            raise InputError("kn, kt, mu and preload must have one value per contact each")

    def __len__(self) -> int:
        return len(self.kn)

    def select(self, at: np.ndarray) -> "Contacts":
        """Some of the contacts, by a mask or by indices; an index may be repeated."""
        some = object.__new__(Contacts)  # of values that were checked
        for name, values in vars(self).items():
            object.__setattr__(some, name, np.atleast_1d(values[at]))
        return some


class SliderStart(NamedTuple):
    """Sliders at t = 0: positions (P, sliders) in m, or from_position: at the motion there (no
    tangential force).

    nearest : a slider that comes to rest does so at the nearest place at which the limit holds it
        through the cycle, which no instant decides; else where it is dragged to in time
    """

    positions: np.ndarray
    from_position: bool
    nearest: bool = False

    @property
    def name(self) -> str:
        """As a result names it."""
        if self.from_position:
            return "zero_force"
        return "given" if self.positions.any() else "zero_slider"


class SampleGrid(NamedTuple):
    """Samples of a cycle: instants tau (n + 1,) rad and, at all but the last, the harmonic basis E
    (n, nh) and its rate E_rate (n, nh)."""

    tau: np.ndarray
    E: np.ndarray
    E_rate: np.ndarray

    @property
    def samples(self) -> int:
        """Their number, n."""
        return len(self.E)


class Motion(NamedTuple):
    """Relative motion at the end of a step of length dt: u (P, nd) m, v (P, nd) m/s, dt s; complex
    in derivatives."""

    u: np.ndarray
    v: np.ndarray
    dt: complex


@dataclass(frozen=True)
class Tangents:
    """Derivatives of force (P, nd) and state (P, ns) after one step, by motion, velocity, state
    before and dt."""

    force_u: np.ndarray  # (P, nd, nd)
    force_v: np.ndarray  # (P, nd, nd)
    force_state: np.ndarray  # (P, nd, ns)
    force_dt: np.ndarray  # (P, nd)
    state_u: np.ndarray  # (P, ns, nd)
    state_v: np.ndarray  # (P, ns, nd)
    state_state: np.ndarray  # (P, ns, ns)
    state_dt: np.ndarray  # (P, ns)

    def reshaped(self, *rows: int) -> "Tangents":
        """With the leading axis split into `rows`."""
        return Tangents(*(a.reshape(*rows, *a.shape[1:]) for a in vars(self).values()))

    @property
    def of_rate(self) -> bool:
        """Whether force or state depends on the velocity or on the length of the step."""
        return any(a.any() for a in (self.force_v, self.state_v, self.force_dt, self.state_dt))


@dataclass(frozen=True)
class ContactForces:
    """Contact forces of one cycle as their deviation g = f - stuck_force - K_c u from the stuck
    springs, with tangents.

    Harmonics are real coefficients (nh = 2H + 1). g is constant for a contact that sticks through
    the cycle, and its derivative zero, so that only the active contacts, a of P, enter Newton's
    system.

    g : (P, nd, nh) N; active : (P, nd) bool, components whose derivative is not zero
    D : (a, nd, nh, nd, nh) N/m, dg/du of the active contacts
    by_preload : (P, nd, nh) dg/dpreload, None where the law does not provide it
    by_omega : (P, nd, nh) N s, dg/domega at given harmonics of u, None for a law that does not
    depend on the rate
    shares : (P, 3) share of the cycle in stick, slip, open; 0 where the force is no contact
    work : (P,) J per cycle that the contacts take, of friction along the paths of the sliders;
    None: by the harmonics
    events : of the cycle, as the law keeps them for `ContactLaw.more_orders`; None: it does not"""

    g: np.ndarray
    active: np.ndarray
    D: np.ndarray
    by_preload: np.ndarray | None
    by_omega: np.ndarray | None
    shares: np.ndarray
    work: np.ndarray | None = None
    events: tuple | None = None

    @cached_property
    def contacts(self) -> np.ndarray:
        """(a,) indices of the active contacts."""
        return np.flatnonzero(self.active.any(axis=1))

    def with_springs(self, stiffness: np.ndarray, x: np.ndarray) -> "ContactForces":
        """With further springs (P, nd) N/m at the relative motion x (P, nd, nh); every component of
        a contact that has them is then active."""
        P, nd, nh = x.shape
        D = np.zeros((P, nd, nh, nd, nh))
        D[self.contacts] = self.D
        for d in range(nd):
            D[:, d, np.arange(nh), d, np.arange(nh)] += stiffness[:, d, None]
        active = self.active | stiffness.any(axis=1)[:, None]
        g = self.g + stiffness[:, :, None] * x
        return replace(self, g=g, D=D[active.any(axis=1)], active=active)
