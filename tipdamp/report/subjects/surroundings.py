"""What the pictures in three dimensions share: the bodies around the contact, the box and the
direction of view."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.fields.surface import OuterSurface
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing.scene import BLADE, BODY, Segments, Solid, Viewpoint, inside, view
from tipdamp.report.text import MM

NO_SURFACE = (
    " The study starts from matrices: there is no mesh whose surface or mode shapes could be "
    "shown, only the pairs."
)


def surroundings(
    surfaces: Mapping[str, OuterSurface], box: np.ndarray
) -> Iterator[Solid | Segments]:
    """The damper, and of the blades what is near it, light and translucent."""
    for body, surface in surfaces.items():
        place = MM * surface.position
        triangles = inside(place, surface.triangles, box)
        edges = inside(place, surface.edges, box)
        if not len(triangles):
            continue
        near = body == "damper"
        used, triangles = np.unique(triangles, return_inverse=True)
        yield Solid(
            place[used],
            triangles.reshape(-1, 3),
            body,
            BODY if near else BLADE,
            1.0 if near else 0.15,
        )
        if len(edges):
            yield Segments(
                place[edges[:, 0]], place[edges[:, 1]], body, "#8d97a1" if near else "#a9c3d8", 1.5
            )


def view_of(pairs: ContactTable, axis: ArrayLike) -> Viewpoint:
    """Onto both sides; each side counts once, however many pairs it has."""
    return view(
        np.sum([pairs.normal[pairs.side == s].mean(axis=0) for s in pairs.sides], axis=0), axis
    )


def box_of(pairs: ContactTable, surfaces: Mapping[str, OuterSurface], margin: float) -> np.ndarray:
    """(2, 3) mm around the damper and its pairs."""
    return box_around(
        [MM * pairs.position, *(MM * surfaces[b].position for b in surfaces if b == "damper")],
        margin,
    )


def box_around(places: Sequence[np.ndarray], margin: float | None = None) -> np.ndarray:
    """(2, 3) around points [(n, 3)] with a margin: by default a twentieth of the diagonal; 1 around
    a single place."""
    place = np.concatenate(places)
    low, high = place.min(axis=0), place.max(axis=0)
    room = np.linalg.norm(high - low) / 20 if margin is None else margin
    room = room or float((high <= low).all())
    return np.array([low - room, high + room])


def pair_name(pairs: ContactTable, i: int) -> str:
    """Side, station and row of a pair, for the text shown on hover."""
    return f"side {pairs.side[i]}, station {pairs.station[i]}, row {pairs.row[i]}"


def node_numbers(pairs: ContactTable, i: int) -> str:
    """The user's numbers of its nodes; of a contact point its own, and its area."""
    if pairs.on_surface[i]:
        return f"contact point {pairs.damper_node[i]}, {1e6 * pairs.area[i]:.3g} mm²"
    return f"blade node {pairs.blade_node[i]}, damper node {pairs.damper_node[i]}"
