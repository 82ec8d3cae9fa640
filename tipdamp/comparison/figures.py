"""Figures of a comparison: optimisation curves, where their peaks lie, preload maps, responses on
both blades."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tipdamp.comparison.events import marks, runs
from tipdamp.comparison.peaks import ComparedPeak, Phase
from tipdamp.comparison.record import ComparedStudies
from tipdamp.hbm.drawing.branches import failures
from tipdamp.hbm.drawing.figure import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    VERMILION,
    Curve,
    Figure,
    Item,
    Marks,
    Panel,
)
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects import preload
from tipdamp.report.subjects.amplitudes import branch, in_colors, orders_of
from tipdamp.report.text import MICRO, listing

COLORS = (VERMILION, BLUE, GREEN, ORANGE, "#CC79A7", "#56B4E9", INK, GREY)
SYMBOLS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "cross")
RATIO = "pull over excitation, Fc/Fe"
AT_LEAST = {False: "at least: curve incomplete", True: "at least: the damper rolls or slides"}
BEST = "least of the curve"
DOUBTED = "hollow: unstable, or error above the tolerance or not known"
ROOM = 1.2  # beside the first and the last mark of a logarithmic axis
BESIDE = 1.025  # of Fc/Fe, from one study to the next: bars of their scatter do not hide each other


def in_words(phase: Phase) -> str:
    """'out of phase'."""
    return phase.replace("_", " ")


def optimisation(comparison: ComparedStudies) -> Iterator[Figure]:
    """Largest FRF over Fc/Fe on logarithmic axes: a column for each phase, a row for each blade."""
    panels = tuple(
        Panel(
            f"{in_words(phase)}, blade {blade}",
            RATIO,
            "largest FRF (µm/N)",
            tuple(_heights(comparison, phase, blade)),
            log_x=True,
            log_y=True,
            x_range=_ratios(comparison),
            y_range=_span(comparison, phase, blade),
        )
        for blade in comparison.blades
        for phase in comparison.phases
    )
    yield Figure(
        "optimisation",
        "Optimisation curves",
        "Largest amplitude per newton, half of peak-to-peak over the patch of each blade, of the "
        "motions in which both blades move in phase and of those out of phase. Lines join levels "
        "whose peaks are of one mode; stars mark the least of both blades where friction "
        "takes anything. Hollow marks: the peak is that of an unstable motion, or its estimated "
        "error is above the tolerance of the study or not known. Hollow triangles: the curve does "
        "not cover the range of the phase, and its peak is at least that high. Rings: between them "
        "the peak drifts, by more than 2 % in frequency. Crosses: the phase has no maximum of its "
        "own at this level, and the place is that between its neighbours. "
        + "Bars: from the least to the largest of the scatter. "
        * any(p.scatter for p in comparison.peaks)
        + "Several pulls of a study draw one curve where the response per newton depends on Fc/Fe "
        "alone: its preload is in proportion to the pull. "
        "Corresponds to figure 3 of Zucca, Berruti and Cosi (2016).",
        panels,
        columns=len(comparison.phases),
        row_height=400,
    )


def places(comparison: ComparedStudies) -> Iterator[Figure]:
    """Frequency of the same peaks on the first blade."""
    panels = tuple(
        Panel(
            in_words(phase),
            RATIO,
            "frequency of the peak (Hz)",
            tuple(_frequencies(comparison, phase)),
            log_x=True,
            x_range=_ratios(comparison),
        )
        for phase in comparison.phases
    )
    yield Figure(
        "frequencies",
        "Frequency of the peaks",
        "Of blade 1. Towards small Fc/Fe the contacts slip and the peak leaves the stuck "
        "frequency.",
        panels,
        columns=len(panels),
    )


def _heights(comparison: ComparedStudies, phase: Phase, blade: int) -> Iterator[Item]:
    """The curves, what happens along them, then bounds and the least of each."""
    names = comparison.names
    mine = {name: comparison.of(name, phase, blade) for name in names}
    style = {name: style_of(comparison, name) for name in names}
    for k, name in enumerate(names):
        aside = BESIDE ** (k - (len(names) - 1) / 2)
        yield from _levels_of(comparison, name, mine[name], style[name], aside)
    for name in names:
        yield from marks(mine[name], style[name][0])
    optima = comparison.optima(phase)
    for name in names:
        color, _ = style[name]
        yield from _bounds(mine[name], color)
        if name in optima and not optima[name].idle:
            best = [peak for peak in mine[name] if peak.ratio == optima[name].ratio]
            sure = not any(peak.doubts for peak in best)
            points = _points(best, "m_per_N", MICRO)
            yield Marks(*points, BEST, color, "star", filled=sure, size=16)


def _levels_of(
    comparison: ComparedStudies,
    name: str,
    peaks: Sequence[ComparedPeak],
    style: tuple[str, str],
    aside: float,
) -> Iterator[Item]:
    """The curve of a study: lines, the scatter beside them by a factor, and marks, hollow where
    they are in doubt."""
    color, symbol = style
    for run in runs(peaks):
        yield Curve(*_points(run, "m_per_N", MICRO), "", color)
    solved = [peak for peak in peaks if peak.m_per_N is not None]
    spreads = [(aside * p.ratio, *comparison.spread(p)) for p in solved]
    yield from _bars(spreads, f"scatter of {listing(comparison.scattered(name))}", color)
    for doubted, said in ((False, name), (True, DOUBTED)):
        some = [peak for peak in solved if bool(peak.doubts) == doubted]
        if some:
            points = _points(some, "m_per_N", MICRO)
            yield Marks(*points, said, color, symbol, filled=not doubted)


def _bounds(peaks: Sequence[ComparedPeak], color: str) -> Iterator[Marks]:
    """What peaks are at least."""
    for drifts, said in AT_LEAST.items():
        bounds = [peak for peak in peaks if peak.at_least and bool(peak.motion) == drifts]
        symbol = "triangle-down" if drifts else "triangle-up"
        if bounds:
            points = _points(bounds, "at_least", MICRO)
            yield Marks(*points, said, color, symbol, filled=False, size=10)


def _bars(spreads: Sequence[tuple[float, float, float]], name: str, color: str) -> Iterator[Curve]:
    """A bar at each (Fc/Fe, low m/N, high m/N) that has a height."""
    wide = [one for one in spreads if one[2] > one[1]]
    x = np.array([(ratio, ratio, ratio) for ratio, *_ in wide]).ravel()
    y = np.array([(MICRO * low, MICRO * high, np.nan) for _, low, high in wide]).ravel()
    if wide:
        yield Curve(x, y, name, color, width=1.2)


def _frequencies(comparison: ComparedStudies, phase: Phase) -> Iterator[Item]:
    for name in comparison.names:
        mine, (color, symbol) = comparison.of(name, phase, 1), style_of(comparison, name)
        for run in runs(mine):
            yield Curve(*_points(run, "hz"), "", color)
        solved = [peak for peak in mine if peak.hz is not None]
        yield Marks(*_points(solved, "hz"), name, color, symbol)


def style_of(comparison: ComparedStudies, name: str) -> tuple[str, str]:
    """(color, symbol): curves of one study with several pulls have its color."""
    studies = {one: found.study.name for one, found in comparison.studies.items()}
    every = list(dict.fromkeys(studies.values()))
    k = every.index(studies[name])
    mine = [one for one in comparison.names if studies[one] == studies[name]]
    symbol = k if len(mine) == 1 else mine.index(name)
    return COLORS[k % len(COLORS)], SYMBOLS[symbol % len(SYMBOLS)]


def _ratios(comparison: ComparedStudies) -> tuple[float, float]:
    """Of Fc/Fe, with room."""
    every = [peak.ratio for peak in comparison.peaks]
    return min(every) / ROOM, max(every) * ROOM


def _span(comparison: ComparedStudies, phase: Phase, blade: int) -> tuple[float, float] | None:
    """With room about peaks, their scatter and bounds."""
    every = [p for name in comparison.names for p in comparison.of(name, phase, blade)]
    values = [MICRO * y for p in every if p.m_per_N is not None for y in comparison.spread(p)]
    values += [MICRO * p.at_least for p in every if p.at_least]
    return (min(values) / ROOM, max(values) * ROOM) if values else None


def _points(
    peaks: Sequence[ComparedPeak], fact: str, factor: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Fc/Fe, and a fact of the peaks in another unit."""
    values = np.array([vars(p)[fact] for p in peaks], dtype=float)
    return np.array([p.ratio for p in peaks]), factor * values


def preloads(comparison: ComparedStudies) -> Iterator[Figure]:
    """The preload maps, a row for each study and a column for each side."""
    panels = tuple(
        replace(panel, title=f"{name}, {panel.title}")
        for name, one in comparison.studies.items()
        if one.whole is not None
        for panel in preload.panels(one, one.whole)
    )
    yield Figure(
        "preloads",
        "Preload maps",
        "Of the whole patch at rest, one row for each study, at the first of its pulls. Filled "
        "marks are closed pairs, hollow ones open; crosses at the lower edge are open ones whose "
        "gap is so wide that they lie below the scale.",
        panels,
        row_height=260,
    )


def responses(comparison: ComparedStudies) -> Iterator[Figure]:
    """Of each study its curves on both blades, per newton, at all levels; one for each pull and
    band."""
    groups: dict[tuple[str, str, str], list[Results]] = {}
    for each in comparison.nominal:
        groups.setdefault((each.name, _pull(each.results), _band(each.results)), []).append(
            each.results
        )
    taken = Counter[str]()
    for (name, pull, band), mine in groups.items():
        alike = [one for one in groups if one[0] == name]
        several = [len({one[k] for one in alike}) > 1 for k in (1, 2)]
        whose = f"{name}, {pull}" if several[0] else name
        file = re.sub(r"[^\w.+-]+", "_", "_".join((whose, *[band] * several[1])))
        taken[file] += 1
        cases = _levels(mine)
        yield Figure(
            f"responses_{file}" + f"_{taken[file]}" * (taken[file] > 1),
            f"{whose}: forced response, {band}",
            "Largest amplitude over the patch of each blade, per newton of force, "
            f"{orders_of(cases)}; dashed parts are unstable.",
            tuple(
                _response(mine[0], cases, patch, k)
                for k, patch in enumerate(mine[0].study.respond.patches, 1)
            ),
            row_height=360,
        )


def _levels(every: Sequence[Results]) -> list[ReportedCurve]:
    """The curves of all, one for each level, ascending: that of most harmonics."""
    cases = [case for one in every for case in one.finest]
    most = {case.Fe: case for case in sorted(cases, key=lambda case: case.H)}
    return [most[Fe] for Fe in sorted(most)]


def _pull(results: Results) -> str:
    return f"Fc = {results.study.driver.pull:g} N"


def _band(results: Results) -> str:
    return "{:g} to {:g} Hz".format(*results.study.respond.band)


def _response(results: Results, cases: Sequence[ReportedCurve], patch: str, blade: int) -> Panel:
    items: list[Item] = []
    for case, color in in_colors(cases):
        factor = MICRO / case.Fe
        items += branch(case, patch, factor, color)
        top = factor * case.patch(patch).max(axis=1)
        items += failures(case.curve, top, case.facts.complete)
    return Panel(
        f"blade {blade}",
        "frequency (Hz)",
        "amplitude per force (µm/N)",
        tuple(items),
        x_range=tuple(results.study.respond.band),
    )
