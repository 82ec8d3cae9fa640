"""A spring that hardens or softens with the cube of the motion."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp.hbm.laws.force import PlainForce


@dataclass(frozen=True)
class CubicSpring(PlainForce):
    """f = cubic u_n^3, the restoring force of Duffing's oscillator. Exact with more than 4 H
    samples.

    cubic : N/m^3, one number or one per contact; negative: softening
    Raises InputError where cubic is not finite.
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
