"""Tables: where the results come from: bodies as read, stages with their time, versions."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.tables.inspected import bodies_table
from tipdamp.report.versions import versions
from tipdamp.results import STAGES


def tables(results: Results) -> Iterator[Table]:
    """Bodies where the study was inspected, stages before the report, versions of what is
    installed."""
    if results.inspect is not None:
        yield bodies_table(results.inspect)
    yield Table(
        f"Stages before this report, {sum(results.seconds.values()):.1f} s in total.",
        ("stage", "what it does", "seconds"),
        tuple((name, STAGES[name], f"{seconds:.1f}") for name, seconds in results.seconds.items()),
        left=(0, 1),
    )
    yield Table("Versions.", ("software", "version"), tuple(versions().items()), left=(0, 1))
