"""Figure: forced response level by level, with its band over the response patch."""

from collections.abc import Iterator

from tipdamp.hbm.drawing.branches import (
    BIFURCATIONS,
    CONTACTS,
    branch_lines,
    error_band,
    failures,
    named_marks,
    outermost,
)
from tipdamp.hbm.drawing.figure import BLUE, DASHES, GREY, VERMILION, Band, Curve, Figure, Item
from tipdamp.report.figures.amplitudes import (
    amplitude_panel,
    orders_of,
    panel_title,
    peakless,
    places,
    unstable_parts,
)
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import MICRO, listing, number, percent


def figures(results: Results) -> Iterator[Figure]:
    """One panel for each level, from the largest, at the most harmonics; beside it the curves with
    fewer, or where there are none the error that is estimated."""
    if not results.cases:
        return
    cases, others = results.finest, results.families[:-1]
    panels = [
        amplitude_panel(results, panel_title(case), "amplitude (µm)", list(_items(results, case)))
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
        tuple(panels),
        columns=min(3, len(panels)),
        row_height=290,
    )


def _items(results, case: ReportedCurve) -> Iterator[Item]:
    amplitude = MICRO * case.patch(results.first_patch)
    hz, top, low = case.curve.frequency, amplitude.max(axis=1), amplitude.min(axis=1)
    yield Band(hz, low, top, f"H = {case.H}, patch of blade 1", VERMILION, 0.28)
    yield from branch_lines(case.curve, top, f"H = {case.H}, largest and smallest", VERMILION)
    yield from branch_lines(case.curve, low, "", VERMILION, 1.0)
    others = results.families[:-1]
    error = case.error_of_top(results.first_patch)
    if error is not None and not others:
        yield error_band(case.curve, top, MICRO * error, "estimated error", BLUE)
    same_level = (c for family in others for c in family if c.Fe == case.Fe)
    for k, other in enumerate(same_level):
        yield Curve(
            other.curve.frequency,
            MICRO * other.patch(results.first_patch).max(axis=1),
            f"H = {other.H}, largest",
            BLUE,
            DASHES[1 + k % 2],
        )
    if results.stuck:
        yield Curve(
            results.stuck.hz,
            MICRO * case.Fe * results.stuck.m_per_N.max(axis=1),
            "linear, stuck",
            GREY,
            "dot",
        )
    named = places(case, MICRO)
    yield from named_marks(named, BIFURCATIONS, VERMILION)
    yield from named_marks(outermost(named), CONTACTS, VERMILION)
    yield from failures(case.curve, top, case.facts.complete)


def _marked(cases) -> str:
    """What the marks of contacts are."""
    if not any(outermost(places(case, MICRO)) for case in cases):
        return ""
    return (
        "Triangles and stars: where along the curve the first contact begins to slip, lifts off "
        "or parts, and where the last one ends. "
    )


def _orders_apart(coarse, fine) -> str:
    """Where the smallest H misses the peak of the largest most."""
    peaks = [(a, b) for a, b in zip(coarse, fine, strict=True) if a.has_peak and b.has_peak]
    if not peaks:
        return ""
    a, b = max(peaks, key=lambda p: abs(p[0].facts.peak_m / p[1].facts.peak_m - 1))
    off = percent(a.facts.peak_m / b.facts.peak_m - 1, 1)
    return f"The peaks at H = {a.H} and H = {b.H} differ most at {a.Fe:g} N, by {off}. "


def _estimated(cases) -> str:
    """The largest error of a peak."""
    known = [c for c in cases if c.facts.truncation is not None]
    if not known:
        return ""
    worst = max(known, key=lambda c: c.facts.truncation)
    return (
        "Blue, where it is wider than the line: the estimated error by the harmonics above H, at "
        f"the peaks {number(worst.facts.truncation, 2, 100)} % at most (Fe = {worst.Fe:g} N). "
    )
