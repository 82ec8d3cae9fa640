"""Return mapping of Coulomb friction on unilateral springs: the force of a pair from its motion and
its slider.

N = max(0, kn (u_n - g0)),    T = kt (u_t - w)  cut to  |T| <= mu N
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CoulombSprings:
    """kn, kt : (P,) N/m; mu : (P,); coupled - the resultant of both tangents has the limit mu N,
    not each of them."""

    kn: np.ndarray
    kt: np.ndarray
    mu: np.ndarray
    coupled: bool

    def forces(
        self, z: np.ndarray, w: np.ndarray, gap: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces (3P,), tangents (P, 3, 3) and slipping pairs (P,) at the motion z (3P,) m from the
        sliders w (P, 2) m with the gaps (P,) m."""
        u = z.reshape(-1, 3)
        N = np.maximum(self.kn * (u[:, 2] - gap), 0.0)
        closed = (N > 0).astype(float)
        limit, dlimit = self.mu * N, self.mu * self.kn * closed
        trial = self.kt[:, None] * (u[:, :2] - w)
        f, J = np.zeros((len(u), 3)), np.zeros((len(u), 3, 3))
        f[:, 2], J[:, 2, 2] = N, self.kn * closed
        norm = (
            np.linalg.norm(trial, axis=1)[:, None] * np.ones(2) if self.coupled else np.abs(trial)
        )
        slips = norm > limit[:, None]
        along = np.divide(trial, norm, out=np.zeros_like(trial), where=norm > 0)
        f[:, :2] = np.where(slips, limit[:, None] * along, trial)
        for d in range(2):
            J[:, d, d] = np.where(slips[:, d], 0.0, self.kt)
            J[:, d, 2] = np.where(slips[:, d], dlimit * along[:, d], 0.0)
        if self.coupled:  # the direction of slip turns with the motion
            turn = np.divide(limit * self.kt, norm[:, 0], out=np.zeros(len(u)), where=slips[:, 0])
            J[:, :2, :2] += turn[:, None, None] * (
                np.eye(2) - along[:, :, None] * along[:, None, :]
            )
        return f.ravel(), J, slips.any(axis=1)
