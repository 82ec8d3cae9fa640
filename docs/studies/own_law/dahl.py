"""A contact law of one's own: Dahl's friction, in a file of one's own.

The tangential force creeps towards the limit L = mu * preload instead of reaching it,

    dT/du = kt (1 - sign(du) T/L)      so that over a step du      T1 = s L + (T0 - s L) exp(-kt |du|/L),  s = sign(du)

[Dahl 1968]. Use it like any other law: forced_response(model, pairs, Dahl(), ...).
"""

from dataclasses import dataclass

import numpy as np

from hbm.laws.sampled import SampledLaw


@dataclass(frozen=True)
class Dahl(SampledLaw):
    """One tangent under a constant normal load; the state of a pair is its force and its position."""

    name: str = "Dahl"
    components: tuple = ("t1",)
    states: int = 2

    def stuck_stiffness(self, pairs):
        """What the linear system takes over: the slope at T = 0. The answer does not depend on it."""
        return pairs.kt[:, None]

    def begin(self, u, sliders, from_position, pairs):
        return np.concatenate([0 * u, u], axis=1)

    def advance(self, u, state, pairs):
        """u (rows, 1) and state (rows, 2) may be complex, for the derivatives: compare real parts only."""
        L = np.maximum(pairs.mu * pairs.preload, 1e-300)
        move = u[:, 0] - state[:, 1]
        s = np.where(move.real > 0, 1.0, -1.0)
        T = s * L + (state[:, 0] - s * L) * np.exp(-pairs.kt * s * move / L)
        return T[:, None], np.stack([T, u[:, 0]], axis=1)
