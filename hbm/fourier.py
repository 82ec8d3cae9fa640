"""The one place that states the order of the Fourier coefficients.

A periodic x(t) with harmonics 0..H is, with tau = omega t and exp(+i omega t),

    x(t) = X0 + Re sum_k X_k exp(i k tau)  =  sum_j x_j e_j(tau)

    real coefficients, last axis:     x = [X0, Re X1, Im X1, Re X2, Im X2, ...]         2 H + 1 numbers
    complex coefficients, last axis:  X = [X0, X1, ..., XH], X0 real                     H + 1 numbers
    basis:                            e_0 = 1,  e_{2k-1} = cos k tau,  e_{2k} = -sin k tau
"""

import numpy as np


def n_real(H: int) -> int:
    """Number of real coefficients of harmonics 0..H."""
    return 2 * H + 1


def to_complex(x: np.ndarray) -> np.ndarray:
    """(..., 2H+1) real -> (..., H+1) complex."""
    X = np.empty((*x.shape[:-1], (x.shape[-1] + 1) // 2), dtype=complex)
    X[..., 0] = x[..., 0]
    X[..., 1:].real = x[..., 1::2]
    X[..., 1:].imag = x[..., 2::2]
    return X


def to_real(X: np.ndarray) -> np.ndarray:
    """(..., H+1) complex -> (..., 2H+1) real; the imaginary part of order 0 is dropped."""
    x = np.empty((*X.shape[:-1], 2 * X.shape[-1] - 1))
    x[..., 0] = X[..., 0].real
    x[..., 1::2] = X[..., 1:].real
    x[..., 2::2] = X[..., 1:].imag
    return x


def work(f: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(P,) J per cycle that forces f dissipate in motions u, both real coefficients (P, nd, 2H+1)."""
    F, U = to_complex(f), to_complex(u)
    return np.pi * np.sum(np.arange(F.shape[-1]) * (F * U.conj()).imag, axis=(1, 2))


def basis(tau: np.ndarray, H: int) -> np.ndarray:
    """(n, 2H+1) values of e_j at the n instants tau (radians)."""
    E = np.ones((len(tau), n_real(H)))
    k = np.arange(1, H + 1)
    E[:, 1::2] = np.cos(np.outer(tau, k))
    E[:, 2::2] = -np.sin(np.outer(tau, k))
    return E


def basis_rate(tau: np.ndarray, H: int) -> np.ndarray:
    """(n, 2H+1) derivatives of e_j with respect to tau."""
    E = np.zeros((len(tau), n_real(H)))
    k = np.arange(1, H + 1)
    E[:, 1::2] = -k * np.sin(np.outer(tau, k))
    E[:, 2::2] = -k * np.cos(np.outer(tau, k))
    return E


def half_peak_to_peak(X: np.ndarray) -> np.ndarray:
    """(...,) half of max minus min over the cycle, from complex harmonics (..., H+1); extrema found to rounding."""
    H = X.shape[-1] - 1
    if H <= 1:
        return np.abs(X[..., 1]) if H else np.zeros(X.shape[:-1])
    x = to_real(X).reshape(-1, n_real(H))
    (high, _), (low, _) = _extrema(x, H)
    return 0.5 * (high - low).reshape(X.shape[:-1])


def half_peak_to_peak_slope(X: np.ndarray, dX: np.ndarray) -> np.ndarray:
    """(...,) derivative of half_peak_to_peak where X changes by dX: that of the values at the extremal instants."""
    H = X.shape[-1] - 1
    x, dx = (to_real(Y).reshape(-1, n_real(H)) for Y in (X, dX))
    (_, high), (_, low) = _extrema(x, H)
    return 0.5 * np.sum((basis(high, H) - basis(low, H)) * dx, axis=1).reshape(X.shape[:-1])


def _extrema(x, H):
    """((highest value, instant), (lowest value, instant)) of series x (n, 2H+1)."""
    tau = np.arange(16 * H) * (2 * np.pi / (16 * H))
    wave = x @ basis(tau, H).T
    return tuple(_extremum(x, tau[pick(axis=1)], H, sign) for pick, sign in ((wave.argmax, 1.0), (wave.argmin, -1.0)))


def _extremum(x, tau, H, sign):
    """Newton on the rate from the best sample; a sample stays where Newton would make it worse."""
    step = np.pi / (16 * H)
    k2 = np.r_[0.0, np.repeat(np.arange(1, H + 1), 2)] ** 2
    best, at = np.sum(basis(tau, H) * x, axis=1), tau
    for _ in range(5):
        rate = np.sum(basis_rate(tau, H) * x, axis=1)
        curvature = -np.sum(basis(tau, H) * x * k2, axis=1)
        move = -rate / np.where(curvature == 0, np.inf, curvature)
        tau = tau + np.clip(move, -step, step)
        value = np.sum(basis(tau, H) * x, axis=1)
        higher = sign * value > sign * best
        best, at = np.where(higher, value, best), np.where(higher, tau, at)
    return best, at


def rms(X: np.ndarray) -> np.ndarray:
    """(...,) root mean square of the vibration, order 0 left out."""
    return np.sqrt(0.5 * np.sum(np.abs(X[..., 1:]) ** 2, axis=-1))


def rms_slope(X: np.ndarray, dX: np.ndarray) -> np.ndarray:
    """(...,) derivative of rms where X changes by dX."""
    size = rms(X)
    return 0.5 * np.sum((X[..., 1:].conj() * dX[..., 1:]).real, axis=-1) / np.where(size > 0, size, 1.0)
