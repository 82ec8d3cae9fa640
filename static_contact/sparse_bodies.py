"""Static contact of the unreduced bodies, for thousands of pairs: nothing is condensed but the compliance at the pairs.

Each body has one sparse Cholesky factor. One that floats is held at six dofs of three nodes, statically determinate: a
load that is balanced, as every load with its contact forces is, puts no force on them, whatever they are.

    bodies = SparseBodies.of([blades, damper])
    StaticContact(bodies, pairs, compliance=SparseCompliance).solve(load)
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import ArrayLike

from hbm.io.dof_table import DIRECTIONS
from modal.body import Body, check_support
from modal.contact_shapes import holding_nodes
from modal.solvers.cholesky import sparse_factor
from static_contact.compliance import Compliance
from static_contact.full.assembled import AssembledBodies

COLUMNS = 256           # unit forces that are dense at once, which bounds the memory


@dataclass(frozen=True)
class SparseBodies:
    """The dofs of bodies one behind the other: as a ReducedModel names them, with K (r, r) as CSR."""

    bodies: tuple[Body, ...]
    K: sp.csr_matrix
    body: np.ndarray
    node: np.ndarray
    direction: np.ndarray
    position: np.ndarray
    rigid: dict[str, np.ndarray]

    @classmethod
    def of(cls, bodies: list[Body]) -> "SparseBodies":
        """Raises InputError where a body is not supported as declared."""
        for one in bodies:
            check_support(one)
        join = np.concatenate
        return cls(tuple(bodies), sp.block_diag([one.K for one in bodies], format="csr"),
                   np.repeat([one.name for one in bodies], [one.dofs for one in bodies]),
                   join([one.node[one.dof_node] for one in bodies]),
                   join([np.array(DIRECTIONS)[one.dof_direction] for one in bodies]),
                   join([one.position[one.dof_node] for one in bodies]),
                   {one.name: one.rigid_motions()[:, :6 * one.free] for one in bodies})

    @property
    def size(self) -> int:
        """r, the number of dofs."""
        return self.K.shape[0]

    @property
    def moves(self) -> np.ndarray:
        """(r,) bool: all of them are displacements of nodes."""
        return np.ones(self.size, dtype=bool)

    def motion_of(self, body: str, numbers: ArrayLike) -> sp.csr_matrix:
        """(3n, r): x, y, z of nodes and contact points in turn."""
        return AssembledBodies(list(self.bodies)).motion_of(body, numbers)


class SparseCompliance(Compliance):
    """As `Compliance`, of a SparseBodies: K is not resisted by weak springs, and no motion is held by one."""

    def _factored(self, model, K):
        ends = np.cumsum([0, *(one.dofs for one in model.bodies)])
        self.parts = [slice(int(a), int(b)) for a, b in zip(ends, ends[1:], strict=False)]
        return [sparse_factor(pinned(one)) for one in model.bodies]

    def _solve(self, right):
        found = np.zeros(right.shape)
        for factor, part in zip(self.factor, self.parts, strict=True):
            if right[part].any():
                found[part] = factor.solve(right[part].reshape(part.stop - part.start, -1)).reshape(right[part].shape)
        return found

    def _compliance(self):
        G = np.zeros((self.B.shape[0],) * 2)
        for factor, part in zip(self.factor, self.parts, strict=True):
            own = self.B[:, part]
            mine = np.flatnonzero(np.diff(own.indptr))
            own = own[mine]
            for first in range(0, len(mine), COLUMNS):
                some = slice(first, first + COLUMNS)
                G[np.ix_(mine, mine[some])] += own @ factor.solve(own[some].T.toarray(order="F"))
        return G

    def displacement(self, applied: np.ndarray, force: np.ndarray, amount: np.ndarray
                     ) -> tuple[np.ndarray, np.ndarray]:
        """As of `Compliance`; what forces do along free motions, by inexact meshes, does not go into the pins."""
        idle = self.loose.idle
        return super().displacement(applied - idle @ (idle.T @ (applied - self.B.T @ force)), force, amount)


def pinned(body: Body) -> sp.csr_matrix:
    """K of a body; with springs as stiff as its dofs at six dofs that hold it, where it floats."""
    if not body.free:
        return body.K
    dofs = body.node_dofs(holding_nodes(body))
    six = dofs[sl.qr(body.rigid_motions()[dofs].T, mode="r", pivoting=True)[1][:6]]
    springs = np.zeros(body.dofs)
    springs[six] = body.K.diagonal()[six]
    return (body.K + sp.diags(springs)).tocsr()
