"""Body: one elastic body as sparse matrices over its free dofs, with the user's node numbers."""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from hbm.errors import InputError, nearest

SYMMETRY = 1e-10  # of the largest entry


@dataclass(frozen=True)
class Body:
    """name; node : (n,) int - the user's node numbers; position : (n, 3) m
    dof_node : (d,) int - index into `node` of each free dof; dof_direction : (d,) int - 0, 1, 2 for x, y, z
    K, M : (d, d) CSR, N/m and kg - symmetric; groups : {name: node numbers}; free : declared to float freely
    loads : {name: (d,) N}; provenance : {str: str}
    M_clamped : (d, c) CSR kg or None - coupling to the clamped dofs (node by node, x, y, z): body forces near a clamp
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

    @classmethod
    def from_matrices(cls, name, K, M, node, position, dof_node, dof_direction, **rest) -> "Body":
        """K, M from any code, with a dof table.

        Raises InputError when shapes disagree, an entry is not finite, a matrix is not symmetric to 1e-10, M is not
        positive definite, or the dof table names a node that is not there or a dof twice.
        """
        K, M = sp.csr_matrix(K), sp.csr_matrix(M)
        dof_node, dof_direction = np.asarray(dof_node), np.asarray(dof_direction)
        node, position = np.asarray(node), np.asarray(position, float)
        if K.shape != M.shape or K.shape[0] != K.shape[1] or not K.shape[0] == len(dof_node) == len(dof_direction):
            raise InputError(f"body '{name}': K is {K.shape}, M is {M.shape}, the dof table has {len(dof_node)} nodes "
                             f"and {len(dof_direction)} directions: they must agree")
        if position.shape != (len(node), 3):
            raise InputError(f"body '{name}': {len(node)} nodes, positions are {position.shape}: must be "
                             f"({len(node)}, 3)")
        body = cls(name, node, position, dof_node, dof_direction, K, M, **rest)
        _check_table(body)
        for label, A in (("K", K), ("M", M)):
            _check_matrix(body, label, A)
        _check_mass(body)
        return body

    @property
    def dofs(self) -> int:
        return self.K.shape[0]

    def group(self, name: str) -> np.ndarray:
        """Node numbers of a group; raises InputError with the groups that exist."""
        if name not in self.groups:
            raise InputError(f"body '{self.name}': no group '{name}'; {nearest(name, sorted(self.groups))}")
        return self.groups[name]

    def node_dofs(self, numbers) -> np.ndarray:
        """Free dofs of the given nodes, in ascending order of (node as given, direction)."""
        wanted = {int(n): i for i, n in enumerate(numbers)}
        rank = np.array([wanted.get(int(n), -1) for n in self.node])[self.dof_node]
        rows = np.flatnonzero(rank >= 0)
        return rows[np.lexsort((self.dof_direction[rows], rank[rows]))]

    def rigid_motions(self) -> np.ndarray:
        """(d, 6): translation along x, y, z and rotation about x, y, z through the centre of the nodes."""
        arm = self.position[self.dof_node] - self.position.mean(axis=0)
        motions = np.zeros((self.dofs, 6))
        unit = np.eye(3)[self.dof_direction]
        motions[:, :3] = unit
        for k in range(3):
            motions[:, 3 + k] = np.einsum("ij,ij->i", np.cross(np.eye(3)[k], arm), unit)
        return motions

    def mass(self) -> np.ndarray:
        """Mass that a unit translation along x, y, z moves, (3,) kg. Clamped dofs do not move."""
        t = self.rigid_motions()[:, :3]
        return np.einsum("ij,ij->j", t, self.M @ t)


def rigid_modes(body: Body) -> int:
    """How many independent rigid motions the body's stiffness does not resist: 0 when held, 6 when free."""
    motions = body.rigid_motions()
    scale = np.sqrt(np.einsum("ij,ij->j", motions, body.M @ motions))
    motions = motions[:, scale > 0] / scale[scale > 0]
    resisted = motions.T @ (body.K @ motions)
    rate = np.linalg.eigvalsh((resisted + resisted.T) / 2)
    # against the stiffness-to-mass ratio of the body's own diagonal, a free motion is zero to rounding
    reference = np.median(body.K.diagonal() / body.M.diagonal())
    return int((rate < 1e-9 * reference).sum())


def parts(body: Body) -> np.ndarray:
    """(d,) int - which piece each dof belongs to; pieces share no entry of K, not even through a third."""
    count = len(body.node)
    K = body.K.tocoo()
    links = body.dof_node[K.row], body.dof_node[K.col]
    graph = sp.coo_matrix((np.ones(K.nnz, dtype=np.int8), links), shape=(count, count))
    label = sp.csgraph.connected_components(graph, directed=False)[1][body.dof_node]
    return np.unique(label, return_inverse=True)[1]


def piece(body: Body, dofs) -> Body:
    """The body restricted to some of its dofs."""
    used = np.unique(body.dof_node[dofs])
    return replace(body, node=body.node[used], position=body.position[used], K=body.K[dofs][:, dofs].tocsr(),
                   M=body.M[dofs][:, dofs].tocsr(), dof_node=np.searchsorted(used, body.dof_node[dofs]),
                   dof_direction=body.dof_direction[dofs], loads={})


def check_support(body: Body) -> int:
    """Number of rigid modes; raises InputError when the body or a piece of it floats undeclared, or is declared free
    and is held."""
    free = rigid_modes(body)
    if free and not body.free:
        held = "nothing holds it" if free == 6 else "it is not held fast"
        raise InputError(f"body '{body.name}': {held}, {free} rigid motions are free; name a clamp group whose nodes "
                         "fix it")
    if body.free and free != 6:
        raise InputError(f"body '{body.name}': declared free but {6 - free} of its 6 rigid motions are held")
    label = parts(body)
    for i in range(label.max() + 1) if label.max() and not body.free else ():
        one = piece(body, np.flatnonzero(label == i))
        if loose := rigid_modes(one):
            raise InputError(f"body '{body.name}' consists of {label.max() + 1} pieces that share no node, and "
                             f"nothing holds the one of {len(one.node)} nodes around "
                             f"{np.round(one.position.mean(axis=0), 4).tolist()} m "
                             f"(node {one.node[0]}): {loose} rigid motions are free; clamp it, or join the meshes")
    return free


# ---- matrices from elsewhere -----------------------------------------------------------------------------------

def _dof(body, i) -> str:
    return f"dof {i} (node {body.node[body.dof_node[i]]}, {'xyz'[body.dof_direction[i]]})"


def _check_table(body):
    for label, column, size in (("node index", body.dof_node, len(body.node)), ("direction", body.dof_direction, 3)):
        wrong = (column < 0) | (column >= size)
        if wrong.any():
            raise InputError(f"body '{body.name}': dof {int(wrong.argmax())} has {label} {column[wrong][0]}, which "
                             f"does not exist or is eliminated; allowed: 0 to {size - 1}")
    key = 3 * body.dof_node.astype(np.int64) + body.dof_direction
    unique, count = np.unique(key, return_counts=True)
    if (count > 1).any():
        raise InputError(f"body '{body.name}': {_dof(body, int((key == unique[count > 1][0]).argmax()))} is in the "
                         "dof table twice")


def _check_matrix(body, label, A):
    entries = A.tocoo()
    bad = ~np.isfinite(entries.data)
    if bad.any():
        i, j = int(entries.row[bad][0]), int(entries.col[bad][0])
        raise InputError(f"body '{body.name}': {label}[{i}, {j}] is {entries.data[bad][0]}: not a finite number, at "
                         f"{_dof(body, i)}")
    gap, scale = abs(A - A.T).tocoo(), max(abs(A).max(), 1e-300)
    if gap.nnz and gap.data.max() > SYMMETRY * scale:
        worst = int(gap.data.argmax())
        i, j = int(gap.row[worst]), int(gap.col[worst])
        raise InputError(f"body '{body.name}': {label} is not symmetric: |{label}[{i}, {j}] - {label}[{j}, {i}]| is "
                         f"{gap.data[worst] / scale:.1e} of its largest entry, allowed {SYMMETRY:g}; at "
                         f"{_dof(body, i)}")


def _check_mass(body):
    """Scaled to a unit diagonal a mass matrix is well conditioned: its lowest eigenvalue comes without a factor."""
    diagonal = body.M.diagonal()
    if (diagonal <= 0).any():
        i = int((diagonal <= 0).argmax())
        empty = not abs(body.M[i]).sum()
        raise InputError(f"body '{body.name}': M has "
                         f"{'a row of zeros' if empty else f'{diagonal[i]:g} on its diagonal'} at "
                         f"{_dof(body, i)}: every dof must have mass ({int((diagonal <= 0).sum())} such dofs)")
    scale = sp.diags(1 / np.sqrt(diagonal))
    lowest, shape = _lowest((scale @ body.M @ scale).tocsr())
    if lowest < -1e-8:
        raise InputError(f"body '{body.name}': M is indefinite: a motion mostly of "
                         f"{_dof(body, int(np.abs(shape).argmax()))} "
                         f"has negative mass ({lowest:.1e} of its diagonal)")


def _lowest(A):
    if A.shape[0] <= 600:
        value, vector = np.linalg.eigh(A.toarray())
        return value[0], vector[:, 0]
    value, vector = sp.linalg.eigsh(A, k=1, which="SA", tol=1e-3, v0=np.ones(A.shape[0]))
    return value[0], vector[:, 0]
