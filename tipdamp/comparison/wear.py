"""Wear index at the best pull of each study."""

from collections.abc import Iterator

import numpy as np

from tipdamp.comparison.figures import in_words, style_of
from tipdamp.comparison.peaks import Phase
from tipdamp.comparison.record import ComparedStudies
from tipdamp.hbm.drawing.figure import Figure, Marks, Panel
from tipdamp.report.subjects import wear
from tipdamp.report.subjects.axial import AXIAL


def figures(comparison: ComparedStudies) -> Iterator[Figure]:
    """A row for each phase, a column for each side."""
    panels = [panel for phase in comparison.phases for panel in _panels(comparison, phase)]
    if panels:
        yield Figure(
            "wear",
            "Wear index at the best pull",
            "Work of friction per hour and length of the damper, or area of the contact where all "
            "studies know it or the width of their sides, at the kept stations, while "
            "the blades vibrate at the peak of blade 1 at the level with the best Fc/Fe of each "
            "study, at the first of its pulls. Wear grows with it (Archard), and it grows with the "
            "square of pull and force at one Fc/Fe.",
            panels,
            row_height=280,
        )


def _panels(comparison: ComparedStudies, phase: Phase) -> Iterator[Panel]:
    """One for each side, on the same scales."""
    unit = "mm²" if has_areas(comparison) else "mm"
    found = {side: list(_marks(comparison, phase, side)) for side in _sides(comparison)}
    every = [marks for items in found.values() for marks in items]
    ends = [np.concatenate([vars(one)[axis] for one in every] or [[0.0]]) for axis in "xy"]
    x_room, top = 0.03 * np.ptp(ends[0]), ends[1].max()
    for side, items in found.items():
        if any(len(marks.x) for marks in items):
            yield Panel(
                f"{in_words(phase)}, side '{side}'",
                AXIAL,
                f"friction work (J per {unit} and hour)",
                items,
                x_range=(ends[0].min() - x_room, ends[0].max() + x_room) if x_room else None,
                y_range=(-0.04 * top, 1.06 * top) if top > 0 else None,
            )


def _sides(comparison: ComparedStudies) -> list[str]:
    tables = [one.whole for one in comparison.studies.values() if one.whole is not None]
    return list(dict.fromkeys(side for table in tables for side in table.sides))


def _marks(comparison: ComparedStudies, phase: Phase, side: str) -> Iterator[Marks]:
    optima, per_area = comparison.optima(phase), has_areas(comparison)
    slipping = {
        name for p in comparison.phases for name, o in comparison.optima(p).items() if not o.idle
    }
    for name, one in comparison.studies.items():
        style = style_of(comparison, name)
        at = [
            peak
            for peak in comparison.of(name, phase, 1)
            if name in optima and not optima[name].idle and peak.ratio == optima[name].ratio
        ]
        x = work = np.empty(0)
        for peak in at[:1]:
            x, work = wear.wear_index(one, peak.friction_W, side, per_area)
            work = (one.study.driver.pull / peak.pull) ** 2 * work
        if name in slipping:  # in the legend in the order of the studies
            yield Marks(x, work, name, *style)


def has_areas(comparison: ComparedStudies) -> bool:
    """Whether all contacts of all studies know theirs, or the width of their sides."""
    kept = [one for one in comparison.studies.values() if one.kept is not None]
    return bool(kept) and all(map(wear.has_areas, kept))
