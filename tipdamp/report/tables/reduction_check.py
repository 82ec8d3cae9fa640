"""Table: stuck frequencies of the reduced model beside those of the full one."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, hertz, percent
from tipdamp.stages.results import FullModelCheck

SETS = {"full_area": "whole area", "full_line": "whole line", "tuned": "kept stations"}


def tables(results: Results) -> Iterator[Table]:
    """One row for each mode of each set of stuck pairs, where the full model was solved."""
    if results.tune is None or results.reduce is None or not results.tune.full_model_check:
        return
    checks, size = results.tune.full_model_check, results.reduce.reduction
    worst = max(check.largest_error for check in checks.values())
    yield Table(f"Stuck frequencies of the reduced model ({size.masters} contact and response dofs, "
                f"{sum(size.modes.values())} fixed-interface modes) beside the full finite-element model "
                f"({size.dofs} dofs), up to 5 kHz; largest error {100 * worst:.3f} %. The bound of the error follows "
                "from the reduction alone.", ("stuck", "mode", "reduced (Hz)", "full (Hz)", "error", "bound"),
                tuple(row for name, check in checks.items() for row in _rows(SETS[name], check)))


def _rows(name: str, check: FullModelCheck) -> Iterator[tuple[str, ...]]:
    bounds = check.error_bound or (None,) * len(check.full_hz)
    for i, (reduced, full, bound) in enumerate(zip(check.reduced_hz, check.full_hz, bounds, strict=True)):
        error = None if reduced is None or full is None else reduced / full - 1
        yield ("" if i else name, f"{i + 1}", hertz(reduced), hertz(full), percent(error, 3),
               NOTHING if bound is None else percent(bound, 3))
