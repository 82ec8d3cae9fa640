"""Stress of the studies that ask for it, side by side."""

from collections.abc import Iterator

from tipdamp.comparison.record import ComparedStudies, Computed
from tipdamp.report.drawing.table import Table
from tipdamp.report.text import MEGA, NOTHING, hertz, number
from tipdamp.results.response_results import PeakStress

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
            "Stress at the peak of blade 1, of the curves of most harmonics; of a curve without a "
            "peak that at its highest solved point, a bound. Alternating: half of the largest von "
            "Mises range between two instants of a period, with the mean stress at its node."
            + " Safety: the least by Goodman, with the body that has it."
            * limits,
            [_row(one, peak) | (_safety(one, peak) if limits else {}) for one, peak in found],
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
        "alternating (MPa)": "at least " * _is_bound(one, peak)
        + number(top.alternating_Pa if top else None, 4, 1 / MEGA),
        "mean there (MPa)": number(top.mean_Pa if top else None, 4, 1 / MEGA),
        "there": f"{top.body}, node {top.node}" if top else NOTHING,
    }


def _safety(one: Computed, peak: PeakStress) -> Row:
    weakest = peak.weakest
    if weakest is None:
        return {"safety": NOTHING, "least in": NOTHING}
    return {
        "safety": "at most " * _is_bound(one, peak) + number(weakest.safety, 3),
        "least in": f"{weakest.body}, node {weakest.node}",
    }


def _is_bound(one: Computed, peak: PeakStress) -> bool:
    """Whether the curve has no peak."""
    curves = {(case.Fe, case.H): case.has_peak for case in one.results.finest}
    return not curves.get((peak.Fe_N, peak.H), True)
