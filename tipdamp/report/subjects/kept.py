"""Preload of what is kept, on which the forced response rests: a figure, and a table of the scaled
one beside the one that static contact gives it."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.figure import (
    BLUE,
    GREY,
    VERMILION,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.hbm.drawing.preload_items import cut_marks, lowest_shown
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.axial import (
    AXIAL,
    in_lines,
    named_side,
    nodal,
    of_side,
    side_title,
    station_sums,
)
from tipdamp.report.text import force_along, listing, moment, number
from tipdamp.results.static_results import KeptCase, SideLoad

HOW = {
    "scaled": (
        "the preload of the whole patch on what is kept, scaled so that it balances the whole load"
    ),
    "resolved": "from static contact on what is kept alone",
    "table": "as the table of the study states it",
}


def figure(results: Results) -> Iterator[Figure]:
    """One figure, a panel for each side."""
    table, whole = results.kept, results.whole
    if results.tune is None or table is None or whole is None:
        return
    off = "detached station" if results.tune.area is None else "detached"
    before = {side: list(_before(results, of_side(whole, side))) for side in table.sides}
    heights = [item.y for items in before.values() for item in items]
    values = np.r_[table.preload[table.carrying], whole.preload, np.concatenate(heights)]
    low = lowest_shown(values)
    span = (1.1 * low - 0.04 * float(values.max()), 1.12 * float(values.max()))
    panels = [
        Panel(
            side_title(results, side),
            AXIAL,
            nodal(table),
            [
                Line("y", 0.0, dash="solid"),
                *before[side],
                *_items(results, of_side(table, side), off, low),
            ],
            y_range=span,
        )
        for side in table.sides
    ]
    sums = listing(
        f"{number(s.sum_N)} N on {named_side(whole, name)} ({number(s.min_N, 3)} to "
        f"{number(s.max_N, 3)} N, {s.detached} open)"
        for name, s in results.tune.preload_kept.items()
    )
    caption = (
        f"Normal preload of what is kept, {results.tune.kept_in_words.replace('mm2', 'mm²')}: "
        f"{HOW[results.study.tune.preload]}. The sum is {sums}. The forced response starts from "
        "this preload."
    )
    yield Figure(
        "preload_kept",
        f"Preload of the {results.tune.kept_name}",
        caption,
        panels,
        row_height=310,
    )


def _before(results: Results, pairs: ContactTable) -> Iterator[Curve | Marks]:
    """The whole patch, station by station, or point by point where these lie on no lines."""
    if in_lines(results, pairs):
        yield Curve(
            *station_sums(results, pairs), "whole patch, sum over the rows", GREY, "dash", 1.2
        )
        return
    closed = pairs.preload > 0
    at, force = results.along(pairs)[closed], pairs.preload[closed]
    yield Marks(at, force, "whole patch", GREY, filled=False, size=10)


def _items(results: Results, mine: ContactTable, off: str, low: float) -> Iterator[Item]:
    carrying = mine.select(mine.carrying)
    detached = results.along(mine)[~mine.carrying & ~np.isin(mine.station, carrying.station)]
    if len(detached):
        yield Marks(detached, np.zeros(len(detached)), off, GREY, "x", size=6)
    at, force = results.along(carrying), carrying.preload
    gap = np.full(len(at), np.nan)
    shown = np.where(force >= low, force, 0.0)
    stems = np.column_stack([0 * force, shown, gap]).ravel()
    yield Curve(np.column_stack([at, at, gap]).ravel(), stems, "", BLUE, width=1.2)
    if (force > 0).any():
        yield Marks(at[force > 0], force[force > 0], "kept pair", BLUE)
    if (opened := (force <= 0) & (force >= low)).any():
        yield Marks(at[opened], force[opened], "kept pair, open at rest", VERMILION, filled=False)
    yield from cut_marks(at, force, low)


def moments(results: Results) -> Iterator[Table]:
    """One row for each side, where scaling leaves more than a small moment."""
    tune = results.tune
    if tune is None or tune.redistribution.resolved is None:
        return
    done, again = tune.redistribution, tune.redistribution.resolved
    share = number(100 * (done.moment_share or 0.0), 2)
    yield Table(
        f"Preload of the {tune.kept_name}, scaled to the whole load and solved again. Scaling "
        f"leaves a moment "
        f"of {moment(done, results.axis)}, {share} % of the load times the length of "
        f'the contact; preload = "resolved" has none: {_said(again)}.',
        [
            {"side": side, **_load("scaled", s), **_load("solved again", again.sides.get(side))}
            for side, s in tune.preload_kept.items()
        ],
    )


def _said(again: KeptCase) -> str:
    if again.refused:
        return f"refused: {again.refused}"
    taken = listing(force_along(motion, load) for motion, load in again.reactions.items())
    return f"with a constraint against {taken}" if taken else "without a constraint"


def _load(how: str, side: SideLoad | None) -> dict[str, str]:
    return {
        f"{how} (N)": number(side.sum_N) if side else "",
        f"{how}, largest (N)": number(side.max_N) if side else "",
        f"{how}, open pairs": f"{side.detached}" if side else "",
    }
