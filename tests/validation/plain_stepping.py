"""Contact laws written once more, plainly: sample by sample, explicit, no code of the laws or of
`tipdamp.hbm.fourier`.

N = max(0, preload + kn u_n); the slider w stays where it is unless kt (u - w) is beyond mu N, then
it is put to the limit: each tangent for itself, or along the resultant (radial return, of first
order in the length of a sample). Where a contact closes between two samples, the slider begins at
the motion there, straight between them.
"""

import numpy as np
from numba import njit

TANGENTS = {
    "Jenkins1D": (1, False),
    "DryFriction1T": (1, False),
    "DryFriction2T": (2, False),
    # and whether mu N is for both
    "UnilateralSpring": (0, False),
    "IsotropicFriction": (2, True),
}


@njit(cache=True)
def march(u, contact, tangents, coupled, force, max_periods, repeats):
    """Forces (n, nd) N at the samples of the motion u (n, nd) m of a contact, once its slider
    repeats; the share of the motion by which it does not.

    contact : kn, kt, mu, preload; the slider starts at zero; sample 0 is the last of a period
    """
    kn, kt, mu, preload = contact
    n, nd = u.shape
    w, T = np.zeros(tangents), np.zeros(tangents)
    size, change = np.abs(u).max() + 1e-300, 0.0
    for period in range(max_periods):
        begin = w.copy()
        for k in range(0 if period == 0 else 1, n + 1):  # the start is held to the limit, too
            i = k % n
            N = preload + kn * u[i, nd - 1] if nd > tangents else preload
            before = preload + kn * u[i - 1, nd - 1] if nd > tangents else preload
            if k > 0 and N > 0 >= before:
                share = before / (before - N)
                w[:] = u[i - 1, :tangents] + share * (u[i, :tangents] - u[i - 1, :tangents])
            T[:] = kt * (u[i, :tangents] - w)
            if N <= 0:
                N = 0.0
            if coupled:
                together = np.hypot(T[0], T[1])
                if together > mu * N:
                    T *= mu * N / together
                    w[:] = u[i, :tangents] - T / kt
            else:
                for d in range(tangents):
                    if abs(T[d]) > mu * N:
                        T[d] = mu * N * np.sign(T[d])
                        w[d] = u[i, d] - T[d] / kt
            force[i, :tangents] = T
            if nd > tangents:
                force[i, nd - 1] = N
        change = np.abs(w - begin).max() / size if tangents else 0.0
        if period and change <= repeats:
            break
    return change


def harmonics(law: str, contacts, X, samples, max_periods=4000, repeats=1e-9):
    """(P, nd, H+1) complex N of P contacts at the motion X (P, nd, H+1) m, as the deviation from
    the force at rest."""
    (P, nd, nh), (tangents, coupled) = X.shape, TANGENTS[law]
    spectrum = np.zeros((P, nd, samples // 2 + 1), complex)
    spectrum[:, :, :nh] = X * samples / 2
    spectrum[:, :, 0] *= 2
    u = np.fft.irfft(spectrum, samples).transpose(0, 2, 1)
    force = np.empty((samples, nd))
    found = np.empty(X.shape, complex)
    for p in range(P):
        contact = contacts.kn[p], contacts.kt[p], contacts.mu[p], contacts.preload[p]
        march(np.ascontiguousarray(u[p]), contact, tangents, coupled, force, max_periods, repeats)
        found[p] = np.fft.rfft(force, axis=0)[:nh].T * 2 / samples
        found[p, :, 0] /= 2
        if nd > tangents:
            found[p, -1, 0] -= max(0.0, contacts.preload[p])
    return found


def modal_damping(M, K, ratio):
    """C whose every mode of (K, M) has the damping ratio: M phi diag(2 zeta w) phi' M for phi' M
    phi = 1."""
    root = 1 / np.sqrt(np.diag(M))  # M is diagonal
    w2, v = np.linalg.eigh(root[:, None] * K * root)
    phi = v / root[:, None]  # M phi
    return phi * (2 * ratio * np.sqrt(w2)) @ phi.T
