"""Preload of the whole patch: nodal forces along both sides at rest and in each load case; tables
of the contact stiffness under it, of the load cases and of the full model."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from tipdamp.bodies.loads import case_pull, rest_load
from tipdamp.fields.line_contact import LineContact
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.figure import (
    Figure,
    Item,
    Line,
    Marks,
    Panel,
)
from tipdamp.hbm.drawing.preload_items import (
    ROWS,
    SYMBOLS,
    cut_marks,
    lowest_shown,
    row_items,
)
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.axial import (
    AXIAL,
    PER_LENGTH,
    lines_of,
    load_of,
    named_side,
    of_side,
    side_title,
    station_sums,
)
from tipdamp.report.text import NOTHING, listing, number
from tipdamp.results.static_results import SideLoad, SideStiffness
from tipdamp.study.schema import LoadCase


def at_rest(results: Results) -> Iterator[Figure]:
    """The map under the pull."""
    if results.preload is None or results.whole is None:
        return
    sides = results.preload.sides
    sums = listing(
        f"{number(s.sum_N)} N on {named_side(results.whole, name)} "
        f"(equilibrium {number(s.equilibrium_N)} N, "
        f"{s.detached} open)"
        for name, s in sides.items()
    )
    worst = max(s.balance_error or 0.0 for s in sides.values())
    caption = (
        f"{_what(results, results.whole)} of the whole patch under "
        f"{rest_load(results.study).name}, along the axis of the damper. Filled marks are closed "
        "pairs, hollow ones open (negative: kn times the remaining gap; crosses at the lower end "
        "of the axis lie below it). The sum "
        f"is {sums}; contact forces and load balance to {number(worst, 1)} of the load. "
        f"{_ends(results, results.whole)}" + results.beside_paper("Corresponds to figure 9")
    )
    yield Figure("preload", "Preload of the whole patch", caption, panels(results, results.whole))


def of_load_cases(results: Results) -> Iterator[Figure]:
    """One map for each further load case."""
    for case, facts in (results.preload.cases if results.preload else {}).items():
        sums = listing(
            f"{number(s.sum_N)} N on {named_side(results.loads[case], name)} ({s.detached} open)"
            for name, s in facts.sides.items()
        )
        caption = (
            f"{_what(results, results.loads[case])} of the whole patch in the load case '{case}'. "
            f"Filled marks are closed pairs, hollow ones open. The sum is {sums}."
        )
        yield Figure(
            f"preload_{case}",
            f"Preload in the load case '{case}'",
            caption,
            panels(results, results.loads[case]),
            row_height=310,
        )


def _what(results: Results, table: ContactTable) -> str:
    if not table.on_surface.all():
        return "Normal preload of every node"
    lines = [f"'{line.side}'" for line in _lines(results, table)]
    if not lines:
        return "Contact pressure at every contact point"
    per_length = f"Force per length of every station on side {listing(lines)}, a line contact,"
    every = len(lines) == len(table.sides)
    return per_length if every else f"{per_length} and contact pressure at every other point"


def panels(results: Results, table: ContactTable) -> list[Panel]:
    """One panel for each side, on one scale; those of contact points along a line on another."""
    load, name = load_of(table)
    lines = {line.side: line.load(table.preload) / 1e3 for line in _lines(results, table)}
    others = load[~np.isin(table.side, list(lines))]
    low = lowest_shown(others) if len(others) else 0.0
    span = _span(others, low)
    panels = []
    for side in table.sides:
        mine, label, ends = of_side(table, side), name, span
        items: list[Item] = [Line("y", 0.0, dash="solid")]
        if side in lines:
            label, ends = PER_LENGTH, _span(np.concatenate(list(lines.values())), 0.0)
            items += _stations(results, mine, lines[side])
        elif table.on_surface.all():
            items += _points(results, mine, load[table.side == side], low)
        else:
            for row in np.unique(mine.row):
                items += _row(results, mine.select(mine.row == row), int(row), low)
        panels.append(Panel(side_title(results, side), AXIAL, label, items, y_range=ends))
    return panels


def _lines(results: Results, table: ContactTable) -> list[LineContact]:
    """Sides of contact points along a line: the pressure at a point, which is force over area,
    would follow the mesh there."""
    return lines_of(results) if table.on_surface.all() else []


def _span(load: np.ndarray, low: float) -> tuple[float, float]:
    top = float(load.max(initial=0.0))
    return low - 0.05 * (top - low) if low < 0 else 0.0, top + 0.08 * (top - low)


def _stations(results: Results, mine: ContactTable, load: np.ndarray) -> Iterator[Item]:
    """Force per length of each station of a side, in the order of the axis."""
    along, _ = station_sums(results, mine)
    yield from row_items(along, load, "station", 0, 0.0)


def _points(
    results: Results, pairs: ContactTable, pressure: np.ndarray, low: float
) -> Iterator[Item]:
    """Contact points of an unlike mesh lie in no rows: from the lower third of the side to the
    upper one."""
    height = pairs.position @ np.array(results.study.driver.pull_direction)
    third = np.minimum(3 * (height - height.min()) / max(float(np.ptp(height)), 1e-300), 2).astype(
        int
    )
    for k, name in enumerate(("lower third", "middle", "upper third")):
        for closed, more in ((True, ""), (False, ", open")):
            mine = (third == k) & ((pressure > 0) == closed) & (pressure >= low)
            if mine.any():
                yield Marks(
                    results.along(pairs)[mine],
                    pressure[mine],
                    name + more,
                    ROWS[k],
                    SYMBOLS[k],
                    filled=closed,
                )
    yield from cut_marks(results.along(pairs), pressure, low)


def _row(results: Results, pairs: ContactTable, row: int, low: float) -> Iterator[Item]:
    name = f"row {row}" + " (lower edge line)" * (row == 0)
    return row_items(results.along(pairs), pairs.preload, name, row, low)


def _ends(results: Results, whole: ContactTable) -> str:
    """Ratio of the station sums at the ends of the damper to the lowest in the middle third."""
    parts = []
    for side in whole.select(~whole.stops).sides:
        _, total = station_sums(results, of_side(whole, side))
        third = max(len(total) // 3, 1)
        middle = total[third : len(total) - third].min(initial=np.inf)
        ends = min(total[0], total[-1])
        if np.isfinite(middle) and middle > 0 and ends > 0:
            parts.append(f"{ends / middle:.1f} times the middle on side '{side}'")
    return f"Per station, the ends carry at least {listing(parts)}." if parts else ""


def stiffness(results: Results) -> Iterator[Table]:
    """Contact stiffness of each side by the ways that lead to it, where there is more to say than
    what the study gives."""
    made = results.preload.stiffness if results.preload is not None else {}
    if not any(len(one.ways) > 1 for one in made.values()):
        return
    compared = any(way.way == "reference" for one in made.values() for way in one.ways)
    place = (
        "contact point" if results.whole is not None and results.whole.on_surface.all() else "node"
    )
    yield Table(
        f"Contact stiffness per {place} (mean of the side): what the study computes with, what it "
        f"was made from{', and the reference of the study' * compared}. Smooth half-spaces are an "
        "upper bound; real contacts are softer.",
        [row for side, one in made.items() for row in _ways(side, one, compared)],
        left=(0, 1, 4 + compared),
    )


def _ways(side: str, one: SideStiffness, compared: bool) -> Iterator[dict[str, str]]:
    reference = next((w.kn_N_per_m for w in one.ways if w.way == "reference"), None)
    for way in one.ways:
        ratio = NOTHING if reference is None else number(way.kn_N_per_m / reference, 3)
        yield {
            "side": f"'{side}'",
            "way": way.way,
            "kn (N/µm)": number(way.kn_N_per_m, 3, 1e-6),
            "kt (N/µm)": number(way.kt_N_per_m, 3, 1e-6),
            **({"kn over reference": ratio} if compared else {}),
            "": "in use" if way.in_use else "",
        }


def full_model(results: Results) -> Iterator[Table]:
    """The preload on the full model beside preload.csv, one row for each side, where it was solved
    for this preload."""
    full = results.full
    if full is None:
        return
    where = f", on {full.ranks} ranks" if full.ranks > 1 else ""
    yield Table(
        f"Preload by Newton's method on the unreduced bodies ({full.dofs} dofs{where}; residual "
        f"{full.residual:.1e} of the load) beside that of preload.csv: largest difference of a "
        f"pair {full.difference:.1e} of the largest force.",
        [
            {
                "side": side,
                "full model (N)": number(s.sum_N, 6),
                "preload.csv (N)": number(s.condensed_N, 6),
                "open pairs": f"{s.open}",
                "largest difference (N)": f"{s.largest_difference_N:.1e}",
            }
            for side, s in full.sides.items()
        ],
    )


def load_cases(results: Results) -> Iterator[Table]:
    """Side forces at rest and in every further load case, where the study has such."""
    preload, whole = results.preload, results.whole
    if preload is None or whole is None or not results.loads:
        return
    study, names = results.study, whole.sides
    case = study.preload.case
    rest = f"{case} (of the response)" if case else "the pull"
    rows = [_case(rest, "" if case else f"{study.driver.pull:g}", preload.sides, names)]
    for name, facts in preload.cases.items():
        what = f"{name}: {_content(study.loads[name])}"
        rows.append(_case(what, f"{case_pull(study, name):g}", facts.sides, names))
    yield Table(
        "Preload of the whole patch in every load case: sum and largest force of the pairs of "
        "each side, and the number of open pairs.",
        rows,
    )


def _case(
    what: str, pull: str, found: Mapping[str, SideLoad], names: Sequence[str]
) -> dict[str, str]:
    row = {"load case": what, "pull (N)": pull}
    for n in names:
        row[f"'{n}', sum (N)"] = number(found[n].sum_N)
        row[f"'{n}', largest (N)"] = number(found[n].max_N)
        row[f"'{n}', open"] = f"{found[n].detached}"
    return row


def _content(load: LoadCase) -> str:
    """What a load case holds beside the pull."""
    parts = [f"{load.speed:g} rad/s"] if load.speed else []
    if any(load.gravity):
        parts.append(f"gravity ({', '.join(f'{v:g}' for v in load.gravity)}) m/s²")
    for what, given in (
        ("forces", load.forces),
        ("pressure", load.pressure),
        ("traction", load.traction),
    ):
        parts += [f"{what} on {body}, '{group}'" for body, group, *_ in given]
    return listing(parts) or "another pull"
