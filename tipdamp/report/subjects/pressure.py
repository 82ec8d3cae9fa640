"""Preload and contact pressure on the damper in three dimensions, at rest and in each load case;
a table of sides in contact along a line: force per length, half-width and peak pressure."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.fields.line_contact import LineContact, shown_patches
from tipdamp.fields.pressure import PressurePatch
from tipdamp.fields.surface import OuterSurface
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing.scene import Item, Points, Scale, Scene, Segments, Solid
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.axial import PER_LENGTH, lines_of
from tipdamp.report.subjects.surroundings import (
    NO_SURFACE,
    box_of,
    node_numbers,
    pair_name,
    surroundings,
    view_of,
)
from tipdamp.report.text import MM, listing, number

PULL = "the pull"
TITLES = {"N/mm²": "pressure (N/mm²)", "N/mm": PER_LENGTH}


def scene(results: Results) -> Iterator[Scene]:
    """One picture of the preload at rest and of every further load case."""
    if results.whole is not None:
        rest = results.study.preload.case or PULL
        tables = {rest: results.whole, **results.loads}
        yield pressure_map(
            tables,
            results.surfaces,
            results.axis,
            results.study.contact.normal == "hard",
            lines_of(results),
        )


def pressure_map(
    tables: Mapping[str, ContactTable],
    surfaces: Mapping[str, OuterSurface],
    axis: ArrayLike,
    hard: bool = False,
    lines: Sequence[LineContact] = (),
) -> Scene:
    """Preload of {load case: ContactTable} on the damper: colour is pressure (or force per length),
    stems are pairs; hard - it is that of pairs without springs; lines - sides that are in contact
    along a line, which show force per length of each station."""
    first = next(iter(tables.values()))
    sides = shown_patches(first, hard, lines)
    along, every = first.position @ np.asarray(axis), np.ptp(first.position, axis=0).max()
    length = 0.09 * MM * float(np.ptp(along) or every) or 1.0  # of a single pair
    box = box_of(first, surfaces, length)
    caption = (
        "Colour: "
        + listing(_meaning(patch) for patch in sides)
        + ". Each stem stands on a pair along the contact normal, its length proportional to the "
        "preload; pairs without a stem are open. Point at a pair for its values. "
        f"{_totals(sides, tables)} Click a name to switch it on or off, drag to turn."
        + (NO_SURFACE if not surfaces else "")
    )
    return Scene(
        "preload_on_damper",
        "Preload and contact pressure on the damper",
        caption,
        [*surroundings(surfaces, box), *_preloads(tables, sides, length)],
        box,
        *view_of(first, axis),
    )


def _preloads(
    tables: Mapping[str, ContactTable], sides: Sequence[PressurePatch], length: float
) -> Iterator[Item]:
    """Patches and stems of each load case, the longest of this length."""
    top = max(float(table.preload.max()) for table in tables.values())
    scales = _scales(sides, tables)
    for case, table in tables.items():
        shown: list[Item] = [
            item for patch in sides for item in _loaded(table, patch, scales[patch.unit])
        ]
        shown += _stems(table, length / top if top > 0 else 0.0)
        yield from (replace(item, case=case) for item in shown) if len(tables) > 1 else shown


def _scales(sides: Sequence[PressurePatch], tables: Mapping[str, ContactTable]) -> dict[str, Scale]:
    """One scale for each unit, common to all sides and load cases."""
    high = {
        unit: max(
            float(np.nanmax(patch.load(table.preload)))
            for patch in sides
            if patch.unit == unit
            for table in tables.values()
        )
        for unit in {patch.unit for patch in sides}
    }
    return {unit: Scale(TITLES[unit], value or 1.0) for unit, value in high.items()}


def _loaded(table: ContactTable, patch: PressurePatch, scale: Scale) -> Iterator[Solid | Points]:
    """The patch in colour, a hair above the damper's surface; pieces of a line take the mean of
    their ends."""
    values, texts = patch.load(table.preload), tuple(_texts(table, patch))
    lift = 0.002 * np.ptp(table.position[patch.rows], axis=0).max()
    place = MM * (table.position + lift * table.normal)[patch.rows]
    name = f"side '{patch.side}'"
    if patch.is_area:
        yield Solid(place, patch.cells, name, values=values, scale=scale, hover=texts)
    yield Points(
        place, name, size=3.0 if patch.is_area else 6.0, values=values, scale=scale, hover=texts
    )


def _stems(table: ContactTable, mm_per_newton: float) -> Iterator[Segments | Points]:
    start = MM * table.position
    closed = table.preload > 0
    end = start + mm_per_newton * np.maximum(table.preload, 0)[:, None] * table.normal
    yield Segments(start[closed], end[closed], "preload of the pairs", "#12355b", 2.5)
    if not closed.all():
        texts = tuple(f"{pair_name(table, i)}: open" for i in np.flatnonzero(~closed))
        yield Points(start[~closed], "open pairs", "#D55E00", 2.5, "square-open", hover=texts)


def _texts(table: ContactTable, patch: PressurePatch) -> Iterator[str]:
    for i, value in zip(patch.rows, patch.load(table.preload), strict=True):
        yield (
            f"{pair_name(table, i)}\npreload {number(table.preload[i])} N, {number(value)} "
            f"{patch.unit}\n{node_numbers(table, i)}"
        )


def _meaning(patch: PressurePatch) -> str:
    what = "preload over area" if patch.is_area else "preload over length, as the pairs form a line"
    if patch.stations:
        return (
            f"side '{patch.side}' {patch.unit} (preload of a station over length: a line contact)"
        )
    by = (
        "tributary"
        if np.allclose(patch.loaded, patch.tributary)
        else "in the ratio of the nodal stiffness"
    )
    return f"side '{patch.side}' {patch.unit} ({what}, {by})"


def _totals(sides: Sequence[PressurePatch], tables: Mapping[str, ContactTable]) -> str:
    parts = []
    for case, table in tables.items():
        sums = listing(
            f"{number(p.carried(table.preload).sum())} N on side '{p.side}'" for p in sides
        )
        most = listing(f"{number(float(np.nanmax(p.load(table.preload))))} {p.unit}" for p in sides)
        under = case if case == PULL else f"'{case}'"
        parts.append(f"Under {under}: {sums}, at most {most}.")
    return " ".join(parts)


def line_tables(results: Results) -> Iterator[Table]:
    """Force per length, half-width and peak pressure station by station, one table for each side
    in contact along a line."""
    for line in lines_of(results):
        force = results.whole.preload  # type: ignore[union-attr]
        rows = zip(
            line.along, line.load(force), line.half_width(force), line.peak(force), strict=True
        )
        yield Table(
            f"Line contact on side '{line.side}', R = {MM * line.radius:.4g} mm: force per length "
            "under the preload, and half-width and peak pressure of Hertz for it. A strip in "
            "contact so narrow lies between the nodes: nodal force over area is no pressure. Over "
            f"the {number(MM * line.length[line.loaded(force)].sum())} mm that carry the mean is "
            f"{number(1e-3 * line.mean_load(force))} N/mm, of which Hertz makes "
            f"{number(1e-6 * line.mean_peak(force))} MPa; where few points lie near the line, "
            "stations scatter about that with the mesh.",
            [
                {
                    "along the axis (mm)": number(MM * round(at, 9)),
                    "N/mm": number(1e-3 * load),
                    "half-width (mm)": number(MM * half),
                    "peak pressure (MPa)": number(1e-6 * peak),
                }
                for at, load, half, peak in rows
            ],
        )
