"""Measured curves with their bands and damping, and how far the computed curves of their levels
agree: tables, and a figure."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import (
    VERMILION,
    Band,
    Curve,
    Figure,
    Marks,
    Panel,
)
from tipdamp.measured.agreement import computed_amplitude, drawn
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.amplitudes import in_colors
from tipdamp.report.text import MICRO, NOTHING, hertz, micro, number, percent
from tipdamp.results.response_results import (
    Agreement,
    FittedCurve,
    MeasuredDamping,
    MeasuredFacts,
)


def tables(results: Results) -> Iterator[Table]:
    """The measured curves; then a row for each computed curve beside one of them."""
    if results.measured is None:
        return
    yield Table(
        "Measured curves: mean over the repeats, with one standard deviation. Damping by "
        "half-power bandwidth and by circle fit; a dash where the method was refused.",
        [_measured(name, one) for name, one in results.measured.curves.items()],
    )
    found = results.agreement
    if found and found.curves:
        yield Table(
            "Computed beside measured curves. Inside: share of the common measured frequencies "
            "at which the computed curve lies in the measured band. Half-power of the computed "
            f"curve is read at the measured frequencies, as on a measured one. {found.zeta:g} was "
            "put into the computation; bias is what half-power makes of it: friction and "
            "neighbouring modes count as damping.",
            [_computed(one, found.zeta) for one in found.curves],
        )


def fitted(results: Results) -> Iterator[Table]:
    """What was fitted with the contacts in the model, beside half-power; and how near it comes."""
    found = results.fit
    if found is None:
        return
    yield Table(
        "Fitted to the measured curves with the contacts in the model, by least squares, with the "
        "interval of 95 % from the scatter about the fit; factors on mu, or on kn and kt, are "
        "those of all pairs. The computed curves of this report have the values of the study.",
        [
            {
                "": one.name,
                "found": number(one.value, one.digits),
                "95 %": f"{number(one.low, one.digits)} to {number(one.high, one.digits)}",
                "start": number(one.start, 4),
            }
            for one in found.values
        ],
    )
    zeta = next((one.value for one in found.values if one.name.startswith("damping")), None)
    yield Table(
        "The measured curves of the fit. Misfit: root mean square of the difference, relative to "
        "the largest amplitude. Half-power takes the whole width of the peak for damping: its "
        "difference to the first ratio of the fit is friction, and neighbouring modes.",
        [_beside(one, zeta) for one in found.curves],
    )


def _beside(one: FittedCurve, zeta: float | None) -> dict[str, str]:
    apparent = one.half_power.zeta
    return {
        "curve": one.measured,
        "Fe (N)": f"{one.level_N:.4g}",
        "misfit": percent(one.misfit, 1).lstrip("+"),
        "half-power": _zeta(one.half_power),
        "half-power over fit": percent(apparent / zeta - 1 if apparent and zeta else None, 1),
    }


def _measured(name: str, one: MeasuredFacts) -> dict[str, str]:
    spread = number(one.peak_m_per_N_deviation, 2, MICRO)
    return {
        "curve": name,
        "Fe (N)": f"{one.level_N:.4g}",
        "repeats": f"{one.repeats}",
        "points": f"{one.points}",
        "peak (Hz)": _plus_minus(hertz(one.peak_hz), hertz(one.peak_hz_deviation)),
        "peak (µm/N)": _plus_minus(micro(one.peak_m_per_N), spread),
        "half-power": _zeta(one.half_power),
        "circle fit": _zeta(one.circle_fit),
    }


def _computed(one: Agreement, zeta: float) -> dict[str, str]:
    identified = one.half_power.zeta
    return {
        "measured": one.measured,
        "Fe (N)": f"{one.Fe_N:g}",
        "H": f"{one.H}",
        "inside": percent(one.share_inside, 0).lstrip("+"),
        "peak": percent(one.peak),
        "frequency": percent(one.frequency),
        "half-power": _zeta(one.half_power),
        "bias": percent(identified / zeta - 1 if identified else None, 1),
    }


def _zeta(damping: MeasuredDamping) -> str:
    return _plus_minus(number(damping.zeta), number(damping.deviation, 2))


def _plus_minus(value: str, deviation: str) -> str:
    return value if NOTHING in (value, deviation) else f"{value} ± {deviation}"


def figure(results: Results) -> Iterator[Figure]:
    """One panel for each measured curve, in the order of the study."""
    if results.measured is not None:
        yield Figure(
            "measured",
            "Measured and computed curves",
            "Measured response per newton: points are the mean of the repeats, the shaded band is "
            "what the measurement allows. Lines are the computed curves of the same level of force "
            "at the same place; several H where the study has several."
            + " Wide: with what was fitted, at the measured frequencies."
            * bool(results.fit),
            [_panel(results, name, one.level_N) for name, one in results.measured.curves.items()],
            row_height=380,
        )


def _panel(results: Results, name: str, level: float) -> Panel:
    band = results.bands[name]
    curves = [*_computed_curves(results, name), *_fitted_curves(results, name)]
    tops = [MICRO * band.high.max(), *(np.nanmax(one.y, initial=0.0) for one in curves)]
    low, high = results.study.respond.band
    return Panel(
        f"{name}: {level:.4g} N",
        "frequency (Hz)",
        "amplitude per force (µm/N)",
        [
            Band(band.hz, MICRO * band.low, MICRO * band.high, "measured, band"),
            Marks(band.hz, MICRO * band.mean, "measured, mean", size=3.5),
            *curves,
        ],
        x_range=(min(low, band.hz[0]), max(high, band.hz[-1])),
        y_range=(0.0, 1.06 * max(tops)),
    )


def _computed_curves(results: Results, name: str) -> Iterator[Curve]:
    """Of the level of a measured curve, per newton."""
    every = results.agreement.curves if results.agreement else ()
    settings = results.study.measured[name]
    for one, color in in_colors([one for one in every if one.measured == name]):
        case = next(c for c in results.cases if c.facts.file == one.computed)
        amplitude = MICRO / case.Fe * computed_amplitude(case.curve, settings, results.first_patch)
        hz, shown = (values[:-1] for values in drawn(case.curve.frequency, amplitude))
        yield Curve(hz, shown, f"computed, H = {case.H}", color)


def _fitted_curves(results: Results, name: str) -> Iterator[Curve]:
    for one in results.fit.curves if results.fit else ():
        if one.measured == name:
            amplitude = MICRO * np.array(one.m_per_N)
            yield Curve(one.hz, amplitude, "fitted", VERMILION, width=5.0)
