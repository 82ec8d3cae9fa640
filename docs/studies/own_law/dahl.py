"""A contact law of one's own: Dahl's friction, in a file of one's own.

The tangential force creeps towards the limit L = mu * preload instead of reaching it,

    dT/du = kt (1 - sign(du) T/L)      so that over a step du      T1 = s L + (T0 - s L) exp(-kt
    |du|/L),  s = sign(du)

[Dahl 1968]. Use it like any other law: forced_response(model, pairs, Dahl(), ...).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp import ContactLaw


@dataclass(frozen=True)
class Dahl(ContactLaw):
    """One tangent under a constant normal load; the state of a contact is its force (N) and its
    position (m)."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    def stuck_stiffness(self, contacts):
        """What the linear system takes over: the slope at T = 0. The answer does not depend on
        it."""
        return contacts.kt[:, None]

    def initial_state(self, u, start, contacts):
        """No force at t = 0."""
        return np.concatenate([0 * u, u], axis=1)

    def step(self, motion, state, contacts):
        """Arrays may be complex, for the derivatives: compare real parts only."""
        L = np.maximum(contacts.mu * contacts.preload, 1e-300)
        move = motion.u[:, 0] - state[:, 1]
        s = np.where(move.real > 0, 1.0, -1.0)
        T = s * L + (state[:, 0] - s * L) * np.exp(-contacts.kt * s * move / L)
        return T[:, None], np.stack([T, motion.u[:, 0]], axis=1)


def main():
    """Energy of a cycle of amplitude X: 4 L (X - L/kt tanh(kt X/L)), the area between the two
    branches of dT/du."""
    from tipdamp import ContactProblem, Contacts, follow_band

    kt, mu, preload = 2.0, 0.5, 1.0
    one = np.eye(1)
    problem = ContactProblem(
        one, 0.05 * one, one, one, Dahl(), Contacts([0.0], [kt], [mu], [preload])
    )
    # one harmonic: a sine
    curve = follow_band(problem, np.ones(1), (0.1, 0.4), harmonics=1, outputs={"x": [1.0]})
    X, L = curve.amplitude("harmonic")[:, 0], mu * preload
    expected = 4 * L * (X - L / kt * np.tanh(kt * X / L))
    top = X.argmax()
    print(
        f"X = {X[top]:.4g} m: {curve.dissipated[top, 0]:.6g} J a cycle, in closed form "
        f"{expected[top]:.6g} J"
    )
    assert np.allclose(curve.dissipated[:, 0], expected, rtol=1e-3)


if __name__ == "__main__":
    main()
