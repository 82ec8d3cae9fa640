"""Table: versions of what is installed."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.versions import versions


def tables(_: Results) -> Iterator[Table]:
    """One row of versions."""
    found = versions()
    yield Table("Versions.", tuple(found), (tuple(found.values()),), left=tuple(range(len(found))))
