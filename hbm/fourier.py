"""The one place that states the order of the Fourier coefficients.

A periodic x(t) with harmonics 0..H is, with tau = omega t and exp(+i omega t),

    x(t) = X0 + Re sum_k X_k exp(i k tau)  =  sum_j x_j e_j(tau)

    real coefficients, last axis:     x = [X0, Re X1, Im X1, Re X2, Im X2, ...]         2 H + 1
    numbers
    complex coefficients, last axis:  X = [X0, X1, ..., XH], X0 real                     H + 1
    numbers
    basis:                            e_0 = 1,  e_{2k-1} = cos k tau,  e_{2k} = -sin k tau
"""

from functools import lru_cache

import numpy as np

EPS = np.finfo(float).eps


def n_real(H: int) -> int:
    """Number of real coefficients of harmonics 0..H."""
    return 2 * H + 1


def to_complex(x: np.ndarray) -> np.ndarray:
    """(..., 2H+1) real -> (..., H+1) complex, of the same precision."""
    X = np.empty((*x.shape[:-1], (x.shape[-1] + 1) // 2), np.result_type(x, np.complex64))
    X[..., 0] = x[..., 0]
    X[..., 1:].real = x[..., 1::2]
    X[..., 1:].imag = x[..., 2::2]
    return X


def to_real(X: np.ndarray) -> np.ndarray:
    """(..., H+1) complex -> (..., 2H+1) real, of the same precision; the imaginary part of order 0
    is dropped."""
    x = np.empty((*X.shape[:-1], 2 * X.shape[-1] - 1), X.real.dtype)
    x[..., 0] = X[..., 0].real
    x[..., 1::2] = X[..., 1:].real
    x[..., 2::2] = X[..., 1:].imag
    return x


def work(f: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(P,) J per cycle that forces f dissipate in motions u, both real coefficients (P, nd,
    2H+1)."""
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
    """(...,) half of max minus min over the cycle, from complex harmonics (..., H+1); extrema found
    to rounding."""
    H = X.shape[-1] - 1
    if H <= 1:
        return modulus(X[..., 1]) if H else np.zeros(X.shape[:-1])
    (high, low), _ = _extrema(X[..., 1:].reshape(-1, H))
    return 0.5 * (high - low).reshape(X.shape[:-1])


def half_peak_to_peak_along(X: np.ndarray, dX: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(half_peak_to_peak, its derivative where X changes by dX), each (...,): that of the values at
    the extremal instants."""
    H = X.shape[-1] - 1
    if H == 1:
        X, dX = X[..., 1], dX[..., 1]
        value = modulus(X)
        along = X.real * dX.real + X.imag * dX.imag
        return value, along / np.where(value > 0, value, 1.0)
    (high, low), tau = _extrema(X[..., 1:].reshape(-1, H))
    up, down = _turned(dX[..., 1:].reshape(-1, H), tau[..., None] * np.arange(1, H + 1))[0].sum(-1)
    return 0.5 * (high - low).reshape(X.shape[:-1]), 0.5 * (up - down).reshape(X.shape[:-1])


def _extrema(X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(highest and lowest values (2, n), their instants (2, n)) of series without a mean, X (n, H)
    of orders 1..H.

    Newton on the rate from the best sample; a sample stays where Newton would make it worse by more
    than rounding. At an extremum values tell an instant to 1e-8 only, the rate tells it to
    rounding.
    """
    n, H = X.shape
    k, (tau, waves) = np.arange(1, H + 1), _waves(H)
    samples = (X @ waves).real
    tau, sign = (
        tau[np.r_[samples.argmax(axis=1), samples.argmin(axis=1)]],
        np.repeat([1.0, -1.0], n),
    )
    X, step, best, at = np.concatenate([X, X]), np.pi / (16 * H), np.full(2 * n, -np.inf), tau
    rounding = EPS * modulus(X).sum(axis=1)
    for _ in range(6):
        real, imag = _turned(X, tau[:, None] * k)
        value, rate, curvature = sign * real.sum(axis=1), -(imag * k).sum(1), -(real * k**2).sum(1)
        at = np.where(value >= best - rounding, tau, at)
        best = np.maximum(value, best)
        tau = tau + np.minimum(
            np.maximum(-rate / np.where(curvature == 0, np.inf, curvature), -step), step
        )
    return (sign * best).reshape(2, n), at.reshape(2, n)


def _turned(X: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real and imaginary part of X exp(i angle)."""
    c, s = np.cos(angle), np.sin(angle)
    return X.real * c - X.imag * s, X.real * s + X.imag * c


def modulus(X: np.ndarray) -> np.ndarray:
    """|X| by real numbers.

    Of a few complex numbers numpy rounds products and moduli in two ways, by how far apart they lie
    in memory: the same call would give other last bits."""
    return np.sqrt(X.real**2 + X.imag**2)


@lru_cache
def _waves(H: int) -> tuple[np.ndarray, np.ndarray]:
    """16 H instants of a cycle, and exp(i k tau) there (H, 16 H) of the orders 1..H."""
    tau = np.arange(16 * H) * (2 * np.pi / (16 * H))
    return tau, np.exp(1j * np.outer(np.arange(1, H + 1), tau))


def rms(X: np.ndarray) -> np.ndarray:
    """(...,) root mean square of the vibration, order 0 left out."""
    return np.sqrt(0.5 * np.sum(X[..., 1:].real ** 2 + X[..., 1:].imag ** 2, axis=-1))


def rms_slope(X: np.ndarray, dX: np.ndarray) -> np.ndarray:
    """(...,) derivative of rms where X changes by dX."""
    size, X, dX = rms(X), X[..., 1:], dX[..., 1:]
    along = np.sum(X.real * dX.real + X.imag * dX.imag, axis=-1)
    return 0.5 * along / np.where(size > 0, size, 1.0)
