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
            "Stress at the peak of blade 1, of the curves of most harmonics. At least, at most: "
            "the curve has no peak, or holes in which it may be higher, and the row is that of its "
            "highest solved point, a bound and no result. Alternating: half of the largest von "
            "Mises range between two instants of a period, with the mean stress at its node."
            + " Safety: the least by Goodman, with the body that has it."
            * limits,
            [_row(one, peak, limits) for one, peak in found],
            left=(0, 7, 9) if limits else (0, 7),
        )


def _row(one: Computed, peak: PeakStress, limits: bool) -> Row:
    pull, top = one.results.study.driver.pull, peak.top
    bound = one.results.is_bound(peak.Fe_N, peak.H)
    return {
        "study": one.name,
        "Fc (N)": number(pull),
        "Fe (N)": number(peak.Fe_N),
        "Fc/Fe": number(pull / peak.Fe_N, 4),
        "at (Hz)": hertz(peak.hz),
        "alternating (MPa)": "at least " * bound
        + number(top.alternating_Pa if top else None, 4, 1 / MEGA),
        "mean there (MPa)": number(top.mean_Pa if top else None, 4, 1 / MEGA),
        "there": f"{top.body}, node {top.node}" if top else NOTHING,
        **(_safety(peak, bound) if limits else {}),
    }


def _safety(peak: PeakStress, bound: bool) -> Row:
    weakest = peak.weakest
    if weakest is None:
        return {"safety": NOTHING, "least in": NOTHING}
    return {
        "safety": "at most " * bound + number(weakest.safety, 3),
        "least in": f"{weakest.body}, node {weakest.node}",
    }
