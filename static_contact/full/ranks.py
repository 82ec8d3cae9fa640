"""Row partition: bodies of which each rank of an mpirun holds its own rows only, so that memory
falls with the ranks.

A rank assembles the cells that touch its nodes: their rows of K and M are then complete. Meshes,
dof tables and vectors are whole on every rank; they are small beside the matrices.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.body import Body
from tipdamp.modal.elasticity import Material, blocks, fixed_nodes
from tipdamp.modal.elements.isoparametric import stiffness_and_mass
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.mesh_checks import parts


@dataclass(frozen=True)
class Part:
    """What `elastic_body` takes: a mesh, its material and support."""

    mesh: Mesh
    material: Material
    name: str
    clamp: Sequence[str] = ()
    free: bool = False
    other_materials: dict = field(default_factory=dict)

    @property
    def clamped(self) -> np.ndarray:
        """(n,) bool - clamped nodes."""
        return fixed_nodes(self.mesh, self.clamp)


def own_rows(comm: Any, size: int) -> tuple[int, int]:
    """First and last row, exclusive, of this rank: PETSc's own layout of `size` rows, the first
    ranks one more."""
    each, more = divmod(size, comm.size)
    low = comm.rank * each + min(comm.rank, more)
    return low, low + each + (comm.rank < more)


def distributed_bodies(parts: list[Part], comm: Any, extra: int = 0) -> list[Body]:
    """The bodies with the rows of this rank; the others are empty. comm : of PETSc or mpi4py

    extra : unknowns behind the dofs of the bodies (hard pairs), which shift the layout.
    """
    dofs = [3 * int((~part.clamped).sum()) for part in parts]
    low, high = own_rows(comm, sum(dofs) + extra)
    first = np.cumsum([0, *dofs])
    return [
        _rows(part, max(low - a, 0), max(min(high - a, n), 0))
        for part, a, n in zip(parts, first, dofs, strict=False)
    ]


def _rows(part: Part, low: int, high: int) -> Body:
    """The body with its rows low..high."""
    mesh, count = part.mesh, len(part.mesh.node)
    keep = np.flatnonzero(np.repeat(~part.clamped, 3))
    mine = np.zeros(count, dtype=bool)
    mine[keep[low:high] // 3] = True
    body = Body(
        name=part.name,
        node=mesh.node,
        position=mesh.position,
        dof_node=keep // 3,
        dof_direction=keep % 3,
        K=sp.csr_matrix((len(keep),) * 2),
        M=sp.csr_matrix((len(keep),) * 2),
        groups=dict(mesh.groups),
        free=part.free,
        provenance={"mesh": mesh.source},
        piece_of_node=parts(mesh)[1],
    )
    return _with_rows(body, part, mine, keep, (low, high)) if mine.any() else body


def _with_rows(
    body: Body, part: Part, mine: np.ndarray, keep: np.ndarray, own: tuple[int, int]
) -> Body:
    """The body with its rows own[0]..own[1], which are at the nodes `mine` (n,) bool; keep (d,) -
    its free dofs among all."""
    piece, used = _touching(part.mesh, mine)
    K, M = _assembled(piece, part)
    held = np.setdiff1d(np.arange(3 * len(mine)), keep)
    place, to_held = (_places(dofs, used, len(mine)) for dofs in (keep, held))
    size = (len(keep), len(keep))
    return replace(
        body,
        K=_spread(K, (place, place), own, size),
        M=_spread(M, (place, place), own, size),
        M_clamped=_spread(M, (place, to_held), own, (len(keep), len(held))),
    )


def _touching(mesh: Mesh, mine: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """The mesh of the cells that touch the nodes `mine` (n,) bool, and its nodes in the whole."""
    touching = {kind: mine[cells].any(axis=1) for kind, cells in mesh.cells.items()}
    used = np.unique(np.concatenate([mesh.cells[kind][t].ravel() for kind, t in touching.items()]))
    local = {kind: t for kind, t in touching.items() if t.any()}
    piece = replace(
        mesh,
        node=mesh.node[used],
        position=mesh.position[used],
        groups={},
        cells={kind: np.searchsorted(used, mesh.cells[kind][t]) for kind, t in local.items()},
        number={kind: mesh.number[kind][t] for kind, t in local.items() if kind in mesh.number},
    )
    return piece, used


def _places(dofs: np.ndarray, used: np.ndarray, count: int) -> np.ndarray:
    """Of the dofs of the nodes `used` among `dofs`, -1 where they are not; count - of all nodes."""
    place = np.full(3 * count, -1)
    place[dofs] = np.arange(len(dofs))
    return place[(3 * used[:, None] + np.arange(3)).ravel()]


def _assembled(piece: Mesh, part: Part) -> tuple[sp.spmatrix, sp.spmatrix]:
    """K and M of the piece by our own assembler: dolfinx hangs at exit where the ranks have not
    called it alike."""
    found = [
        stiffness_and_mass(piece.position, kind, cells, of.lame, of.shear, of.density)
        for kind, cells, of in blocks(piece, part.material, part.other_materials)
    ]
    return sum(K for K, _ in found), sum(M for _, M in found)


def _spread(
    matrix: sp.spmatrix,
    places: tuple[np.ndarray, np.ndarray],
    own: tuple[int, int],
    size: tuple[int, int],
) -> sp.csr_matrix:
    """Rows own[0]..own[1] of a matrix of that size from the matrix of the piece, whose rows and
    columns stand at `places`; those at -1 drop out."""
    entries = matrix.tocoo()
    row, column = places[0][entries.row], places[1][entries.col]
    good = (row >= own[0]) & (row < own[1]) & (column >= 0)
    return sp.csr_matrix((entries.data[good], (row[good], column[good])), shape=size)
