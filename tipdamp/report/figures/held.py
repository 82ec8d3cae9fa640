"""Figure: the force on what holds a rigid motion of the damper."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import DASHES, Curve, Figure, Item, Marks, Panel, level_colors
from tipdamp.report.figures.amplitudes import levels_of, orders_of
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import hertz, listing, number


def figures(results: Results) -> Iterator[Figure]:
    """Mean force over the band at every level, one panel for each motion, at the largest H."""
    cases = results.solved
    if not cases or not cases[0].facts.held:
        return
    panels = tuple(
        _panel(results, cases, k, name, facts.unit)
        for k, (name, facts) in enumerate(cases[0].facts.held.items())
    )
    at = [
        f"{number(one.mean, 3)} {one.unit} ({name}, {case.Fe:g} N, {hertz(one.hz)} Hz)"
        for case in cases
        for name, one in case.facts.held.items()
    ]
    yield Figure(
        "held",
        "Force on what holds the damper",
        f"Mean force of the damper on what holds it at {levels_of(cases)} with {orders_of(cases)}, "
        "positive along the motion, beside the one at rest: what a stop there would have to "
        f"take. Circles mark the highest amplitude of blade 1: {listing(at)}.",
        panels,
        columns=min(2, len(panels)),
    )


def _panel(results: Results, cases: list[ReportedCurve], k: int, name: str, unit: str) -> Panel:
    items: list[Item] = []
    for i, (case, color) in enumerate(zip(cases, level_colors(len(cases)), strict=True)):
        facts = case.facts.held[name]
        items.append(
            Curve(
                case.curve.frequency,
                case.curve.reaction[:, k, 0].real,
                f"Fe = {case.Fe:g} N",
                color,
                DASHES[i % len(DASHES)],
            )
        )
        items.append(Marks(np.array([facts.hz]), np.array([facts.mean]), "", color, filled=False))
    low, high = results.study.respond.band
    return Panel(name, "frequency (Hz)", f"mean force ({unit})", tuple(items), x_range=(low, high))
