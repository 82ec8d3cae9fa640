"""Body: one elastic body as sparse matrices over its free dofs, with the user's node numbers."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from hbm.errors import InputError, nearest


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
        """K, M from any code, with a dof table. Raises InputError when shapes disagree or a matrix is unsymmetric."""
        K, M = sp.csr_matrix(K), sp.csr_matrix(M)
        if K.shape != M.shape or K.shape[0] != K.shape[1] or K.shape[0] != len(dof_node):
            raise InputError(f"body '{name}': K is {K.shape}, M is {M.shape}, the dof table has {len(dof_node)} rows")
        for label, A in (("K", K), ("M", M)):
            if not np.isfinite(A.data).all():
                raise InputError(f"body '{name}': {label} holds an entry that is not a finite number")
            gap = abs(A - A.T).max() / max(abs(A).max(), 1e-300)
            if gap > 1e-10:
                raise InputError(f"body '{name}': {label} is not symmetric ({gap:.1e} of its largest entry)")
        return cls(name, np.asarray(node), np.asarray(position, float), np.asarray(dof_node),
                   np.asarray(dof_direction), K, M, **rest)

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


def check_support(body: Body) -> int:
    """Number of rigid modes; raises InputError when the body floats undeclared, or is declared free and is held."""
    free = rigid_modes(body)
    if free and not body.free:
        raise InputError(f"body '{body.name}': nothing holds it, {free} rigid motions are free; name a clamp group "
                         "with nodes, or declare the body free")
    if body.free and free != 6:
        raise InputError(f"body '{body.name}': declared free but {6 - free} of its 6 rigid motions are held")
    return free
