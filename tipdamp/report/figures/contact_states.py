"""Figure: contact states, the shares of stick, slip and open over frequency."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.branches import failures
from tipdamp.hbm.drawing.figure import DARK, ORANGE, PALE, Band, Figure, Panel
from tipdamp.report.figures.amplitudes import level_title, orders_of
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.text import listing


def figures(results: Results) -> Iterator[Figure]:
    """One panel for each level with a solved point, from the largest, at the largest H."""
    cases = results.solved
    if not cases:
        return
    pairs = cases[0].curve.share_stick.shape[1]
    panels = [_panel(case, pairs, tuple(results.study.respond.band)) for case in reversed(cases)]
    caption = (
        f"Contact states over frequency at {orders_of(cases)}: share of the cycle in which each of "
        f"the {pairs} kept pairs sticks, slips or is open, summed over the pairs. "
        f"{_where_slip_begins(cases)}"
    )
    yield Figure(
        "contact_states",
        "Stick, slip and open",
        caption,
        tuple(panels),
        columns=min(3, len(panels)),
        row_height=250,
    )


def _panel(case: ReportedCurve, pairs: int, band: tuple) -> Panel:
    curve = case.curve
    stick, slip, opened = (
        s.sum(axis=1) for s in (curve.share_stick, curve.share_slip, curve.share_open)
    )
    hz, zero = curve.frequency, np.zeros(len(curve.frequency))
    items = (
        Band(hz, zero, opened, "open", DARK, 1.0),
        Band(hz, opened, opened + slip, "slip", ORANGE, 1.0),
        Band(hz, opened + slip, opened + slip + stick, "stick", PALE, 1.0),
        *failures(case.curve, opened + slip, case.facts.complete),
    )
    return Panel(
        level_title(case), "frequency (Hz)", "pairs", items, y_range=(0, pairs), x_range=band
    )


def _where_slip_begins(cases) -> str:
    slipping = [case.Fe for case in cases if case.facts.slipping_pairs]
    if not slipping:
        return "No pair slips at any level."
    stuck = [f"{case.Fe:g}" for case in cases if case.Fe < min(slipping)]
    return (
        f"No pair slips at {listing(stuck)} N; slip begins at {min(slipping):g} N."
        if stuck
        else "Pairs slip at every level."
    )
