"""A contact law of one's own with parameters: Bouc-Wen hysteresis, one set of parameters per
contact.

    f = k (alpha u + (1 - alpha) z),    dz/du = 1 - |z/r|^n (gamma + beta sign(z du))

with k = kt of the contact, z in m and r the z at which slip is complete, for beta + gamma = 1 [Bouc
1967; Wen 1976]. `python bouc_wen.py` compares two such contacts with the same differential
equations integrated in time by scipy."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tipdamp import ContactLaw


@dataclass(frozen=True)
class BoucWen(ContactLaw):
    """One tangent; the state of a contact is z (m) and the position before (m).

    alpha : share of the stiffness that stays in slip; reach : r, m; beta, gamma : shape of the
    loop;
    each one number or one per contact. order : n, a whole number
    """

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    alpha: float | np.ndarray
    reach: float | np.ndarray
    beta: float | np.ndarray = 0.5
    gamma: float | np.ndarray = 0.5
    order: int = 1

    def check(self, contacts):
        """Ranges of the parameters."""
        self.check_range("alpha", 0, 1)
        self.check_range("reach", 0, above=True)
        self.check_range("order", 1)
        super().check(contacts)

    def stuck_stiffness(self, contacts):
        """The slope at z = 0."""
        return contacts.kt[:, None]

    def initial_state(self, u, start, contacts):
        """z = 0 at t = 0."""
        return np.concatenate([0 * u, u], axis=1)

    def step(self, motion, state, contacts):
        """One step of the classical Runge-Kutta method in u."""
        u, z, du = motion.u[:, 0], state[:, 0], motion.u[:, 0] - state[:, 1]
        k1 = self.slope(z, du)
        k2 = self.slope(z + 0.5 * du * k1, du)
        k3 = self.slope(z + 0.5 * du * k2, du)
        k4 = self.slope(z + du * k3, du)
        z = z + du * (k1 + 2 * k2 + 2 * k3 + k4) / 6
        force = contacts.kt * (self.alpha * u + (1 - self.alpha) * z)
        return force[:, None], np.stack([z, u], axis=1)

    def slope(self, z, du):
        """dz/du; of complex numbers the real part is compared."""
        size = np.where(z.real < 0, -z, z) / self.reach
        return 1 - size**self.order * (self.gamma + self.beta * np.sign(z.real * du.real))


def main():
    """Amplitudes of two coupled masses, each on a contact of its own, by harmonic balance and by
    scipy."""
    from scipy.integrate import solve_ivp

    from tipdamp import ContactProblem, Contacts, solve_at

    law = BoucWen(alpha=[0.1, 0.3], reach=[0.2, 0.5], beta=[0.8, 0.4], gamma=[0.2, 0.6])
    contacts = Contacts(kn=[0, 0], kt=[1.0, 2.0], mu=[0, 0], preload=[0, 0])
    M, C, K = np.eye(2), 0.2 * np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]])
    F, w = np.array([1.0, 0.3]), 1.3
    problem = ContactProblem(M, C, K, np.eye(2), law, contacts)
    outputs = {"first": [1, 0], "second": [0, 1]}
    solution = solve_at(problem, F, omega=w, harmonics=9, samples=256, outputs=outputs)

    def rate(t, y):
        q, v, z = y[:2], y[2:4], y[4:]
        f = contacts.kt * (law.alpha * q + (1 - law.alpha) * z)
        return np.concatenate([v, F * np.cos(w * t) - C @ v - K @ q - f, v * law.slope(z, v)])

    T = 2 * np.pi / w
    t = 50 * T + T * np.arange(2048) / 2048
    motion = solve_ivp(rate, (0, 51 * T), np.zeros(6), "LSODA", t, rtol=1e-8, atol=1e-10).y[:2]
    expected = np.abs(2 * np.mean(motion * np.exp(-1j * w * t), axis=1))
    found = np.abs(solution.harmonics[:, 1])
    print(f"amplitudes {found} m by harmonic balance, {expected} m by time integration")
    assert np.allclose(found, expected, rtol=1e-4)


if __name__ == "__main__":
    main()
