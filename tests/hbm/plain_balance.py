"""Harmonic balance of the D cases as plainly as it can be: sampled, dense, no event detected,
nothing of `hbm`.

For finding out who is right where the references and `hbm` disagree: refine the samples and look
where it goes."""

import numpy as np
from numba import njit
from scipy.optimize import root


@njit(cache=True)
def forces(u, un, kt, kn, mu, N0):
    """(T, N - N0) of one contact at the samples of the second period."""
    n = len(u)
    T, N = np.empty(n), np.empty(n)
    w = 0.0
    for i in range(2 * n):
        k = i % n
        N[k] = max(0.0, N0 + kn * un[k])
        if N[k] <= 0:
            T[k], w = 0.0, u[k]
            continue
        trial, limit = kt * (u[k] - w), mu * N[k]
        T[k] = min(max(trial, -limit), limit)
        w = u[k] - T[k] / kt
    return T, N - N0


def harmonic_one(p, omega, H, samples):
    """(r,) |X_1| of the periodic solution; p: parameters of a D file, started from the linear
    response."""
    M, C, K = (np.array(p[k]) for k in "MCK")
    contacts = [
        (np.array(c["bt"]), np.array(c["bn"]), c["kt"], c["kn"], c["mu"], c["N0"])
        for c in p["contacts"]
    ]
    F = np.zeros((H + 1, len(M)), complex)
    F[1] = np.array(p["f_cos"]) - 1j * np.array(p["f_sin"])
    Z = [K - (k * omega) ** 2 * M + 1j * k * omega * C for k in range(H + 1)]
    stuck = sum(kt * np.outer(bt, bt) + kn * np.outer(bn, bn) for bt, bn, kt, kn, _, _ in contacts)

    def unpack(x):
        Q = x.reshape(2 * H + 1, -1)
        return np.vstack([Q[:1], Q[1 : H + 1] + 1j * Q[H + 1 :]])

    def residual(x):
        Q = unpack(x)
        q = np.fft.irfft(np.vstack([Q[:1], Q[1:] / 2]) * samples, samples, axis=0)
        R = np.array([z @ X for z, X in zip(Z, Q, strict=True)]) - F
        for bt, bn, *settings in contacts:
            for force, b in zip(forces(q @ bt, q @ bn, *settings), (bt, bn), strict=True):
                G = np.fft.rfft(force)[: H + 1] * (2 / samples)
                G[0] /= 2
                R += G[:, None] * b
        scaled = np.array([np.linalg.solve(z + stuck, r) for z, r in zip(Z, R, strict=True)])
        return np.vstack([scaled[:1].real, scaled[1:].real, scaled[1:].imag]).ravel()

    X = np.zeros((2 * H + 1, len(M)))
    linear = np.linalg.solve(Z[1] + stuck, F[1])
    X[1], X[H + 1] = linear.real, linear.imag
    found = root(residual, X.ravel(), method="hybr", options={"xtol": 1e-13})
    if not np.abs(found.fun).max() < 1e-9:
        raise RuntimeError(f"no solution: {found.message}")
    return np.abs(unpack(found.x)[1])
