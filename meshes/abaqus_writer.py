"""Several bodies in one Abaqus file: nodes, C3D10 and C3D27 elements, sets of nodes and elements,
surfaces of faces."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from tipdamp.meshes.structured import HexMesh
from tipdamp.modal.elements.cells import CELLS

TYPES = {10: "C3D10", 27: "C3D27"}
# corners of the faces S1, S2, ...                                     [Abaqus Analysis User's
# Guide, 28.1.4]
_FACES: dict[int, list[tuple[int, ...]]] = {
    10: [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)],
    27: [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
}


def _orders() -> dict[int, np.ndarray]:
    """Columns of our cells, which are gmsh's, in the order of Abaqus."""
    # fmt: off
    ring = [
        (0, 1), (1, 2), (2, 3), (3, 0),
        (4, 5), (5, 6), (6, 7), (7, 4),
        (0, 4), (1, 5), (2, 6), (3, 7),
    ]
    # fmt: on
    ours = CELLS["hexahedron27"].columns([*ring, tuple(range(8)), *_FACES[27]])
    # gmsh swaps the last two edges of a tetrahedron
    return {10: np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 8]), 27: np.argsort(ours)}


def write(path: str | Path, bodies: Sequence[HexMesh]) -> None:
    """Numbers run on from body to body; groups are written as 'body_group', cells as an element set
    of the body."""
    lines, node, element = ["*HEADING", "two-blade rig"], 1, 1
    for mesh in bodies:
        lines += _body(mesh, node, element)
        node, element = node + len(mesh.nodes), element + len(mesh.cells)
    Path(path).write_text("\n".join([*lines, ""]))


def _body(mesh: HexMesh, node: int, element: int) -> Iterator[str]:
    per = mesh.cells.shape[1]
    yield "*NODE"
    yield from (
        f"{node + i}, {x:.17g}, {y:.17g}, {z:.17g}"
        for i, (x, y, z) in enumerate(mesh.nodes.tolist())
    )
    yield f"*ELEMENT, TYPE={TYPES[per]}, ELSET={mesh.name}"
    for i, row in enumerate((mesh.cells[:, _orders()[per]] + node).tolist()):
        yield from _wrapped([element + i, *row])
    for name, nodes in mesh.node_sets.items():
        yield f"*NSET, NSET={mesh.name}_{name}"
        yield from _wrapped((nodes + node).tolist())
    where = {
        tuple(sorted(mesh.cells[c, list(corners)].tolist())): (element + c, f"S{k}")
        for c in range(len(mesh.cells))
        for k, corners in enumerate(_FACES[per], start=1)
    }
    for name, faces in mesh.surfaces.items():
        yield f"*SURFACE, NAME={mesh.name}_{name}"
        for face in faces[:, : 3 if per == 10 else 4].tolist():
            yield "{}, {}".format(*where[tuple(sorted(face))])


def _wrapped(values: list[int]) -> list[str]:
    lines = [values[i : i + 12] for i in range(0, len(values), 12)]
    return [", ".join(map(str, line)) + ("," if line is not lines[-1] else "") for line in lines]
