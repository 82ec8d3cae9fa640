"""Table: stuck frequencies of the reduced model beside those of the full one."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, hertz, percent
from tipdamp.results.static_results import FullModelCheck

HEAD = ("stuck", "mode", "reduced (Hz)", "full (Hz)", "error", "bound")


def tables(results: Results) -> Iterator[Table]:
    """One row for each mode of each set of stuck pairs, where the full model was solved."""
    if results.tune is None or results.reduce is None or not results.tune.full_model_check:
        return
    tune, size = results.tune, results.reduce.reduction
    words = {"full_area": "whole area", "full_line": "whole line", "tuned": tune.kept_name}
    checks = {
        name: check
        for name, check in tune.full_model_check.items()
        if name != "full_line" or not tune.line_is_whole
    }
    worst = max(check.largest_error for check in checks.values())
    sets: dict[tuple, list[str]] = {}
    for name, check in checks.items():  # sets of the same pairs have the same frequencies
        sets.setdefault((check.reduced_hz, check.full_hz), []).append(name)
    bound = (
        "Its contact shapes are of tractions, so that no bound follows from the reduction alone."
        if size.tractions
        else "The bound of the error follows from the reduction alone."
    )
    columns = len(HEAD) - bool(size.tractions)
    yield Table(
        f"Stuck frequencies of the reduced model ({size.in_words}, fixed-interface ones) beside "
        f"the full finite-element model ({size.dofs} dofs), up to 5 kHz, or "
        f"half as much again as the tracked mode; largest error {100 * worst:.3f} %. {bound}",
        HEAD[:columns],
        tuple(
            row[:columns]
            for same in sets.values()
            for row in _rows(", ".join(words[name] for name in same), checks[same[0]])
        ),
    )


def _rows(name: str, check: FullModelCheck) -> Iterator[tuple[str, ...]]:
    bounds = check.error_bound or (None,) * len(check.full_hz)
    for i, (reduced, full, bound) in enumerate(
        zip(check.reduced_hz, check.full_hz, bounds, strict=True)
    ):
        error = None if reduced is None or full is None else reduced / full - 1
        yield (
            "" if i else name,
            f"{i + 1}",
            hertz(reduced),
            hertz(full),
            percent(error, 3),
            NOTHING if bound is None else percent(bound, 3),
        )
