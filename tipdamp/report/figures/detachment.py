"""Figures: history of detachment, the stuck frequency and the MAC over the number of kept stations;
what each station is worth."""

from collections.abc import Iterator

import numpy as np

from tipdamp.hbm.drawing.figure import (
    BLUE,
    GREY,
    INK,
    VERMILION,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.report.figures.axial import AXIAL
from tipdamp.report.results import Results
from tipdamp.report.text import MM, hertz

STATIONS = "kept stations on each side"
HOW = {
    "from_middle": (
        "Every number of stations at the front and at the back is tried (grey); in blue the most "
        "even ends, from which stations leave one after the other from the middle."
    ),
    "least_loaded": "Stations leave along the preload map, the least loaded first.",
}


def figures(results: Results) -> Iterator[Figure]:
    """The history, where stations were detached to meet a target; what the stations are worth."""
    tune = results.tune
    if tune is None:
        return
    if len(tune.history) > 1:
        yield _history(results)
    if tune.station_worth:
        yield _worth(results)


def _history(results) -> Figure:
    tune, order = results.tune, results.study.tune.order
    count = np.array([s.front + s.back for s in tune.history], dtype=float)
    hz = np.array([s.hz for s in tune.history])
    mac = np.array([s.mac for s in tune.history])
    known = _reference(results.study.reference, count.max())
    seen = [*hz, tune.target_hz, *known[:, 1]]
    low, high = min(seen) - 0.12 * np.ptp(seen), max(seen) + 0.06 * np.ptp(seen)
    mode = results.study.tune.follow.replace("_", "-")
    caption = (
        f"{HOW[order]} Left: frequency of the {mode} mode of the stuck assembly. Right: its "
        "energy-weighted MAC with the mode without damper (MAC of the blades times their share "
        "of the kinetic energy), by which it is tracked through changes of order; a dip marks a "
        "crossing with another mode."
        + results.beside_paper("Corresponds to the tuning in section 8")
    )
    even = np.array([order == "least_loaded" or s.front - s.back in (0, 1) for s in tune.history])
    return Figure(
        "tuning",
        "Tuning by detachment",
        caption,
        (
            Panel(
                "",
                STATIONS,
                "stuck frequency (Hz)",
                (*_sets(count, hz, even), *_met(tune, known, count)),
                y_range=(low, high),
                whole_x=True,
            ),
            Panel(
                "",
                STATIONS,
                "energy-weighted MAC",
                tuple(_sets(count, mac, even)),
                y_range=(0, 1),
                whole_x=True,
            ),
        ),
    )


def _sets(count, values, even) -> Iterator[Item]:
    """The sets off the line first, under it."""
    if not even.all():
        yield Marks(count[~even], values[~even], "other ends", GREY, size=3)
    order = np.flatnonzero(even)[np.argsort(count[even], kind="stable")]
    yield Curve(count[order], values[order], "", BLUE)
    yield Marks(count[order], values[order], "tracked mode", BLUE, size=5)


def _met(tune, known, count) -> Iterator[Item]:
    """The target over the sets that were tried, what was chosen and what is known; named in the
    legend, where nothing is in their way."""
    kept, part = tune.tuned_pairs, 1.0 if tune.graded is None else tune.graded.part
    if tune.scatter_hz:
        for edge in (-1, 1):
            yield Line("y", tune.target_hz + edge * tune.scatter_hz, color=VERMILION, dash="dot")
    yield Curve(
        np.array([count.min(), count.max()]),
        np.full(2, tune.target_hz),
        f"target {tune.target_hz:g} Hz",
        VERMILION,
        "dash",
        1.2,
    )
    graded = (
        "" if tune.graded is None else f", of station {tune.graded.station} a part of {part:.3g}"
    )
    yield Marks(
        np.array([kept.front + kept.back - 1 + part]),
        np.array([tune.stuck_hz.tuned]),
        f"chosen: {kept.front} + {kept.back}{graded}, {hertz(tune.stuck_hz.tuned)} Hz",
        VERMILION,
        "diamond",
        size=11,
    )
    if len(known):
        yield Marks(known[:, 0], known[:, 1], "reference", INK, "square", filled=False, size=9)


def _worth(results) -> Figure:
    worth = results.tune.station_worth
    x = MM * np.array([w.position_m for w in worth])
    hz = np.array([w.hz for w in worth])
    kept = np.array([w.kept for w in worth])
    kinds = (
        (kept, "kept: lost without it", BLUE, True),
        (~kept, "detached: gained with it", GREY, False),
    )
    items = tuple(
        Marks(x[on], hz[on], name, color, filled=filled)
        for on, name, color, filled in kinds
        if on.any()
    )
    caption = (
        "Hz per station: what the stuck frequency would lose if a kept station were detached, "
        "and gain if a detached one were kept, each alone. Whole stations cannot meet a target "
        "more closely than about half of it."
    )
    return Figure(
        "station_worth",
        "What a station is worth",
        caption,
        (
            Panel(
                "",
                AXIAL,
                "stuck frequency per station (Hz)",
                items,
                y_range=(0, 1.15 * float(hz.max())),
            ),
        ),
    )


def _reference(reference, most) -> np.ndarray:
    """(n, 2): stations and Hz of the whole line and of the kept stations, as far as the study
    states them."""
    stations = sum(reference.get(k, 0) for k in ("front", "back"))
    found = [(most, reference.get("full_line_hz")), (stations, reference.get("tuned_hz"))]
    return np.array([(n, f) for n, f in found if n and f], dtype=float).reshape(-1, 2)
