"""Amplitude of a periodic motion from its harmonics, and the maxima of amplitudes along a curve."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm import fourier
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.validation import brief, is_whole

KINDS = ("half_peak_to_peak", "harmonic", "rms")
RIPPLE = 1e-3  # a local maximum that stands out less, relative to its height, is none


def orders_of(kind: str, order: int | None, H: int, force_orders: ArrayLike) -> list[int]:
    """The orders that count in an amplitude of a kind; InputError for an order that the kind or the
    curve has not."""
    if order is None:
        return sorted(set(np.asarray(force_orders, dtype=int).tolist())) or [1]
    if kind != "harmonic":
        raise InputError(f"order = {order}: belongs to the kind 'harmonic', not to '{kind}'")
    if not is_whole(order) or not 1 <= order <= H:
        raise InputError(
            f"order = {brief(order)}: must be a whole number from 1 to harmonics = {H}"
        )
    return [int(order)]


def amplitude(X: np.ndarray, kind: str, orders: list[int]) -> np.ndarray:
    """(...) amplitude of a kind from harmonics (..., H+1); NaN where they are. orders : that count
    in 'harmonic'."""
    if kind == "half_peak_to_peak":
        return fourier.half_peak_to_peak(X)
    if kind == "harmonic":
        return np.sqrt(2) * fourier.rms(_chosen(X, orders))
    if kind == "rms":
        return fourier.rms(X)
    raise InputError(f"amplitude kind '{kind}' is unknown; {nearest(kind, KINDS)}")


def amplitude_along(
    X: np.ndarray, dX: np.ndarray, kind: str, orders: list[int]
) -> tuple[np.ndarray, np.ndarray]:
    """(that amplitude, its derivative), each (...), where the harmonics change by dX (..., H+1)."""
    if kind == "half_peak_to_peak":
        return fourier.half_peak_to_peak_along(X, dX)
    if kind == "harmonic":
        X, dX = _chosen(X, orders), _chosen(dX, orders)
    share = np.sqrt(2) if kind == "harmonic" else 1.0
    return share * fourier.rms(X), share * fourier.rms_slope(X, dX)


def _chosen(X: np.ndarray, orders: Sequence[int]) -> np.ndarray:
    """The harmonics with those of other orders left out; the mean stands first."""
    return X[..., [0, *(k for k in orders if k < X.shape[-1])]]


def local_maxima(a: ArrayLike, jumps: ArrayLike) -> list[int]:
    """Places of the local maxima of an amplitude (n,) along a curve, both neighbours solved and
    ripples left out.

    jumps : (n,) bool, points to which the branch does not lead from the point before
    """
    a, jumps = np.asarray(a, dtype=float), np.asarray(jumps)
    higher = (a[1:-1] > a[:-2]) & (a[1:-1] >= a[2:])
    return [
        i
        for i in np.flatnonzero(higher & ~jumps[1:-1] & ~jumps[2:]) + 1
        if a[i] - max(_saddle(a[i::-1]), _saddle(a[i:])) > RIPPLE * a[i]
    ]


def _saddle(a: np.ndarray) -> float:
    """The least value before the first that is higher than the first one."""
    above = np.flatnonzero(a > a[0])
    return np.nanmin(a[: above[0]] if len(above) else a)


def parabola_top(x: np.ndarray, a: np.ndarray) -> tuple[float, float]:
    """(place, value) of the maximum of the parabola through three points, x (3,) and a (3,), the
    middle one where that does not lie among them."""
    s = x - x[1]
    c = np.polyfit(s / np.abs(s).max(), a, 2)
    if c[0] < 0:
        top = -0.5 * c[1] / c[0]
        place = float(x[1] + float(top * np.abs(s).max()))
        if min(x) <= place <= max(x):
            return place, float(np.polyval(c, top))
    return float(x[1]), float(a[1])
