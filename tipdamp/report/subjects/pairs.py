"""Contact pairs: both nodes of each and its frame t1, t2, n in three dimensions; a table of the
geometry of each side."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tipdamp.checks import only_friction
from tipdamp.fields.surface import OuterSurface
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing.scene import NORMAL, TANGENT_1, TANGENT_2, Points, Scene, Segments
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.axial import named_side
from tipdamp.report.subjects.surroundings import (
    NO_SURFACE,
    box_of,
    node_numbers,
    pair_name,
    surroundings,
    view_of,
)
from tipdamp.report.text import MM, NOTHING, distance, listing, number, sentence
from tipdamp.results.static_results import InspectResult, SideCheck

FULL_SIZE = 60  # pairs whose marks do not hide each other; more have smaller ones
# of the arms of a frame: lines lie in the faces of the damper, which would hide half of them
LIFT = 0.04
COLORS = {"damper": "#E69F00", "blades": "#0072B2"}
CURVED = 0.01  # of the faces of a side: contact beyond them by projections of curved faces
FRAME = (
    ("t1, along the axis", TANGENT_1),
    ("t2, across", TANGENT_2),
    ("n, into the blade", NORMAL),
)


def scene(results: Results) -> Iterator[Scene]:
    """The pairs of the whole patch."""
    if results.whole is not None:
        yield contact_pairs(
            results.whole, results.places(results.whole), results.surfaces, results.axis
        )


def contact_pairs(
    pairs: ContactTable,
    places: Mapping[str, np.ndarray],
    surfaces: Mapping[str, OuterSurface],
    axis: ArrayLike,
    angles: np.ndarray | None = None,
    edges: Mapping[str, np.ndarray] | None = None,
) -> Scene:
    """places {body: (P, 3) m} of the nodes of the pairs; angles (P,) degrees between n and the
    surface of the damper, where meshes are there; edges {body: (e, 2, 3) m} of faces that meet as
    surfaces."""
    length = _triad_length(MM * places["damper"])
    box = box_of(pairs, surfaces, 4 * length)
    counts = listing(
        f"{int((pairs.side == s).sum())} on {named_side(pairs, s)}" for s in pairs.sides
    )
    place = "contact point" if pairs.on_surface.all() else "node"
    caption = (
        f"The {len(pairs)} contact pairs ({counts}) with their frames: n must point out of the "
        f"damper into the blade, t1 along the axis. Point at a {place} for its numbers, the "
        f"distance of the two {place}s and the initial gap." + (NO_SURFACE if not surfaces else "")
    )
    return Scene(
        "contact_pairs",
        "Contact pairs and their frames",
        caption,
        [
            *surroundings(surfaces, box),
            *_faces(pairs, places, edges or {}, length),
            *_nodes(pairs, places, list(_texts(pairs, places, angles))),
            *_frames(pairs, places, axis, length, f"from {place} to {place}"),
        ],
        box,
        *view_of(pairs, axis),
    )


def _faces(
    pairs: ContactTable,
    places: Mapping[str, np.ndarray],
    edges: Mapping[str, np.ndarray],
    length: float,
) -> Iterator[Segments]:
    """Edges of the faces that meet, lifted along the normal of the nearest pair."""
    for body, color in COLORS.items():
        if len(edges.get(body, ())):
            nearest = cKDTree(MM * places["damper"]).query(MM * edges[body].mean(axis=1))[1]
            start, end = MM * edges[body].transpose(1, 0, 2) + LIFT * length * pairs.normal[nearest]
            yield Segments(start, end, f"contact faces of the {body}", color, 1.5)


def _nodes(
    pairs: ContactTable, places: Mapping[str, np.ndarray], hover: Sequence[str]
) -> Iterator[Points]:
    """Both nodes of each pair, side by side."""
    small = min(1.0, (FULL_SIZE / max(len(pairs), 1)) ** 0.5)
    for side in pairs.sides:
        mine = pairs.side == side
        texts = tuple(hover[i] for i in np.flatnonzero(mine))
        what = f"{'points' if pairs.on_surface[mine].all() else 'nodes'}, side '{side}'"
        for body, name, size, symbol in (
            ("damper", "damper", 3.5, "diamond"),
            ("blades", "blade", 5.5, "circle-open"),
        ):
            at, color = MM * places[body][mine], COLORS[body]
            yield Points(at, f"{name} {what}", color, size * small, symbol, hover=texts)


def _frames(
    pairs: ContactTable,
    places: Mapping[str, np.ndarray],
    axis: ArrayLike,
    length: float,
    between: str,
) -> Iterator[Segments]:
    """The arms of each frame, what lies between the nodes of a pair, and the axis."""
    blade, damper = (MM * places[body] for body in ("blades", "damper"))
    above = damper + LIFT * length * pairs.normal
    for k, (name, color) in enumerate(FRAME):
        yield Segments(above, above + length * pairs.frame[:, k], name, color, 3.0)
    yield Segments(damper, blade, between, "#222222", 4.0)
    along, middle = np.asarray(axis, dtype=float), damper.mean(axis=0)
    end = (middle + along * ((damper - middle) @ along).max())[None]
    yield Segments(end, end + 4 * length * along, "axis of the damper", "#222222", 7.0)


def _texts(
    pairs: ContactTable, places: Mapping[str, np.ndarray], angles: np.ndarray | None
) -> Iterator[str]:
    u = np.einsum("pij,pj->pi", pairs.frame, places["blades"] - places["damper"])
    for i in range(len(pairs)):
        n = ", ".join(f"{v:+.3f}" for v in pairs.frame[i, 2])
        yield (
            f"{pair_name(pairs, i)}\n{node_numbers(pairs, i)}\n"
            f"{'points' if pairs.on_surface[i] else 'nodes'} apart: {distance(u[i, 2])} µm along "
            f"n, {distance(np.hypot(*u[i, :2]))} µm across\ninitial gap {distance(pairs.gap[i])} "
            f"µm\nn = ({n})"
            + ("" if angles is None else f", {angles[i]:.1f}° off the damper's surface")
        )


def _triad_length(place: np.ndarray) -> float:
    """About half the usual distance of neighbours, mm."""
    if len(place) < 2:
        return 1.0
    nearest = cKDTree(place).query(place, k=2)[0][:, 1]
    return 0.6 * float(np.median(nearest)) or 1.0


def pairs_table(found: InspectResult) -> Table:
    """Geometry of the pairs of each side."""
    trouble = next((c.trouble for c in found.pair_checks.values() if c.trouble), None)
    return Table(
        "Contact pairs. The mean normal points from the damper into the blade. Spread: largest "
        "angle between a normal and their mean. Off the surface: largest angle between a normal "
        "and that of the faces of damper or blade. Apart: from the node of the damper to that of "
        "the blade. Covered: area of contact between surfaces, and of all faces of the damper "
        "there. Force: on the side per newton of pull, without friction"
        + (f" (not found: {trouble})." if trouble else ".")
        + (f" {sentence(only_friction.said(found.only_friction))}" if found.only_friction else ""),
        [_side(name, check) for name, check in found.pair_checks.items()],
    )


def covered(check: SideCheck) -> str:
    """'143.8 of 144': mm2 of contact, and of the damper's faces on the side, which rounding of
    curved faces may exceed; none where nodes match."""
    if check.area_m2 is None or check.faces_m2 is None:
        return NOTHING
    most = check.faces_m2 if check.area_m2 <= (1 + CURVED) * check.faces_m2 else check.area_m2
    return f"{MM**2 * min(check.area_m2, most):.4g} of {MM**2 * check.faces_m2:.4g}"


def _side(name: str, check: SideCheck) -> dict[str, str]:
    off, apart = check.off_surface_deg, dict.fromkeys(map(distance, check.apart_along_n_m))
    return {
        "side": name,
        "pairs": f"{check.pairs}",
        "stations × rows": f"{check.stations} × {check.rows}",
        "mean normal": f"({', '.join(f'{v:+.3f}' for v in check.mean_normal)})",
        "spread": f"{check.normals_within_deg:.1f}°",
        "off the surface": NOTHING if off is None else f"{off:.1f}°",
        "apart along n (µm)": " to ".join(apart),
        "apart across (µm)": distance(check.apart_across_m),
        "covered (mm²)": covered(check),
        "force (N/N)": number(check.force_per_pull),
    }
