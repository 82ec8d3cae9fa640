"""Table: stuck frequencies of the reduced model beside those of the full one."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, hertz, percent

SETS = {"full_area": "whole area", "full_line": "whole line", "tuned": "kept stations"}


def tables(results: Results) -> Iterator[Table]:
    """One table, where the full model was solved."""
    if results.tune is None or results.reduce is None or not results.tune.full_model_check:
        return
    checks, size = results.tune.full_model_check, results.reduce.reduction
    columns, cells = ["mode"], []
    for name, check in checks.items():
        columns += [f"{SETS.get(name, name)}, reduced (Hz)", "full (Hz)", "error", "bound"]
        bounds = check.error_bound or (None,) * len(check.full_hz)
        cells.append([(hertz(a), hertz(b), _error(a, b), NOTHING if c is None else percent(c, 3))
                      for a, b, c in zip(check.reduced_hz, check.full_hz, bounds, strict=True)])
    rows = [(f"{i + 1}", *(text for column in cells for text in (column[i] if i < len(column) else ("",) * 4)))
            for i in range(max(map(len, cells)))]
    worst = max(check.largest_error for check in checks.values())
    yield Table(f"Stuck frequencies of the reduced model ({size.masters} contact and response dofs, "
                f"{sum(size.modes.values())} fixed-interface modes) beside the full finite-element model "
                f"({size.dofs} dofs), up to 5 kHz; largest error {100 * worst:.3f} %. The bound of the error follows "
                "from the reduction alone.", tuple(columns), tuple(rows), left=())


def _error(reduced, full) -> str:
    return percent(None if reduced is None or full is None else reduced / full - 1, 3)
