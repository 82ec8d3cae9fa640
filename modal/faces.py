"""Faces of a mesh: those on its surface, their normals, and integration over them."""

from functools import cache

import numpy as np

from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.mesh import Mesh

_QUAD = np.array(
    [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=float
)
_TRI = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)], dtype=float)
# powers of the two coordinates that a face with so many nodes spans
_POWERS = {
    3: [(0, 0), (1, 0), (0, 1)],
    6: [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)],
    4: [(i, j) for i in range(2) for j in range(2)],
    9: [(i, j) for i in range(3) for j in range(3)],
    8: [(i, j) for i in range(3) for j in range(3) if i + j < 4],
}


def boundary_faces(mesh: Mesh) -> list[np.ndarray]:
    """Faces that belong to one cell only, one (f, k) array of node indices per cell type and number
    of face nodes."""
    blocks = face_blocks(mesh)
    _, inverse, count = np.unique(
        np.concatenate([face_keys(b) for b in blocks]),
        axis=0,
        return_inverse=True,
        return_counts=True,
    )
    single = _by_block(count[inverse.ravel()] == 1, blocks)
    return [b[s] for b, s in zip(blocks, single, strict=True)]


def group_faces(mesh: Mesh, name: str) -> list[np.ndarray]:
    """Boundary faces of a group, in arrays as of `boundary_faces`: its face set where the file has
    one, otherwise those whose nodes all belong to it."""
    blocks = boundary_faces(mesh)
    if name in mesh.face_groups:
        parts = [mesh.face_groups[name], *(face_keys(mesh.node[b]) for b in blocks)]
        label = np.unique(np.concatenate(parts), axis=0, return_inverse=True)[1].ravel()
        own, *others = _by_block(label, parts)
        return [b[np.isin(their, own)] for b, their in zip(blocks, others, strict=True)]
    member = np.zeros(len(mesh.node), dtype=bool)
    member[mesh.index(mesh.group(name))] = True
    return [b[member[b].all(axis=1)] for b in blocks]


def _by_block(values: np.ndarray, blocks: list[np.ndarray]) -> list[np.ndarray]:
    """Values of the rows of all blocks in turn, parted as these are."""
    return np.split(values, np.cumsum([len(b) for b in blocks])[:-1])


def face_blocks(mesh: Mesh) -> list[np.ndarray]:
    """(f, k) node indices of all faces, cell type by cell type, those with equally many nodes
    together."""
    out = []
    for kind, cells in mesh.cells.items():
        for size in sorted({len(f) for f in CELLS[kind].faces}):
            out.append(
                np.concatenate([cells[:, list(f)] for f in CELLS[kind].faces if len(f) == size])
            )
    return out


def face_keys(faces: np.ndarray) -> np.ndarray:
    """(f, 4) sorted corners of faces (f, k), -1 in front of triangles: equal for the two cells that
    share a face."""
    corners = np.sort(faces[:, : face_corners(faces.shape[1])], axis=1)
    return np.pad(corners, ((0, 0), (4 - corners.shape[1], 0)), constant_values=-1)


def face_corners(nodes: int) -> int:
    """Corners of a face with that many nodes."""
    return 3 if nodes in (3, 6) else 4


def node_normals(mesh: Mesh, index: int, faces: list[np.ndarray]) -> np.ndarray:
    """Outward unit normals at one node, one row for each boundary face that holds it, (m, 3)."""
    normals = []
    for block in faces:
        for face in block[(block == index).any(axis=1)]:
            power, reference = _shape(len(face))
            gradient = np.vstack(
                [_monomials(power, reference[face == index], d) for d in ((1, 0), (0, 1))]
            )
            a, b = gradient @ np.linalg.solve(
                _monomials(power, reference, (0, 0)), mesh.position[face]
            )
            n = np.cross(a, b)
            normals.append(n / np.linalg.norm(n))
    return np.array(normals).reshape(-1, 3)


@cache
def face_rule(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shape functions (g, k), slopes (g, 2, k) and weights (g,) at the Gauss points of a face with
    k nodes.

    4 x 4 points on a square; the same collapsed onto the triangle, exact to degree 6.
    """
    points, weight = triangle_rule(4) if face_corners(nodes) == 3 else _square_rule(4)
    return *face_shapes(nodes, points), weight


def triangle_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n^2, 2) and weights (n^2,) on the triangle (0, 0), (1, 0), (0, 1): exact to degree 2n
    - 2."""
    points, weight = _square_rule(n)
    r, s = (points.T + 1) / 2
    return np.column_stack([r, s * (1 - r)]), weight / 4 * (1 - r)


def _square_rule(n: int) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(n)
    return np.column_stack([g.ravel() for g in np.meshgrid(x, x)]), np.outer(w, w).ravel()


def face_shapes(nodes: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (m, k) and slopes (m, 2, k) of a face with k nodes at reference coordinates
    (m, 2)."""
    power, reference = _shape(nodes)
    inverse = np.linalg.inv(_monomials(power, reference, (0, 0)))
    slope = np.stack([_monomials(power, points, d) @ inverse for d in ((1, 0), (0, 1))], axis=1)
    return _monomials(power, points, (0, 0)) @ inverse, slope


def face_places(nodes: int) -> np.ndarray:
    """(k, 2) reference coordinates of the nodes of a face."""
    return _shape(nodes)[1]


def _shape(nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Powers (k, 2) and places (k, 2) of the shape functions of a face with so many nodes."""
    return np.array(_POWERS[nodes]), (_TRI if face_corners(nodes) == 3 else _QUAD)[:nodes]


def _monomials(power: np.ndarray, points: np.ndarray, derivative: tuple[int, int]) -> np.ndarray:
    """x^i y^j of each pair of powers at each point, or its first derivative."""
    (i, j), (dx, dy) = power.T, derivative
    x, y = points.T[:, :, None]
    return (i**dx) * x ** np.maximum(i - dx, 0) * (j**dy) * y ** np.maximum(j - dy, 0)
