"""Plain forces: nonlinear springs and dashpots of one or several components that are no contact."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.validation import check_call


class PlainForce(ContactLaw):
    """Base of forces f(u, v) that depend on the present motion alone: no state, no friction, no
    preload.

    A subclass states its components, its parameters and `force`. It may prefer a direction, as u^2
    does; the settings kn, kt, mu and preload of its contacts are not used. What it gives at rest is
    balanced by the static loads that a problem with `preloaded=True` implies; with
    `preloaded=False` it acts.
    `hbm.testing.check_force` is its conformance.

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

    def check(self, contacts):
        """InputError where `force` takes other arguments, and as that of `ContactLaw`."""
        check_call(f"law {self.name}: force", self.force, "u", "v")
        super().check(contacts)

    def step(self, motion, state, contacts):
        """The force of the end of the step."""
        return self.force(motion.u, motion.v), state

    def harmonics(self, contacts, x, start, grid, omega):
        """Forces of the cycle; what is no contact neither sticks nor slips nor opens."""
        forces = super().harmonics(contacts, x, start, grid, omega)
        return replace(forces, shares=np.zeros((len(x), 3)))


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

    def force(self, u, v):
        """(P, 1) N."""
        return np.reshape(self.cubic, (-1, 1)) * u**3

    def check(self, contacts):
        """InputError where cubic is not finite or does not fit the contacts."""
        self.check_range("cubic")
        super().check(contacts)
