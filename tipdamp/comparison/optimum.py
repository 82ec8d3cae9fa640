"""The least of an optimisation curve, and how flat it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from tipdamp.comparison.peaks import ComparedPeak

FLAT = 0.05  # above the least, within which a pull counts as good
FINE = 2001  # places between the computed levels


@dataclass(frozen=True)
class Optimum:
    """ratio - Fc/Fe at which the largest FRF is least, m_per_N - there; of_end - whether that is
    the first or the last level; low, high - Fc/Fe between which it stays within 5 % of the least;
    at_end - whether one of these is an end of what was computed, so that the true one lies at it or
    beyond: '' or 'low', 'high', 'both'."""

    ratio: float
    m_per_N: float
    of_end: bool
    low: float
    high: float
    at_end: str


def optimum(peaks: Sequence[ComparedPeak]) -> Optimum | None:
    """Of the peaks of one study, phase and pull, on one or several blades, of which the largest
    counts; None without two levels that have a peak.

    Between the levels the curve is monotone piecewise cubic in log-log (Fritsch and Carlson, 1980),
    so that its least is that of a computed level.
    """
    ratio, height = envelope(peaks)
    if len(ratio) < 2:
        return None
    x, y = np.log(ratio), np.log(height)
    i = int(y.argmin())
    fine = np.linspace(x[0], x[-1], FINE)
    good = PchipInterpolator(x, y)(fine) <= y[i] + np.log1p(FLAT)
    at = int(np.abs(fine - x[i]).argmin())
    bad_before, bad_after = np.flatnonzero(~good[:at]), np.flatnonzero(~good[at:])
    first = bad_before[-1] + 1 if len(bad_before) else 0
    last = at + bad_after[0] - 1 if len(bad_after) else FINE - 1
    ends = (first == 0, last == FINE - 1)
    said = {(True, True): "both", (True, False): "low", (False, True): "high"}.get(ends, "")
    return Optimum(
        ratio=float(ratio[i]),
        m_per_N=float(height[i]),
        of_end=i in (0, len(ratio) - 1),
        low=float(min(np.exp(fine[first]), ratio[i])),
        high=float(max(np.exp(fine[last]), ratio[i])),
        at_end=said,
    )


def envelope(peaks: Sequence[ComparedPeak]) -> tuple[np.ndarray, np.ndarray]:
    """(Fc/Fe (n,) ascending, m/N (n,)) of the cases in which every blade has a peak: the largest of
    them."""
    found: dict[float, list[float | None]] = {}
    for peak in peaks:
        found.setdefault(peak.ratio, []).append(peak.m_per_N)
    whole = {
        ratio: max(one for one in heights if one is not None)
        for ratio, heights in found.items()
        if None not in heights
    }
    ratio = np.array(sorted(whole))
    return ratio, np.array([whole[one] for one in ratio])


def ranks(least: dict[str, float]) -> dict[str, int]:
    """{name: place}, 1 of the smallest; equal ones share a place."""
    return {name: 1 + sum(other < mine for other in least.values()) for name, mine in least.items()}


def lowest_at(curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> dict[str, tuple[int, int]]:
    """{name: (at how many of the ratios that all have in their range its curve is the lowest, how
    many these are)}; between their levels the curves are interpolated in log-log."""
    known = {name: c for name, c in curves.items() if len(c[0]) >= 2}
    if len(known) < 2:
        return {}
    low = max(ratio[0] for ratio, _ in known.values())
    high = min(ratio[-1] for ratio, _ in known.values())
    every = np.unique(np.concatenate([ratio for ratio, _ in known.values()]))
    common = every[(every >= low) & (every <= high)]
    heights = np.array(
        [
            np.interp(np.log(common), np.log(ratio), np.log(height))
            for ratio, height in known.values()
        ]
    )
    first = heights.argmin(axis=0) if len(common) else np.empty(0, int)
    return {name: (int((first == k).sum()), len(common)) for k, name in enumerate(known)}
