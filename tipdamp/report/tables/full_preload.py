"""Table: the preload on the full model beside preload.csv."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import number


def tables(results: Results) -> Iterator[Table]:
    """One row for each side, where the full model was solved for this preload."""
    full = results.full
    if full is None:
        return
    where = f", on {full.ranks} ranks" if full.ranks > 1 else ""
    yield Table(
        f"Preload by Newton's method on the unreduced bodies ({full.dofs} dofs{where}; residual "
        f"{full.residual:.1e} of the load) beside that of preload.csv: largest difference of a "
        f"pair {full.difference:.1e} of the largest force.",
        ("side", "full model (N)", "preload.csv (N)", "open pairs", "largest difference (N)"),
        tuple(
            (
                side,
                number(s.sum_N, 6),
                number(s.condensed_N, 6),
                f"{s.open}",
                f"{s.largest_difference_N:.1e}",
            )
            for side, s in full.sides.items()
        ),
    )
