"""Figures of what comes before friction: response without damper, preload along both sides, tuning."""

import numpy as np

from hbm.contact import ContactTable
from tipdamp.loads import rest_name
from tipdamp.report.figure import BLUE, GREEN, GREY, INK, ORANGE, VERMILION, Curve, Figure, Line, Marks, Panel
from tipdamp.report.results import Results
from tipdamp.report.text import hertz, listing, number

ROWS = (BLUE, ORANGE, GREEN, VERMILION)
AXIAL = "axial coordinate (mm)"


def linear(results: Results) -> Figure:
    """Response without damper of both blades."""
    response, free = results["reduce"]["free_response"], results["reduce"]["free_hz"]
    hz = np.array(response["hz"], dtype=float)
    styles = ((BLUE, "solid"), (VERMILION, "dash"))
    curves = [Curve(hz, np.array(y, dtype=float), f"blade {k + 1} ({patch})", *style) for k, ((patch, y), style)
              in enumerate(zip(response["m_per_N"].items(), styles, strict=False))]
    highest = max(c.y.max() for c in curves)
    lowest = max(min(c.y.min() for c in curves), 1e-6 * highest)      # a blade of its own does not move at all
    lines = []
    for name in free:
        left = free[name] == min(free.values())
        lines.append(Line("x", free[name], f"{name.replace('_', ' ')} {hertz(free[name])} Hz", INK, "dot", left=left))
        if results.study.reference.get(f"{name}_hz"):
            value = results.study.reference[f"{name}_hz"]
            lines.append(Line("x", value, f"reference {value:g} Hz", GREY, "dash", "low", left))
    lines = [line for line in lines if hz[0] <= line.value <= hz[-1]]
    zeta = listing(f"{100 * z:g} %" for z in results.study.free.damping_ratio)
    where = (f"Out of phase the blades move at {hertz(free['out_of_phase'])} Hz, in phase at {hertz(free['in_phase'])} "
             "Hz." if free else "None of the modes is of both blades.")
    caption = (f"Linear response of the two blades without damper to a force of 1 N at the excited blade, largest over "
               f"each response patch, damping ratio {zeta}. {where}"
               + results.beside_paper("Corresponds to figure 2"))
    return Figure("linear_without_damper", "Without damper", caption,
                  (Panel("", "frequency (Hz)", "amplitude per force (m/N)", (*curves, *lines), log_y=True,
                         x_range=(hz[0], hz[-1]), y_range=(0.7 * lowest, 3 * highest)),), columns=1)


def preload(results: Results) -> Figure:
    """Nodal preload of the whole patch, row by row."""
    sides = results["preload"]["sides"]
    sums = listing(f"{number(s['sum_N'])} N on side '{name}' (equilibrium {number(s['equilibrium_N'])} N, "
                   f"{s['detached']} open)" for name, s in sides.items())
    worst = max(s["balance_error"] or 0.0 for s in sides.values())
    caption = (f"Normal preload of every node of the whole patch under {rest_name(results.study)} (kn v0) along the "
               f"axis of the damper; filled marks are closed, hollow ones open (negative: the remaining gap times kn). "
               f"The sum is {sums}; "
               f"contact forces and pull balance to {worst:.0e} of the pull. {_ends(results)}"
               + results.beside_paper("Corresponds to figure 9"))
    return Figure("preload", "Preload of the whole patch", caption, _map(results, results.whole))


def load_case(results: Results, case: str) -> Figure:
    """The same under a further load case."""
    facts = results["preload"]["cases"][case]
    sums = listing(f"{number(s['sum_N'])} N on side '{name}' ({s['detached']} open)"
                   for name, s in facts["sides"].items())
    caption = (f"Normal preload of every node of the whole patch under the load case '{case}'; filled marks are "
               f"closed, hollow ones open. The sum is {sums}.")
    return Figure(f"preload_{case}", f"Preload under '{case}'", caption, _map(results, results.loads[case]),
                  row_height=310)


def _map(results, table: ContactTable) -> tuple:
    """One panel for each side, on one scale."""
    top, low = float(table.preload.max()), min(float(table.preload.min()), 0.0)
    span = (low - 0.05 * (top - low) if low < 0 else 0.0, top + 0.08 * (top - low))
    panels = []
    for side in table.sides:
        mine = table.select(table.side == side)
        items = [item for row in np.unique(mine.row) for item in _row(results, mine.select(mine.row == row), int(row))]
        panels.append(Panel(_side_title(results, side), AXIAL, "normal preload of each node (N)",
                            (Line("y", 0.0, dash="solid"), *items), y_range=span))
    return tuple(panels)


def _row(results, pairs: ContactTable, row: int):
    order = np.argsort(results.along(pairs))
    x, y = results.along(pairs)[order], pairs.preload[order]
    color, name = ROWS[row % len(ROWS)], "row 0 (lower edge line)" if row == 0 else f"row {row}"
    closed = y > 0
    symbol = ("circle", "square", "diamond")[row % 3]
    yield Curve(x, y, "", color, width=1.0)
    yield Marks(x[closed], y[closed], name, color, symbol)
    if not closed.all():
        yield Marks(x[~closed], y[~closed], f"{name}, open", color, symbol, filled=False)


def _ends(results) -> str:
    """Ratio of the station sums at the ends to the lowest in the middle third."""
    parts = []
    for side in results.whole.sides:
        _, total = _station_sums(results, results.whole.select(results.whole.side == side))
        third = max(len(total) // 3, 1)
        middle = total[third:len(total) - third].min(initial=np.inf)
        if np.isfinite(middle) and middle > 0:
            parts.append(f"{min(total[0], total[-1]) / middle:.1f} times the middle on side '{side}'")
    return f"Per station, the ends carry at least {listing(parts)}." if parts else ""


def _station_sums(results, pairs):
    """(axial coordinate, force of the closed rows together) of the stations, in the order of the axis."""
    stations = np.unique(pairs.station)
    x = np.array([results.along(pairs)[pairs.station == s].mean() for s in stations])
    total = np.array([np.maximum(pairs.preload[pairs.station == s], 0).sum() for s in stations])
    order = np.argsort(x)
    return x[order], total[order]


def kept(results: Results) -> Figure:
    """What the kept stations carry."""
    table = results.kept
    whole = [_station_sums(results, results.whole.select(results.whole.side == side))[1] for side in table.sides]
    values = np.r_[table.preload[table.carrying], results.whole.preload, np.concatenate(whole)]
    span = (min(1.1 * float(values.min()), 0.0) - 0.04 * float(values.max()), 1.12 * float(values.max()))
    panels = []
    for side in table.sides:
        mine = table.select(table.side == side)
        panels.append(Panel(_side_title(results, side), AXIAL, "normal preload of each node (N)",
                            tuple(_kept_items(results, mine, side)), y_range=span))
    sums = listing(f"{number(s['sum_N'])} N on side '{name}' ({number(s['min_N'], 3)} to {number(s['max_N'], 3)} N, "
                   f"{s['detached']} open)" for name, s in results["tune"]["preload_kept"].items())
    how = {"scaled": "the whole map's part on the kept stations, scaled until it carries the whole pull",
           "resolved": "the static contact problem, solved again on the kept stations"}
    pairs = results["tune"]["tuned_pairs"]
    caption = (f"What the {pairs['front']} + {pairs['back']} kept stations carry: "
               f"{how[results.study.tune.preload]}. The sum is {sums}. "
               "This is the preload of the forced response.")
    return Figure("preload_kept", "Preload of the kept stations", caption, tuple(panels), row_height=310)


def _kept_items(results, mine, side):
    carrying = mine.select(mine.carrying)
    x, whole = _station_sums(results, results.whole.select(results.whole.side == side))
    yield Line("y", 0.0, dash="solid")
    yield Curve(x, whole, "whole patch, sum over the rows", GREY, "dash", 1.2)
    gone = mine.select(~mine.carrying)
    gone = results.along(gone)[~np.isin(gone.station, carrying.station)]
    if len(gone):
        yield Marks(gone, np.zeros(len(gone)), "detached station", GREY, "x", size=6)
    at, force = results.along(carrying), carrying.preload
    stems = np.column_stack([at, at, np.full(len(at), np.nan)]).ravel()
    yield Curve(stems, np.column_stack([np.zeros(len(at)), force, np.full(len(at), np.nan)]).ravel(), "", BLUE,
                width=1.2)
    if (force > 0).any():
        yield Marks(at[force > 0], force[force > 0], "kept pair", BLUE)
    if (force <= 0).any():
        yield Marks(at[force <= 0], force[force <= 0], "kept pair, open at rest", VERMILION, filled=False)


def _side_title(results, side) -> str:
    shape = results.study.sides[side].shape if side in results.study.sides else ""
    return f"side '{side}'" + (f", {shape}" if shape else "")


def tuning(results: Results) -> Figure:
    """Stuck frequency against the number of kept stations, where a target was met by detaching."""
    tune, reference = results["tune"], results.study.reference
    steps = sorted(tune["history"], key=lambda s: s["front"] + s["back"])
    count, hz, mac = (np.array(v, dtype=float) for v in zip(
        *((s["front"] + s["back"], s["hz"], s["mac"]) for s in steps), strict=True))
    chosen = tune["tuned_pairs"]
    at = chosen["front"] + chosen["back"]
    label = f"{chosen['front']} + {chosen['back']}: {hertz(tune['stuck_hz']['tuned'])} Hz"
    target = tune["target_hz"]
    items = [Curve(count, hz, "", BLUE), Marks(count, hz, "tracked mode", BLUE, size=5),
             Line("y", target, f"target {target:g} Hz", VERMILION),
             Marks(np.array([at]), np.array([tune["stuck_hz"]["tuned"]]), "chosen", VERMILION, "diamond", size=11,
                   labels=(label,))]
    known = [(count.max(), reference.get("full_line_hz")), (sum(reference.get(k, 0) for k in ("front", "back")),
                                                            reference.get("tuned_hz"))]
    known = [(n, f) for n, f in known if n and f]
    if known:
        items.append(Marks(*np.array(known, dtype=float).T, "reference", INK, "square", filled=False, size=9))
    seen = [*hz, target, *(f for _, f in known)]
    low, high = min(seen) - 0.12 * np.ptp(seen), max(seen) + 0.06 * np.ptp(seen)
    mode = results.study.tune.follow.replace("_", "-")
    caption = (f"Detaching stations from the middle: frequency of the {mode} mode of the stuck assembly, and its "
               "energy-weighted MAC with the mode without damper (MAC of the blades times their part of the kinetic "
               "energy), by which it is tracked through changes of order. A dip in the MAC marks a crossing with "
               "another mode." + results.beside_paper("Corresponds to the tuning in section 8"))
    return Figure("tuning", "Tuning by detachment", caption, (
        Panel("", "kept stations on each side", "stuck frequency (Hz)", tuple(items),
              y_range=(low, high)),
        Panel("", "kept stations on each side", "energy-weighted MAC", (Curve(count, mac, "", BLUE),
              Marks(count, mac, "", BLUE, size=5)), y_range=(0, 1))))
