"""Figures: tuning by area, the stuck frequency and the MAC over the kept share; the kept part of
every side."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import (
    BLUE,
    GREY,
    ORANGE,
    VERMILION,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.report.figures.axial import AXIAL, of_side, side_title
from tipdamp.report.results import Results
from tipdamp.report.text import MM, hertz, listing

HOW = {
    "from_edge": (
        "The closed part of every side shrinks from its edge inwards, where the pressure is "
        "least first."
    ),
    "least_loaded": "The closed part of every side shrinks by the least pressure.",
    "from_middle": (
        "The closed part of every side shrinks from the middle of the axis to both ends."
    ),
}
SHARE = "kept part of the closed area (%)"


def figures(results: Results) -> Iterator[Figure]:
    """Where it was tuned by area or by cell."""
    if results.tune is not None and results.tune.area is not None:
        yield _history(results)
        if results.kept is not None:
            yield _map(results)


def _history(results) -> Figure:
    tune, area = results.tune, results.tune.area
    share, hz, mac = 100 * np.array([(s.share, s.hz / 100, s.mac / 100) for s in area.history]).T
    seen = [*hz, tune.stuck_hz.tuned, *([tune.target_hz] if tune.target_hz else [])]
    low, high = min(seen) - 0.12 * np.ptp(seen), max(seen) + 0.06 * np.ptp(seen)
    mode = results.study.tune.follow.replace("_", "-")
    caption = (
        f"{HOW[results.study.tune.order]} Left: frequency of the {mode} mode of the stuck "
        "assembly; where it is tuned, a percent of the area is worth "
        f"{abs(area.hz_per_percent):.2g} Hz. Right: its energy-weighted MAC with the mode without "
        "damper, by which it is tracked; a dip marks a crossing with another mode."
    )

    def items(values) -> Iterator[Item]:
        yield Curve(share, values, "", BLUE)
        yield Marks(share, values, "tracked mode", BLUE, size=4)

    return Figure(
        "tuning",
        "Tuning by area",
        caption,
        (
            Panel(
                "",
                SHARE,
                "stuck frequency (Hz)",
                (*items(hz), *_met(tune)),
                x_range=(0, 103),
                y_range=(low, high),
            ),
            Panel(
                "",
                SHARE,
                "energy-weighted MAC",
                tuple(items(mac)),
                x_range=(0, 103),
                y_range=(0, 1.03),
            ),
        ),
    )


def _met(tune) -> Iterator[Item]:
    if tune.target_hz:
        for edge in (-1, 1) if tune.scatter_hz else ():
            yield Line("y", tune.target_hz + edge * tune.scatter_hz, color=VERMILION, dash="dot")
        yield Curve(
            np.array([0.0, 100.0]),
            np.full(2, tune.target_hz),
            f"target {tune.target_hz:g} Hz",
            VERMILION,
            "dash",
            1.2,
        )
    yield Marks(
        np.array([100 * tune.area.share]),
        np.array([tune.stuck_hz.tuned]),
        f"kept: {100 * tune.area.share:.3g} %, {hertz(tune.stuck_hz.tuned)} Hz",
        VERMILION,
        "diamond",
        size=11,
    )


def _map(results) -> Figure:
    kept, whole = results.kept, results.whole
    sides = results.tune.area.sides
    amounts = listing(
        f"{s.kept:.4g} of {s.closed:.4g} {s.unit.replace('2', '²')} on side '{name}'"
        for name, s in sides.items()
    )
    caption = (
        f"Every contact point on its side, seen along the normal: what is kept, {amounts}. In "
        "part: at the edge of the kept area, with that part of kn and kt."
    )
    panels = []
    for side in kept.sides:
        mine, before = of_side(kept, side), of_side(whole, side)
        t2 = mine.frame[:, 1].mean(axis=0)
        # up is to where the pull is
        t2 *= 1 if t2 @ np.array(results.study.driver.pull_direction) >= 0 else -1
        across = MM * (mine.position - mine.position.mean(axis=0)) @ (t2 / np.linalg.norm(t2))
        part, closed = mine.weight, before.preload > 0
        kinds = (
            ((part >= 1) & closed, "kept", BLUE, "circle", True),
            ((part > 0) & (part < 1) & closed, "kept in part", ORANGE, "diamond", True),
            ((part == 0) & closed, "detached", GREY, "circle", False),
            (~closed, "open at rest", VERMILION, "x", True),
        )
        items = tuple(
            Marks(results.along(mine)[on], across[on], name, color, symbol, filled=filled, size=8)
            for on, name, color, symbol, filled in kinds
            if on.any()
        )
        room = 0.15 * (float(np.ptp(across)) or 1.0)
        panels.append(
            Panel(
                side_title(results, side),
                AXIAL,
                "across the side (mm)",
                items,
                y_range=(across.min() - room, across.max() + room),
            )
        )
    return Figure(
        "kept_area", "What is kept of the contact area", caption, tuple(panels), row_height=300
    )
