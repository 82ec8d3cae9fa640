"""How far cells are from regular ones: slivers have hardly any volume for the length of their
edges, and are far too stiff beside what they should be."""

from collections.abc import Sequence
from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tipdamp.modal.elements.cells import CELLS
from tipdamp.modal.mesh import Mesh

# shape of a sliver: a tetrahedron cut from a brick ten times as long as wide has 0.04, and meshes
# whose mesher has optimised them have none below that
SLIVER = 0.01
# share of the cells that may be slivers without a word: meshers leave one in a thousand, which no
# frequency feels; one in ten made those of a blade 9 % and 2.2 times too high
FEW = 0.005


class Slivers(NamedTuple):
    """flat of total cells have a shape below SLIVER; shape of the worst cell, and its centre (3,)
    in the unit of the mesh."""

    flat: int
    total: int
    worst: float
    centre: np.ndarray


def slivers(mesh: Mesh) -> Slivers:
    """Of all cells of a mesh."""
    shapes = {kind: cell_shapes(kind, mesh.position, block) for kind, block in mesh.cells.items()}
    kind = min(shapes, key=lambda k: shapes[k].min())
    worst = int(shapes[kind].argmin())
    corners = mesh.cells[kind][worst, : CELLS[kind].corners]
    return Slivers(
        sum(int((shape < SLIVER).sum()) for shape in shapes.values()),
        sum(map(len, shapes.values())),
        float(shapes[kind][worst]),
        mesh.position[corners].mean(axis=0),
    )


def sliver_warning(mesh: Mesh, length_unit: float, unit: str) -> str:
    """What is wrong with a mesh of which too many cells are slivers, '' where it is not. unit - in
    which places are told, whose length is `length_unit` in that of the mesh."""
    found = slivers(mesh)
    if found.flat <= FEW * found.total:
        return ""
    place = ", ".join(f"{x:.3g}" for x in found.centre / length_unit)
    return (
        f"{found.flat} of {found.total} cells are slivers (shape below {SLIVER:g}, 1 = regular; "
        f"worst {found.worst:.1g} at ({place}) {unit}): frequencies and stresses come out too high "
        "or wrong there; mesh them anew, and let the mesher optimise the cells"
    )


def cell_shapes(kind: str, position: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """(c,) 1 for a regular cell, 0 for a flat one, whatever its size; of the corners alone.

    Of tetrahedra volume over the cube of the root mean square edge [Parthasarathy, Graichen and
    Hathaway 1994], which finds four corners near one plane though every edge is long; of hexahedra
    and wedges the least scaled Jacobian of a corner [Knupp 2000], which a stretched layer of
    right-angled cells leaves at 1.
    """
    corner = position[cells[:, : CELLS[kind].corners]]
    if CELLS[kind].corners == 4:
        return _tetrahedra(corner)
    found = np.full(len(cells), np.inf)
    for at, ends in enumerate(_neighbours(kind)):
        upright = _scaled_jacobian(CELLS[kind].reference[None, :, :], at, ends)[0]
        ideal = np.sign(upright) * (np.sqrt(3) / 2 if CELLS[kind].corners == 6 else 1.0)
        found = np.minimum(found, _scaled_jacobian(corner, at, ends) / ideal)
    return found


def _tetrahedra(corner: np.ndarray) -> np.ndarray:
    """corner : (c, 4, 3)."""
    edges = [corner[:, b] - corner[:, a] for a, b in combinations(range(4), 2)]
    volume = np.linalg.det(np.stack(edges[:3], axis=1)) / 6
    mean_square = np.mean([np.einsum("ci,ci->c", e, e) for e in edges], axis=0)
    return 6 * np.sqrt(2) * volume / np.maximum(mean_square**1.5, np.finfo(float).tiny)


def _scaled_jacobian(corner: np.ndarray, at: int, ends: Sequence[int]) -> np.ndarray:
    """(c,) volume that three edges of unit length span. corner : (c, k, 3)."""
    edges = corner[:, list(ends)] - corner[:, [at]]
    length = np.linalg.norm(edges, axis=2, keepdims=True)
    return np.linalg.det(edges / np.maximum(length, np.finfo(float).tiny))


@cache
def _neighbours(kind: str) -> tuple[tuple[int, ...], ...]:
    """For each corner the three at the other ends of its edges."""
    corners = CELLS[kind].corners
    found: list[set[int]] = [set() for _ in range(corners)]
    for face in CELLS[kind].faces:
        around = [node for node in face if node < corners]
        for a, b in zip(around, (*around[1:], around[0]), strict=True):
            found[a].add(b)
            found[b].add(a)
    return tuple(tuple(sorted(ends)) for ends in found)
