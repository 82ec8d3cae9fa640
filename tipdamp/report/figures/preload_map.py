"""Figures: preload map, the nodal preload of the whole patch along both sides, at rest and in each
load case."""

from collections.abc import Iterator

import numpy as np

from tipdamp.bodies.loads import rest_name
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.figure import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILION,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.report.figures.axial import (
    AXIAL,
    cut_marks,
    load_of,
    lowest_shown,
    of_side,
    side_title,
    station_sums,
)
from tipdamp.report.results import Results
from tipdamp.report.text import listing, number

ROWS = (BLUE, ORANGE, GREEN, VERMILION)
SYMBOLS = ("circle", "square", "diamond")


def figures(results: Results) -> Iterator[Figure]:
    """The map at rest."""
    if results.preload is None or results.whole is None:
        return
    sides = results.preload.sides
    sums = listing(
        f"{number(s.sum_N)} N on side '{name}' (equilibrium {number(s.equilibrium_N)} N, "
        f"{s.detached} open)"
        for name, s in sides.items()
    )
    worst = max(s.balance_error or 0.0 for s in sides.values())
    caption = (
        f"{_what(results.whole)} of the whole patch under {rest_name(results.study)}, along the "
        "axis of the damper. Filled marks are closed pairs, hollow ones open (negative: kn times "
        "the remaining gap; crosses at the lower end of the axis lie below it). The sum is "
        f"{sums}; contact forces and load balance to {number(worst, 1)} of the load. "
        f"{_ends(results)}" + results.beside_paper("Corresponds to figure 9")
    )
    yield Figure("preload", "Preload of the whole patch", caption, _panels(results, results.whole))


def load_case_figures(results: Results) -> Iterator[Figure]:
    """One map for each further load case."""
    for case, facts in (results.preload.cases if results.preload else {}).items():
        sums = listing(
            f"{number(s.sum_N)} N on side '{name}' ({s.detached} open)"
            for name, s in facts.sides.items()
        )
        caption = (
            f"{_what(results.loads[case])} of the whole patch in the load case '{case}'. Filled "
            f"marks are closed pairs, hollow ones open. The sum is {sums}."
        )
        yield Figure(
            f"preload_{case}",
            f"Preload in the load case '{case}'",
            caption,
            _panels(results, results.loads[case]),
            row_height=310,
        )


def _what(table: ContactTable) -> str:
    return (
        "Contact pressure at every contact point"
        if table.on_surface.all()
        else "Normal preload of every node"
    )


def _panels(results, table: ContactTable) -> tuple[Panel, ...]:
    """One panel for each side, on one scale."""
    load, name = load_of(table)
    top, low = float(load.max()), lowest_shown(load)
    span = (low - 0.05 * (top - low) if low < 0 else 0.0, top + 0.08 * (top - low))
    panels = []
    for side in table.sides:
        mine = of_side(table, side)
        items = (
            list(_points(results, mine, load[table.side == side], low))
            if table.on_surface.all()
            else [
                item
                for row in np.unique(mine.row)
                for item in _row(results, mine.select(mine.row == row), int(row), low)
            ]
        )
        panels.append(
            Panel(
                side_title(results, side),
                AXIAL,
                name,
                (Line("y", 0.0, dash="solid"), *items),
                y_range=span,
            )
        )
    return tuple(panels)


def _points(results, pairs: ContactTable, pressure: np.ndarray, low: float) -> Iterator[Item]:
    """Contact points of an unlike mesh lie in no rows: from the lower third of the side to the
    upper one."""
    height = pairs.position @ np.array(results.study.driver.pull_direction)
    third = np.minimum(3 * (height - height.min()) / max(float(np.ptp(height)), 1e-300), 2).astype(
        int
    )
    for k, name in enumerate(("lower third", "middle", "upper third")):
        for closed, more in ((True, ""), (False, ", open")):
            mine = (third == k) & ((pressure > 0) == closed) & (pressure >= low)
            if mine.any():
                yield Marks(
                    results.along(pairs)[mine],
                    pressure[mine],
                    name + more,
                    ROWS[k],
                    SYMBOLS[k],
                    filled=closed,
                )
    yield from cut_marks(results.along(pairs), pressure, low)


def _row(results, pairs: ContactTable, row: int, low: float) -> Iterator[Item]:
    order = np.argsort(results.along(pairs))
    x, y = results.along(pairs)[order], pairs.preload[order]
    color = ROWS[row % len(ROWS)]
    name = f"row {row}" + " (lower edge line)" * (row == 0)
    symbol = SYMBOLS[row % 3]
    closed, opened = y > 0, (y <= 0) & (y >= low)
    yield Curve(x, np.maximum(y, low), "", color, width=1.0)
    yield Marks(x[closed], y[closed], name, color, symbol)
    if opened.any():
        yield Marks(x[opened], y[opened], f"{name}, open", color, symbol, filled=False)
    yield from cut_marks(x, y, low)


def _ends(results) -> str:
    """Ratio of the station sums at the ends to the lowest in the middle third."""
    parts = []
    for side in results.whole.sides:
        _, total = station_sums(results, of_side(results.whole, side))
        third = max(len(total) // 3, 1)
        middle = total[third : len(total) - third].min(initial=np.inf)
        if np.isfinite(middle) and middle > 0:
            parts.append(
                f"{min(total[0], total[-1]) / middle:.1f} times the middle on side '{side}'"
            )
    return f"Per station, the ends carry at least {listing(parts)}." if parts else ""
