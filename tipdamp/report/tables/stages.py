"""Table: the stages of the run and their time."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.stages import STAGES


def tables(results: Results) -> Iterator[Table]:
    """One row for each stage before the report."""
    rows = [(name, STAGES[name], f"{seconds:.1f}") for name, seconds in results.seconds.items()]
    total = sum(results.seconds.values())
    yield Table(f"Stages before this report, {total:.1f} s in total.", ("stage", "what it does", "seconds"),
                tuple(rows), left=(0, 1))
