"""The outside of a body for pictures: a skin of triangles and, once reduced, how it moves with the
reduced dofs.

Written by the stage `reduce` into surface.npz, so that no picture needs a mesh or a finite-element
library again."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.io.array_files import open_npz, save_npz
from tipdamp.modal.faces import boundary_faces
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.reduction import Reduction

# nodes of a skin; finer ones are thinned, for pictures and for the size of surface.npz
MAX_NODES = 8000
SHARP = np.cos(np.radians(30))
# faces by their number of nodes (corners, middles of edges, centre) as triangles, counter-clockwise
# like the face
_TRIANGLES = {
    3: [(0, 1, 2)],
    6: [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)],
    4: [(0, 1, 2), (0, 2, 3)],
    8: [(0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)],
    9: [(a, b, 8) for a, b in zip((0, 4, 1, 5, 2, 6, 3, 7), (4, 1, 5, 2, 6, 3, 7, 0), strict=True)],
}


@dataclass(frozen=True)
class OuterSurface:
    """node : (n,) int - the user's numbers; position : (n, 3) m; triangles : (t, 3) int, outward
    counter-clockwise
    edges : (e, 2) int - sharp edges; recovery : (3n, r) float32 or None - x, y, z of each node from
    the body's r reduced dofs; thinned - not every node of the outside is there."""

    body: str
    node: np.ndarray
    position: np.ndarray
    triangles: np.ndarray
    edges: np.ndarray
    recovery: np.ndarray | None = None
    thinned: bool = False

    def displacement(self, q: np.ndarray) -> np.ndarray:
        """(n, 3) m from this body's part of the reduced vector, (r,)."""
        assert self.recovery is not None, "a surface without reduction does not move"
        return (self.recovery @ np.asarray(q, dtype=np.float32)).reshape(-1, 3)


def skin(
    mesh: Mesh, body: str, reduction: Reduction | None = None, max_nodes: int = MAX_NODES
) -> OuterSurface:
    """Boundary faces of a mesh as triangles through all their nodes, or fewer where there are more
    than `max_nodes`."""
    triangles = np.concatenate(
        [block[:, _TRIANGLES[block.shape[1]]].reshape(-1, 3) for block in boundary_faces(mesh)]
    )
    whole = len(np.unique(triangles))
    triangles = _thinned(mesh.position, triangles, max_nodes)
    used, inverse = np.unique(triangles, return_inverse=True)
    triangles = inverse.reshape(-1, 3)
    return OuterSurface(
        body,
        mesh.node[used],
        mesh.position[used],
        triangles,
        _sharp_edges(mesh.position[used], triangles),
        None if reduction is None else _recovery(reduction, used),
        len(used) < whole,
    )


def _thinned(position: np.ndarray, triangles: np.ndarray, max_nodes: int) -> np.ndarray:
    """Nodes that share a cell of a grid become one of them; triangles that collapse are gone."""
    used, inverse = np.unique(triangles, return_inverse=True)
    inverse, place = inverse.reshape(-1, 3), position[used]
    if len(used) <= max_nodes:
        return triangles
    area = (
        np.linalg.norm(np.cross(*np.diff(place[inverse], axis=1).transpose(1, 0, 2)), axis=1).sum()
        / 2
    )
    size = np.sqrt(area / max_nodes)
    while True:
        cell = np.floor((place - place.min(axis=0)) / size).astype(np.int64)
        _, first, cluster = np.unique(cell, axis=0, return_index=True, return_inverse=True)
        if len(first) <= max_nodes:
            break
        size *= 1.15
    triangles = first[cluster.ravel()[inverse]]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    _, once = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)
    return used[triangles[once]]


def _sharp_edges(position: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(e, 2) - edges where the skin ends or turns by more than 30 degrees."""
    normal = np.cross(
        position[triangles[:, 1]] - position[triangles[:, 0]],
        position[triangles[:, 2]] - position[triangles[:, 0]],
    )
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], np.repeat(np.arange(len(triangles)), 3)[order]
    first = np.flatnonzero(np.r_[True, (np.diff(edges, axis=0) != 0).any(axis=1)])
    count = np.diff(np.r_[first, len(edges)])
    second = np.minimum(first + 1, len(edges) - 1)
    turn = np.einsum("ij,ij->i", normal[owner[first]], normal[owner[second]])
    return edges[first[(count != 2) | (turn < SHARP)]]


def _recovery(reduction: Reduction, index: np.ndarray) -> np.ndarray:
    """Rows of [1 0; Psi Phi] for the nodes at `index` of the body; 0 where a direction is
    clamped."""
    body, b = reduction.body, len(reduction.boundary)
    dof = np.full((len(body.node), 3), -1)
    dof[body.dof_node, body.dof_direction] = np.arange(body.dofs)
    dof = dof[index].ravel()
    place = np.full(body.dofs + 1, -1)  # the last stands for clamped ones
    place[reduction.interior] = np.arange(len(reduction.interior))
    place[reduction.boundary] = np.arange(b)
    inner = np.zeros(body.dofs + 1, dtype=bool)
    inner[reduction.interior] = True
    rows = np.zeros((len(dof), b + reduction.Phi.shape[1]), dtype=np.float32)
    inside = inner[dof]
    rows[inside, :b], rows[inside, b:] = (
        reduction.Psi[place[dof[inside]]],
        reduction.Phi[place[dof[inside]]],
    )
    masters = np.flatnonzero(~inside & (dof >= 0))
    rows[masters, place[dof[masters]]] = 1.0
    return rows


def save(surfaces: Iterable[OuterSurface], path: Path) -> None:
    """Several bodies in one .npz."""
    content: dict[str, Any] = {"bodies": np.array([s.body for s in surfaces])}
    for s in surfaces:
        parts = {
            "node": s.node,
            "position": s.position,
            "triangles": s.triangles.astype(np.int32),
            "edges": s.edges.astype(np.int32),
            "thinned": np.array(s.thinned),
        }
        if s.recovery is not None:
            parts["recovery"] = s.recovery
        content.update({f"{s.body}/{key}": value for key, value in parts.items()})
    save_npz(path, **content)


def load(path: Path) -> dict[str, OuterSurface]:
    """{body: Surface}"""
    with open_npz(path) as z:
        return {
            body: OuterSurface(
                body,
                z[f"{body}/node"],
                z[f"{body}/position"],
                z[f"{body}/triangles"],
                z[f"{body}/edges"],
                z[f"{body}/recovery"] if f"{body}/recovery" in z else None,
                bool(z[f"{body}/thinned"]),
            )
            for body in z["bodies"].tolist()
        }
