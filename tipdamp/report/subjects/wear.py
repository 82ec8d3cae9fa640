"""Wear index: work of friction per hour and length of the damper, or area of the contact, at every
station."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.hbm.drawing.figure import Curve, Figure, Item, Marks, Panel
from tipdamp.report.results import Results
from tipdamp.report.subjects.amplitudes import in_colors
from tipdamp.report.subjects.axial import (
    AXIAL,
    by_point,
    middles,
    of_side,
    parted,
    side_title,
    sums,
)
from tipdamp.report.text import MM, MM2

HOUR = 3600.0  # s
AREA = "area of the contact (of a line of nodes its width, as stated or by Hertz, times its length)"


def figure(results: Results) -> Iterator[Figure]:
    """A panel for each side, a line for each level, at the largest H."""
    if results.cycles is None or results.kept is None:
        return
    if not any(one.friction_share > 0 for one in results.periods):
        return
    per_area = has_areas(results)
    unit, over = ("mm²", AREA) if per_area else ("mm", "length of the damper")
    items = {side: list(_levels(results, side, per_area)) for side in results.kept.sides}
    panels = [
        Panel(side_title(results, side), AXIAL, f"friction work (J per {unit} and hour)", drawn)
        for side, drawn in items.items()
        if drawn
    ]
    if panels:
        yield Figure(
            "wear",
            "Wear index",
            f"Work of friction per hour and {over} at the kept stations, or at each contact point "
            "where these lie on no lines across the axis, while the blades vibrate "
            "at the peak of each level. Wear grows with it (Archard).",
            panels,
            row_height=310,
        )


def _levels(results: Results, side: str, per_area: bool) -> Iterator[Item]:
    assert results.cycles is not None and results.kept is not None
    carrying = results.kept.select(results.kept.carrying)
    pairs = of_side(carrying, side)
    stations, lined = np.unique(pairs.station), not (per_area and by_point(results, carrying))
    for one, color in in_colors(results.periods):
        power = [one.hz * one.friction_J[name] for name in results.cycles.pairs]
        x, work = wear_index(results, power, side, per_area)
        if not len(x):
            continue
        if lined:
            along, parts = parted(stations, x, work)
            yield Curve(along, parts, "", color)
        yield Marks(x, work, f"Fe = {one.Fe_N:g} N", color, size=5)


def wear_index(
    one: Results, power: Sequence[float], side: str, per_area: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """(mm along the axis (s,), J per mm and hour (s,)) of the kept stations of a side, each of
    which stands for the length half way to its neighbours on the whole line, one at an end of it
    for half as much, or J per mm2 and hour of the area of its contact points or, with the width of
    the side, of that length; empty without kept pairs, or of a single station.

    power (P,) W - of friction in each kept pair. Per area the contact points that lie on no lines
    across the axis, as on unlike meshes, each with its own: a sum over a station follows the mesh.
    """
    if one.kept is None or one.whole is None:
        return np.empty(0), np.empty(0)
    carrying = one.kept.select(one.kept.carrying)
    every, mine = of_side(one.whole, side), carrying.side == side
    own = np.array(power)[mine]
    pairs = of_side(carrying, side)
    if per_area and by_point(one, carrying):
        order = np.argsort(along := one.along(pairs))
        return along[order], (HOUR * own / (MM2 * pairs.area))[order]
    line, stations = np.unique(every.station), np.unique(pairs.station)
    if len(line) < 2 or not len(stations):
        return np.empty(0), np.empty(0)
    length = tributary(middles(one, every))[np.searchsorted(line, stations)]
    x, work = middles(one, pairs), HOUR * sums(pairs, own)
    if not per_area:
        return x, work / length
    if (pairs.area > 0).all():
        return x, work / (MM2 * sums(pairs, pairs.area))
    return x, work / (MM * (width(one, side) or np.nan) * length)


def tributary(places: np.ndarray) -> np.ndarray:
    """(n,) length that each of the places (n,) along a line stands for: half way to its
    neighbours."""
    order = np.argsort(places)
    half = np.diff(places[order]) / 2
    length = np.empty(len(places))
    length[order] = np.r_[half, 0.0] + np.r_[0.0, half]
    return length


def has_areas(one: Results) -> bool:
    """Whether all kept contacts know theirs, or the width of their side is known."""
    if one.kept is None:
        return False
    kept = one.kept.select(one.kept.carrying)
    return all((of_side(kept, side).area > 0).all() or width(one, side) for side in kept.sides)


def width(one: Results, side: str) -> float | None:
    """m across a side: in contact under the pull, where its stiffness was found by that; as stated
    of a side that is not round; else None."""
    found = one.preload.stiffness.get(side) if one.preload else None
    if found and found.half_width_m:
        return 2 * found.half_width_m
    stated = one.study.sides.get(side)
    return stated.width if stated and stated.shape != "cylinder" else None
