"""Tuning by area: which part of the closed area of each side is kept, and what of it goes into the
result."""

from collections.abc import Sequence

import numpy as np

from tipdamp.engine.progress import Tick
from tipdamp.fields.pressure import PressurePatch, patches
from tipdamp.hbm.contact import ContactTable
from tipdamp.results import static_results as results
from tipdamp.static_contact.contact.contact_cells import cells_in, fade_of, plane_of
from tipdamp.static_contact.contact.mirror import Mirror, mirrors_of
from tipdamp.static_contact.tuning.area_detachment import (
    AreaDetachment,
    AreaStep,
    detach_area,
    keep_area,
)
from tipdamp.static_contact.tuning.kept_stations import halves
from tipdamp.static_contact.tuning.station_detachment import DetachmentOptions
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly
from tipdamp.study.view import Study

UNITS = {True: ("mm2", 1e6), False: ("mm", 1e3)}  # of areas, and of sides that are a line


def keep(
    study: Study,
    assembly: StuckAssembly,
    line: ContactTable,
    follow: np.ndarray,
    target_hz: float | None,
    options: DetachmentOptions,
    tick: Tick,
) -> tuple[ContactTable, dict]:
    """The pairs of the line with what is kept of them, by the target or the share that the study
    gives; and the fields of TuneResult on it."""

    def report(step: AreaStep, share: float) -> None:
        tick(0.8 * share, f"{step.share:.0%} of the area  {step.hz:.0f} Hz")

    tune = study.tune
    load = np.ones(len(line)) if options.load is None else options.load
    area = np.zeros(len(line))
    found = patches(line, study.contact.normal == "hard")
    for patch in found:
        area[patch.rows] = patch.loaded
    mirrors = mirrors_of(line, area, load, study.driver.axis, study.driver.pull_direction)
    fade = fade_of(line, area, load, study.driver.axis, tune.order, tune.cell_size, mirrors)
    fade = fade if tune.by == "area" or tune.graded else fade.whole()
    if target_hz is None:
        kept = keep_area(assembly, line, fade, tune.kept_share or 1.0, follow, options)
    else:
        kept = detach_area(assembly, line, fade, target_hz, follow, options, report)
    closed = line.carrying & (load > 0)
    sides = {
        patch.side: _side(patch, closed, area, line, kept.pairs, tune.cell_size) for patch in found
    }
    return kept.pairs, _facts(line, kept, sides, mirrors)


def _facts(
    line: ContactTable,
    kept: AreaDetachment,
    sides: dict[str, results.KeptSide],
    mirrors: Sequence[Mirror],
) -> dict:
    """Fields of TuneResult."""
    front, back = halves(line, kept.pairs.weight > 0)
    return {
        "area": results.KeptArea(
            share=kept.chosen.share,
            hz_per_percent=kept.hz_per_share / 100,
            sides=sides,
            history=kept.history,
            mirrors=tuple(
                results.KeptMirror(normal=tuple(m.normal), noise=m.noise) for m in mirrors
            ),
        ),
        "tuned_pairs": results.Stations(front=front, back=back),
        "history": (),
        "kept_stations": tuple(np.unique(line.station[kept.pairs.carrying]).tolist()),
    }


def _side(
    patch: PressurePatch,
    closed: np.ndarray,
    area: np.ndarray,
    line: ContactTable,
    kept: ContactTable,
    size: float | None,
) -> results.KeptSide:
    unit, factor = UNITS[patch.is_area]
    mine = patch.rows[closed[patch.rows]]
    left = kept.weight[mine] / line.weight[mine]
    cell = cells_in(plane_of(line.select(patch.rows)), size)[closed[patch.rows]]
    return results.KeptSide(
        unit=unit,
        closed=factor * area[mine].sum(),
        kept=factor * (area[mine] * left).sum(),
        cells=len(np.unique(cell)),
        kept_cells=len(np.unique(cell[left > 0])),
    )
