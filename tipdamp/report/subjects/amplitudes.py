"""What the figures of the forced response share: panels of amplitude, lists of levels."""

import re
from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np

from tipdamp.hbm.drawing.branches import Place, branch_lines
from tipdamp.hbm.drawing.figure import Curve, Item, Panel, level_colors
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import hertz, listing, micro
from tipdamp.results.response_results import PeakCycle

T = TypeVar("T")


def amplitude_panel(results: Results, title: str, label: str, items: Sequence[Item]) -> Panel:
    """Amplitude from zero over the band."""
    top = max(
        (np.nanmax(i.y) for i in items if isinstance(i, Curve) and np.isfinite(i.y).any()),
        default=1.0,
    )
    return Panel(
        title,
        "frequency (Hz)",
        label,
        items,
        x_range=tuple(results.study.respond.band),
        y_range=(0.0, 1.06 * top),
    )


def in_colors(levels: Sequence[T]) -> Iterator[tuple[T, str]]:
    """Each with the colour of its level, from dark to light."""
    return zip(levels, level_colors(len(levels)), strict=True)


def branch(case: ReportedCurve, patch: str, factor: float, color: str) -> Iterator[Item]:
    """The largest amplitude over a patch, times a factor, with its name in the legend."""
    top, named = (factor * a.max(axis=1) for a in (case.patch(patch), case.named(patch)))
    return branch_lines(case.curve, top, named, level_title(case), color)


def unstable_parts(cases: Sequence[ReportedCurve]) -> str:
    """Of how many curves a part is dashed."""
    n = sum(bool(case.facts.unstable_points) for case in cases)
    return (
        f"Dashed on {n} of {len(cases)} curves: unstable motions, whose disturbances grow. "
        if n
        else ""
    )


def places(case: ReportedCurve, factor: float) -> list[Place]:
    """The named points of a curve, at their amplitude times a factor."""
    return [Place(one.kind, one.hz, factor * one.largest_m) for one in case.facts.named]


def levels_of(cases: Sequence[ReportedCurve]) -> str:
    """'Fe = 1, 6 and 20 N'."""
    return f"Fe = {listing(f'{c.Fe:g}' for c in cases)} N"


def orders_of(cases: Sequence[ReportedCurve | PeakCycle]) -> str:
    """'H = 5', or 'H = 3 to 11' where each has as many as it needs."""
    few, *_, most = sorted([case.H for case in cases] * 2)
    return f"H = {few}" if few == most else f"H = {few} to {most}"


def level_title(case: ReportedCurve) -> str:
    """Of a curve among those of its family: 'Fe = 20 N', with H where each has its own."""
    return f"Fe = {case.Fe:g} N" + f", H = {case.H}" * bool(case.facts.tried)


def peakless(cases: Sequence[ReportedCurve]) -> str:
    """Sentences on the curves that have no peak, and on those without a solved point; empty where
    all have one."""
    parts = [
        f"{c.Fe:g} N, H = {c.H} (at least {micro(c.at_least_per_newton)} µm/N at "
        f"{hertz(c.facts.at_least_hz)} Hz)"
        for c in cases
        if not c.has_peak and not c.facts.solved_nothing
    ]
    said = [
        f"No peak, since the curve stops or has a gap at its highest point: {listing(parts)}."
    ] * bool(parts)
    said += [
        f"No point of the curve {c.Fe:g} N, H = {c.H} is solved: {reason(c)}."
        for c in cases
        if c.facts.solved_nothing
    ]
    return " ".join(said)


def reason(case: ReportedCurve) -> str:
    """Why a curve ended, without the advice that follows."""
    return re.split("[:;]", case.facts.ended)[0]


def panel_title(case: ReportedCurve) -> str:
    """Of a panel for one level."""
    return level_title(case) + ": no point solved" * case.facts.solved_nothing


def of_one_mode(cases: Sequence[ReportedCurve]) -> list[list[ReportedCurve]]:
    """The curves (with a peak, by level) in runs whose largest peaks are of one mode."""
    runs: list[list[ReportedCurve]] = []
    for case in cases:
        if not runs or case.facts.of_another_mode:
            runs.append([])
        runs[-1].append(case)
    return runs
