"""Plain forces: nonlinear springs and dashpots of one or several components that are no contact."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import sampled
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.records import ContactForces, Contacts, Motion, SampleGrid, SliderStart
from tipdamp.hbm.validation import check_call


class PlainForce(ContactLaw):
    """Base of forces f(u, v) that depend on the present motion alone: no state, no friction, no
    preload.

    A subclass states its components, its parameters and `force`. It may prefer a direction, as u^2
    does; the settings kn, kt, mu and preload of its contacts are not used. What it gives at rest is
    balanced by the static loads that a problem with `preloaded=True` implies; with
    `preloaded=False` it acts.
    `check_force` is its conformance.

    >>> class Quadratic(PlainForce):
    ...     components = ("n",)
    ...
    ...     def force(self, u, v):
    ...         return 2e9 * u**2
    >>> oscillator = Problem([[0.05]], K=[[1e6]], damping_ratio=0.01).add(Quadratic(), 0)
    >>> found = oscillator.force(0, 5.0).solve_at(700, outputs={"tip": 0})
    >>> bool(found.harmonics[0, 0].real < 0)  # its mean lies where the force is less
    True
    """

    def force(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(P, nd) N at the motion u m and the velocity v m/s, each (P, nd); analytic where it is
        smooth, as `step`."""
        raise InputError(
            f"law {self.name} has no force: define force(self, u, v), which returns (P, "
            "components) N"
        )

    def check(self, contacts: Contacts) -> None:
        """InputError where `force` takes other arguments, and as that of `ContactLaw`."""
        check_call(f"law {self.name}: force", self.force, "u", "v")
        super().check(contacts)

    def step(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray]:
        """The force of the end of the step."""
        return self.force(motion.u, motion.v), state

    def harmonics(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> ContactForces:
        """Forces of the cycle; what is no contact neither sticks nor slips nor opens.

        There is no state to carry from sample to sample: the harmonics of the force and of its
        slopes at the samples are all.
        """
        P, nd, nh = x.shape
        _, E, E_rate = grid
        n, weights = len(E), sampled.projector(E)
        u, rate = (np.moveaxis(x @ basis.T, 2, 0).reshape(n * P, nd) for basis in (E, E_rate))
        every = np.tile(np.arange(P), n)
        with np.errstate(divide="ignore"):  # a static motion takes for ever
            dt = float(np.divide(2 * np.pi / n, omega))
        law, motion = self.select(every), Motion(u, omega * rate, dt)
        force, _, t = law.tangents(motion, np.zeros((n * P, 0)), contacts.select(every))
        bases = ((t.force_u, E), (t.force_v, omega * E_rate))[: 1 + t.of_rate]
        D: Any = sum(
            _harmonics_of_slopes(by.reshape(n, P, nd, nd), one, weights) for by, one in bases
        )
        f = np.tensordot(force.reshape(n, P, nd), weights, (0, 0))
        by_omega = None
        if t.of_rate:
            change = np.einsum("aij,aj->ai", t.force_v, rate).reshape(n, P, nd)
            by_omega = np.tensordot(change, weights, (0, 0))
        slope = max(np.abs(by * one.max()).max(initial=1e-300) for by, one in bases)
        active = np.abs(D).max(axis=(2, 3, 4)) > sampled.SETTINGS.rounding * slope
        D[~active] = 0.0
        shares, work = np.zeros((P, 3)), fourier.work(f, x)
        return ContactForces(f, active, D[active.any(axis=1)], None, by_omega, shares, work)


def _harmonics_of_slopes(by: np.ndarray, basis: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(P, nd, nh, nd, nh) derivative of the harmonics of a force by those of the motion: by
    (n, P, nd, nd) at the samples, by what the basis (n, nh) makes of the motion there."""
    n, P, nd, _ = by.shape
    nh = basis.shape[1]
    D = weights.T @ (by.reshape(n, P * nd * nd).T[:, :, None] * basis)
    return D.reshape(P, nd, nd, nh, nh).transpose(0, 1, 3, 2, 4)


@dataclass(frozen=True)
class CubicSpring(PlainForce, tested=True):
    """f = cubic u_n^3, the restoring force of Duffing's oscillator. Exact with more than 4 H
    samples.

    cubic : N/m^3, one number or one per contact; negative: softening
    Raises InputError where cubic is not finite.

    >>> hardening = CubicSpring(cubic=1e12)
    >>> print(hardening.force(np.array([[1e-4], [2e-4]]), np.zeros((2, 1))).ravel().round(6))  # N
    [1. 8.]
    """

    components: ClassVar[tuple] = ("n",)

    cubic: float | np.ndarray

    def force(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(P, 1) N."""
        return np.reshape(self.cubic, (-1, 1)) * u**3

    def check(self, contacts: Contacts) -> None:
        """InputError where cubic is not finite or does not fit the contacts."""
        self.check_range("cubic")
        super().check(contacts)
