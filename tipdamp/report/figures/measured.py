"""Figure: measured curves with their bands, the computed curves of their levels on top."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import Band, Curve, Figure, Item, Marks, Panel, level_colors
from tipdamp.measured.agreement import computed_amplitude, drawn
from tipdamp.report.results import Results
from tipdamp.report.text import MICRO

COLUMNS = 2


def figures(results: Results) -> Iterator[Figure]:
    """One panel for each measured curve, in the order of the study."""
    if results.measured is None:
        return
    panels = tuple(
        _panel(results, name, one.level_N) for name, one in results.measured.curves.items()
    )
    yield Figure(
        "measured",
        "Measured and computed curves",
        "Measured response per newton: points are the mean of the repeats, the shaded band is "
        "what the measurement allows. Lines are the computed curves of the same level of force "
        "at the same place; several H where the study has several.",
        panels,
        columns=min(COLUMNS, len(panels)),
        row_height=380,
    )


def _panel(results: Results, name: str, level: float) -> Panel:
    band, settings = results.bands[name], results.study.measured[name]
    beside = [
        one
        for one in (results.agreement.curves if results.agreement else ())
        if one.measured == name
    ]
    items: list[Item] = [
        Band(band.hz, MICRO * band.low, MICRO * band.high, "measured, band"),
        Marks(band.hz, MICRO * band.mean, "measured, mean", size=3.5),
    ]
    top = MICRO * band.high.max()
    for one, color in zip(beside, level_colors(len(beside)) if beside else [], strict=True):
        case = next(c for c in results.cases if c.facts.file == one.computed)
        amplitude = MICRO / case.Fe * computed_amplitude(case.curve, settings, results.first_patch)
        hz, drawn_amplitude = (values[:-1] for values in drawn(case.curve.frequency, amplitude))
        items.append(Curve(hz, drawn_amplitude, f"computed, H = {case.H}", color))
        top = max(top, np.nanmax(amplitude))
    low, high = results.study.respond.band
    return Panel(
        f"{name}: {level:.4g} N",
        "frequency (Hz)",
        "amplitude per force (µm/N)",
        tuple(items),
        x_range=(min(low, band.hz[0]), max(high, band.hz[-1])),
        y_range=(0.0, 1.06 * top),
    )
