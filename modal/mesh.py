"""Mesh: nodes with the user's numbers, solid cells, and named node groups. Reads gmsh .msh files.

gmsh's own reader is used for .msh because it keeps node numbers and every physical group; a node that belongs to
several groups stays in all of them.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hbm.errors import InputError, nearest

# gmsh element number -> name of the solid cells that elasticity.py assembles
SOLID = {4: "tetra", 5: "hexahedron", 11: "tetra10", 12: "hexahedron27"}
CELL_NODES = {"tetra": 4, "hexahedron": 8, "tetra10": 10, "hexahedron27": 27}

# faces of each cell: corner nodes first, counter-clockwise seen from outside, then the nodes on the edges and centre
_HEX8 = [[0, 3, 2, 1], [0, 1, 5, 4], [0, 4, 7, 3], [1, 2, 6, 5], [2, 3, 7, 6], [4, 5, 6, 7]]
_HEX27 = [[0, 3, 2, 1, 9, 13, 11, 8, 20], [0, 1, 5, 4, 8, 12, 16, 10, 21], [0, 4, 7, 3, 10, 17, 15, 9, 22],
          [1, 2, 6, 5, 11, 14, 18, 12, 23], [2, 3, 7, 6, 13, 15, 19, 14, 24], [4, 5, 6, 7, 16, 18, 19, 17, 25]]
_TET4 = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
_TET10 = [[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 9, 7], [0, 3, 2, 7, 8, 6], [1, 2, 3, 5, 8, 9]]
FACES = {"tetra": _TET4, "hexahedron": _HEX8, "tetra10": _TET10, "hexahedron27": _HEX27}


@dataclass(frozen=True)
class Mesh:
    """node : (n,) int - the user's node numbers; position : (n, 3) m; cells : {type: (c, k) int} - indices into
    `node`; groups : {name: (g,) int node numbers}; unused : what the file holds and this record does not."""

    node: np.ndarray
    position: np.ndarray
    cells: dict
    groups: dict = field(default_factory=dict)
    unused: tuple = ()
    source: str = ""

    def index(self, numbers) -> np.ndarray:
        """Indices into `node` of the given node numbers."""
        order = np.argsort(self.node)
        found = np.searchsorted(self.node, numbers, sorter=order)
        found = order[np.minimum(found, len(order) - 1)]
        wrong = np.asarray(numbers)[self.node[found] != numbers]
        if len(wrong):
            raise InputError(f"{self.source}: node {wrong[0]} does not exist")
        return found

    def group(self, name: str) -> np.ndarray:
        """Node numbers of a group; raises InputError with the groups that exist."""
        if name not in self.groups:
            raise InputError(f"{self.source}: no group '{name}'; {nearest(name, sorted(self.groups))}")
        if not len(self.groups[name]):
            raise InputError(f"{self.source}: group '{name}' is empty")
        return self.groups[name]


def read_mesh(path, length_unit: float = 1.0) -> Mesh:
    """Read a gmsh file. Coordinates are multiplied by length_unit (m per unit of the file).

    Raises InputError for a missing or damaged file, a coordinate that is not finite, cells that refer to absent
    nodes, cell types that cannot be assembled and cells with a Jacobian that is not positive.
    """
    path = Path(path)
    if not path.is_file():
        kind = "is a folder" if path.is_dir() else "not found"
        raise InputError(f"mesh file {kind}: {path} (looked for it as {path.absolute()})")
    if path.suffix.lower() != ".msh":
        raise InputError(f"{path}: mesh files of type '{path.suffix}' are not read; use gmsh .msh (2.2 or 4.1)")
    _check_sections(path)
    nodes, position, cells, groups, unused = _read_gmsh(path)
    mesh = Mesh(nodes, position * length_unit, cells, groups, unused, path.name)
    _check(mesh)
    return mesh


def boundary_faces(mesh: Mesh) -> list[np.ndarray]:
    """Faces that belong to one cell only, one (f, k) array of node indices per cell type."""
    faces = {kind: np.concatenate([cells[:, f] for f in FACES[kind]]) for kind, cells in mesh.cells.items()}
    corners = {"tetra": 3, "tetra10": 3}
    keys = {kind: np.sort(f[:, :corners.get(kind, 4)], axis=1) for kind, f in faces.items()}
    padded = [np.pad(k, ((0, 0), (0, 4 - k.shape[1])), constant_values=-1) for k in keys.values()]
    _, inverse, count = np.unique(np.concatenate(padded), axis=0, return_inverse=True, return_counts=True)
    single = np.split(count[inverse.ravel()] == 1, np.cumsum([len(p) for p in padded])[:-1])
    return [f[s] for f, s in zip(faces.values(), single, strict=True)]


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


def _face_tangents(face, local, position):
    """Derivatives of the isoparametric face with respect to its two coordinates, at its node `local`."""
    reference = (_TRI if len(face) in (3, 6) else _QUAD)[:len(face)]
    powers = {3: [(0, 0), (1, 0), (0, 1)], 6: [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)],
              4: [(i, j) for i in range(2) for j in range(2)], 9: [(i, j) for i in range(3) for j in range(3)]}
    i, j = np.array(powers[len(face)]).T
    x, y = reference.T
    vandermonde = x[:, None] ** i * y[:, None] ** j
    x, y = reference[local]
    gradient = np.array([i * x ** np.maximum(i - 1, 0) * y ** j, j * x ** i * y ** np.maximum(j - 1, 0)])
    return gradient @ np.linalg.solve(vandermonde, position[face])


def _check_sections(path):
    """A file cut off in the middle has a section that is opened and never closed."""
    with open(path, "rb") as f:
        head = f.read(64)
        f.seek(0, 2)
        f.seek(max(0, f.tell() - 4096))
        tail = f.read().rstrip()
    if not head.startswith(b"$MeshFormat"):
        raise InputError(f"{path}: is not a gmsh file (it does not begin with $MeshFormat)")
    last = tail[tail.rfind(b"\n$") + 1:].split(b"\n")[0].strip()
    if not last.startswith(b"$End"):
        raise InputError(f"{path}: is cut off (its last section is not closed by a $End line)")


def _read_gmsh(path):
    import gmsh

    own_session = not _is_running(gmsh)
    if own_session:
        gmsh.initialize(readConfigFiles=False)
    previous = "" if own_session else gmsh.model.getCurrent()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("tipdamp-reader")
        try:
            gmsh.merge(str(path))
        except Exception as error:  # gmsh raises bare Exception
            raise InputError(f"{path}: gmsh cannot read it: {error}") from None
        return _collect(gmsh, path)
    finally:
        gmsh.model.remove()
        if own_session:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(previous)


def _is_running(gmsh) -> bool:
    """Whether someone else has gmsh open. Before 4.9 gmsh cannot tell, and is taken to be ours."""
    return hasattr(gmsh, "isInitialized") and bool(gmsh.isInitialized())


def _collect(gmsh, path):
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    if not len(tags):
        raise InputError(f"{path}: holds no nodes")
    tags, first = np.unique(tags.astype(np.int64), return_index=True)
    xyz = np.asarray(xyz).reshape(-1, 3)[first]
    lookup = np.full(int(tags[-1]) + 1, -1)
    lookup[tags] = np.arange(len(tags))
    cells, unused = {}, []
    for kind, _, node_tags in zip(*gmsh.model.mesh.getElements(3), strict=True):
        name, _, _, per_cell, _, _ = gmsh.model.mesh.getElementProperties(kind)
        if kind not in SOLID:
            raise InputError(f"{path}: cells of type '{name}' cannot be assembled; "
                             f"allowed: {', '.join(SOLID.values())}")
        corner = np.asarray(node_tags, dtype=np.int64)
        absent = corner[(corner > tags[-1]) | (lookup[np.minimum(corner, tags[-1])] < 0)]
        if len(absent):
            raise InputError(f"{path}: a cell refers to node {absent[0]}, which does not exist")
        cells[SOLID[kind]] = lookup[corner].reshape(-1, per_cell)
    if not cells:
        raise InputError(f"{path}: holds no solid cells")
    used = np.zeros(len(tags), dtype=bool)
    for block in cells.values():
        used[block] = True
    if not used.all():
        unused.append(f"{int((~used).sum())} nodes that no solid cell uses")
    groups = _groups(gmsh, tags[used])
    renumber = np.cumsum(used) - 1
    return tags[used], xyz[used], {k: renumber[c] for k, c in cells.items()}, groups, tuple(unused)


def _groups(gmsh, used_tags):
    groups = {}
    for dim, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dim, tag) or f"{('point', 'curve', 'surface', 'volume')[dim]}_{tag}"
        numbers = []
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            numbers += [np.asarray(t, dtype=np.int64) for t in gmsh.model.mesh.getElements(dim, entity)[2]]
        merged = np.unique(np.concatenate(numbers)) if numbers else np.empty(0, dtype=np.int64)
        groups[name] = merged[np.isin(merged, used_tags)]
    return groups


def _check(mesh):
    bad = ~np.isfinite(mesh.position).all(axis=1)
    if bad.any():
        raise InputError(f"{mesh.source}: node {mesh.node[bad][0]} has a coordinate that is not a finite number")
    for kind, cells in mesh.cells.items():
        size = np.prod(np.ptp(mesh.position, axis=0) + 1e-300) / max(len(cells), 1)
        volume = corner_jacobians(kind, mesh.position[cells]).min(axis=1)
        worst = volume.argmin()
        if volume[worst] <= 1e-9 * size:
            count = int((volume <= 1e-9 * size).sum())
            raise InputError(f"{mesh.source}: {count} {kind} cells are inverted or flat "
                             f"(smallest corner Jacobian {volume[worst]:.2e} m3, first at node "
                             f"{mesh.node[cells[worst][0]]})")


def corner_jacobians(kind: str, corners: np.ndarray) -> np.ndarray:
    """Triple product of the three straight edges at each corner, (c, 4 or 8) m3; positive where not inverted."""
    if kind.startswith("tetra"):
        edges = [(0, 1, 2, 3)]
    else:
        edges = [(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2),
                 (7, 6, 4, 3)]
    out = [np.einsum("ij,ij->i", np.cross(corners[:, a] - corners[:, o], corners[:, b] - corners[:, o]),
                     corners[:, c] - corners[:, o]) for o, a, b, c in edges]
    return np.stack(out, axis=1)
