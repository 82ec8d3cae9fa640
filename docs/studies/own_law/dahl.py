"""A contact law of one's own: Dahl's friction, in a file of one's own.

The tangential force creeps towards the limit L = mu * preload instead of reaching it,

    dT/du = kt (1 - sign(du) T/L)      so that over a step du      T1 = s L + (T0 - s L) exp(-kt |du|/L),  s = sign(du)

[Dahl 1968]. Use it like any other law: forced_response(model, pairs, Dahl(), ...).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hbm.laws import ContactLaw


@dataclass(frozen=True)
class Dahl(ContactLaw):
    """One tangent under a constant normal load; the state of a contact is its force (N) and its position (m)."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    def stuck_stiffness(self, contacts):
        """What the linear system takes over: the slope at T = 0. The answer does not depend on it."""
        return contacts.kt[:, None]

    def initial_state(self, u, start, contacts):
        return np.concatenate([0 * u, u], axis=1)

    def step(self, motion, state, contacts):
        """Arrays may be complex, for the derivatives: compare real parts only."""
        L = np.maximum(contacts.mu * contacts.preload, 1e-300)
        move = motion.u[:, 0] - state[:, 1]
        s = np.where(move.real > 0, 1.0, -1.0)
        T = s * L + (state[:, 0] - s * L) * np.exp(-contacts.kt * s * move / L)
        return T[:, None], np.stack([T, motion.u[:, 0]], axis=1)
