"""Table: the numbers of harmonics that harmonics = "auto" tried."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, number


def tables(results: Results) -> Iterator[Table]:
    """One row for each level; none for a study that names its numbers."""
    found = [case.facts for case in results.finest if case.facts.tried]
    if not found:
        return
    yield Table(
        "Harmonics of each level: as many as the tolerance of "
        f"{results.study.respond.tolerance:g} needs. Error: what the harmonics above H would "
        "change by estimate, relative to the vibration of a point, on 99 % of the points of a "
        "curve at most.",
        ("Fe (N)", "H", "error", "tolerance", "tried: error with H"),
        tuple(_row(one) for one in found),
        left=(4,),
    )


def _row(facts):
    error = next(one.error for one in facts.tried if one.H == facts.H)
    tried = (
        f"{number(one.error, 1)} with {one.H}" + ", incomplete" * (not one.complete)
        for one in facts.tried
    )
    met = {True: "met", False: "not met", None: NOTHING}
    return (
        f"{facts.Fe_N:g}",
        f"{facts.H}",
        number(error, 1),
        met[facts.within_tolerance],
        "; ".join(tried),
    )
