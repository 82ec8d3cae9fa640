"""Pieces of a mesh that share no node: each of the damper's needs contact and load of its own, or
nothing holds it."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.bodies import DAMPER
from tipdamp.bodies.loads import Loads
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body, parts, piece, piece_in_words
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import parts as mesh_parts
from tipdamp.modal.mesh_checks import some
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies

SAME_PLACE = 1e-6  # of the size of a mesh: nodes nearer to each other lie on one another


def coincident(mesh: Mesh) -> np.ndarray:
    """(c, 2) int: indices of nodes of different pieces that lie on one another."""
    count, label = mesh_parts(mesh)
    if count == 1:
        return np.empty((0, 2), dtype=int)
    near = SAME_PLACE * np.ptp(mesh.position, axis=0).max()
    both = cKDTree(mesh.position).query_pairs(near, output_type="ndarray")
    return both[label[both[:, 0]] != label[both[:, 1]]]


def merging(mesh: Mesh) -> str:
    """'9 of its nodes lie on nodes of other pieces ...: merge ...', or '' where none do."""
    twice = coincident(mesh)
    if not len(twice):
        return ""
    first, second = mesh.node[twice[0]]
    return (
        f"{len(np.unique(twice[:, 1]))} of its nodes lie on nodes of other pieces (first: "
        f"{second} on {first}): merge coincident nodes where that is one body"
    )


def check_pieces(meshes: dict[str, Mesh], bodies: Sequence[Body], pairs: ContactTable) -> None:
    """InputError where the damper has a piece that is there twice, or one without contact or load
    of its own.

    bodies - with their loads and contact points."""
    damper = next(body for body in bodies if body.name == DAMPER)
    label = parts(damper)
    if not label.max(initial=0):
        return
    _check_not_twice(meshes[DAMPER])
    loaded = np.any([force != 0 for force in damper.loads.values()], axis=0)
    touched = _touched(damper, pairs)
    for i in range(label.max() + 1):
        mine = label == i
        lacks = [
            what
            for what, there in (("contact", touched), ("load", loaded))
            if not there[mine].any()
        ]
        if lacks:
            merged = merging(meshes[DAMPER])
            raise InputError(
                f"[damper] mesh: the damper consists of {label.max() + 1} pieces "
                f"that share no node, and {piece_in_words(piece(damper, np.flatnonzero(mine)))} "
                f"has no {' and no '.join(lacks)} of its own: nothing holds it; "
                f"{merged}{'; ' * bool(merged)}join the pieces, take it out of the mesh, or give "
                f"it {_remedy(lacks)}"
            )


def check_loaded(model: ReducedModel | SparseBodies, loads: Loads) -> None:
    """InputError where the load at rest leaves out a piece of the damper; model - knows its rigid
    motions."""
    mine = np.flatnonzero(model.body == DAMPER)
    motions = model.rigid.get(DAMPER, np.zeros((len(mine), 0)))
    for first in range(0, motions.shape[1], 6):
        own = mine[motions[:, first : first + 6].any(axis=1)]
        if motions.shape[1] > 6 and not loads.at_rest[own].any():
            place = np.round(model.position[own].mean(axis=0), 4).tolist()
            raise InputError(
                f"the damper consists of {motions.shape[1] // 6} pieces that share "
                f"no node, and the one around {place} m (node {model.node[own[0]]}) has no load "
                f"of its own in {loads.rest.name}: nothing presses it against the blades; "
                f"join the pieces, or give it {_remedy(['load'])}"
            )


def _touched(damper: Body, pairs: ContactTable) -> np.ndarray:
    """(d,) bool: dofs of the nodes of pairs, or that the contact points read."""
    numbers = pairs.damper_node[pairs.damper_body == DAMPER]
    motion = damper.motion_of(DAMPER, np.unique(numbers))
    return np.asarray((abs(motion)).sum(axis=0)).ravel() > 0


def _remedy(lacks: Sequence[str]) -> str:
    ways = {
        "contact": "faces in the groups of [contact.NAME]",
        "load": "nodes of [damper] load_points",
    }
    return " and ".join(ways[what] for what in lacks)


def _check_not_twice(mesh: Mesh) -> None:
    """InputError where every node of a piece lies on one of the same other piece."""
    label = mesh_parts(mesh)[1]
    size, both = np.bincount(label), coincident(mesh)
    ends = np.vstack([both, both[:, ::-1]])
    where = label[ends]
    for i, j in np.unique(where, axis=0).tolist():
        mine = np.unique(ends[(where == [i, j]).all(axis=1), 0])
        if len(mine) == size[i]:
            raise InputError(
                f"[damper] mesh: the damper has a piece twice: all {size[i]} nodes "
                f"of the one of nodes {some(mesh.node[mine].tolist())} lie on nodes of another "
                "piece; take one of them out of the mesh, or merge coincident nodes"
            )
