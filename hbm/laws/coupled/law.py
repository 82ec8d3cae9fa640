"""Isotropic Coulomb friction in the tangential plane: the law and its plain form; the kernel is `coulomb`."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hbm.laws.coupled.kernels import march
from hbm.laws.sampled import SampledLaw, projector


@dataclass(frozen=True)
class IsotropicFriction(SampledLaw):
    """Isotropic coupled friction, |T| <= mu N, under N = max(0, preload + kn u_n); open: T = 0, the slider follows.

    `harmonics` is the kernel; `begin` and `advance` are the plain form, whose state is the slider (2) and the motion
    before (3).
    """

    name: str = "IsotropicFriction"
    components: tuple = ("t1", "t2", "n")
    tangents: int = 2
    states: int = 5
    has_normal: bool = True
    kernel: ClassVar = march

    def stuck_stiffness(self, pairs):
        return np.stack([pairs.kt, pairs.kt, pairs.kn], axis=1)

    def begin(self, u, sliders, from_position, pairs):
        state = np.concatenate([u[:, :2] if from_position else sliders + 0 * u[:, :2], u], axis=1)
        for p in range(len(u)):
            N = pairs.preload[p] + pairs.kn[p] * u[p, 2]
            T = pairs.kt[p] * (u[p, :2] - state[p, :2])
            size, limit = np.sqrt(T[0] ** 2 + T[1] ** 2), pairs.mu[p] * N * (N.real > 0)
            if size.real > limit.real:
                state[p, :2] = u[p, :2] - limit / size * (u[p, :2] - state[p, :2])
        return state

    def advance(self, u, state, pairs):
        force, new = np.zeros(u.shape, dtype=u.dtype), np.concatenate([u[:, :2], u], axis=1)
        for p in range(len(u)):
            kt, kn, mu = pairs.kt[p], pairs.kn[p], pairs.mu[p]
            N0, N1 = pairs.preload[p] + kn * state[p, 4], pairs.preload[p] + kn * u[p, 2]
            if N1.real <= 0:
                continue
            was = N0.real > 0
            T = kt * (state[p, 2:4] - state[p, :2]) if was else 0 * u[p, :2]
            d = kt * (u[p, :2] - state[p, 2:4]) * (1 if was else N1 / (N1 - N0))
            force[p, :2], force[p, 2] = plain_slide(T, d, mu * N0 if was else 0 * N0, mu * N1), N1
            if kt > 0:
                new[p, :2] = u[p, :2] - force[p, :2] / kt
        return force, new

    def harmonics(self, pairs, x, start, grid):
        P, nd, nh = x.shape
        E = grid[1]
        n, project = len(E), projector(E)
        u = np.ascontiguousarray((x @ E.T).transpose(0, 2, 1))
        w, dw = np.zeros((P, n, 2)), np.zeros((P, n, 2, nd * nh))
        moves, shares = np.zeros((P, nd), dtype=bool), np.empty((P, 3))
        march(u, E, pairs.kt, pairs.kn, pairs.mu, pairs.preload, *start, w, dw, moves, shares)
        g, D = np.zeros((P, nd, nh)), np.zeros((P, nd, nh, nd, nh))
        g[:, :2] = -pairs.kt[:, None, None] * (w.transpose(0, 2, 1) @ project)
        slid = moves[:, 0]
        g[~slid, :2, 1:] = 0.0                   # a slider at rest is a constant, to the last digit
        by = np.matmul(project.T, dw[slid].reshape(-1, n, 2 * nd * nh)).reshape(-1, nh, 2, nd, nh)
        D[slid, :2] = -pairs.kt[slid, None, None, None, None] * by.transpose(0, 2, 1, 3, 4)
        opens = moves[:, 2]
        N = pairs.preload[opens, None] + pairs.kn[opens, None] * u[opens, :, 2]
        g[opens, 2] = np.maximum(0.0, -N) @ project
        D[opens, 2, :, 2, :] = -pairs.kn[opens, None, None] * np.matmul(project.T, (N <= 0)[:, :, None] * E)
        return g, D, moves, shares


def plain_slide(T, d, L0, L1):
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
    decay = np.exp(-(1 - s) * size / _plain_log_mean(L, L1))
    x = n @ m
    below = 1 + x + decay**2 * (1 - x)
    if below.real <= 0:
        return -L1 * m                           # straight against the motion
    return L1 / below * (2 * decay * n + (1 + x - decay**2 * (1 - x) - 2 * decay * x) * m)


def _plain_log_mean(a, b):
    z = (b - a) / (b + a)
    return 0.5 * (a + b) / (1 + z**2 / 3 + z**4 / 5 + z**6 / 7) if abs(z) < 1e-2 else (b - a) / np.log(b / a)
