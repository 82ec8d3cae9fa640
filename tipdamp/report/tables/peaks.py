"""Table: the peak of every curve."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Case, Results
from tipdamp.report.text import hertz, micro, names_of_pairs, number

CLOSE = 1e-6             # difference of two peaks below which they are equal


def tables(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    if not results.cases:
        return
    kept = f"; {int(results.kept.carrying.sum())} pairs are kept." if results.kept is not None else "."
    caption = ("Peaks of blade 1, half of peak-to-peak along the force: largest and smallest over the nodes of the "
               "patch. Other way: relative change of the peak when the band is followed from its other end. "
               "Pairs that slip or open are named by side and station, with the row where a side has several"
               + kept)
    yield Table(caption, ("H", "Fe (N)", "peak (Hz)", "largest (µm)", "smallest (µm)", "largest per force (µm/N)",
                          "points", "curve", "other way", "slipping pairs"),
                tuple(_row(case) for case in results.cases), left=(7, 9))


def _row(case: Case):
    facts = case.facts
    return (f"{case.H}", f"{case.Fe:g}", hertz(facts.peak_hz), micro(facts.peak_m), micro(facts.min_peak_m),
            micro(case.peak_per_newton), f"{facts.points}", _state(facts), _other_way(facts),
            names_of_pairs(facts.slipping_pairs))


def _state(facts) -> str:
    failed = f"{facts.failed_points} points failed" if facts.failed_points else ""
    if facts.complete:
        return failed or "complete"
    return f"incomplete, {failed}" if failed else "incomplete"


def _other_way(facts) -> str:
    if facts.back is None:
        return "not followed"
    if facts.back.peak_m is None or facts.peak_m is None:
        return "no peak"
    off = abs(facts.back.peak_m / facts.peak_m - 1)
    return "equal" if off < CLOSE else number(off, 1)
