"""Tuning by detachment: the stuck frequency and the MAC over what is kept, stations or area; what
each station is worth, the kept part of every side, and sets that fit equally well."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.figure import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    VERMILION,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.hbm.drawing.pictures import KEPT_STATIONS
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.axial import ACROSS, AXIAL, across, of_side, side_title, with_room
from tipdamp.report.text import MM, hertz, listing, number, true_minus
from tipdamp.results.static_results import KeptArea, TuneResult, TuneStep

HOW_STATIONS = {
    "from_middle": (
        "Every number of stations at the front and at the back is tried (grey); in blue the most "
        "even ends, from which stations leave one after the other from the middle."
    ),
    "least_loaded": "Stations leave along the preload map, the least loaded first.",
}
HOW_AREA = {
    "from_edge": (
        "The closed part of every side shrinks from its edge inwards, where the pressure is "
        "least first."
    ),
    "least_loaded": "The closed part of every side shrinks by the least pressure.",
    "from_middle": (
        "The closed part of every side shrinks from the middle of the axis to both ends."
    ),
}
SHOWN = 20  # equivalent sets


def histories(results: Results) -> Iterator[Figure]:
    """Where stations or area were detached to meet a target; what the stations are worth."""
    tune = results.tune
    if tune is None:
        return
    if len(tune.history) > 1:
        yield _of_stations(results, tune)
    if tune.station_worth:
        yield _worth(tune)
    if tune.area is not None:
        yield _of_area(results, tune, tune.area)
        if results.kept is not None and results.whole is not None:
            yield _map(results, tune.area, results.kept, results.whole)


def _of_stations(results: Results, tune: TuneResult) -> Figure:
    order, kept = results.study.tune.order, tune.tuned_pairs
    count = np.array([s.front + s.back for s in tune.history], dtype=float)
    even = np.array([order == "least_loaded" or s.front - s.back in (0, 1) for s in tune.history])
    hz = np.array([s.hz for s in tune.history])
    known = _reference(results.study.reference, count.max())
    part, chosen = 1.0, f"chosen: {kept.front} + {kept.back}"
    if tune.graded is not None:
        part = tune.graded.part
        chosen += f", of station {tune.graded.station} a part of {part:.3g}"
    stated = Marks(known[:, 0], known[:, 1], "reference", INK, "square", filled=False, size=9)
    return _history(
        results,
        tune,
        "Tuning by detachment",
        KEPT_STATIONS,
        HOW_STATIONS[order],
        [*hz, *known[:, 1]],
        [
            *_sets(count, hz, even),
            *_target(tune, count.min(), count.max()),
            _chosen(tune, kept.front + kept.back - 1 + part, chosen),
            *[stated] * bool(len(known)),
        ],
        list(_sets(count, np.array([s.mac for s in tune.history]), even)),
    )


def _of_area(results: Results, tune: TuneResult, area: KeptArea) -> Figure:
    share = 100 * np.array([s.share for s in area.history])

    def steps(values: Sequence[float]) -> Iterator[Item]:
        yield Curve(share, values, "", BLUE)
        yield Marks(share, values, "tracked mode", BLUE, size=4)

    hz = [s.hz for s in area.history]
    kept = _chosen(tune, 100 * area.share, f"kept: {100 * area.share:.3g} %")
    how = (
        f"{HOW_AREA[results.study.tune.order]} Where it is tuned, a percent of the area is worth "
        f"{abs(area.hz_per_percent):.2g} Hz."
    )
    return _history(
        results,
        tune,
        "Tuning by area",
        "kept part of the closed area (%)",
        how,
        [*hz, tune.stuck_hz.tuned],
        [*steps(hz), *_target(tune, 0, 100), kept],
        list(steps([s.mac for s in area.history])),
        x_range=(0, 103),
    )


def _history(
    results: Results,
    tune: TuneResult,
    title: str,
    label: str,
    how: str,
    seen: Sequence[float],
    hz: Sequence[Item],
    mac: Sequence[Item],
    x_range: tuple | None = None,
) -> Figure:
    """seen - frequencies that must fit, beside the target; without a range x counts stations."""
    seen = [*seen, *([tune.target_hz] if tune.target_hz else [])]
    low, high = min(seen) - 0.12 * np.ptp(seen), max(seen) + 0.06 * np.ptp(seen)
    caption = (
        f"{how} Left: frequency of the {results.study.tune.follow.replace('_', '-')} mode of the "
        "stuck assembly. Right: its energy-weighted MAC with the mode without damper (MAC of the "
        "blades times their share of the kinetic energy), by which it is tracked through changes "
        "of order; a dip marks a crossing with another mode."
        + results.beside_paper("Corresponds to the tuning in section 8")
    )
    whole = x_range is None
    return Figure(
        "tuning",
        title,
        caption,
        [
            Panel(
                "",
                label,
                "stuck frequency (Hz)",
                hz,
                x_range=x_range,
                y_range=(low, high),
                whole_x=whole,
            ),
            Panel(
                "",
                label,
                "energy-weighted MAC",
                mac,
                x_range=x_range,
                y_range=(0, 1.03),
                whole_x=whole,
            ),
        ],
    )


def _sets(count: np.ndarray, values: np.ndarray, even: np.ndarray) -> Iterator[Item]:
    """The sets off the line first, under it."""
    if not even.all():
        yield Marks(count[~even], values[~even], "other ends", GREY, size=3)
    order = np.flatnonzero(even)[np.argsort(count[even], kind="stable")]
    yield Curve(count[order], values[order], "", BLUE)
    yield Marks(count[order], values[order], "tracked mode", BLUE, size=5)


def _target(tune: TuneResult, first: float, last: float) -> Iterator[Item]:
    """The target over what was tried, with its scatter; named in the legend, where nothing is in
    its way."""
    if not tune.target_hz:
        return
    for edge in (-1, 1) if tune.scatter_hz else ():
        yield Line("y", tune.target_hz + edge * tune.scatter_hz, color=VERMILION, dash="dot")
    name = f"target {tune.target_hz:g} Hz"
    yield Curve([first, last], [tune.target_hz] * 2, name, VERMILION, "dash", 1.2)


def _chosen(tune: TuneResult, at: float, name: str) -> Marks:
    hz = tune.stuck_hz.tuned
    return Marks([at], [hz], f"{name}, {hertz(hz)} Hz", VERMILION, "diamond", size=11)


def _reference(reference: Mapping[str, float], most: float) -> np.ndarray:
    """(n, 2): stations and Hz of the whole line and of the kept stations, as far as the study
    states them."""
    stations = sum(reference.get(k, 0) for k in ("front", "back"))
    found = [(most, reference.get("full_line_hz")), (stations, reference.get("tuned_hz"))]
    return np.array([(n, f) for n, f in found if n and f], dtype=float).reshape(-1, 2)


def _worth(tune: TuneResult) -> Figure:
    kinds = ((True, "kept: lost without it", BLUE), (False, "detached: gained with it", GREY))
    items = []
    for kept, name, color in kinds:
        mine = [one for one in tune.station_worth if one.kept == kept]
        if mine:
            at, hz = [MM * one.position_m for one in mine], [one.hz for one in mine]
            items.append(Marks(at, hz, name, color, filled=kept))
    top = 1.15 * max(one.hz for one in tune.station_worth)
    return Figure(
        "station_worth",
        "What a station is worth",
        "Hz per station: what the stuck frequency would lose if a kept station were detached, "
        "and gain if a detached one were kept, each alone. Whole stations cannot meet a target "
        "more closely than about half of it.",
        [Panel("", AXIAL, "stuck frequency per station (Hz)", items, y_range=(0, top))],
    )


def _map(results: Results, area: KeptArea, kept: ContactTable, whole: ContactTable) -> Figure:
    """The contact points of every side, seen along the normal."""
    amounts = listing(
        f"{s.kept:.4g} of {s.closed:.4g} {s.unit.replace('2', '²')} on side '{name}'"
        for name, s in area.sides.items()
    )
    return Figure(
        "kept_area",
        "What is kept of the contact area",
        f"Every contact point on its side, seen along the normal: what is kept, {amounts}. In "
        "part: at the edge of the kept area, with that part of kn and kt.",
        [
            _seen_along_the_normal(results, side, of_side(kept, side), of_side(whole, side))
            for side in kept.sides
        ],
        row_height=300,
    )


def _seen_along_the_normal(
    results: Results, side: str, mine: ContactTable, before: ContactTable
) -> Panel:
    heights = across(results, mine)
    part, closed = mine.weight, before.preload > 0
    kinds = (
        ((part >= 1) & closed, "kept", BLUE, "circle", True),
        ((part > 0) & (part < 1) & closed, "kept in part", ORANGE, "diamond", True),
        ((part == 0) & closed, "detached", GREY, "circle", False),
        (~closed, "open at rest", VERMILION, "x", True),
    )
    items = [
        Marks(results.along(mine)[on], heights[on], name, color, symbol, filled=filled, size=8)
        for on, name, color, symbol, filled in kinds
        if on.any()
    ]
    return Panel(side_title(results, side), AXIAL, ACROSS, items, y_range=with_room(heights))


def equivalent_sets(results: Results) -> Iterator[Table]:
    """Sets of stations that fit the target equally well, where the study states its scatter."""
    tune = results.tune
    if tune is None or not tune.history or not tune.scatter_hz or not tune.target_hz:
        return
    sets, tried, target = tune.equivalent, len(tune.history), tune.target_hz
    scatter = (
        f"{number(tune.scatter_hz, 3)} Hz of the target of {target:g} Hz, its measured scatter"
    )
    if sets:
        more = f" The nearest {SHOWN} are shown." if len(sets) > SHOWN else ""
        caption = (
            f"{len(sets)} of {tried} sets of whole stations lie within {scatter}, and fit equally "
            f"well: the measurement does not tell them apart.{more}"
        )
    else:
        caption = f"No set of whole stations lies within {scatter}; the nearest of {tried}."
        sets = (min(tune.history, key=lambda s: abs(s.hz - target)),)
    yield Table(caption, [_set(one, target) for one in sets[:SHOWN]])


def _set(step: TuneStep, target_hz: float) -> dict[str, str]:
    return {
        "stations, front + back": f"{step.front} + {step.back}",
        "stuck frequency (Hz)": hertz(step.hz),
        "off the target (Hz)": true_minus(f"{step.hz - target_hz:+.1f}"),
        "energy-weighted MAC": number(step.mac, 3),
    }
