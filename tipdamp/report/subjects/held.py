"""The force on what holds a rigid motion of the damper: a table, and a figure over the band."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.branches import with_gaps
from tipdamp.hbm.drawing.figure import DASHES, Curve, Figure, Item, Marks, Panel
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import in_colors, levels_of, orders_of
from tipdamp.report.text import MICRO, NOTHING, amount, hertz, listing, number
from tipdamp.results.response_results import CurveResult, HeldForce

NO_FORCE = 1e-9  # of the excitation: less is rounding


def table(results: Results) -> Iterator[Table]:
    """One row for each curve and motion."""
    rows = [
        _row(name, case.facts, one)
        for case in results.cases
        for name, one in case.facts.held.items()
    ]
    if rows:
        rest = results.preload.held if results.preload is not None else {}
        at_rest = "".join(
            f" At rest: {amount(force, 'N m' if 'roll' in name else 'N')} ({name})."
            for name, force in rest.items()
        )
        yield Table(
            "Force of the damper on what holds it, at the highest amplitude of blade 1: mean, "
            "and half of peak-to-peak of its vibration, which is the spring's own; beside the "
            "force at rest. With a spring ten times as stiff: largest relative change of peak "
            "and mean force, the latter beside the excitation, and change of a mean force that "
            "follows the stiffness, as sticking contacts carry it, beside itself. Displaced: "
            f"mean of the spring.{at_rest}{_without(results)}",
            rows,
        )


def _row(name: str, facts: CurveResult, one: HeldForce) -> dict[str, str]:
    scale, unit = (MICRO, "µm") if one.unit == "N" else (1.0, "rad")
    return {
        "motion": name,
        "H": f"{facts.H}",
        "Fe (N)": f"{facts.Fe_N:g}",
        "at (Hz)": hertz(one.hz),
        "mean": f"{number(_above_rounding(one.mean, facts.Fe_N))} {one.unit}",
        "vibration": f"{number(one.amplitude)} {one.unit}",
        "ten times": number(facts.held_change, 2) if one.spring else NOTHING,
        "of the mean force": number(facts.held_reaction_change, 2) if one.spring else NOTHING,
        "displaced": f"{number(one.moved, 3, scale)} {unit}" if one.spring else NOTHING,
    }


def _above_rounding(force: float | None, Fe: float) -> float | None:
    return force if force is None or abs(force) > NO_FORCE * Fe else 0.0


def figure(results: Results) -> Iterator[Figure]:
    """Mean force over the band at every level, one panel for each motion that has any, at the
    largest H."""
    cases = results.solved
    loaded = _loaded(results)
    if not loaded:
        return
    at = [
        f"{number(one.mean, 3)} {one.unit} ({name}, {case.Fe:g} N, {hertz(one.hz)} Hz)"
        for case in cases
        for name, one in case.facts.held.items()
        if name in loaded
    ]
    yield Figure(
        "held",
        "Force on what holds the damper",
        f"Mean force of the damper on what holds it at {levels_of(cases)} with {orders_of(cases)}, "
        "positive along the motion, beside the one at rest: what a stop there would have to "
        f"take. Circles mark the highest amplitude of blade 1: {listing(at)}.",
        [
            _panel(results, cases, k, name, cases[0].facts.held[name].unit)
            for name, k in loaded.items()
        ],
    )


def _loaded(results: Results) -> dict[str, int]:
    """{motion: its place} of those with a mean force at any level, at the largest H."""
    cases = results.solved
    return {
        name: k
        for k, name in enumerate(cases[0].facts.held if cases else ())
        if any(
            np.nanmax(np.abs(case.curve.reaction[:, k, 0]), initial=0.0) > NO_FORCE * case.Fe
            for case in cases
        )
    }


def _without(results: Results) -> str:
    """Of the motions that the figure leaves out."""
    held = results.solved[0].facts.held if results.solved else ()
    loaded = _loaded(results)
    none = listing(name for name in held if name not in loaded)
    return f" No mean force at any level, so no figure: {none}." if none else ""


def _panel(results: Results, cases: list[ReportedCurve], k: int, name: str, unit: str) -> Panel:
    items: list[Item] = []
    for i, (case, color) in enumerate(in_colors(cases)):
        facts, force = case.facts.held[name], case.curve.reaction[:, k, 0].real
        dash = DASHES[i % len(DASHES)]
        hz, shown = with_gaps(case.curve, force)
        items += [
            Curve(hz, shown, f"Fe = {case.Fe:g} N", color, dash),
            Marks([facts.hz], [facts.mean], "", color, filled=False),
        ]
    band = tuple(results.study.respond.band)
    return Panel(name, "frequency (Hz)", f"mean force ({unit})", items, x_range=band)
