"""Inside the contacts: states over frequency, energy of a period at the peaks, where friction takes
it, and the loops there."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.branches import failures
from tipdamp.hbm.drawing.figure import (
    COMPONENTS,
    DARK,
    GREY,
    INK,
    ORANGE,
    PALE,
    SEQUENCE,
    Band,
    Curve,
    Figure,
    Item,
    Line,
    Marks,
    Panel,
    Tiles,
)
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import in_colors, level_title, orders_of
from tipdamp.report.subjects.axial import (
    ACROSS,
    AXIAL,
    across,
    by_point,
    middles,
    of_side,
    parted,
    side_title,
    sums,
    with_room,
)
from tipdamp.report.text import MICRO, MM2, hertz, listing, number, percent
from tipdamp.results.loops import Loops
from tipdamp.results.response_results import PeakCycle

MOST_PAIRS = 60  # rows of the state map that can be told apart
SHOWN = 12  # pairs with the largest friction work; the files of the stage `cycles` hold all


def states(results: Results) -> Iterator[Figure]:
    """Shares of stick, slip and open, one panel for each level with a solved point, from the
    largest, at the largest H."""
    cases = results.solved
    if not cases:
        return
    pairs, band = cases[0].curve.share_stick.shape[1], tuple(results.study.respond.band)
    yield Figure(
        "contact_states",
        "Stick, slip and open",
        f"Contact states over frequency at {orders_of(cases)}: share of the cycle in which each of "
        f"the {pairs} kept pairs sticks, slips or is open, summed over the pairs. "
        f"{_where_slip_begins(cases)}",
        [_shares(case, pairs, band) for case in reversed(cases)],
        columns=3,
        row_height=250,
    )


def _shares(case: ReportedCurve, pairs: int, band: tuple) -> Panel:
    curve, hz = case.curve, case.curve.frequency
    stick, slip, opened = (
        s.sum(axis=1) for s in (curve.share_stick, curve.share_slip, curve.share_open)
    )
    items = [
        Band(hz, np.zeros(len(hz)), opened, "open", DARK, 1.0),
        Band(hz, opened, opened + slip, "slip", ORANGE, 1.0),
        Band(hz, opened + slip, opened + slip + stick, "stick", PALE, 1.0),
        *failures(case.curve, opened + slip, case.facts.complete),
    ]
    return Panel(
        level_title(case), "frequency (Hz)", "pairs", items, y_range=(0, pairs), x_range=band
    )


def _where_slip_begins(cases: Sequence[ReportedCurve]) -> str:
    slipping = [case.Fe for case in cases if case.facts.slipping_pairs]
    if not slipping:
        return "No pair slips at any level."
    stuck = [f"{case.Fe:g}" for case in cases if case.Fe < min(slipping)]
    return (
        f"No pair slips at {listing(stuck)} N; slip begins at {min(slipping):g} N."
        if stuck
        else "Pairs slip at every level."
    )


def energies(results: Results) -> Iterator[Table]:
    """One row for each curve."""
    curves = results.cycles.curves if results.cycles is not None else ()
    if curves:
        yield Table(
            "Energy of one period at the highest point of each curve: what the excitation puts in "
            "is lost in the damping of the structure and in friction. Friction is taken from the "
            "slip of each contact in time, not from harmonics, so that the error of the balance "
            "is a check of the solution. Ratio: the damping ratio of the structure alone in this "
            "motion, which is that of the study with every pair closed.",
            [_energy(one) for one in sorted(curves, key=lambda c: (c.H, c.Fe_N))],
        )


def _energy(one: PeakCycle) -> dict[str, str]:
    return {
        "H": f"{one.H}",
        "Fe (N)": f"{one.Fe_N:g}",
        "at (Hz)": hertz(one.hz),
        "input (µJ)": number(one.input_J, 4, MICRO),
        "damping (µJ)": number(one.damping_J, 4, MICRO),
        "ratio": percent(one.damping_ratio, 2).lstrip("+"),
        "friction (µJ)": number(sum(one.friction_J.values()), 4, MICRO),
        "friction share": percent(one.friction_share, 1).lstrip("+"),
        "error": number(one.error, 1),
    }


def friction_work(results: Results) -> Iterator[Figure]:
    """Friction work along the axis, a panel for each side; states at the largest level; both at the
    largest H."""
    if results.cycles is None or results.kept is None or not results.periods:
        return
    names, sides = results.cycles.pairs, results.kept.sides
    kept = results.kept.select(results.kept.carrying)
    if any(one.friction_share > 0 for one in results.cycles.curves):
        yield Figure(
            "friction_work",
            "Friction work of the pairs",
            "Energy that friction takes in each period at the peak, "
            f"{orders_of(results.periods)}, each level in its colour: sum over the rows of each "
            "station; of contact points that lie on no lines across the axis, each over its area.",
            [_work(results, names, kept, side) for side in sides],
            row_height=310,
        )
        yield _map(results, names, kept, sides)
        if len(names) <= MOST_PAIRS:
            yield _states(results.solved[-1], names, tuple(results.study.respond.band))


def _work(results: Results, pairs: Sequence[str], kept: ContactTable, side: str) -> Panel:
    mine = of_side(kept, side)
    names = np.array(pairs)[kept.side == side].tolist()
    items: list[Item] = [Line("y", 0.0, dash="solid")]
    x, alone = middles(results, mine), by_point(results, kept)
    for one, color in in_colors(results.periods):
        work = MICRO * np.array([one.friction_J[name] for name in names])
        level = f"Fe = {one.Fe_N:g} N"
        if alone:
            over_area = work / (MM2 * mine.area)
            items.append(Marks(results.along(mine), over_area, level, color, size=5))
            continue
        total = sums(mine, work)
        along, parts = parted(np.unique(mine.station), x, total)
        items += [Curve(along, parts, "", color), Marks(x, total, level, color, size=5)]
    unit = "µJ/mm²" if alone else "µJ"
    return Panel(side_title(results, side), AXIAL, f"friction work ({unit} per period)", items)


def _map(
    results: Results, names: Sequence[str], kept: ContactTable, sides: Sequence[str]
) -> Figure:
    """A panel for each side, at the largest level."""
    one = results.periods[-1]
    work = MICRO * np.array([one.friction_J[name] for name in names])
    return Figure(
        "friction_map",
        "Friction work over the contact sides",
        f"Energy that friction takes in each pair in one period at the peak, Fe = {one.Fe_N:g} N, "
        f"H = {one.H}: stations along the axis, rows across the side (0 is the lower edge), blank "
        "without a kept pair; points that lie on no such lines where they are on the side, each "
        "over its area.",
        [
            (_points if by_point(results, kept) else _tiles)(results, kept, side, work)
            for side in sides
        ],
        row_height=240,
    )


def _points(results: Results, kept: ContactTable, side: str, work: np.ndarray) -> Panel:
    """Every point where it is on its side, its colour by its work over its area."""
    mine = of_side(kept, side)
    over_area, heights = work[kept.side == side] / (MM2 * mine.area), across(results, mine)
    bounds = np.linspace(0.0, float(over_area.max()) or 1.0, len(SEQUENCE) + 1)
    of = np.clip(np.digitize(over_area, bounds) - 1, 0, len(SEQUENCE) - 1)
    items = [
        Marks(
            results.along(mine)[of == k],
            heights[of == k],
            f"'{side}': {number(bounds[k], 2)} to {number(bounds[k + 1], 2)} µJ/mm²",
            color,
            size=8,
        )
        for k, color in enumerate(SEQUENCE)
        if (of == k).any()
    ]
    return Panel(side_title(results, side), AXIAL, ACROSS, items, y_range=with_room(heights))


def _tiles(results: Results, kept: ContactTable, side: str, work: np.ndarray) -> Panel:
    mine = of_side(results.whole if results.whole is not None else kept, side)
    known = kept.side == side
    stations, rows = np.unique(mine.station), np.unique(mine.row)
    x = middles(results, mine)
    values = np.full((len(rows), len(stations)), np.nan)
    place = np.searchsorted(rows, kept.row[known]), np.searchsorted(stations, kept.station[known])
    values[place] = work[known]
    order, top = np.argsort(x), float(work.max()) or 1.0
    tiles = Tiles(x[order], rows.astype(float), values[:, order], "µJ per period", top)
    return Panel(side_title(results, side), AXIAL, "row across the side", [tiles], whole_y=True)


def _states(case: ReportedCurve, names: Sequence[str], band: tuple) -> Figure:
    curve = case.curve
    hz, items = curve.frequency, list[Item]()
    for row in range(len(names)):
        floor = np.full(len(hz), float(row))
        slip, opened = (0.9 * share[:, row] for share in (curve.share_slip, curve.share_open))
        items += [
            Line("y", row, color=GREY, dash="solid"),
            Band(hz, floor, floor + opened, "open", DARK, 1.0),
            Band(hz, floor + opened, floor + opened + slip, "slip", ORANGE, 1.0),
        ]
    panel = Panel(
        f"Fe = {case.Fe:g} N, H = {case.H}",
        "frequency (Hz)",
        "kept pair",
        items,
        x_range=band,
        y_range=(-0.3, len(names) + 0.3),
        y_names=names,
    )
    return Figure(
        "state_map",
        "States of the pairs over frequency",
        "Share of the cycle in which each kept pair slips or is open, as the height of its row "
        "at the largest level: an empty row sticks, a full one slips or is open all the time.",
        [panel],
        columns=1,
        row_height=max(260, 26 * len(names)),
    )


def hysteresis(results: Results) -> Iterator[Figure]:
    """At the peak of the largest level, a panel for each pair that takes most energy, tangential
    force over motion; and their normal forces in time."""
    if not results.periods:
        return
    one = results.periods[-1]
    loops = results.loops[one.file]
    work = np.array([one.friction_J[name] for name in loops.pairs])
    most = np.argsort(-work, kind="stable")[:SHOWN]
    chosen = np.sort(most[work[most] > 1e-3 * work.max()]).tolist() or [0]
    what = f"at the highest point of Fe = {one.Fe_N:g} N, H = {one.H} ({one.hz:.1f} Hz)"
    tangents = [k for k, name in enumerate(loops.components) if name != "n"]
    if tangents:
        yield Figure(
            "hysteresis",
            "Hysteresis loops",
            f"Tangential force over the relative motion about its mean {what}, of the "
            f"{len(chosen)} pairs in which friction takes most: "
            f"{listing(loops.components[k] for k in tangents)} (t1 along the axis of the damper, "
            "t2 across). The area of a loop is the friction work of a period. The files "
            "cycles/*.npz hold every pair and level.",
            [_loop(loops, i, tangents) for i in chosen],
            columns=4,
            row_height=230,
        )
    if "n" in loops.components:
        yield Figure(
            "normal_force",
            "Normal force of the pairs",
            f"Normal force over one period {what}; 0 where a pair is open.",
            [_normal(loops, i) for i in chosen],
            columns=4,
            row_height=200,
        )


def _loop(loops: Loops, i: int, tangents: Sequence[int]) -> Panel:
    motion = MICRO * (loops.motion[:, i] - loops.motion[:-1, i].mean(axis=0))
    items = [
        Curve(motion[:, k], loops.force[:, i, k], name, COMPONENTS[name])
        for k, name in enumerate(loops.components)
        if k in tangents
    ]
    return Panel(loops.pairs[i], "motion (µm)", "force (N)", items)


def _normal(loops: Loops, i: int) -> Panel:
    force = loops.force[:, i, loops.components.index("n")]
    return Panel(
        loops.pairs[i],
        "time (periods)",
        "force (N)",
        [Curve(loops.time / loops.time[-1], force, "normal force", INK)],
        x_range=(0.0, 1.0),
        y_range=(min(0.0, 1.1 * float(force.min())), max(0.0, 1.15 * float(force.max())) or 1.0),
    )
