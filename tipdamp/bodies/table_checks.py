"""A user's own table of pairs against the model that it is for: partners, places and normals."""

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.contact_doubts import (
    misplaced,
    mixed_partners,
    node_places,
    opposed_normals,
)
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.faces import boundary_faces, node_normals
from tipdamp.modal.mesh import Mesh
from tipdamp.study.view import Study

OUTWARD = 90.0  # degrees off the surfaces: beyond, n points into the damper


def check_against_model(study: Study, model: ReducedModel, pairs: ContactTable) -> None:
    """InputError where the pairs contradict the positions in a model's dof table, as far as it has
    them, or each other."""
    where, tolerance = f"{study.path}: [contact] pairs", study.contact.tolerance
    blade, damper = node_places(model, pairs)
    apart = mixed_partners(pairs, blade, damper, tolerance) or misplaced(
        pairs, blade, damper, tolerance
    )
    if apart:
        raise InputError(f"{where}, {apart}; [contact] tolerance allows distances that are meant")
    _check_normals(where, pairs)


def check_on_surface(study: Study, meshes: dict[str, Mesh], pairs: ContactTable) -> None:
    """InputError where a normal points into the damper, or a node is not on the surface."""
    where = f"{study.path}: [contact] pairs"
    _check_normals(where, pairs)
    angles = surface_angles(pairs, meshes)
    i = int(angles.argmax())
    if angles[i] > OUTWARD:
        raise InputError(
            f"{where}, pair {i + 1} (side '{pairs.side[i]}', station {pairs.station[i]}, row "
            f"{pairs.row[i]}): n is {angles[i]:.0f} degrees off the surfaces at blade node "
            f"{pairs.blade_node[i]} and damper node {pairs.damper_node[i]} "
            f"({(angles > OUTWARD).sum()} such pairs): n must point out of the damper into the "
            "blade, with t1 x t2 = n"
        )


def unknown_places(model: ReducedModel, pairs: ContactTable) -> list[str]:
    """A sentence where the model does not know where the nodes of the pairs lie."""
    blade, damper = (np.isnan(place).any(axis=1) for place in node_places(model, pairs))
    missing = int(
        (blade & (pairs.blade_body != GROUND) | damper & (pairs.damper_body != GROUND)).sum()
    )
    if not missing:
        return []
    return [
        f"[model] matrices: the dof table has no positions for the nodes of {missing} of "
        f"{len(pairs)} pairs: partners and places of [contact] pairs cannot be checked"
    ]


def _check_normals(where: str, pairs: ContactTable) -> None:
    against = opposed_normals(pairs)
    if against:
        raise InputError(f"{where}, {against}")


def surface_angles(pairs: ContactTable, meshes: dict) -> np.ndarray:
    """(P,) degrees: how far n is off the damper's outward normal or the blade's inward one,
    whichever is worse; of several faces at a node the nearest counts. 180 where a node is not on
    the surface; 0 at contact points, whose n is that of the surfaces."""
    worst = np.zeros(len(pairs))
    for body, bodies, nodes, sign in (
        (DAMPER, pairs.damper_body, pairs.damper_node, 1.0),
        (BLADES, pairs.blade_body, pairs.blade_node, -1.0),
    ):
        mesh = meshes[body]
        there = np.flatnonzero((bodies != GROUND) & ~pairs.on_surface)
        faces = boundary_faces(mesh)
        for i, index in zip(there, mesh.index(nodes[there]), strict=True):
            normals = node_normals(mesh, index, faces)
            cosine = (sign * normals @ pairs.normal[i]).max() if len(normals) else -1.0
            worst[i] = max(worst[i], np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return worst
