"""Table: the peak of every curve."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import NOTHING, hertz, micro, names_of_pairs


def tables(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    if not results.cases:
        return
    kept = (
        f"; {int(results.kept.carrying.sum())} pairs are kept." if results.kept is not None else "."
    )
    caption = (
        "Peaks of blade 1, half of peak-to-peak along the force: largest and smallest over the "
        "nodes of the patch. Lift off: pairs that are closed at rest and open "
        "in a part of some cycle. Pairs are named by side and station, with the row where a side "
        "has several" + kept
    )
    if not all(case.has_peak for case in results.cases):
        caption += (
            " A curve that stopped before the end of the band, or whose highest point borders a "
            "gap, has no peak; it is at least the largest amplitude that was solved."
        )
    yield Table(
        caption,
        (
            "H",
            "Fe (N)",
            "peak (Hz)",
            "largest (µm)",
            "smallest (µm)",
            "largest per force (µm/N)",
            "lift off",
            "pairs that slip or open",
        ),
        tuple(_row(case) for case in results.cases),
        left=(7,),
    )


def _row(case: ReportedCurve):
    facts = case.facts
    largest, per_newton = (
        (micro(facts.peak_m), micro(case.peak_per_newton))
        if case.has_peak
        else (at_least(facts.at_least_m), at_least(case.at_least_per_newton))
    )
    return (
        f"{case.H}",
        f"{case.Fe:g}",
        hertz(facts.peak_hz),
        largest,
        micro(facts.min_peak_m),
        per_newton,
        f"{len(facts.lift_off_pairs)}" if case.curve.converged.any() else NOTHING,
        names_of_pairs(facts.slipping_pairs) if case.curve.converged.any() else NOTHING,
    )


def at_least(value: float | None) -> str:
    """A lower bound in m, in um."""
    return NOTHING if value is None else f"at least {micro(value)}"
