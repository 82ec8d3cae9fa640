"""Pictures in three dimensions: preload and contact pressure on the damper, and the pairs with their frames."""

import numpy as np

from hbm.contact import ContactTable
from tipdamp.pressure import patches
from tipdamp.report import modes
from tipdamp.report.scene import (
    BLADE,
    BODY,
    NORMAL,
    TANGENT_1,
    TANGENT_2,
    Points,
    Scale,
    Scene,
    Segments,
    Solid,
    inside,
    view,
)
from tipdamp.report.text import distance, listing, number

MM = 1e3
PULL = "the pull"
NO_SURFACE = (" The study starts from matrices: there is no mesh whose surface or mode shapes could be shown, only the "
              "pairs.")


def preload_on_damper(results) -> Scene:
    """Of the pull and of every further load case."""
    rest = results.study.preload.case or PULL
    return pressure_map({rest: results.whole, **results.loads}, results.surfaces, results.axis)


def pairs_of(results) -> Scene:
    """Of the whole patch."""
    return contact_pairs(results.whole, results.places(results.whole), results.surfaces, results.axis)


def modes_of(results) -> modes.ModeShapes | None:
    """None without meshes: there is no surface that could move."""
    if not results.surfaces or results.model is None:
        return None
    outward = view_of(results.whole, results.axis)["up"] if results.whole is not None else (0.0, 0.0, 1.0)
    return modes.mode_shapes(results.surfaces, results.model, results.shapes, outward, results.axis)


def pressure_map(pairs: dict, surfaces: dict, axis) -> Scene:
    """Preload of {load case: ContactTable} on the damper: colour is pressure (or force per length), stems are pairs."""
    first = next(iter(pairs.values()))
    sides = patches(first)
    top = max(float(table.preload.max()) for table in pairs.values())
    scales = _scales(sides, pairs)
    length = 0.09 * float(np.ptp(first.position @ np.asarray(axis)) or np.ptp(first.position)) * MM
    items = [*surroundings(surfaces, box := box_of(first, surfaces, length))]
    for case, table in pairs.items():
        for patch in sides:
            items += _loaded(table, patch, scales[patch.unit], case)
        items += _stems(table, length / top if top > 0 else 0.0, case)
    caption = ("Colour: " + listing(_meaning(patch) for patch in sides) + ". The stems stand on the pairs along the "
               "contact normal, as long as the preload is large; pairs without a stem are open. Point at a pair for "
               f"its figures. {_totals(sides, pairs)} Click a name to switch it on or off, drag to turn."
               + (NO_SURFACE if not surfaces else ""))
    if len(pairs) == 1:
        items = [_without_case(item) for item in items]
    return Scene("preload_on_damper", "Preload and contact pressure on the damper", caption, tuple(items), box,
                 **view_of(first, axis))


def contact_pairs(pairs: ContactTable, places: dict, surfaces: dict, axis, angles=None) -> Scene:
    """Both nodes of every pair, and t1, t2, n. places {body: (P, 3) m} of the pairs' nodes; angles : (P,) degrees
    between n and the damper's surface, where meshes are there."""
    blade, damper = (MM * places[body] for body in ("blades", "damper"))
    length = _triad_length(damper)
    hover = list(_pair_texts(pairs, places, angles))
    items = [*surroundings(surfaces, box := box_of(pairs, surfaces, 4 * length))]
    for side in pairs.sides:
        mine = pairs.side == side
        texts = tuple(hover[i] for i in np.flatnonzero(mine))
        items += [Points(damper[mine], f"damper nodes, side '{side}'", "#E69F00", 3.5, "diamond", hover=texts),
                  Points(blade[mine], f"blade nodes, side '{side}'", "#0072B2", 5.5, "circle-open", hover=texts)]
    for k, (name, color) in enumerate((("t1, along the axis", TANGENT_1), ("t2, across", TANGENT_2),
                                       ("n, into the blade", NORMAL))):
        items.append(Segments(damper, damper + length * pairs.frame[:, k], name, color, 3.0))
    items.append(Segments(damper, blade, "from node to node", "#222222", 4.0))
    axis = np.asarray(axis, dtype=float)
    end = damper.mean(axis=0) + axis * ((damper - damper.mean(axis=0)) @ axis).max()
    items.append(Segments(end[None], end[None] + 4 * length * axis, "axis of the damper", "#222222", 7.0))
    counts = listing(f"{int((pairs.side == s).sum())} on side '{s}'" for s in pairs.sides)
    caption = (f"The {len(pairs)} contact pairs ({counts}) with their frames: n must point out of the damper into the "
               "blade, t1 along the axis. Point at a node for the node numbers of your meshes, the distance of the two "
               "nodes and the initial gap." + (NO_SURFACE if not surfaces else ""))
    return Scene("contact_pairs", "Contact pairs and their frames", caption, tuple(items), box, **view_of(pairs, axis))


def surroundings(surfaces: dict, box):
    """The damper, and of the blades what is near it, light and translucent."""
    for body, surface in surfaces.items():
        place = MM * surface.position
        triangles = surface.triangles if box is None else inside(place, surface.triangles, box)
        edges = surface.edges if box is None else inside(place, surface.edges, box)
        if not len(triangles):
            continue
        near = body == "damper"
        used, triangles = np.unique(triangles, return_inverse=True)
        yield Solid(place[used], triangles.reshape(-1, 3), body, BODY if near else BLADE, 1.0 if near else 0.15)
        if len(edges):
            yield Segments(place[edges[:, 0]], place[edges[:, 1]], body, "#8d97a1" if near else "#a9c3d8", 1.5)


def view_of(pairs: ContactTable, axis) -> dict:
    """eye and up of a Scene; each side counts once, however many pairs it has."""
    return view(np.sum([pairs.normal[pairs.side == s].mean(axis=0) for s in pairs.sides], axis=0), axis)


def box_of(pairs: ContactTable, surfaces: dict, margin: float) -> np.ndarray:
    """(2, 3) mm around the damper and its pairs."""
    return box_around([MM * pairs.position, *(MM * surfaces[b].position for b in surfaces if b == "damper")], margin)


def box_around(places, margin: float | None = None) -> np.ndarray:
    """(2, 3) around points, [(n, 3)], with a margin: by default a twentieth of the diagonal."""
    place = np.concatenate(places)
    low, high = place.min(axis=0), place.max(axis=0)
    margin = np.linalg.norm(high - low) / 20 if margin is None else margin
    return np.array([low - margin, high + margin])


def _scales(sides, tables):
    high = {}
    for patch in sides:
        for table in tables.values():
            high[patch.unit] = max(high.get(patch.unit, 0.0), float(np.nanmax(patch.load(table.preload))))
    title = {"N/mm²": "pressure (N/mm²)", "N/mm": "force per length (N/mm)"}
    return {unit: Scale(title[unit], value or 1.0) for unit, value in high.items()}


def _loaded(table, patch, scale, case):
    """The patch in colour, a hair above the damper's surface; pieces of a line take the mean of their ends."""
    values, texts = patch.load(table.preload), tuple(_load_texts(table, patch))
    lift = 0.002 * np.ptp(table.position[patch.rows], axis=0).max()
    place = MM * (table.position + lift * table.normal)[patch.rows]
    name = f"side '{patch.side}'"
    if patch.is_area:
        yield Solid(place, patch.cells, name, values=values, scale=scale, hover=texts, case=case)
    yield Points(place, name, size=3.0 if patch.is_area else 6.0, values=values, scale=scale, hover=texts, case=case)


def _stems(table, per_newton, case):
    start = MM * table.position
    closed = table.preload > 0
    end = start + per_newton * np.maximum(table.preload, 0)[:, None] * table.normal
    yield Segments(start[closed], end[closed], "preload of the pairs", "#12355b", 2.5, case)
    if not closed.all():
        texts = tuple(f"side {table.side[i]}, station {table.station[i]}, row {table.row[i]}: open"
                      for i in np.flatnonzero(~closed))
        yield Points(start[~closed], "open pairs", "#D55E00", 2.5, "square-open", hover=texts, case=case)


def _load_texts(table, patch):
    for i, value in zip(patch.rows, patch.load(table.preload), strict=True):
        yield (f"side {table.side[i]}, station {table.station[i]}, row {table.row[i]}\n"
               f"preload {number(table.preload[i])} N, {number(value)} {patch.unit}\n"
               f"blade node {table.blade_node[i]}, damper node {table.damper_node[i]}")


def _meaning(patch) -> str:
    what = "preload over tributary area" if patch.is_area else "preload over length: the pairs are one line"
    return f"side '{patch.side}' {patch.unit} ({what})"


def _totals(sides, tables) -> str:
    parts = []
    for case, table in tables.items():
        sums = listing(f"{number(np.maximum(table.preload[p.rows], 0).sum())} N on side '{p.side}'" for p in sides)
        most = listing(f"{number(float(np.nanmax(p.load(table.preload))))} {p.unit}" for p in sides)
        parts.append(f"Under {case if case == PULL else chr(39) + case + chr(39)}: {sums}, at most {most}.")
    return " ".join(parts)


def _pair_texts(pairs, places, angles):
    apart = places["blades"] - places["damper"]
    u = np.einsum("pij,pj->pi", pairs.frame, apart)
    for i in range(len(pairs)):
        n = ", ".join(f"{v:+.3f}" for v in pairs.frame[i, 2])
        yield (f"side {pairs.side[i]}, station {pairs.station[i]}, row {pairs.row[i]}\n"
               f"blade node {pairs.blade_node[i]}, damper node {pairs.damper_node[i]}\n"
               f"nodes apart: {distance(u[i, 2])} µm along n, {distance(np.hypot(*u[i, :2]))} µm across\n"
               f"initial gap {distance(pairs.gap[i])} µm\nn = ({n})"
               + ("" if angles is None else f", {angles[i]:.1f}° off the damper's surface"))


def _triad_length(place) -> float:
    """Half the usual distance of neighbours, mm."""
    from scipy.spatial import cKDTree

    if len(place) < 2:
        return 1.0
    nearest = cKDTree(place).query(place, k=2)[0][:, 1]
    return 0.6 * float(np.median(nearest)) or 1.0


def _without_case(item):
    from dataclasses import replace

    return replace(item, case="") if hasattr(item, "case") else item
