"""Isotropic Coulomb friction in the tangential plane: the formula; its compiled cycle is in `kernels`."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hbm.laws import compilation
from hbm.laws.base import ContactLaw
from hbm.laws.coupled.kernels import cycle
from hbm.laws.records import ContactForces
from hbm.laws.sampled import projector, slip_work


@dataclass(frozen=True)
class IsotropicFriction(ContactLaw):
    """Isotropic coupled friction, |T| <= mu N, under N = max(0, preload + kn u_n); open: T = 0, the slider follows.

    State: the slider (2) and the motion before (3).
    """

    components: ClassVar[tuple] = ("t1", "t2", "n")
    sliders: ClassVar[int] = 2
    states: ClassVar[int] = 5
    coupled: ClassVar[bool] = True

    def stuck_stiffness(self, contacts):
        """(P, 3) N/m: kt, kt, kn."""
        return np.stack([contacts.kt, contacts.kt, contacts.kn], axis=1)

    def stuck_force(self, contacts):
        """(P, 3) N: the preload on the normal."""
        return np.stack([0 * contacts.preload, 0 * contacts.preload, contacts.preload], axis=1)

    def initial_state(self, u, start, contacts):
        """(P, 5) state at t = 0: the slider, pulled along where the limit does not hold it, and the motion."""
        state = np.concatenate([u[:, :2] if start.from_position else start.positions + 0 * u[:, :2], u], axis=1)
        for p in range(len(u)):
            N = contacts.preload[p] + contacts.kn[p] * u[p, 2]
            T = contacts.kt[p] * (u[p, :2] - state[p, :2])
            size, limit = np.sqrt(T[0] ** 2 + T[1] ** 2), contacts.mu[p] * N * (N.real > 0)
            if size.real > limit.real:
                state[p, :2] = u[p, :2] - limit / size * (u[p, :2] - state[p, :2])
        return state

    def step(self, motion, state, contacts):
        """Force (P, 3) N and state (P, 5); the motion of a step and the change of the normal load are straight."""
        u, kind = motion.u, np.result_type(motion.u, state)
        force, new = np.zeros(u.shape, kind), np.concatenate([u[:, :2], u], axis=1).astype(kind)
        for p in range(len(u)):
            kt, kn, mu = contacts.kt[p], contacts.kn[p], contacts.mu[p]
            N0, N1 = contacts.preload[p] + kn * state[p, 4], contacts.preload[p] + kn * u[p, 2]
            if N1.real <= 0:
                continue
            was = N0.real > 0
            T = kt * (state[p, 2:4] - state[p, :2]) if was else 0 * u[p, :2]
            d = kt * (u[p, :2] - state[p, 2:4]) * (1 if was else N1 / (N1 - N0))
            force[p, :2], force[p, 2] = slide(T, d, mu * N0 if was else 0 * N0, mu * N1), N1
            if kt > 0:
                new[p, :2] = u[p, :2] - force[p, :2] / kt
        return force, new

    def harmonics(self, contacts, x, start, grid, omega):
        """Forces of the cycle by the compiled kernel, with the derivatives in closed form."""
        compilation.announce(cycle)
        P, nd, nh = x.shape
        E = grid[1]
        n, project = len(E), projector(E)
        u = np.ascontiguousarray((x @ E.T).transpose(0, 2, 1))
        w, dw = np.zeros((P, n, 2)), np.zeros((P, n, 2, nd * nh))
        active, shares = np.zeros((P, nd), dtype=bool), np.empty((P, 3))
        cycle(u, E, (contacts.kt, contacts.kn, contacts.mu, contacts.preload), start, (w, dw, active, shares))
        g, D = np.zeros((P, nd, nh)), np.zeros((P, nd, nh, nd, nh))
        g[:, :2] = -contacts.kt[:, None, None] * (w.transpose(0, 2, 1) @ project)
        slid = active[:, 0]
        g[~slid, :2, 1:] = 0.0                   # a slider at rest is a constant, to the last digit
        by = np.matmul(project.T, dw[slid].reshape(-1, n, 2 * nd * nh)).reshape(-1, nh, 2, nd, nh)
        D[slid, :2] = -contacts.kt[slid, None, None, None, None] * by.transpose(0, 2, 1, 3, 4)
        opens = active[:, 2]
        N = contacts.preload[opens, None] + contacts.kn[opens, None] * u[opens, :, 2]
        g[opens, 2] = np.maximum(0.0, -N) @ project
        D[opens, 2, :, 2, :] = -contacts.kn[opens, None, None] * np.matmul(project.T, (N <= 0)[:, :, None] * E)
        w = w.transpose(1, 0, 2)
        T = contacts.kt[:, None] * (u[:, :, :2].transpose(1, 0, 2) - w)
        return ContactForces(g, active, D[active.any(axis=1)], None, None, shares, slip_work(T, w - np.roll(w, 1, 0)))

    def sticks_surely(self, contacts, amplitude):
        """(P,) bool: neither slip nor lift-off within the amplitude."""
        least = contacts.preload - contacts.kn * amplitude[:, 2]
        return (least > 0) & (contacts.kt * np.hypot(amplitude[:, 0], amplitude[:, 1]) <= contacts.mu * least)


def slide(T, d, L0, L1):
    """Force (2,) at the end of a straight elastic path d under a limit from L0 to L1; complex for derivatives."""
    e = T + d
    if (e @ e - L1 * L1).real <= 0:
        return e
    dL = L1 - L0
    a, b, c = d @ d - dL * dL, T @ d - L0 * dL, T @ T - L0 * L0
    s = 0 * a
    at_limit = c.real >= -1e-12 * (L0 * L0).real
    if at_limit and b.real < 0:
        s = -2 * b / a                           # leaves the limit and comes back to it
    elif not at_limit:
        root = np.sqrt(b * b - a * c)
        s = -c / (b + root) if b.real >= 0 else (root - b) / a
    size = np.sqrt(d @ d)
    if size.real == 0:
        return L1 / np.sqrt(e @ e) * e
    m, L = d / size, L0 + s * dL
    if L.real <= 0 or L1.real <= 0:              # from no load the force lies along the motion
        return L1 * m
    n = (T + s * d) / L
    decay = np.exp(-(1 - s) * size / _log_mean(L, L1))
    x = n @ m
    below = 1 + x + decay**2 * (1 - x)
    if below.real <= 0:
        return -L1 * m                           # straight against the motion
    return L1 / below * (2 * decay * n + (1 + x - decay**2 * (1 - x) - 2 * decay * x) * m)


def _log_mean(a, b):
    z = (b - a) / (b + a)
    return 0.5 * (a + b) / (1 + z**2 / 3 + z**4 / 5 + z**6 / 7) if abs(z) < 1e-2 else (b - a) / np.log(b / a)
