"""Isotropic Coulomb friction in the tangential plane: the law, and the period in which its sliders repeat."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from hbm.coulomb import SLIP, STICK, begin, plain_slide, step
from hbm.sampled import SampledLaw, projector

MOST_PERIODS = 60
REPEATS = 1e-13          # of the largest motion: the slider has come back to where it was
REGULAR = 1e-7           # of det(I - A): below, what a period does to the slider is not inverted


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


@njit(cache=True)
def one_period(u, w1, w2, kt, kn, mu, preload, J, M, C0, C1, w, state, A):
    """March from sample 0 round to sample 0: w (n, 2), state (n,), M, C0, C1 of each sample, A = dw(end)/dw(begin)."""
    n = len(u)
    A[0, 0], A[0, 1], A[1, 0], A[1, 1] = 1.0, 0.0, 0.0, 1.0
    for k in range(1, n + 1):
        i = k % n
        w1, w2, state[i] = step(u[k - 1], u[i], w1, w2, kt, kn, mu, preload, J, M[i], C0[i], C1[i])
        w[i, 0], w[i, 1] = w1, w2
        if state[i] != STICK or M[i, 0, 0] != 1.0:
            for j in range(2):
                top, low = A[0, j], A[1, j]
                A[0, j], A[1, j] = M[i, 0, 0] * top + M[i, 0, 1] * low, M[i, 1, 0] * top + M[i, 1, 1] * low
    return w1, w2


@njit(cache=True)
def carry(dw, E, M, C0, C1):
    """Derivatives dw (n, 2, 2 + 3 nh) along the period from those in dw[0], which is left as at its end."""
    n, nh = E.shape
    for k in range(1, n + 1):
        i, before = k % n, dw[k - 1].copy()
        for r in range(2):
            for c in range(before.shape[1]):
                dw[i, r, c] = M[i, r, 0] * before[0, c] + M[i, r, 1] * before[1, c]
            for d in range(3):
                c0, c1 = C0[i, r, d], C1[i, r, d]
                if c0 != 0 or c1 != 0:
                    for m in range(nh):
                        dw[i, r, 2 + d * nh + m] += c0 * E[k - 1, m] + c1 * E[i, m]


@njit(cache=True)
def determinant(A):
    """Of I - A: zero where a period leaves the slider, or a part of it, where it was."""
    return (1 - A[0, 0]) * (1 - A[1, 1]) - A[0, 1] * A[1, 0]


@njit(cache=True)
def settle(u, w1, w2, kt, kn, mu, preload, newton, J, M, C0, C1, w, state, A):
    """March until the slider repeats: periods marched, whether it did, whether by Newton, whether it ever slid.

    In the plane a slider only creeps to where it repeats. Newton on the map of a period takes it there.
    """
    size, C = np.abs(u).max() + 1e-300, np.empty((2, 3))
    slid, leapt = False, False
    for periods in range(1, MOST_PERIODS + 1):
        a1, a2 = w1, w2
        w1, w2 = one_period(u, a1, a2, kt, kn, mu, preload, J, M, C0, C1, w, state, A)
        e1, e2 = w1 - a1, w2 - a2
        slid = slid or (state != STICK).any()
        if periods == 1:
            continue
        if max(abs(e1), abs(e2)) <= REPEATS * size:
            return periods, True, leapt, slid
        det = determinant(A)
        if newton and abs(det) > REGULAR:
            leapt = True
            w1, w2 = a1 + ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det, a2 + (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det
            w1, w2 = begin(u[0], w1, w2, kt, kn, mu, preload, C)
    return MOST_PERIODS, False, leapt, slid


@njit(cache=True)
def fixed_point(by, A, dw):
    """dw (n, 2, 3 nh) of the slider that repeats; by (n, 2, 2 + 3 nh) from unit columns of the slider at t = 0."""
    det = determinant(A)
    for m in range(2, by.shape[2]):
        e1, e2 = by[0, 0, m], by[0, 1, m]            # of the end of the period, which is sample 0 again
        s1, s2 = ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det, (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det
        for i in range(len(by)):
            dw[i, 0, m - 2] = by[i, 0, m] + by[i, 0, 0] * s1 + by[i, 0, 1] * s2
            dw[i, 1, m - 2] = by[i, 1, m] + by[i, 1, 0] * s1 + by[i, 1, 1] * s2


@njit(cache=True)
def march(u, E, kt, kn, mu, preload, sliders, from_position, w, dw, moves, shares):
    """Fill the sliders w (P, n, 2) of the period that repeats, their derivatives dw (P, n, 2, 3 nh) by the harmonics
    of the motion u (P, n, 3), moves (P, 3) and shares (P, 3: stick, slip, open). E (n, nh).

    The derivative is that of a fixed point of the map of a period. Where a pair has come to rest, and where it creeps
    to a rest that Newton would leap over, the derivative is carried through all periods from the start.
    """
    P, n = u.shape[0], u.shape[1]
    nh = E.shape[1]
    J, A, C = np.empty((2, 6)), np.empty((2, 2)), np.empty((2, 3))
    M, C0, C1 = np.empty((n, 2, 2)), np.empty((n, 2, 3)), np.empty((n, 2, 3))
    state, by = np.empty(n, np.int64), np.empty((n, 2, 2 + 3 * nh))
    for p in range(P):
        law = (kt[p], kn[p], mu[p], preload[p])
        lift = preload[p] + kn[p] * u[p, :, 2] <= 0
        shares[p, 2] = lift.sum() / n
        moves[p, 2] = lift.any() and kn[p] > 0
        shares[p, 1] = 0.0
        if kt[p] > 0:
            given1, given2 = (u[p, 0, 0], u[p, 0, 1]) if from_position else (sliders[p, 0], sliders[p, 1])
            w1, w2 = begin(u[p, 0], given1, given2, *law, C)
            pulled = w1 != given1 or w2 != given2
            periods, repeats, leapt, slid = settle(u[p], w1, w2, *law, True, J, M, C0, C1, w[p], state, A)
            if leapt and (not repeats or abs(determinant(A)) <= REGULAR):
                periods, repeats, _, slid = settle(u[p], w1, w2, *law, False, J, M, C0, C1, w[p], state, A)
                leapt = False
            moves[p, 0] = moves[p, 1] = slid or pulled or from_position
            shares[p, 1] = (state == SLIP).sum() / n
            by[0] = 0.0
            if leapt or np.abs(A).max() < 1e-12:
                by[0, 0, 0] = by[0, 1, 1] = 1.0
                carry(by, E, M, C0, C1)
                fixed_point(by, A, dw[p])
            elif moves[p, 0]:
                for d in range(2):
                    for j in range(3):
                        value = C[d, j] if pulled else 1.0 * (from_position and d == j)
                        by[0, d, 2 + j * nh:2 + (j + 1) * nh] = value * E[0]
                for _ in range(periods):
                    w1, w2 = one_period(u[p], w1, w2, *law, J, M, C0, C1, w[p], state, A)
                    carry(by, E, M, C0, C1)
                dw[p] = by[:, :, 2:]
        shares[p, 0] = 1 - shares[p, 1] - shares[p, 2]
