"""The backbone beside the forced peaks: its figure, and what it predicts for each level."""

from collections.abc import Iterator

from tipdamp.hbm.drawing.figure import BLUE, INK, Curve, Figure, Item, Marks, Panel
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.amplitudes import amplitude_panel, branch, in_colors
from tipdamp.report.text import MICRO, hertz, listing, micro, percent
from tipdamp.results.response_results import BackboneResult, PredictedPeak

AMPLITUDE = "amplitude (µm)"
NAME = "backbone"


def figure(results: Results) -> Iterator[Figure]:
    """Over the forced curves; then frequency and damping ratio over the amplitude."""
    found, mode = results.backbone, results.mode
    if found is None or mode is None:
        return
    a = MICRO * mode.largest()
    peaks = [one for one in found.peaks if one.peak_m is not None]
    marks = Marks(
        [MICRO * (one.peak_m or 0.0) for one in peaks],
        [one.peak_hz for one in peaks],
        "peaks of the curves",
        BLUE,
    )
    yield Figure(
        "backbone",
        f"Nonlinear mode {found.mode}, stuck at {hertz(found.rest_hz or found.stuck_hz)} Hz",
        f"Left: the mode with H = {found.H} over the forced curves on '{found.response}', half of "
        "peak-to-peak, largest over its nodes. Middle and right: its frequency and its damping "
        "ratio, of structure and contacts together, over that amplitude; circles are the peaks of "
        f"the forced curves. {_open_at_rest(found)}{_reached(found)}",
        [
            amplitude_panel(
                results,
                "over the forced curves",
                AMPLITUDE,
                [*_forced(results, found), Curve(mode.frequency, a, NAME, INK, "dashdot")],
            ),
            Panel(
                "frequency",
                AMPLITUDE,
                "frequency (Hz)",
                [Curve(a, mode.frequency, NAME, INK), marks],
                log_x=True,
            ),
            Panel(
                "damping",
                AMPLITUDE,
                "damping ratio (%)",
                [Curve(a, 100 * mode.damping_ratio, NAME, INK)],
                log_x=True,
            ),
        ],
        columns=3,
        row_height=380,
    )


def _forced(results: Results, found: BackboneResult) -> Iterator[Item]:
    for case, color in in_colors(results.finest):
        yield from branch(case, found.response, MICRO, color)


def _open_at_rest(found: BackboneResult) -> str:
    """Which of two frequencies with stuck pairs is which."""
    if found.rest_hz is None:
        return ""
    return (
        f"{hertz(found.rest_hz)} Hz is its frequency with the kept pairs stuck that are in contact "
        "at rest, as in the tuning; modes are counted, and damped, with every kept pair closed "
        f"and stuck: then it has {hertz(found.stuck_hz)} Hz. "
    )


def _reached(found: BackboneResult) -> str:
    if found.complete:
        return ""
    return f"It ends at {micro(found.reached_m)} µm: {found.ended.partition(';')[0]}."


def table(results: Results) -> Iterator[Table]:
    """A row for each level: the peak of its curve, and that which the mode alone predicts."""
    if results.backbone is None:
        return
    yield Table(
        "Peaks that the backbone predicts, with the other modes stuck and linear, beside those of "
        "the forced curves. Where other modes overlap it is a hint, and the last column says so."
        + _other_harmonics(results, results.backbone),
        [_row(one) for one in results.backbone.peaks],
    )


def _other_harmonics(results: Results, found: BackboneResult) -> str:
    """That the two differ by their harmonics, too."""
    orders = sorted({case.H for case in results.finest})
    if found.H is None or orders == [found.H]:
        return ""
    those = listing(orders)
    return f" The backbone has H = {found.H}, the curves H = {those}: a part of the difference."


def _row(one: PredictedPeak) -> dict[str, str]:
    known = one.peak_m and one.predicted_m
    return {
        "Fe (N)": f"{one.Fe_N:g}",
        "peak (µm)": micro(one.peak_m),
        "at (Hz)": hertz(one.peak_hz),
        "predicted (µm)": micro(one.predicted_m),
        "predicted at (Hz)": hertz(one.predicted_hz),
        "height off": percent(known / one.peak_m - 1 if known and one.peak_m else None, 2),
        "": one.said or " ",
    }
