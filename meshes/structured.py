"""Structured meshes of quadratic hexahedra (27 nodes): ruled blocks in a cross-section, extruded
along an axis.

Every node position is computed here and nowhere else, so two bodies built from the same numbers
match to rounding. The cross-section lies in the x-z plane, the axis of extrusion is y.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.modal.elements.cells import CELLS

SAME_NODE = 1e-9  # m; nodes of two blocks closer than this are one node


@dataclass(frozen=True)
class HexMesh:
    """A solid of 27-node hexahedra with named groups.

    nodes: (n, 3) float, m. cells: (m, 27) int, columns in gmsh's order (see `HEX27`). surfaces:
    {name: (k, 9) int}, faces in gmsh's 9-node order, normal outward. node_sets: {name: (k,) int},
    in the order that the name implies (stations along the axis, row by row). name: the volume's own
    group.
    """

    name: str
    nodes: np.ndarray
    cells: np.ndarray
    surfaces: dict
    node_sets: dict


# places of the nodes in gmsh's order on the lattice {0, 1, 2}^3
HEX27 = (CELLS["hexahedron27"].reference + 1).astype(int)
_QUAD9 = np.array([(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1)])


def _face_columns() -> np.ndarray:
    """Columns of a cell's 27 nodes that form its six faces, in 9-node order with outward normal,
    shape (6, 9)."""
    column = {tuple(p): i for i, p in enumerate(HEX27)}
    faces = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3  # right-handed: a x b points along +axis
        for side in (0, 2):
            face = []
            for s, t in _QUAD9 if side else _QUAD9[:, ::-1]:
                p = [0, 0, 0]
                p[axis], p[a], p[b] = side, s, t
                face.append(column[tuple(p)])
            faces.append(face)
    return np.array(faces)


FACES = _face_columns()


def subdivide(breaks: Sequence[float] | np.ndarray, counts: Sequence[int]) -> np.ndarray:
    """Node positions (2 * sum(counts) + 1,): every interval of `breaks` in its count of equal
    quadratic cells."""
    parts = [
        np.linspace(a, b, 2 * n + 1)[:-1]
        for a, b, n in zip(breaks[:-1], breaks[1:], counts, strict=True)
    ]
    return np.append(np.concatenate(parts), breaks[-1])


def ruled(first: np.ndarray, second: np.ndarray, cells: int) -> np.ndarray:
    """Block of nodes (len(first), 2 * cells + 1, 2): straight lines between the points of two
    curves."""
    s = np.linspace(0.0, 1.0, 2 * cells + 1)[None, :, None]
    first, second = np.asarray(first)[:, None, :], np.asarray(second)[:, None, :]
    return first * (1 - s) + second * s


def join(blocks: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Blocks (p, q, 2) that share borders -> points (n, 2) and cells (m, 3, 3) of 9-node
    quadrilaterals."""
    grids, start = [], 0
    for block in blocks:
        p, q = block.shape[:2]
        grids.append(start + np.arange(p * q).reshape(p, q))
        start += p * q
    points = np.vstack([b.reshape(-1, 2) for b in blocks])
    first = np.arange(len(points))
    for a, b in sorted(cKDTree(points).query_pairs(SAME_NODE)):
        first[b] = min(first[b], first[a])
    kept, number = np.unique(first, return_inverse=True)
    cells = [
        number[g[i : i + 3, j : j + 3]]
        for g in grids
        for i in range(0, g.shape[0] - 1, 2)
        for j in range(0, g.shape[1] - 1, 2)
    ]
    return points[kept], np.array(cells)


def extrude(points: np.ndarray, quads: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Section (points (n, 2) in x, z; quads (m, 3, 3)) at the levels y (2k + 1,) -> nodes (N, 3),
    cells (M, 27)."""
    n = len(points)
    nodes = np.empty((len(y), n, 3))
    nodes[:, :, [0, 2]] = points
    nodes[:, :, 1] = np.asarray(y)[:, None]
    a, b, d = points[quads[:, 0, 0]], points[quads[:, 2, 0]], points[quads[:, 0, 2]]
    mirrored = (b - a)[:, 0] * (d - a)[:, 1] - (b - a)[:, 1] * (d - a)[:, 0] > 0
    quads = np.where(mirrored[:, None, None], quads.transpose(0, 2, 1), quads)  # x cross z is -y
    layer = quads[:, HEX27[:, 0], HEX27[:, 1]] + n * HEX27[:, 2]
    cells = np.concatenate([layer + 2 * k * n for k in range((len(y) - 1) // 2)])
    return nodes.reshape(-1, 3), cells


def faces_of(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All faces (6m, 9) of the cells and, for each, in how many cells it occurs."""
    faces = cells[:, FACES].reshape(-1, 9)
    _, index, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return faces, count[index.ravel()]


def boundary(cells: np.ndarray) -> np.ndarray:
    """Faces (k, 9) that belong to one cell only, with outward normals."""
    faces, count = faces_of(cells)
    return faces[count == 1]


def select(faces: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Those faces whose nine nodes all satisfy the mask `inside` (n_nodes,)."""
    return faces[inside[faces].all(axis=1)]


def find_nodes(nodes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Numbers of the nodes at the given points (k, 3); ValueError where none lies within
    `SAME_NODE`."""
    distance, index = cKDTree(nodes).query(points)
    if distance.max() > SAME_NODE:
        worst = np.asarray(points)[distance.argmax()]
        raise ValueError(
            f"no node at {worst.round(6).tolist()} m: the nearest is {distance.max():.2e} m away"
        )
    return index
