"""Contact sides of a study as surfaces: which sides do not match node by node, their faces and
contact points."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.faces import face_corners, face_keys
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.facets import Surface, facets
from tipdamp.static_contact.surfaces.pairing import Side, matches
from tipdamp.static_contact.surfaces.pick import FacePick, faces_of
from tipdamp.static_contact.surfaces.points import (
    FacingSides,
    MeshPoints,
    check_faces,
    surface_contact,
)
from tipdamp.study.view import Study


class SurfaceContact(NamedTuple):
    """pairs - of the sides that meet as surfaces, or of all; points {body: MeshPoints} on either
    mesh."""

    pairs: ContactTable
    points: dict[str, MeshPoints]


def named_side(study: Study, name: str) -> Side:
    """A side with the names of its groups; faces picked by geometry are the group "[contact.NAME]
    blade"."""
    side = study.sides[name]
    blade, damper = (
        f"[contact.{name}] {what}" if isinstance(faces, FacePick) else faces
        for what, faces in (("blade", side.blade), ("damper", side.damper))
    )
    return Side(name, blade, damper, BLADES, DAMPER)


def with_picked(study: Study, meshes: dict[str, Mesh]) -> dict[str, Mesh]:
    """The meshes with the groups that the study picks by geometry: their nodes and faces.
    InputError where there is no such face."""
    found = dict(meshes)
    for name, side in study.sides.items() if not study.contact.pairs else ():
        named = named_side(study, name)
        for body, other, what, chosen, group in (
            (BLADES, DAMPER, "blade", side.blade, named.blade),
            (DAMPER, BLADES, "damper", side.damper, named.damper),
        ):
            if isinstance(chosen, FacePick):
                faces = chosen.faces(meshes[body], meshes[other])
                if not any(map(len, faces)):
                    why = chosen.why_none(
                        meshes[body], meshes[other], length_text(study.length_unit)
                    )
                    check_faces(named, what, group, meshes[body], faces, why)
                found[body] = with_faces(found[body], group, faces)
    return found


def on_surfaces(study: Study, meshes: dict[str, Mesh]) -> list[str]:
    """Names of the sides that meet as surfaces: all of method 'surfaces'; with 'auto' those whose
    nodes do not match and whose stiffness is not per node."""
    method, found = study.contact.method, []
    for name, side in study.sides.items() if not study.contact.pairs and method != "nodes" else ():
        if method == "surfaces" or not (
            side.per_node
            or matches(
                meshes[BLADES], meshes[DAMPER], named_side(study, name), study.contact.tolerance
            )
        ):
            found.append(name)
    return found


def surface_points(study: Study, meshes: dict[str, Mesh]) -> SurfaceContact | None:
    """Pairs and points of the sides that meet as surfaces; None where there are none."""
    surfaces = []
    for name in on_surfaces(study, meshes):
        side, faces = named_side(study, name), {}
        for body, what, group in ((BLADES, "blade", side.blade), (DAMPER, "damper", side.damper)):
            faces[body] = faces_of(meshes[body], group)
            check_faces(side, what, group, meshes[body], faces[body])
        surfaces.append(
            FacingSides(side, *(Surface(meshes[body], faces[body]) for body in (BLADES, DAMPER)))
        )
    if not surfaces:
        return None
    pairs, *points = surface_contact(
        surfaces,
        axis=study.driver.axis,
        pull=study.driver.pull_direction,
        closed=study.contact.distance == "closed",
        shown=length_text(study.length_unit),
    )
    return SurfaceContact(pairs, dict(zip((BLADES, DAMPER), points, strict=True)))


def damper_areas(study: Study, meshes: dict[str, Mesh]) -> dict[str, float]:
    """{side: m2} of all faces of the damper on the sides that meet as surfaces."""
    damper = meshes[DAMPER]
    return {
        name: sum(
            float(kind.area.sum())
            for kind in facets(Surface(damper, faces_of(damper, named_side(study, name).damper)))
        )
        for name in on_surfaces(study, meshes)
    }


def contact_edges(study: Study, meshes: dict[str, Mesh]) -> dict[str, np.ndarray]:
    """{"blades", "damper": (e, 2, 3) m} of the edges of the faces that meet as surfaces, for
    pictures."""
    found: dict[str, list[np.ndarray]] = {
        BLADES: [np.empty((0, 2, 3))],
        DAMPER: [np.empty((0, 2, 3))],
    }
    for name in on_surfaces(study, meshes):
        side = named_side(study, name)
        for body, group in ((BLADES, side.blade), (DAMPER, side.damper)):
            for faces in faces_of(meshes[body], group):
                corners = faces[:, : face_corners(faces.shape[1])]
                edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
                found[body].append(meshes[body].position[np.unique(np.sort(edges, axis=1), axis=0)])
    return {body: np.concatenate(edges) for body, edges in found.items()}


def with_faces(mesh: Mesh, group: str, faces: list[np.ndarray]) -> Mesh:
    """The mesh with a group of faces (f, k) node indices."""
    nodes = np.unique(np.concatenate([f.ravel() for f in faces]))
    keys = np.concatenate([face_keys(mesh.node[f]) for f in faces])
    return replace(
        mesh,
        groups={**mesh.groups, group: mesh.node[nodes]},
        dimension={**mesh.dimension, group: 2},
        face_groups={**mesh.face_groups, group: keys},
    )


def length_text(unit: float) -> Callable[[float], str]:
    """How a length in m is written in the study's own unit, whose length is `unit` m."""
    name = "m" if unit == 1 else "mm"
    return lambda metres: f"{metres / unit:.3g} {name}"
