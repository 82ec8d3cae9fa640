"""Figures of the forced response: the family of curves, each level with its band, contact states, trend of the peak."""

import numpy as np

from tipdamp.report.figure import (
    BLUE,
    DARK,
    DASHES,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PALE,
    VERMILION,
    Band,
    Curve,
    Figure,
    Line,
    Marks,
    Panel,
    level_colors,
)
from tipdamp.report.results import Case, Results
from tipdamp.report.text import MICRO, hertz, listing, micro, number, percent

LEVEL_DASHES = ("solid", "dash", "dashdot")
ORDERS = (VERMILION, BLUE, GREEN, ORANGE)


def family(results: Results, H: int) -> Figure:
    """All levels at one number of harmonics: per newton, beside the linear stuck response, and absolute."""
    per_force, absolute = [], []
    cases = results.of_order(H)
    for k, (case, color) in enumerate(zip(cases, level_colors(len(cases)), strict=True)):
        name, dash = f"Fe = {case.Fe:g} N", LEVEL_DASHES[k % len(LEVEL_DASHES)]
        per_force += _curve(results, case, name, color, dash, MICRO / case.Fe)
        absolute += _curve(results, case, name, color, dash, MICRO)
    if results.stuck:
        per_force.append(Curve(results.stuck["hz"], MICRO * results.stuck["m_per_N"].max(axis=1), "linear, stuck", INK,
                               "dot", 1.8))
    caption = (f"Response of blade 1 at {_levels(cases)} with H = {H}, half of peak-to-peak: left divided by the "
               "force, right as it is. Lines are the largest over the response patch, shaded down to the smallest; "
               f"circles mark the peaks. {_family_words(cases)}"
               + results.beside_paper("Corresponds to figure 7 (measured) and figures 10 to 14"))
    return Figure(f"family_H{H}", f"Forced response, H = {H}", caption, (
        _panel(results, "per newton", "amplitude per force (µm/N)", per_force),
        _panel(results, "absolute", "amplitude (µm)", absolute)), row_height=400)


def _panel(results, title, label, items):
    """Amplitude from zero over the band."""
    top = max((np.nanmax(i.y) for i in items if isinstance(i, Curve) and np.isfinite(i.y).any()), default=1.0)
    return Panel(title, "frequency (Hz)", label, tuple(items), x_range=tuple(results.study.respond.band),
                 y_range=(0.0, 1.06 * top))


def _curve(results, case: Case, name, color, dash, factor):
    amplitude = factor * case.patch(results.first_patch)
    top, low = amplitude.max(axis=1), amplitude.min(axis=1)
    hz, facts = case.curve.frequency, case.facts
    yield Band(hz, low, top, "", color, 0.13)
    yield Curve(hz, top, name, color, dash)
    if case.has_peak:
        yield Marks(np.array([facts["peak_hz"]]), np.array([factor * facts["peak_m"]]), "", color, filled=False)
    yield from _failures(case, top)


def _failures(case, amplitude):
    """A mark on the gap of each failed point, at the height of its neighbours, and where a curve stops early."""
    hz, bad = case.curve.frequency, ~np.isfinite(amplitude)
    if not case.facts["complete"] and not bad.any():
        yield Marks(hz[-1:], amplitude[-1:], "curve stops", VERMILION, "diamond", filled=False, size=10)
    if bad.any():
        at = np.arange(len(hz))
        height = np.interp(at[bad], at[~bad], amplitude[~bad]) if not bad.all() else np.zeros(bad.sum())
        yield Marks(hz[bad], height, "failed point", VERMILION, "x", size=9)


def _family_words(cases) -> str:
    good = [c for c in cases if c.has_peak]
    if len(good) < 2:
        return ""
    first, last = good[0], good[-1]
    return (f"From {first.Fe:g} to {last.Fe:g} N the peak goes from {hertz(first.facts['peak_hz'])} to "
            f"{hertz(last.facts['peak_hz'])} Hz and from {micro(first.facts['peak_m'] / first.Fe)} to "
            f"{micro(last.facts['peak_m'] / last.Fe)} µm/N.")


def _levels(cases) -> str:
    return f"Fe = {listing(f'{c.Fe:g}' for c in cases)} N"


def levels(results: Results) -> Figure:
    """One panel a level, from the largest: band over the patch at the largest H, the other H beside it."""
    most = results.orders[-1]
    others = results.orders[:-1]
    panels = []
    for case in reversed(results.of_order(most)):
        amplitude = MICRO * case.patch(results.first_patch)
        hz, top, low = case.curve.frequency, amplitude.max(axis=1), amplitude.min(axis=1)
        items = [Band(hz, low, top, f"H = {most}, patch of blade 1", VERMILION, 0.28),
                 Curve(hz, top, f"H = {most}, largest and smallest", VERMILION),
                 Curve(hz, low, "", VERMILION, width=1.0)]
        for k, other in enumerate(c for H in others for c in results.of_order(H) if c.Fe == case.Fe):
            items.append(Curve(other.curve.frequency, MICRO * other.patch(results.first_patch).max(axis=1),
                               f"H = {other.H}, largest", BLUE, DASHES[1 + k % 2]))
        if results.stuck:
            items.append(Curve(results.stuck["hz"], MICRO * case.Fe * results.stuck["m_per_N"].max(axis=1),
                               "linear, stuck", GREY, "dot"))
        panels.append(_panel(results, f"Fe = {case.Fe:g} N", "amplitude (µm)", [*items, *_failures(case, top)]))
    caption = ("Each level by itself, from the largest force: the largest and the smallest response over the nodes of "
               f"the patch of blade 1 at H = {most}"
               + (f", beside the largest at H = {listing(others)}" if others else "")
               + f", and the linear response with all kept pairs stuck. {_order_words(results)}"
               + results.beside_paper("Corresponds to figures 10 to 14, without their measured curves,"))
    return Figure("levels", "Each level with its band over the response patch", caption, tuple(panels),
                  columns=min(3, len(panels)), row_height=290)


def _order_words(results) -> str:
    """Where the smallest H misses the peak of the largest most."""
    few, most = results.orders[0], results.orders[-1]
    pairs = [(a, b) for a in results.of_order(few) for b in results.of_order(most)
             if a.Fe == b.Fe and a.has_peak and b.has_peak]
    if few == most or not pairs:
        return ""
    a, b = max(pairs, key=lambda p: abs(p[0].facts["peak_m"] / p[1].facts["peak_m"] - 1))
    off = percent(a.facts["peak_m"] / b.facts["peak_m"] - 1, 1)
    return f"The peaks at H = {few} and H = {most} differ most at {a.Fe:g} N, by {off}."


def shares(results: Results) -> Figure:
    """Stick, slip and open over frequency at the largest H."""
    most, panels = results.orders[-1], []
    for case in reversed(results.of_order(most)):
        curve = case.curve
        stick, slip, opened = (s.sum(axis=1) for s in (curve.share_stick, curve.share_slip, curve.share_open))
        pairs = curve.share_stick.shape[1]
        hz, zero = curve.frequency, np.zeros(len(curve.frequency))
        items = (Band(hz, zero, opened, "open", DARK, 1.0), Band(hz, opened, opened + slip, "slip", ORANGE, 1.0),
                 Band(hz, opened + slip, opened + slip + stick, "stick", PALE, 1.0), *_failures(case, opened + slip))
        panels.append(Panel(f"Fe = {case.Fe:g} N", "frequency (Hz)", "pairs", items, y_range=(0, pairs),
                            x_range=tuple(results.study.respond.band)))
    caption = (f"Contact states over frequency at H = {most}: share of the cycle in which each of the {pairs} kept "
               f"pairs sticks, slips or is open, summed over the pairs. {_slip_words(results.of_order(most))}")
    return Figure("contact_states", "Stick, slip and open", caption, tuple(panels), columns=min(3, len(panels)),
                  row_height=250)


def _slip_words(cases) -> str:
    slipping = [case.Fe for case in cases if case.facts["slipping_pairs"]]
    if not slipping:
        return "No pair slips at any level."
    stuck = [case.Fe for case in cases if case.Fe < min(slipping)]
    return (f"No pair slips at {listing(f'{Fe:g}' for Fe in stuck)} N; slip appears from {min(slipping):g} N."
            if stuck else "Pairs slip at every level.")


def trend(results: Results) -> Figure:
    """Height and frequency of the peak over the level."""
    height, place = [], []
    for k, H in enumerate(results.orders):
        cases = [c for c in results.of_order(H) if c.has_peak]
        Fe, hz, peak = (np.array(v, dtype=float) for v in (
            [c.Fe for c in cases], [c.facts["peak_hz"] for c in cases], [c.facts["peak_m"] for c in cases]))
        color, dash = ORDERS[(len(results.orders) - 1 - k) % 4], DASHES[(len(results.orders) - 1 - k) % 4]
        symbol = ("circle", "square", "diamond")[k % 3]
        for items, y in ((height, MICRO * peak / Fe), (place, hz)):
            items += [Curve(Fe, y, "", color, dash), Marks(Fe, y, f"H = {H}", color, symbol)]
    if "tune" in results:
        stuck = results["tune"]["stuck_hz"]["tuned"]
        place.append(Line("y", stuck, f"stuck {hertz(stuck)} Hz", INK, "dot"))
    if results.stuck:
        top = MICRO * results.stuck["m_per_N"].max()
        height.append(Line("y", top, f"linear, stuck {number(top, 3)} µm/N", INK, "dot"))
    caption = ("Peak of blade 1 over the excitation level: amplitude per newton, and frequency. Curves that do not "
               "cover the band are left out." + results.beside_paper("Corresponds to the trend of figure 7"))
    x = "excitation Fe (N)"
    return Figure("peaks", "Peak over the excitation level", caption, (
        Panel("", x, "peak per force (µm/N)", tuple(height)), Panel("", x, "peak frequency (Hz)", tuple(place))),
        row_height=300)
