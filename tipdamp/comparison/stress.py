"""Stress of the studies that ask for it, side by side."""

from collections.abc import Iterator

from tipdamp.comparison.record import ComparedStudies, Computed
from tipdamp.report.drawing.table import Table
from tipdamp.report.text import MEGA, NOTHING, hertz, number
from tipdamp.results.response_results import PeakStress, StressPlace

Row = dict[str, str]


def table(comparison: ComparedStudies) -> Iterator[Table]:
    """One row for each study, pull and level that has it."""
    found = [
        (one, peak)
        for one in comparison.nominal
        if one.results.stress is not None
        for peak in sorted(one.results.stress.curves, key=lambda peak: peak.Fe_N)
    ]
    limits = any(peak.weakest for _, peak in found)
    if found:
        yield Table(
            "Stress at the peak of blade 1, of the curves of most harmonics. Alternating: half of "
            "the largest von Mises range between two instants of a period, with the mean stress "
            "at its node." + " Safety: the least by Goodman, with the body that has it." * limits,
            [_row(one, peak) | (_safety(peak.weakest) if limits else {}) for one, peak in found],
            left=(0, 7, 9) if limits else (0, 7),
        )


def _row(one: Computed, peak: PeakStress) -> Row:
    pull, top = one.results.study.driver.pull, peak.top
    return {
        "study": one.name,
        "Fc (N)": number(pull),
        "Fe (N)": number(peak.Fe_N),
        "Fc/Fe": number(pull / peak.Fe_N, 4),
        "at (Hz)": hertz(peak.hz),
        "alternating (MPa)": number(top.alternating_Pa if top else None, 4, 1 / MEGA),
        "mean there (MPa)": number(top.mean_Pa if top else None, 4, 1 / MEGA),
        "there": f"{top.body}, node {top.node}" if top else NOTHING,
    }


def _safety(weakest: StressPlace | None) -> Row:
    return {
        "safety": number(weakest.safety if weakest else None, 3),
        "least in": f"{weakest.body}, node {weakest.node}" if weakest else NOTHING,
    }
