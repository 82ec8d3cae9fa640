"""Table: contact stiffness of each side by the ways that lead to it, beside the reference of the
study."""

from collections.abc import Iterator

from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.text import NOTHING, number
from tipdamp.results.static_results import SideStiffness


def tables(results: Results) -> Iterator[Table]:
    """One table, where there is more to say than what the study gives."""
    made = results.preload.stiffness if results.preload is not None else {}
    if not any(len(one.ways) > 1 for one in made.values()):
        return
    compared = any(way.way == "reference" for one in made.values() for way in one.ways)
    rows = tuple(
        row if compared else row[:4] + row[5:]
        for side, one in made.items()
        for row in _rows(side, one)
    )
    place = (
        "contact point" if results.whole is not None and results.whole.on_surface.all() else "node"
    )
    yield Table(
        f"Contact stiffness per {place} (mean of the side): what the study computes with, what it "
        f"was made from{', and the reference of the study' * compared}. Smooth half-spaces are an "
        "upper bound; real contacts are softer.",
        (
            "side",
            "way",
            "kn (N/\N{MICRO SIGN}m)",
            "kt (N/\N{MICRO SIGN}m)",
            *["kn over reference"] * compared,
            "",
        ),
        rows,
        left=(0, 1, 4 + compared),
    )


def _rows(side: str, one: SideStiffness) -> Iterator[tuple[str, ...]]:
    reference = next((w.kn_N_per_m for w in one.ways if w.way == "reference"), None)
    for way in one.ways:
        ratio = NOTHING if reference is None else number(way.kn_N_per_m / reference, 3)
        yield (
            f"'{side}'",
            way.way,
            number(way.kn_N_per_m, 3, 1e-6),
            number(way.kt_N_per_m, 3, 1e-6),
            ratio,
            "in use" if way.in_use else "",
        )
