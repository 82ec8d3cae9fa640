"""Body: one elastic body as sparse matrices over its free dofs, with the user's node numbers."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.points import ContactPoints, motion_of
from tipdamp.modal.definite import SETTINGS, check_stiffness_diagonal, negative_stiffness
from tipdamp.modal.matrix_checks import (
    check_mass,
    check_mass_by_direction,
    check_matrix,
    check_nodes,
    check_table,
    sparse,
)


@dataclass(frozen=True)
class Body:
    """One elastic body: matrices over its free dofs, with the numbers of the user's nodes.

    name; node : (n,) int - the user's node numbers; position : (n, 3) m
    dof_node : (d,) int - index into `node` of each free dof; dof_direction : (d,) int - 0, 1, 2 for
    x, y, z
    K, M : (d, d) CSR, N/m and kg - symmetric; groups : {name: node numbers}; free : declared to
    float freely
    loads : {name: (d,) N}; provenance : {str: str}
    M_clamped : (d, c) CSR kg or None - coupling to the clamped dofs (node by node, x, y, z): body
    forces near a clamp
    points : ContactPoints or None - where a contact meets an unlike mesh
    piece_of_node : (n,) int or None - connected piece of each node; None: a whole K tells (`parts`)

    >>> springs = 1e8 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])  # held at one end
    >>> table = dict(node=[1, 2, 3], position=0.1 * np.eye(3), dof_node=np.repeat([0, 1, 2], 3))
    >>> K, M, xyz = np.kron(springs, np.eye(3)), np.eye(9), np.tile([0, 1, 2], 3)
    >>> blade = Body.from_matrices("blade", K, M, dof_direction=xyz, **table)
    >>> print(blade.dofs, blade.mass())  # kg along x, y, z
    9 [3. 3. 3.]
    """

    name: str
    node: np.ndarray
    position: np.ndarray
    dof_node: np.ndarray
    dof_direction: np.ndarray
    K: sp.csr_matrix
    M: sp.csr_matrix
    groups: dict = field(default_factory=dict)
    free: bool = False
    loads: dict = field(default_factory=dict)
    provenance: dict = field(default_factory=dict)
    M_clamped: sp.csr_matrix | None = None
    points: ContactPoints | None = None
    piece_of_node: np.ndarray | None = None

    @classmethod
    def from_matrices(
        cls,
        name: str,
        K: sp.spmatrix | np.ndarray,
        M: sp.spmatrix | np.ndarray,
        node: "ArrayLike",
        position: "ArrayLike",
        dof_node: "ArrayLike",
        dof_direction: "ArrayLike",
        **rest: Any,
    ) -> "Body":
        """K, M from any code, with a dof table.

        Raises InputError when shapes disagree, an entry or a position is not finite, a matrix is
        complex or not symmetric to 1e-10, M is not positive definite or not the same along x, y and
        z, a node or a dof stands there twice, or the dof table names a node that is not there.
        """
        K, M = sparse(name, "K", K), sparse(name, "M", M)
        dof_node, dof_direction = np.asarray(dof_node), np.asarray(dof_direction)
        node, position = np.asarray(node), np.asarray(position, float)
        if (
            K.shape != M.shape
            or K.shape[0] != K.shape[1]
            or not K.shape[0] == len(dof_node) == len(dof_direction)
        ):
            raise InputError(
                f"body '{name}': K is {K.shape}, M is {M.shape}, the dof table has "
                f"{len(dof_node)} nodes and {len(dof_direction)} directions: they must agree"
            )
        if position.shape != (len(node), 3):
            raise InputError(
                f"body '{name}': {len(node)} nodes, positions are {position.shape}: must be "
                f"({len(node)}, 3)"
            )
        body = cls(name, node, position, dof_node, dof_direction, K, M, **rest)
        check_nodes(body)
        check_table(body)
        for label, A in (("K", K), ("M", M)):
            check_matrix(body, label, A)
        check_mass(body)
        check_mass_by_direction(body)
        return body

    @property
    def dofs(self) -> int:
        """Number of free dofs."""
        return self.K.shape[0]

    def group(self, name: str) -> np.ndarray:
        """Node numbers of a group; raises InputError with the groups that exist."""
        if name not in self.groups:
            raise InputError(
                f"body '{self.name}': no group '{name}'; {nearest(name, sorted(self.groups))}"
            )
        return self.groups[name]

    def node_dofs(self, numbers: Iterable[int]) -> np.ndarray:
        """Free dofs of the given nodes, in ascending order of (node as given, direction)."""
        wanted = {int(n): i for i, n in enumerate(numbers)}
        rank = np.array([wanted.get(int(n), -1) for n in self.node])[self.dof_node]
        rows = np.flatnonzero(rank >= 0)
        return rows[np.lexsort((self.dof_direction[rows], rank[rows]))]

    def motion_of(self, body: str, numbers: "ArrayLike") -> sp.csr_matrix:
        """(3n, d): x, y, z of nodes and contact points in turn, zero where a node is clamped;
        raises InputError for a node that is not there, or another body."""
        if body != self.name:
            raise InputError(f"body '{self.name}' is not '{body}'")
        order = np.argsort(self.node)
        table = np.full((len(self.node), 3), -1)
        table[self.dof_node, self.dof_direction] = np.arange(self.dofs)

        def dofs(number: int) -> np.ndarray:
            place = int(np.searchsorted(self.node, number, sorter=order))
            if place == len(order) or self.node[order[place]] != number:
                raise InputError(f"body '{self.name}' has no node {number}")
            return table[order[place]]

        return motion_of(numbers, dofs, self.points, self.dofs)

    def rigid_motions(self) -> np.ndarray:
        """(d, 6 p) of each of the p pieces that share no node: translation along x, y, z and
        rotation about x, y, z through the centre of its nodes."""
        label, unit = parts(self), np.eye(3)[self.dof_direction]
        motions = np.zeros((self.dofs, 6 * (label.max(initial=0) + 1)))
        for i in range(motions.shape[1] // 6):
            mine = label == i
            place, way = self.position[self.dof_node[mine]], unit[mine]
            arm = place - self.position[np.unique(self.dof_node[mine])].mean(axis=0)
            motions[mine, 6 * i : 6 * i + 3] = way
            for k in range(3):
                motions[mine, 6 * i + 3 + k] = np.einsum(
                    "ij,ij->i", np.cross(np.eye(3)[k], arm), way
                )
        return motions

    def mass(self) -> np.ndarray:
        """Mass that a unit translation along x, y, z moves, (3,) kg. Clamped dofs do not move."""
        t = np.eye(3)[self.dof_direction]
        return np.einsum("ij,ij->j", t, self.M @ t)


def rigid_modes(body: Body) -> int:
    """Number of independent rigid motions that the stiffness does not resist: 0 when fixed, 6 of
    each piece when free.

    Raises InputError where one of them meets negative stiffness.
    """
    return sum(_rigid_modes(one) for one in pieces(body))


def _rigid_modes(body: Body) -> int:
    """Of a body in one piece."""
    motions = body.rigid_motions()
    scale = np.sqrt(np.einsum("ij,ij->j", motions, body.M @ motions))
    motions = motions[:, scale > 0] / scale[scale > 0]
    resisted = motions.T @ (body.K @ motions)
    rate, way = np.linalg.eigh((resisted + resisted.T) / 2)
    # against the stiffness-to-mass ratio of the body's own diagonal, a free motion is zero to
    # rounding
    reference = np.median(np.abs(body.K.diagonal()) / body.M.diagonal())
    if rate[0] < -SETTINGS.floating * reference:
        lead = np.flatnonzero(scale > 0)[np.abs(way[:, 0]).argmax()]
        raise negative_stiffness(
            body,
            f"a rigid motion meets it, mostly a {'turn' if lead > 2 else 'slide'} "
            f"{'about' if lead > 2 else 'along'} {'xyz'[lead % 3]}",
        )
    return int((rate < SETTINGS.floating * reference).sum())


def parts(body: Body) -> np.ndarray:
    """(d,) int - connected piece of each dof: K couples no two pieces, directly or through a
    third."""
    if body.piece_of_node is not None:
        return np.unique(body.piece_of_node[body.dof_node], return_inverse=True)[1].ravel()
    # K is symmetric: no need to turn it over
    if sp.csgraph.connected_components(body.K, connection="strong")[0] == 1:
        return np.zeros(body.dofs, dtype=int)
    count = len(body.node)
    K = body.K.tocoo()
    links = body.dof_node[K.row], body.dof_node[K.col]
    graph = sp.coo_matrix((np.ones(K.nnz, dtype=np.int8), links), shape=(count, count))
    label = sp.csgraph.connected_components(graph, directed=False)[1][body.dof_node]
    return np.unique(label, return_inverse=True)[1]


def piece(body: Body, dofs: np.ndarray) -> Body:
    """The body restricted to some of its dofs."""
    used = np.unique(body.dof_node[dofs])
    return replace(
        body,
        node=body.node[used],
        position=body.position[used],
        K=body.K[dofs][:, dofs].tocsr(),
        M=body.M[dofs][:, dofs].tocsr(),
        dof_node=np.searchsorted(used, body.dof_node[dofs]),
        dof_direction=body.dof_direction[dofs],
        loads={},
        piece_of_node=np.zeros(len(used), dtype=int),
    )


def pieces(body: Body) -> list[Body]:
    """The connected pieces of a body, each as one of its own."""
    label = parts(body)
    count = label.max(initial=0) + 1
    return [body] if count == 1 else [piece(body, np.flatnonzero(label == i)) for i in range(count)]


def piece_in_words(one: Body) -> str:
    """'the one of 27 nodes around [0.005, 0.005, 0.005] m (node 28)'"""
    return (
        f"the one of {len(one.node)} nodes around "
        f"{np.round(one.position.mean(axis=0), 4).tolist()} m (node {one.node[0]})"
    )


def check_support(body: Body) -> int:
    """Number of rigid modes; raises InputError when the body or a piece of it floats undeclared, or
    is declared free and is held, and when a dof or a rigid motion meets negative stiffness, or a
    dof none."""
    check_stiffness_diagonal(body)
    own = [(one, _rigid_modes(one)) for one in pieces(body)]
    for one, loose in own:
        if loose == 6 * body.free:
            continue
        which = f"{piece_in_words(one)}: " * (len(own) > 1)
        if body.free:
            raise InputError(
                f"body '{body.name}': {which}declared free but {6 - loose} of its 6 rigid motions "
                "are held"
            )
        if len(own) > 1:
            raise InputError(
                f"body '{body.name}' consists of {len(own)} pieces that share no node, and "
                f"nothing holds {which}{loose} rigid motions are free; clamp it, or join the "
                "meshes"
            )
        support = "nothing holds it" if loose == 6 else "it is not fully supported"
        raise InputError(
            f"body '{body.name}': {support}, {loose} rigid motions are free; name a clamp group "
            "whose nodes fix it"
        )
    return sum(loose for _, loose in own)
