"""Return mapping of Coulomb friction on unilateral springs: the force of a pair from its motion and
its slider.

N = max(0, kn (u_n - g0)),    T = kt (u_t - w)  cut to  |T| <= mu N
"""

from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.laws.friction import FrictionLimit

STEP = 2.0**-100  # of the complex step: a power of two, so that linear forces have exact tangents


@dataclass(frozen=True)
class CoulombSprings:
    """kn, kt : (P,) N/m; mu : (P,); friction - whose limit is mu N: of each tangent, or of their
    resultant."""

    kn: np.ndarray
    kt: np.ndarray
    mu: np.ndarray
    friction: FrictionLimit

    def forces(
        self, z: np.ndarray, w: np.ndarray, gap: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces (3P,), tangents (P, 3, 3) and slipping sliders (P, 2) at the motion z (3P,) m from
        the sliders w (P, 2) m with the gaps (P,) m."""
        u = z.reshape(-1, 3)
        f, slips = self._forces(u, w, gap)
        varied = (self._forces(u + 1j * STEP * way, w, gap)[0] for way in np.eye(3))
        return f.ravel(), np.stack([np.imag(one) / STEP for one in varied], axis=2), slips

    def _forces(self, u, w, gap):
        N = self.kn * (u[:, 2] - gap)
        N = np.where(N.real > 0, N, 0.0)
        T, slips = self.friction(self.kt[:, None] * (u[:, :2] - w), self.mu * N)
        return np.column_stack([T, N]), slips
