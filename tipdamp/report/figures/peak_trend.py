"""Figure: height and frequency of the peak over the excitation level."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.hbm.drawing.figure import (
    BLUE,
    DASHES,
    GREEN,
    INK,
    ORANGE,
    VERMILION,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.report.figures.amplitudes import of_one_mode, orders_of, peakless
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import MICRO, hertz, number

COLORS = (VERMILION, BLUE, GREEN, ORANGE)  # from the largest H down
SYMBOLS = ("circle", "square", "diamond")
LEVEL = "excitation Fe (N)"


def figures(results: Results) -> Iterator[Figure]:
    """One figure, where at least two levels have a peak."""
    if len({case.Fe for case in results.cases if case.has_peak}) < 2:
        return
    height: list[Item] = []
    place: list[Item] = []
    for k, family in enumerate(results.families):
        rank = (len(results.families) - 1 - k) % 4
        cases = [c for c in family if c.has_peak]
        for run in of_one_mode(cases):
            Fe, hz, peak = _peaks(run)
            for items, y in ((height, peak), (place, hz)):
                items.append(Curve(Fe, y, "", COLORS[rank], DASHES[rank]))
        Fe, hz, peak = _peaks(cases)
        for items, y in ((height, peak), (place, hz)):
            items.append(Marks(Fe, y, orders_of(family), COLORS[rank], SYMBOLS[k % 3]))
    if results.tune:
        stuck = results.tune.stuck_hz.tuned
        place.append(_limit(stuck, f"stuck {hertz(stuck)} Hz", place))
    if results.stuck:
        top = MICRO * float(results.stuck.m_per_N.max())
        height.append(_limit(top, f"linear, stuck {number(top, 3)} µm/N", height))
    caption = (
        "Largest peak of blade 1 over the excitation level: amplitude per newton, and frequency; "
        "lines join levels at which it is of one mode. "
        + peakless(results.cases)
        + results.beside_paper("Corresponds to the trend of figure 7")
    )
    yield Figure(
        "peaks",
        "Peak over the excitation level",
        caption,
        (
            Panel("", LEVEL, "peak per force (µm/N)", tuple(height)),
            Panel("", LEVEL, "peak frequency (Hz)", tuple(place)),
        ),
        row_height=300,
    )


def _peaks(cases: Sequence[ReportedCurve]) -> np.ndarray:
    """(3, n): level N, Hz and micrometres per newton."""
    found = [(c.Fe, c.facts.peak_hz, MICRO * (c.peak_per_newton or 0.0)) for c in cases]
    return np.array(found, dtype=float).reshape(-1, 3).T


def _limit(value: float, label: str, items: list[Item]) -> Line:
    """The stuck value as a line, its label at the end from which the marks are farther away."""
    marks = [item for item in items if isinstance(item, Marks) and len(item.y)]
    first, last = (min(abs(m.y[end] - value) for m in marks) for end in (0, -1))
    return Line("y", value, label, INK, "dot", left=bool(first > last))
