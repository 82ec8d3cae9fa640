"""What happens to the peaks along an optimisation curve: where they drift, are of another mode, or
have merged with those of the other phase."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.comparison.peaks import ComparedPeak
from tipdamp.hbm.drawing.figure import Marks
from tipdamp.report.text import MICRO

DRIFT = 0.02  # of the frequency: what a peak must have moved to be told
DRIFTS = "ends of a drift in frequency"
OTHER_MODE = "another mode from here on"
MERGED = "merged: no maximum of its own"


def runs(peaks: Sequence[ComparedPeak]) -> list[list[ComparedPeak]]:
    """Neighbouring levels whose peaks are of one mode, of the peaks of one study, phase and blade;
    a level without a peak parts them."""
    found: list[list[ComparedPeak]] = [[]]
    for peak in sorted(peaks, key=lambda p: -p.ratio):
        if peak.m_per_N is None or peak.of_another_mode:
            found.append([])
        if peak.m_per_N is not None:
            found[-1].append(peak)
    return [run for run in found if run]


def drifts(peaks: Sequence[ComparedPeak]) -> list[tuple[ComparedPeak, ComparedPeak]]:
    """(first, last) of each run along which the frequency moves, from large Fc/Fe to small."""
    ends = [(run[0], run[-1]) for run in runs(peaks)]
    return [
        (first, last)
        for first, last in ends
        if first.hz and last.hz and abs(last.hz / first.hz - 1) > DRIFT
    ]


def marks(peaks: Sequence[ComparedPeak], color: str) -> Iterator[Marks]:
    """On the curve of one study, phase and blade over Fc/Fe, in µm/N; a merged level stands between
    its neighbours."""
    solved = [peak for peak in peaks if peak.m_per_N is not None]
    if not solved:
        return
    ends = [peak for pair in drifts(peaks) for peak in pair]
    others = [peak for peak in peaks if peak.of_another_mode]
    merged = [peak for peak in peaks if peak.merged]
    for name, found, symbol, filled, size in (
        (DRIFTS, ends, "circle", False, 13.0),
        (OTHER_MODE, others, "hexagram", False, 15.0),
        (MERGED, merged, "x", True, 9.0),
    ):
        ratio = np.array([peak.ratio for peak in found])
        if len(ratio):
            yield Marks(ratio, _height(solved, ratio), name, color, symbol, filled, size)


def _height(solved: Sequence[ComparedPeak], ratio: np.ndarray) -> np.ndarray:
    """µm/N on the lines of a logarithmic figure."""
    x, y = np.log([(p.ratio, MICRO * (p.m_per_N or np.nan)) for p in solved]).T
    order = x.argsort()
    return np.exp(np.interp(np.log(ratio), x[order], y[order]))
