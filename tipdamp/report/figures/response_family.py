"""Figures: forced response at all levels, one figure for each H."""

from collections.abc import Iterator

from tipdamp.hbm.drawing.branches import (
    BIFURCATIONS,
    branch_lines,
    error_band,
    failures,
    named_marks,
    peak_mark,
)
from tipdamp.hbm.drawing.figure import INK, Band, Curve, Figure, Item, level_colors
from tipdamp.report.figures.amplitudes import (
    amplitude_panel,
    level_title,
    levels_of,
    of_one_mode,
    orders_of,
    peakless,
    places,
    unstable_parts,
)
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import MICRO, hertz, micro, number
from tipdamp.statics.model_inputs import in_patch


def figures(results: Results) -> Iterator[Figure]:
    """Per newton beside the linear stuck response, and absolute; the largest H first."""
    for cases in reversed(results.families):
        orders = orders_of(cases)
        per_force: list[Item] = []
        absolute: list[Item] = []
        for case, color in zip(cases, level_colors(len(cases)), strict=True):
            per_force += _curve(results, case, color, MICRO / case.Fe)
            absolute += _curve(results, case, color, MICRO)
        if results.stuck:
            per_force.append(
                Curve(
                    results.stuck.hz,
                    MICRO * results.stuck.m_per_N.max(axis=1),
                    "linear, stuck",
                    INK,
                    "dot",
                    1.8,
                )
            )
        caption = (
            f"Response of blade 1 at {levels_of(cases)} with {orders}, half of peak-to-peak: left "
            "per newton of force, right absolute. Lines are the largest amplitude over the "
            "response patch, shaded down to the smallest; circles mark the peaks. "
            f"{_truncated(cases)}"
            f"{unstable_parts(cases)}"
            f"{_beside(cases)}"
            f"{_trend(cases)}{peakless(cases)}"
            + results.beside_paper("Corresponds to figure 7 (measured) and figures 10 to 14")
        )
        yield Figure(
            "family_auto" if cases[0].facts.tried else f"family_H{cases[0].H}",
            f"Forced response, {orders}",
            caption,
            (
                amplitude_panel(results, "per newton", "amplitude per force (µm/N)", per_force),
                amplitude_panel(results, "absolute", "amplitude (µm)", absolute),
            ),
            row_height=400,
        )


def _curve(results, case: ReportedCurve, color, factor) -> Iterator[Item]:
    amplitude = factor * case.patch(results.first_patch)
    top, low = amplitude.max(axis=1), amplitude.min(axis=1)
    hz, facts = case.curve.frequency, case.facts
    yield Band(hz, low, top, "", color, 0.13)
    error = case.error_of_top(results.first_patch)
    if error is not None:
        yield error_band(case.curve, top, factor * error, "", color)
    yield from branch_lines(case.curve, top, level_title(case), color)
    for one in case.beside:
        highest = one.amplitude()[:, in_patch(one.output_names, results.first_patch)].max(axis=1)
        yield from branch_lines(one, factor * highest, "", color, 0.9)
    yield from named_marks(places(case, factor), BIFURCATIONS, color)
    if facts.peak_m is not None and facts.peak_hz is not None:
        yield peak_mark(facts.peak_hz, factor * facts.peak_m, color)
    yield from failures(case.curve, top, case.facts.complete)


def _truncated(cases) -> str:
    """What the harmonics left out would change at the peaks, in words."""
    known = [c.facts.truncation for c in cases if c.facts.truncation is not None]
    if not known:
        return ""
    return (
        "Darker bands, where they are wider than the line: what more harmonics would change by "
        f"estimate, at the peaks {number(max(known), 2, 100)} % at most. "
    )


def _beside(cases) -> str:
    """Of how many curves further ones were found."""
    n = sum(len(c.beside) for c in cases)
    curves = "a further curve that was" if n == 1 else f"{n} further curves that were"
    return f"Thin: {curves} found beside them. " if n else ""


def _trend(cases) -> str:
    """Of each run of levels whose largest peaks are of one mode."""
    said = []
    for i, run in enumerate(of_one_mode([c for c in cases if c.has_peak])):
        first, last = run[0], run[-1]
        other = f"At {first.Fe:g} N the largest peak is that of another mode" * (i > 0)
        if len(run) > 1:
            said += [f"{other}."] * (i > 0) + [
                f"From {first.Fe:g} to {last.Fe:g} N the peak moves from "
                f"{hertz(first.facts.peak_hz)} to {hertz(last.facts.peak_hz)} Hz and from "
                f"{micro(first.peak_per_newton)} to {micro(last.peak_per_newton)} µm/N."
            ]
        elif i > 0:
            said.append(
                f"{other}, at {hertz(first.facts.peak_hz)} Hz with "
                f"{micro(first.peak_per_newton)} µm/N."
            )
    return " ".join(said)
