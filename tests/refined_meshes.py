"""Ten-node tetrahedra cut into eight each: the same solid with the same groups, in cells of half
the size."""

from pathlib import Path

import numpy as np

from tipdamp.meshes import mesh_file
from tipdamp.meshes.structured import HexMesh
from tipdamp.modal import mesh as modal_mesh
from tipdamp.modal.faces import boundary_faces, face_keys, group_faces
from tipdamp.readers.dispatch import read_mesh

EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1))  # of nodes 4 to 9, in gmsh's order
# nodes of a cell that are the corners of the eight; the last four lie around the line from node 6
# to node 9
CUTS = np.array(
    # fmt: off
    [
        (0, 4, 6, 7),
        (4, 1, 5, 9),
        (6, 5, 2, 8),
        (7, 9, 8, 3),
        (6, 5, 4, 9),
        (6, 8, 5, 9),
        (6, 7, 8, 9),
        (6, 4, 7, 9),
    ]
    # fmt: on
)
FACE_CUTS = np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)])
SAME = 1e-9  # of the mesh's size: two nodes in one place


def refine(path: str | Path, out: str | Path) -> None:
    """Read a gmsh file of tet10 cells, write it refined."""
    mesh = read_mesh(path)
    cells = mesh.cells["tetra10"]
    # barycentric
    whole = np.vstack([np.eye(4), [(np.eye(4)[a] + np.eye(4)[b]) / 2 for a, b in EDGES]])
    parts = np.array(
        [
            np.vstack([whole[cut], [(whole[cut[a]] + whole[cut[b]]) / 2 for a, b in EDGES]])
            for cut in CUTS
        ]
    )
    place = np.einsum("ijk,ckx->cijx", _shapes(parts), mesh.position[cells])
    near = np.round(place.reshape(-1, 3) / (SAME * np.ptp(mesh.position)))
    _, first, index = np.unique(near, axis=0, return_index=True, return_inverse=True)
    nodes, fine = place.reshape(-1, 3)[first], index.reshape(-1, 10)
    number = np.empty(len(mesh.node), dtype=int)
    number[cells[:, CUTS]] = fine[:, :4].reshape(len(cells), 8, 4)
    outside = np.concatenate(
        boundary_faces(modal_mesh.Mesh(np.arange(len(nodes)), nodes, {"tetra10": fine}))
    )
    at = {tuple(key): face for key, face in zip(face_keys(outside).tolist(), outside, strict=True)}
    surfaces, sets = {}, {}
    for group, its in mesh.groups.items():
        if mesh.dimension.get(group) == 2:
            corners = number[np.concatenate(group_faces(mesh, group))[:, FACE_CUTS]].reshape(-1, 3)
            surfaces[group] = np.array([at[tuple(key)] for key in face_keys(corners).tolist()])
        elif mesh.dimension.get(group) == 0:
            sets[group] = number[mesh.index(its)]
    mesh_file.write(out, HexMesh("solid", nodes, fine, surfaces, sets))


def _shapes(at):
    """(..., 10) functions of the nodes at barycentric coordinates (..., 4)."""
    return np.concatenate(
        [at * (2 * at - 1), np.stack([4 * at[..., a] * at[..., b] for a, b in EDGES], axis=-1)],
        axis=-1,
    )
