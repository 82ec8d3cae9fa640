"""Dahl's friction in both tangents, each by itself, under constant normal loads, beside a spring
that never slips: as dahl.py, for dampers between flanks.

In a study beside this file: [respond] law = { name = "creeping_contact.py:CreepingContact",
elastic = 0.1 }, run with --allow-code.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp import ContactLaw


@dataclass(frozen=True)
class CreepingContact(ContactLaw):
    """The state of a contact is the friction (N) of both tangents and their positions (m).

    elastic : share of kt that never slips
    """

    components: ClassVar[tuple] = ("t1", "t2")
    states: ClassVar[int] = 4

    elastic: float | np.ndarray = 0.0

    def check(self, contacts):
        """The share is one."""
        self.check_range("elastic", 0, 1)
        super().check(contacts)

    def stuck_stiffness(self, contacts):
        """The slopes at rest."""
        return np.stack([contacts.kt, contacts.kt], axis=1)

    def initial_state(self, u, start, contacts):
        """No friction at t = 0."""
        return np.concatenate([0 * u, u], axis=1)

    def step(self, motion, state, contacts):
        """Arrays may be complex, for the derivatives: compare real parts only."""
        friction, move = state[:, :2], motion.u - state[:, 2:]
        elastic, kt = np.reshape(self.elastic, (-1, 1)), contacts.kt[:, None]
        limit = np.maximum(contacts.mu * contacts.preload, 1e-300)[:, None]
        s = np.where(move.real > 0, 1.0, -1.0)
        fading = np.exp(-(1 - elastic) * kt * s * move / limit)
        friction = s * limit + (friction - s * limit) * fading
        return friction + elastic * kt * motion.u, np.concatenate([friction, motion.u], axis=1)
