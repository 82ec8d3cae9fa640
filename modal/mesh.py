"""Mesh: nodes and cells with the user's numbers, named node groups and cell groups; faces and their normals.

Files become meshes in tipdamp/readers; what a mesh must fulfil is checked in mesh_checks.py.
"""

from dataclasses import dataclass, field

import numpy as np

from hbm.errors import InputError, nearest, shown
from modal.elements.cells import CELLS

DIMENSION = ("nodes", "a curve", "a surface", "a volume")


@dataclass(frozen=True)
class Mesh:
    """node : (n,) int - the user's node numbers; position : (n, 3) m; cells : {type of cells.CELLS: (c, k) int} -
    indices into `node`, in gmsh's order; groups : {name: (g,) int node numbers}; unused : what the file holds and
    this record does not; number : {type: (c,) int} - the user's element numbers; cell_groups : {name: element
    numbers}; dimension : {group: 0 nodes, 1 curve, 2 surface, 3 volume} where known; warnings : what was repaired or
    looks wrong; format : of the file."""

    node: np.ndarray
    position: np.ndarray
    cells: dict
    groups: dict = field(default_factory=dict)
    unused: tuple = ()
    source: str = ""
    number: dict = field(default_factory=dict)
    cell_groups: dict = field(default_factory=dict)
    dimension: dict = field(default_factory=dict)
    warnings: tuple = ()
    format: str = ""

    def index(self, numbers) -> np.ndarray:
        """Indices into `node` of the given node numbers."""
        order = np.argsort(self.node)
        found = np.searchsorted(self.node, numbers, sorter=order)
        found = order[np.minimum(found, len(order) - 1)]
        wrong = np.asarray(numbers)[self.node[found] != numbers]
        if len(wrong):
            raise InputError(f"{self.source}: node {wrong[0]} does not exist")
        return found

    def group(self, name: str, dimensions=(0, 1, 2, 3)) -> np.ndarray:
        """Node numbers of a group; raises InputError with the groups that exist, or with what the group holds when it
        is empty or not of the allowed dimensions."""
        if name not in self.groups:
            raise InputError(f"{self.source}: no group '{shown(name)}'; {nearest(name, sorted(self.groups))}")
        has, count = self.dimension.get(name, 0), len(self.groups[name])
        holds = f"{DIMENSION[has]} (dimension {has}) with {count} nodes"
        if not count:
            raise InputError(f"{self.source}: group '{shown(name)}' is empty: it holds {holds} of solid cells")
        if has not in dimensions:
            raise InputError(f"{self.source}: group '{shown(name)}' holds {holds}; "
                             f"wanted: {' or '.join(DIMENSION[d] for d in dimensions)}")
        return self.groups[name]

    def members(self, name: str) -> dict:
        """{type: (c,) bool} - which cells belong to a cell group; raises InputError with the groups that exist."""
        if name not in self.cell_groups:
            raise InputError(f"{self.source}: no group of cells '{shown(name)}'; "
                             f"{nearest(name, sorted(self.cell_groups))}")
        return {kind: np.isin(number, self.cell_groups[name]) for kind, number in self.number.items()}


def boundary_faces(mesh: Mesh) -> list[np.ndarray]:
    """Faces that belong to one cell only, one (f, k) array of node indices per cell type and number of face nodes."""
    blocks = [block for _, block in face_blocks(mesh)]
    _, inverse, count = np.unique(np.concatenate([face_keys(b) for b in blocks]), axis=0, return_inverse=True,
                                  return_counts=True)
    single = np.split(count[inverse.ravel()] == 1, np.cumsum([len(b) for b in blocks])[:-1])
    return [b[s] for b, s in zip(blocks, single, strict=True)]


def face_blocks(mesh: Mesh) -> list[tuple[str, np.ndarray]]:
    """(cell type, (f, k) node indices) of all faces, those with equally many nodes together."""
    out = []
    for kind, cells in mesh.cells.items():
        for size in sorted({len(f) for f in CELLS[kind].faces}):
            faces = [cells[:, list(f)] for f in CELLS[kind].faces if len(f) == size]
            out.append((kind, np.concatenate(faces)))
    return out


def face_keys(faces: np.ndarray) -> np.ndarray:
    """(f, 4) sorted corners of faces, -1 in front of triangles: equal for the two cells that share a face."""
    corners = np.sort(faces[:, :face_corners(faces.shape[1])], axis=1)
    return np.pad(corners, ((0, 0), (4 - corners.shape[1], 0)), constant_values=-1)


def face_corners(nodes: int) -> int:
    """Corners of a face with that many nodes."""
    return 3 if nodes in (3, 6) else 4


def node_normals(mesh: Mesh, index: int, faces: list[np.ndarray]) -> np.ndarray:
    """Outward unit normals at one node, one row for each boundary face that holds it, (m, 3)."""
    normals = []
    for block in faces:
        for face in block[(block == index).any(axis=1)]:
            a, b = _face_tangents(face, int(np.flatnonzero(face == index)[0]), mesh.position)
            n = np.cross(a, b)
            normals.append(n / np.linalg.norm(n))
    return np.array(normals).reshape(-1, 3)


_QUAD = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)], dtype=float)
_TRI = np.array([(0, 0), (1, 0), (0, 1), (.5, 0), (.5, .5), (0, .5)], dtype=float)
# powers of the two coordinates that a face with so many nodes spans
_POWERS = {3: [(0, 0), (1, 0), (0, 1)], 6: [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)],
           4: [(i, j) for i in range(2) for j in range(2)], 9: [(i, j) for i in range(3) for j in range(3)],
           8: [(i, j) for i in range(3) for j in range(3) if i + j < 4]}


def _face_tangents(face, local, position):
    """Derivatives of the isoparametric face with respect to its two coordinates, at its node `local`."""
    reference = (_TRI if face_corners(len(face)) == 3 else _QUAD)[:len(face)]
    i, j = np.array(_POWERS[len(face)]).T
    x, y = reference.T
    vandermonde = x[:, None] ** i * y[:, None] ** j
    x, y = reference[local]
    gradient = np.array([i * x ** np.maximum(i - 1, 0) * y ** j, j * x ** i * y ** np.maximum(j - 1, 0)])
    return gradient @ np.linalg.solve(vandermonde, position[face])
