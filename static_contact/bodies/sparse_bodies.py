"""Static contact of the unreduced bodies, for thousands of pairs: nothing is condensed but the
compliance at the pairs.

Each body has one sparse Cholesky factor. One that floats is held at six dofs of three nodes,
statically determinate: a load that is balanced, as every load with its contact forces is, puts no
force on them, whatever they are.

`AssembledBodies` is what `tipdamp.hbm.contact.relative_motion` asks of a model.

    bodies = SparseBodies.of([blades, damper])
    StaticContact(bodies, pairs, compliance=SparseCompliance).solve(load)
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.hbm.io.dof_table import DIRECTIONS
from tipdamp.modal.body import Body, check_support, parts
from tipdamp.modal.contact_shapes import holding_nodes
from tipdamp.modal.craig_bampton import side_by_side
from tipdamp.modal.definite import negative_stiffness
from tipdamp.modal.solvers.cholesky import SingularStiffness
from tipdamp.modal.solvers.dissection import dissection
from tipdamp.modal.solvers.multifrontal import CarryingFactor
from tipdamp.static_contact.bodies.compliance import Compliance
from tipdamp.static_contact.bodies.loose_motions import Loose
from tipdamp.static_contact.bodies.stuck_bodies import StuckBodies


class AssembledBodies:
    """size - dofs of all bodies, one behind the other."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        ends = np.cumsum([body.dofs for body in bodies])
        self.size = int(ends[-1])
        self._bodies = {
            body.name: (body, int(end) - body.dofs) for body, end in zip(bodies, ends, strict=True)
        }

    def motion_of(self, body: str, numbers: ArrayLike) -> sp.csr_matrix:
        """(3n, size): x, y, z of nodes and contact points in turn, as `Body.motion_of`."""
        if body not in self._bodies:
            raise InputError(
                f"there is no body '{shown(str(body))}'; {nearest(str(body), list(self._bodies))}"
            )
        one, start = self._bodies[str(body)]
        own = one.motion_of(str(body), numbers)
        return sp.csr_matrix(
            (own.data, own.indices + start, own.indptr), shape=(own.shape[0], self.size)
        )


@dataclass(frozen=True)
class SparseBodies:
    """The dofs of bodies one behind the other: as a ReducedModel names them, with K and M (r, r) as
    CSR; loads {name: (r,) N} are those that the bodies have, side by side."""

    bodies: tuple[Body, ...]
    K: sp.csr_matrix
    M: sp.csr_matrix
    body: np.ndarray
    node: np.ndarray
    direction: np.ndarray
    position: np.ndarray
    rigid: dict[str, np.ndarray]
    loads: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, bodies: list[Body]) -> "SparseBodies":
        """Raises InputError where a body is not supported as declared, floats in pieces, or has the
        name of another."""
        names = [one.name for one in bodies]
        if not names or len(set(names)) < len(names):
            twice = [name for name in names if names.count(name) > 1]
            raise InputError(
                f"two bodies '{twice[0]}': give each its own name" if twice else "no bodies"
            )
        for one in bodies:
            if check_support(one) and (count := parts(one).max() + 1) > 1:
                raise InputError(
                    f"body '{one.name}' floats in {count} pieces that share no node: make each a "
                    "body of its own, or join the meshes"
                )
        join = np.concatenate
        K, M = (
            sp.block_diag(each, format="csr")
            for each in zip(*((one.K, one.M) for one in bodies), strict=True)
        )
        return cls(
            tuple(bodies),
            K,
            M,
            np.repeat([one.name for one in bodies], [one.dofs for one in bodies]),
            join([one.node[one.dof_node] for one in bodies]),
            join([np.array(DIRECTIONS)[one.dof_direction] for one in bodies]),
            join([one.position[one.dof_node] for one in bodies]),
            {one.name: one.rigid_motions()[:, : 6 * one.free] for one in bodies},
            side_by_side(bodies),
        )

    @property
    def size(self) -> int:
        """r, the number of dofs."""
        return self.K.shape[0]

    @property
    def moves(self) -> np.ndarray:
        """(r,) bool: all of them are displacements of nodes."""
        return np.ones(self.size, dtype=bool)

    def motion_of(self, body: str, numbers: ArrayLike) -> sp.csr_matrix:
        """(3n, r): x, y, z of nodes and contact points in turn; raises InputError for a node
        without a dof."""
        one = next((one for one in self.bodies if one.name == body), None)
        if one is not None and len(
            fixed := np.intersect1d(numbers, np.setdiff1d(one.node, one.node[one.dof_node]))
        ):
            raise InputError(
                f"node {fixed[0]} of body '{body}' is clamped: take it out of the contact "
                f"({len(fixed)} such)"
            )
        return AssembledBodies(list(self.bodies)).motion_of(body, numbers)


class SideBySide:
    """A of bodies that nothing joins, one factor each, and the motions B (P, r) of the pairs."""

    def __init__(self, factors: Sequence[CarryingFactor]) -> None:
        self.factors = factors
        ends = np.cumsum([0, *(one.dofs for one in factors)])
        self.parts = [slice(int(a), int(b)) for a, b in pairwise(ends)]

    def solve(self, right: np.ndarray) -> np.ndarray:
        """A^-1 right, (r,) or (r, m)."""
        found = np.zeros(right.shape)
        for factor, part in zip(self.factors, self.parts, strict=True):
            mine = right[part]
            if mine.any():
                found[part] = factor.solve(mine.reshape(factor.dofs, -1)).reshape(mine.shape)
        return found

    def swept(self, load: np.ndarray) -> tuple[np.ndarray, Any]:
        """B A^-1 load (P,) of a load (r,), and the load as each factor's elimination leaves it."""
        swept = [
            factor.swept(load[part]) for factor, part in zip(self.factors, self.parts, strict=True)
        ]
        left = [one[factor.dofs :] for factor, one in zip(self.factors, swept, strict=True)]
        return -np.sum(left, axis=0), swept

    def back(self, near: Any, force: np.ndarray) -> np.ndarray:
        """A^-1 (load - B' force), (r,), of a load that was swept and of (P,)."""
        each = zip(self.factors, near, strict=True)
        return np.concatenate([factor.back(one, force) for factor, one in each])

    def take_compliance(self) -> np.ndarray:
        """B A^-1 B' (P, P), which is given away: it is large."""
        first, *others = self.factors
        G = first.take_compliance()
        for factor in others:
            G += factor.take_compliance()
        G += np.tril(G, -1).T
        return G


class PinnedBodies(SideBySide):
    """Bodies of a SparseBodies that float held on pins; nothing resists their loose motions. As
    `compliance.HeldBodies`."""

    def __init__(self, model: SparseBodies, B: sp.csr_matrix, loose: Loose, gauge: float) -> None:
        self.B, self.idle = B, loose.idle
        self.Z, self.resisted = loose.Z, loose.resisted
        ends = np.cumsum([0, *(one.dofs for one in model.bodies)])
        super().__init__(
            [
                _on_pins(one, B[:, first:end], model.position[first:end])
                for one, (first, end) in zip(model.bodies, pairwise(ends), strict=True)
            ]
        )

    def swept(self, load: np.ndarray) -> tuple[np.ndarray, Any]:
        """As of SideBySide, with the load."""
        felt, swept = super().swept(load)
        return felt, (load, swept)

    def back(self, near: Any, force: np.ndarray) -> np.ndarray:
        """What forces do along free motions, by inexact meshes, does not go into the pins."""
        load, swept = near
        return super().back(swept, force) - self._pins @ (self.idle.T @ (load - self.B.T @ force))

    def moved(self, q: np.ndarray) -> np.ndarray:
        """q (r,) without what the pins make of free motions."""
        return q - self.idle @ (self.idle.T @ q)

    @cached_property
    def _pins(self) -> np.ndarray:
        """(r, i): what forces along the free motions do to the bodies on their pins."""
        return self.solve(self.idle)


SparseCompliance = partial(Compliance, factored=PinnedBodies)


def sparse_stuck_bodies(model: SparseBodies, B: sp.csr_matrix, k0: np.ndarray) -> StuckBodies:
    """As `stuck_bodies.stuck_bodies`, of a SparseBodies: the springs join the bodies to one sparse
    matrix."""
    A = (model.K + B.T @ sp.diags(k0) @ B).tocsr()
    ends = np.cumsum([0, *(len(one.node) for one in model.bodies)])
    node = np.concatenate(
        [first + one.dof_node for first, one in zip(ends, model.bodies, strict=False)]
    )
    joined = CarryingFactor(A, B, elimination(A, node, model.position))
    return StuckBodies(SideBySide([joined]), k0)


def _on_pins(body: Body, B: sp.spmatrix, position: np.ndarray) -> CarryingFactor:
    K = pinned(body)
    try:
        return CarryingFactor(K, B, elimination(K, body.dof_node, position))
    except SingularStiffness:
        raise negative_stiffness(body, "a motion of the supported body meets it, or none") from None


def pinned(body: Body) -> sp.csr_matrix:
    """K of a body; with springs as stiff as its dofs at six dofs that hold it, where it floats."""
    if not body.free:
        return body.K
    dofs = body.node_dofs(holding_nodes(body))
    six = dofs[sl.qr(body.rigid_motions()[dofs].T, mode="r", pivoting=True)[1][:6]]
    springs = np.zeros(body.dofs)
    springs[six] = body.K.diagonal()[six]
    return (body.K + sp.diags(springs)).tocsr()


def elimination(
    K: sp.csr_matrix, node: np.ndarray, position: np.ndarray
) -> list[tuple[np.ndarray, int]]:
    """Dofs in the order of their elimination from K (d, d), as `tipdamp.modal.solvers.multifrontal`
    takes them; node (d,) index of the node of each, position (d, 3) m."""
    _, first, node = np.unique(node, return_index=True, return_inverse=True)
    d, n = len(node), len(first)
    of_node = sp.csr_matrix((np.ones(d), (np.arange(d), node)), (d, n))
    pattern = sp.csr_matrix((np.ones(K.nnz), K.indices, K.indptr), K.shape)
    dofs = np.split(np.argsort(node, kind="stable"), np.cumsum(np.bincount(node))[:-1])
    return [
        (np.concatenate([dofs[i] for i in nodes]), children)
        for nodes, children in dissection((of_node.T @ pattern @ of_node).tocsr(), position[first])
    ]
