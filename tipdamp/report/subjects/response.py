"""Forced response: all levels together, level by level with the band over the response patch, and
the peak over the level."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.hbm.drawing.branches import (
    BIFURCATIONS,
    CONTACTS,
    Place,
    branch_lines,
    error_band,
    failures,
    named_amplitudes,
    named_marks,
    outermost,
    peak_mark,
    with_gaps,
)
from tipdamp.hbm.drawing.figure import (
    BLUE,
    DASHES,
    GREEN,
    GREY,
    INK,
    ORANGE,
    VERMILION,
    Band,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import (
    amplitude_panel,
    branch,
    in_colors,
    levels_of,
    of_one_mode,
    orders_of,
    panel_title,
    peakless,
    places,
    unstable_parts,
)
from tipdamp.report.text import MICRO, hertz, listing, micro, number, percent
from tipdamp.statics.model_inputs import in_patch

COLORS = (VERMILION, BLUE, GREEN, ORANGE)  # from the largest H down
SYMBOLS = ("circle", "square", "diamond")
LEVEL = "excitation Fe (N)"
NEAR, FAR = 0.02, 3.0  # of a value, and times the span of the marks: a line beyond squeezes them


def families(results: Results) -> Iterator[Figure]:
    """All levels together, a figure for each H, the largest first: per newton beside the linear
    stuck response, and absolute."""
    for cases in reversed(results.families):
        orders = orders_of(cases)
        per_force: list[Item] = []
        absolute: list[Item] = []
        for case, color in in_colors(cases):
            per_force += _family_curve(results, case, color, MICRO / case.Fe)
            absolute += _family_curve(results, case, color, MICRO)
        per_force += _stuck(results, MICRO, INK, 1.8)
        caption = (
            f"Response of blade 1 at {levels_of(cases)} with {orders}, half of peak-to-peak: left "
            "per newton of force, right absolute. Lines are the largest amplitude over the "
            "response patch, shaded down to the smallest; circles mark the peaks. "
            f"{_truncated(cases)}"
            f"{unstable_parts(cases)}"
            f"{_beside(cases)}"
            f"{' '.join(filter(None, (_trend(cases), peakless(cases))))}"
            + results.beside_paper("Corresponds to figure 7 (measured) and figures 10 to 14")
        )
        yield Figure(
            "family_auto" if cases[0].facts.tried else f"family_H{cases[0].H}",
            f"Forced response, {orders}",
            caption,
            [
                amplitude_panel(results, "per newton", "amplitude per force (µm/N)", per_force),
                amplitude_panel(results, "absolute", "amplitude (µm)", absolute),
            ],
            row_height=400,
        )


def _stuck(results: Results, factor: float, color: str, width: float = 1.6) -> Iterator[Curve]:
    """The linear response with all kept pairs stuck, where there is one."""
    if results.stuck:
        amplitude = factor * results.stuck.m_per_N.max(axis=1)
        yield Curve(results.stuck.hz, amplitude, "linear, stuck", color, "dot", width)


def _family_curve(
    results: Results, case: ReportedCurve, color: str, factor: float
) -> Iterator[Item]:
    amplitude = factor * case.patch(results.first_patch)
    top, low = amplitude.max(axis=1), amplitude.min(axis=1)
    facts = case.facts
    hz, below, above = with_gaps(case.curve, low, top)
    yield Band(hz, below, above, "", color, 0.13)
    error = case.error_of_top(results.first_patch)
    if error is not None:
        yield error_band(case.curve, top, factor * error, color)
    yield from branch(case, results.first_patch, factor, color)
    named = places(case, factor)
    for one in case.beside:
        columns = in_patch(one.output_names, results.first_patch)
        highest, heights = (
            factor * every[:, columns].max(axis=1)
            for every in (one.amplitude(), named_amplitudes(one))
        )
        yield from branch_lines(one, highest, heights, "", color, 0.9)
        points = zip(one.named_points, heights, strict=True)
        named += [Place(at.kind, at.frequency, height) for at, height in points]
    yield from named_marks(named, BIFURCATIONS, color)
    if facts.peak_m is not None and facts.peak_hz is not None:
        yield peak_mark(facts.peak_hz, factor * facts.peak_m, color)
    yield from failures(case.curve, top, case.facts.complete)


def _truncated(cases: Sequence[ReportedCurve]) -> str:
    """What the harmonics left out would change at the peaks, in words."""
    known = [c.facts.truncation for c in cases if c.facts.truncation is not None]
    if not known:
        return ""
    return (
        "Darker bands, where they are wider than the line: what more harmonics would change by "
        f"estimate, at the peaks {number(max(known), 2, 100)} % at most. "
    )


def _beside(cases: Sequence[ReportedCurve]) -> str:
    """Of how many curves further ones were found."""
    n = sum(len(c.beside) for c in cases)
    curves = "a further curve that was" if n == 1 else f"{n} further curves that were"
    return f"Thin: {curves} found beside them. " if n else ""


def _trend(cases: Sequence[ReportedCurve]) -> str:
    """Of each run of levels whose largest peaks are of one mode."""
    said = []
    for i, run in enumerate(of_one_mode([c for c in cases if c.has_peak])):
        first, last = run[0], run[-1]
        other = f"At {first.Fe:g} N the largest peak is that of another mode" * (i > 0)
        if len(run) > 1:
            said += [f"{other}."] * (i > 0) + [
                f"From {first.Fe:g} to {last.Fe:g} N the peak {_moves(first, last)} from "
                f"{micro(first.peak_per_newton)} to {micro(last.peak_per_newton)} µm/N."
            ]
        elif i > 0:
            said.append(
                f"{other}, at {hertz(first.facts.peak_hz)} Hz with "
                f"{micro(first.peak_per_newton)} µm/N."
            )
    return " ".join(said)


def _moves(first: ReportedCurve, last: ReportedCurve) -> str:
    """What the frequency of the peak does, to the digits that are shown."""
    low, high = (hertz(one.facts.peak_hz) for one in (first, last))
    return f"stays at {low} Hz and goes" if low == high else f"moves from {low} to {high} Hz and"


def levels(results: Results) -> Iterator[Figure]:
    """One panel for each level, from the largest, at the most harmonics; beside it the curves with
    fewer, or where there are none the error that is estimated."""
    if not results.cases:
        return
    cases, others = results.finest, results.families[:-1]
    panels = [
        amplitude_panel(
            results, panel_title(case), "amplitude (µm)", list(_level_items(results, case))
        )
        for case in reversed(cases)
    ]
    unsolved = [c for c in cases if c.facts.solved_nothing]
    fewer = listing(f"{family[0].H}" for family in others)
    beside = f", beside the largest at H = {fewer}" if others else ""
    caption = (
        "Each level from the largest force down: the largest and the smallest amplitude over the "
        f"nodes of the patch of blade 1 at {orders_of(cases)}{beside}, and the linear response "
        "with all kept pairs stuck. "
        f"{unstable_parts(cases)}{_marked(cases)}"
        f"{_orders_apart(others[0], cases) if others else _estimated(cases)}{peakless(unsolved)}"
        + results.beside_paper("Corresponds to figures 10 to 14, without their measured curves,")
    )
    yield Figure(
        "levels",
        "Each level with its band over the response patch",
        caption,
        panels,
        columns=3,
        row_height=290,
    )


def _level_items(results: Results, case: ReportedCurve) -> Iterator[Item]:
    amplitude = MICRO * case.patch(results.first_patch)
    hz, top, low = case.curve.frequency, amplitude.max(axis=1), amplitude.min(axis=1)
    yield Band(hz, low, top, f"H = {case.H}, patch of blade 1", VERMILION, 0.28)
    heights = MICRO * case.named(results.first_patch)
    title = f"H = {case.H}, largest and smallest"
    yield from branch_lines(case.curve, top, heights.max(axis=1), title, VERMILION)
    yield from branch_lines(case.curve, low, heights.min(axis=1), "", VERMILION, 1.0)
    others = results.families[:-1]
    error = case.error_of_top(results.first_patch)
    if error is not None and not others:
        yield error_band(case.curve, top, MICRO * error, BLUE)
    same_level = (c for family in others for c in family if c.Fe == case.Fe)
    for k, other in enumerate(same_level):
        largest = MICRO * other.patch(results.first_patch).max(axis=1)
        name, dash = f"H = {other.H}, largest", DASHES[1 + k % 2]
        yield Curve(other.curve.frequency, largest, name, BLUE, dash)
    yield from _stuck(results, MICRO * case.Fe, GREY)
    named = places(case, MICRO)
    yield from named_marks(named, BIFURCATIONS, VERMILION)
    yield from named_marks(outermost(named), CONTACTS, VERMILION)
    yield from failures(case.curve, top, case.facts.complete)


def _marked(cases: Sequence[ReportedCurve]) -> str:
    """What the marks of contacts are."""
    if not any(outermost(places(case, MICRO)) for case in cases):
        return ""
    return (
        "Triangles and stars: where along the curve the first contact begins to slip, lifts off "
        "for a part of the cycle or separates for the whole of it, and where the last one ends. "
    )


def _orders_apart(coarse: Sequence[ReportedCurve], fine: Sequence[ReportedCurve]) -> str:
    """Where the smallest H misses the peak of the largest most."""
    found = [
        (few.facts.peak_m / many.facts.peak_m - 1, few.H, many)
        for few, many in zip(coarse, fine, strict=True)
        if few.facts.peak_m and many.facts.peak_m
    ]
    if not found:
        return ""
    off, H, at = max(found, key=lambda one: abs(one[0]))
    return f"The peaks at H = {H} and H = {at.H} differ most at {at.Fe:g} N, by {percent(off, 1)}. "


def _estimated(cases: Sequence[ReportedCurve]) -> str:
    """The largest error of a peak."""
    known = [(c.facts.truncation, c.Fe) for c in cases if c.facts.truncation is not None]
    if not known:
        return ""
    worst, Fe = max(known, key=lambda one: one[0])
    return (
        "Blue, where it is wider than the line: the estimated error by the harmonics above H, at "
        f"the peaks {number(worst, 2, 100)} % at most (Fe = {Fe:g} N). "
    )


def trend(results: Results) -> Iterator[Figure]:
    """Height and frequency of the peak over the level, where at least two levels have a peak."""
    if len({case.Fe for case in results.cases if case.has_peak}) < 2:
        return
    height, place = _over_levels(results)
    beyond = ""
    if results.tune:
        stuck = results.tune.stuck_hz.tuned
        if _far(stuck, place):
            beyond = f"All pairs stuck the mode has {hertz(stuck)} Hz, far beyond the axis. "
        else:
            place.append(_limit(stuck, f"stuck {hertz(stuck)} Hz", place))
    if results.stuck:
        top = MICRO * float(results.stuck.m_per_N.max())
        height.append(_limit(top, f"linear, stuck {number(top, 3)} µm/N", height))
    caption = (
        "Largest peak of blade 1 over the excitation level: amplitude per newton, and frequency; "
        "lines join levels at which it is of one mode. "
        + beyond
        + peakless(results.cases)
        + results.beside_paper("Corresponds to the trend of figure 7")
    )
    yield Figure(
        "peaks",
        "Peak over the excitation level",
        caption,
        [
            Panel("", LEVEL, "peak per force (µm/N)", height),
            Panel("", LEVEL, "peak frequency (Hz)", place),
        ],
        row_height=300,
    )


def _over_levels(results: Results) -> tuple[list[Item], list[Item]]:
    """(height, frequency) of the peaks of each family: lines of one mode, and marks."""
    height: list[Item] = []
    place: list[Item] = []
    for k, family in enumerate(results.families):
        rank = (len(results.families) - 1 - k) % 4
        cases = [c for c in family if c.has_peak]
        for run in of_one_mode(cases):
            Fe, hz, peak = _peaks(run)
            for items, y in ((height, peak), (place, hz)):
                items.append(Curve(Fe, y, "", COLORS[rank], DASHES[rank]))
        Fe, hz, peak = _peaks(cases)
        for items, y in ((height, peak), (place, hz)):
            items.append(Marks(Fe, y, orders_of(family), COLORS[rank], SYMBOLS[k % 3]))
    return height, place


def _peaks(cases: Sequence[ReportedCurve]) -> np.ndarray:
    """(3, n): level N, Hz and micrometres per newton."""
    found = [(c.Fe, c.facts.peak_hz, MICRO * (c.peak_per_newton or 0.0)) for c in cases]
    return np.array(found, dtype=float).reshape(-1, 3).T


def _far(value: float, items: list[Item]) -> bool:
    """Whether a line there would leave the marks a small part of the axis."""
    y = np.concatenate([item.y for item in items if isinstance(item, Marks)])
    span = max(np.ptp(y), NEAR * value)
    return bool(np.abs(y - value).min() > FAR * span)


def _limit(value: float, label: str, items: list[Item]) -> Line:
    """The stuck value as a line, its label at the end from which the marks are farther away."""
    marks = [item for item in items if isinstance(item, Marks) and len(item.y)]
    first, last = (min(abs(m.y[end] - value) for m in marks) for end in (0, -1))
    return Line("y", value, label, INK, "dot", left=bool(first > last))
