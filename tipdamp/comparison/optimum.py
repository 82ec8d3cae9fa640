"""The least of an optimisation curve, and how flat it is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from tipdamp.comparison.peaks import ComparedPeak
from tipdamp.hbm.ties import SAME, first_largest

FLAT = 0.05  # above the least, within which a pull counts as good
FINE = 2001  # places between the computed levels
NEAR = 1e-9  # relative: levels closer to each other than this are at one Fc/Fe
# factor of Fc/Fe up to which a level tells of a place: levels by twos do everywhere
NEARBY = 2**0.5
Spans = dict[str, tuple[float, float]]  # {case: (from, to)}


@dataclass(frozen=True)
class Optimum:
    """peak - of the larger blade, where it is least over Fc/Fe; of_end - whether that is the first
    or the last level; idle - whether friction takes nothing there, so that no pull is best
    low, high - Fc/Fe between which it stays within 5 % of the least; at_end - whether one of these
    is an end of what was computed, so that the true one lies at it or beyond: '' or 'low', 'high',
    'both'."""

    peak: ComparedPeak
    of_end: bool
    idle: bool
    low: float
    high: float
    at_end: str

    @property
    def ratio(self) -> float:
        """Fc/Fe at the least."""
        return self.peak.ratio

    @property
    def beyond(self) -> str:
        """' or less', ' or more': where the true least may lie, of one at an end; else ''."""
        if not self.of_end:
            return ""
        return " or less" if self.low >= self.ratio * (1 - NEAR) else " or more"

    @property
    def flat(self) -> bool:
        """Whether every level is within 5 % of the least, so that no pull is best."""
        return self.at_end == "both"

    @property
    def m_per_N(self) -> float:
        """m/N there."""
        return self.peak.m_per_N or 0.0


def optimum(peaks: Sequence[ComparedPeak]) -> Optimum | None:
    """Of the peaks of one study, phase and pull, on one or several blades, of which the largest
    counts; None without two levels that have a peak.

    Between the levels the curve is monotone piecewise cubic in log-log (Fritsch and Carlson, 1980),
    so that its least is that of a computed level.
    """
    every = tops(peaks)
    if len(every) < 2:
        return None
    ratio, height = envelope(peaks)
    x, y = np.log(ratio), np.log(height)
    i = first_largest(-height)
    first, last, fine = _flat_range(x, y, i)
    ends = (first == 0, last == FINE - 1)
    said = {(True, True): "both", (True, False): "low", (False, True): "high"}.get(ends, "")
    return Optimum(
        peak=every[i],
        of_end=i in (0, len(every) - 1),
        idle=is_idle(every[i], every),
        low=float(min(np.exp(fine[first]), ratio[i])),
        high=float(max(np.exp(fine[last]), ratio[i])),
        at_end=said,
    )


def _flat_range(x: np.ndarray, y: np.ndarray, i: int) -> tuple[int, int, np.ndarray]:
    """(first, last, of which places (FINE,)) around level i between which a curve of logarithms
    (n,) stays close to that level."""
    fine = np.linspace(x[0], x[-1], FINE)
    bad = np.flatnonzero(~(PchipInterpolator(x, y)(fine) <= y[i] + np.log1p(FLAT)))
    at = int(np.abs(fine - x[i]).argmin())
    first = bad[bad < at].max(initial=-1) + 1
    return first, bad[bad >= at].min(initial=FINE) - 1, fine


def is_idle(least: ComparedPeak, every: Sequence[ComparedPeak]) -> bool:
    """Whether friction takes nothing at the least of a curve, or leaves it within the errors, where
    these are known, as high as a level at which it takes nothing."""
    most = least.span[1] if np.isfinite(least.span[1]) else least.m_per_N or 0.0
    return any(one.idle and one.span[0] <= most for one in every)


def tops(peaks: Sequence[ComparedPeak]) -> list[ComparedPeak]:
    """Of the cases in which every blade has a peak the largest, ascending in Fc/Fe."""
    found: dict[float, list[ComparedPeak]] = {}
    for peak in peaks:
        found.setdefault(peak.ratio, []).append(peak)
    whole = {
        ratio: max(mine, key=lambda peak: peak.m_per_N or 0.0)
        for ratio, mine in found.items()
        if all(peak.m_per_N is not None for peak in mine)
    }
    return [whole[ratio] for ratio in sorted(whole)]


def envelope(peaks: Sequence[ComparedPeak]) -> tuple[np.ndarray, np.ndarray]:
    """(Fc/Fe (n,) ascending, m/N (n,)) of `tops`."""
    every = tops(peaks)
    height = [peak.m_per_N for peak in every]
    return np.array([peak.ratio for peak in every]), np.array(height, dtype=float)


def reach(peaks: Sequence[ComparedPeak]) -> tuple[float, float]:
    """(Fc/Fe, Fc/Fe) of the first and last level whose curve is whole, or at which the damper rolls
    or slides: beyond a level that is not there for another reason nothing is known."""
    known = [peak.ratio for peak in peaks if peak.complete or peak.motion]
    return min(known), max(known)


def least_within(every: Sequence[ComparedPeak], low: float, high: float) -> list[ComparedPeak]:
    """Of `tops` those between whose heights the least from low to high (Fc/Fe) lies.

    It is that of the least level there; where an end of the range lies between two levels, that
    beyond it too if it is lower. Of a curve that is flat over the range all levels there: which of
    them is the least says nothing.
    """
    inside = [p for p in every if low * (1 - NEAR) <= p.ratio <= high * (1 + NEAR)]
    before = [p for p in every if p.ratio < low * (1 - NEAR)][-1:]
    after = [p for p in every if p.ratio > high * (1 + NEAR)][:1]
    if not inside:
        return before + after
    beyond = before if inside[0].ratio > low * (1 + NEAR) else []
    beyond += after if inside[-1].ratio < high * (1 - NEAR) else []
    heights = np.array([p.m_per_N for p in inside], dtype=float)
    least = heights.min()
    lower = [p for p in beyond if (p.m_per_N or 0.0) < least]
    if heights.max() <= (1 + FLAT) * least:
        return inside + lower
    return [inside[first_largest(-heights)], *lower]


def far_between(every: Sequence[ComparedPeak], low: float, high: float) -> bool:
    """Whether the least from low to high (Fc/Fe) is only interpolated: it lies beside an end of the
    range, between two levels of `tops` that are both far from that end."""
    outside = [
        peak
        for peak in least_within(every, low, high)
        if not low * (1 - NEAR) <= peak.ratio <= high * (1 + NEAR)
    ]
    ratios = np.array([peak.ratio for peak in every])
    ends = [low if peak.ratio < low else high for peak in outside]
    return any(not is_near(ratios, end) for end in ends)


def is_near(ratios: np.ndarray, place: float) -> bool:
    """Whether one of the levels (n,) tells of a place (Fc/Fe)."""
    return bool((np.abs(np.log(ratios / place)) <= np.log(NEARBY)).any())


def within(
    curve: tuple[np.ndarray, np.ndarray], low: float, high: float
) -> tuple[np.ndarray, np.ndarray]:
    """The part of a curve (Fc/Fe, m/N) from low to high, as far as it reaches; at ends between two
    levels interpolated in log-log."""
    ratio, height = curve
    low, high = max(low, ratio[0]), min(high, ratio[-1])
    inner = ratio[(ratio > low) & (ratio < high)]
    found = np.unique(np.r_[low, inner, high])
    return found, np.exp(np.interp(np.log(found), np.log(ratio), np.log(height)))


def ranks(spans: dict[str, Spans]) -> dict[str, int]:
    """{name: place}, 1 of the smallest: before it are those that lie below it, so that equal ones
    share a place. spans {name: {case: (from, to)}}: where two have the same cases, one lies below
    the other if it does in every case, else if it does whole."""
    return {
        name: 1 + sum(_below(other, mine) for other in spans.values())
        for name, mine in spans.items()
    }


def _below(one: Spans, other: Spans) -> bool:
    if one.keys() == other.keys():
        return all(one[case][1] < other[case][0] for case in one)
    return max(high for _, high in one.values()) < min(low for low, _ in other.values())


def lowest_at(curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> dict[str, tuple[int, int]]:
    """{name: (at how many of the ratios that all have in their range, with a level nearby, its
    curve is the lowest, how many these are)}; between their levels the curves are interpolated in
    log-log."""
    known = {name: c for name, c in curves.items() if len(c[0]) >= 2}
    if len(known) < 2:
        return {}
    low = max(ratio[0] for ratio, _ in known.values())
    high = min(ratio[-1] for ratio, _ in known.values())
    every = np.unique(np.concatenate([ratio for ratio, _ in known.values()]))
    common = np.array(
        [
            place
            for place in every[(every >= low) & (every <= high)]
            if all(is_near(ratio, place) for ratio, _ in known.values())
        ]
    )
    heights = np.array(
        [
            np.interp(np.log(common), np.log(ratio), np.log(height))
            for ratio, height in known.values()
        ]
    )
    first = heights <= heights.min(axis=0) + SAME  # of logarithms
    return {name: (int(mine.sum()), len(common)) for name, mine in zip(known, first, strict=True)}
