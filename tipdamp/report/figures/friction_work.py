"""Figures: where friction takes its energy at the peak, and the state of every pair over
frequency."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import (
    DARK,
    GREY,
    ORANGE,
    Band,
    Curve,
    Figure,
    Item,
    Line,
    Panel,
    Tiles,
    level_colors,
)
from tipdamp.report.figures.amplitudes import orders_of
from tipdamp.report.figures.axial import AXIAL, of_side, side_title
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import MICRO

MOST_PAIRS = 60  # rows of the state map that can be told apart


def figures(results: Results) -> Iterator[Figure]:
    """Friction work along the axis, a panel for each side; states at the largest level; both at the
    largest H."""
    if results.cycles is None or results.kept is None or not results.periods:
        return
    if any(one.friction_share > 0 for one in results.cycles.curves):
        yield Figure(
            "friction_work",
            "Friction work of the pairs",
            "Energy that friction takes in each period at the peak, "
            f"{orders_of(results.periods)}: sum over the rows of each station, one line for each "
            "level.",
            tuple(_work(results, side) for side in results.kept.sides),
            row_height=310,
        )
        yield _map(results)
        if len(results.cycles.pairs) <= MOST_PAIRS:
            yield _states(results, results.solved[-1])


def _work(results, side) -> Panel:
    kept = results.kept.select(results.kept.carrying)
    mine = of_side(kept, side)
    names = np.array(results.cycles.pairs)[kept.side == side].tolist()
    curves = results.periods
    stations = np.unique(mine.station)
    x = np.array([results.along(mine)[mine.station == s].mean() for s in stations])
    apart = 1 + np.flatnonzero(np.abs(np.diff(stations[np.argsort(x)])) > 1)
    order, items = np.argsort(x), list[Item]([Line("y", 0.0, dash="solid")])
    for one, color in zip(curves, level_colors(len(curves)), strict=True):
        work = MICRO * np.array([one.friction_J[name] for name in names])
        sums = np.array([work[mine.station == s].sum() for s in stations])
        # detached stations between the ends part the line
        items.append(
            Curve(
                np.insert(x[order], apart, np.nan),
                np.insert(sums[order], apart, np.nan),
                f"Fe = {one.Fe_N:g} N",
                color,
            )
        )
    return Panel(side_title(results, side), AXIAL, "friction work (µJ per period)", tuple(items))


def _map(results) -> Figure:
    """A panel for each side, at the largest level."""
    one = results.periods[-1]
    kept = results.kept.select(results.kept.carrying)
    work = MICRO * np.array([one.friction_J[name] for name in results.cycles.pairs])
    panels = []
    for side in kept.sides:
        mine = of_side(results.whole if results.whole is not None else kept, side)
        known = kept.side == side
        stations, rows = np.unique(mine.station), np.unique(mine.row)
        x = np.array([results.along(mine)[mine.station == s].mean() for s in stations])
        values = np.full((len(rows), len(stations)), np.nan)
        values[
            np.searchsorted(rows, kept.row[known]), np.searchsorted(stations, kept.station[known])
        ] = work[known]
        order = np.argsort(x)
        panels.append(
            Panel(
                side_title(results, side),
                AXIAL,
                "row across the side",
                (
                    Tiles(
                        x[order],
                        rows.astype(float),
                        values[:, order],
                        "µJ per period",
                        float(work.max()) or 1.0,
                    ),
                ),
                whole_y=True,
            )
        )
    return Figure(
        "friction_map",
        "Friction work over the contact sides",
        f"Energy that friction takes in each pair in one period at the peak, Fe = {one.Fe_N:g} N, "
        f"H = {one.H}: stations along the axis, rows across the side (0 is the lower edge). Blank: "
        "no kept pair.",
        tuple(panels),
        row_height=240,
    )


def _states(results, case: ReportedCurve) -> Figure:
    curve, names = case.curve, results.cycles.pairs
    hz, items = curve.frequency, list[Item]()
    for row, _ in enumerate(names):
        floor = np.full(len(hz), float(row))
        slip, opened = (0.9 * share[:, row] for share in (curve.share_slip, curve.share_open))
        items += [
            Line("y", row, color=GREY, dash="solid"),
            Band(hz, floor, floor + opened, "open", DARK, 1.0),
            Band(hz, floor + opened, floor + opened + slip, "slip", ORANGE, 1.0),
        ]
    panel = Panel(
        f"Fe = {case.Fe:g} N, H = {case.H}",
        "frequency (Hz)",
        "kept pair",
        tuple(items),
        x_range=tuple(results.study.respond.band),
        y_range=(-0.3, len(names) + 0.3),
        y_names=tuple(names),
    )
    return Figure(
        "state_map",
        "States of the pairs over frequency",
        "Share of the cycle in which each kept pair slips or is open, as the height of its row "
        "at the largest level: an empty row sticks, a full one slips or is open all the time.",
        (panel,),
        columns=1,
        row_height=max(260, 26 * len(names)),
    )
