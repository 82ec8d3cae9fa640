"""How far a computed curve agrees with a measured one."""

from itertools import pairwise

import numpy as np

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.result import ForcedResponse
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.schema import Measured

LINKS = 16  # straight links of the drawn curve between two computed points


def drawn(path_hz: np.ndarray, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The computed points linked by PCHIP over the length of the curve, as a dense polygon; NaN is
    a gap.

    path_hz, path (m,) - in the order of the curve, which may fold
    """
    good = np.isfinite(path_hz) & np.isfinite(path)
    edges = np.flatnonzero(np.diff(np.r_[False, good, False].astype(int)))
    parts: list[np.ndarray] = []
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        points = np.column_stack([path_hz[a:b], path[a:b]])
        size = np.maximum(np.ptp(points, axis=0), np.finfo(float).tiny)
        steps = np.hypot(*(np.diff(points, axis=0) / size).T)
        points = points[np.r_[True, steps > 0]]
        if len(points) > 1:
            parts += [_linked(points, steps[steps > 0]), np.full((1, 2), np.nan)]
    joined = np.concatenate(parts) if parts else np.empty((0, 2))
    return joined[:, 0], joined[:, 1]


def _linked(points: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Points (n, 2) that lie steps (n - 1,) apart, with straight links in between."""
    from scipy.interpolate import PchipInterpolator

    s = np.r_[0.0, np.cumsum(steps)]
    fine = [np.linspace(a, b, LINKS, endpoint=False) for a, b in pairwise(s)]
    return PchipInterpolator(s, points)(np.r_[*fine, s[-1]])


def values_at(hz: np.ndarray, path_hz: np.ndarray, path: np.ndarray) -> list[np.ndarray]:
    """All values of a polygon (NaN: a gap) at each frequency: several where the curve folds."""
    a, b = path_hz[:-1], path_hz[1:]
    good = np.isfinite(path[:-1]) & np.isfinite(path[1:]) & (a != b)
    found = []
    for f in hz:
        k = np.flatnonzero(good & (np.minimum(a, b) <= f) & (f <= np.maximum(a, b)))
        found.append(path[k] + (path[k + 1] - path[k]) * (f - a[k]) / (b[k] - a[k]))
    return found


def share_inside(
    hz: np.ndarray, low: np.ndarray, high: np.ndarray, path_hz: np.ndarray, path: np.ndarray
) -> float:
    """Part of the measured frequencies which a computed curve covers at which it lies within the
    measured band; NaN where it covers none.

    hz, low, high (n,) Hz, m/N - measured band; path_hz, path (m,) - computed points in the order of
    the curve"""
    values = values_at(hz, *drawn(path_hz, path))
    hits = [
        bool(((v >= a) & (v <= b)).any())
        for v, a, b in zip(values, low, high, strict=True)
        if len(v)
    ]
    return float(np.mean(hits)) if hits else float("nan")


def at_place(curve: ForcedResponse, settings: Measured, first_patch: str) -> np.ndarray:
    """(m,) bool: outputs of the measured place. Raises InputError where the curve has no such
    output."""
    place, names = settings.response or first_patch, curve.output_names.tolist()
    mine = in_patch(names, place) | (curve.output_names == place)
    if not mine.any():
        raise InputError(f"response = '{place}': no output of that name; {nearest(place, names)}")
    return mine


def computed_amplitude(curve: ForcedResponse, settings: Measured, first_patch: str) -> np.ndarray:
    """(n,) m, largest computed amplitude over the nodes of the measured place; NaN where a point
    failed."""
    mine = at_place(curve, settings, first_patch)
    values = (
        np.abs(curve.harmonics[:, mine, 1])
        if settings.amplitude == "fundamental"
        else curve.amplitude()[:, mine]
    )
    return np.where(curve.converged, values.max(axis=1), np.nan)
