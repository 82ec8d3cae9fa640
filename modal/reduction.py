"""Reduction: a Body on its masters, contact shapes and modes, and the way back to the full mesh."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.dof_table import DIRECTIONS
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.points import ContactPoints
from tipdamp.modal.body import Body
from tipdamp.modal.contact_shapes import contact_shapes, spread
from tipdamp.modal.elasticity import Material
from tipdamp.modal.loads import nodal_load
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.stress_recovery import nodal_stress
from tipdamp.modal.truncation import Truncation

# of a frequency: modes nearer to each other are a cluster, which is not parted
EQUAL = 1e-4


@dataclass(frozen=True)
class Reduction:
    """A body reduced onto masters, with the way back to all its dofs.

    model - the body's ReducedModel; boundary, interior : (b,), (i,) int - dofs of the body
    Psi : (i, b); Phi : (i, m); omega : (m,) rad/s - contact shapes, fixed-interface modes and
    static shapes of interior loads in this order; contact_shapes, load_modes - how many of those;
    rigid - number of rigid modes; truncation - what was left out, None where it was not asked for;
    tractions (n, c) - of which the contact shapes are, None where they are of forces on every
    contact point.

    >>> springs = 1e8 * np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])  # held at one end
    >>> table = dict(node=[1, 2, 3], position=0.1 * np.eye(3), dof_node=np.repeat([0, 1, 2], 3))
    >>> K, M, xyz = np.kron(springs, np.eye(3)), np.eye(9), np.tile([0, 1, 2], 3)
    >>> blade = Body.from_matrices("blade", K, M, dof_direction=xyz, **table)
    >>> reduction = craig_bampton(blade, masters=[3], modes=3)
    >>> isinstance(reduction, Reduction), reduction.Phi.shape
    (True, (6, 3))
    """

    body: Body
    model: ReducedModel
    boundary: np.ndarray
    interior: np.ndarray
    Psi: np.ndarray
    Phi: np.ndarray
    omega: np.ndarray
    rigid: int
    contact_shapes: int
    load_modes: int
    truncation: Truncation | None
    tractions: sp.csr_matrix | None = None

    def condense(self, numbers: Iterable[int], forces: np.ndarray) -> np.ndarray:
        """Nodal forces (n, 3) N on any nodes of the mesh as a load on the reduced dofs, (b + m,).

        f_B + Psi' f_I is exact for the static displacement of the master nodes.
        """
        return self.condense_dofs(nodal_load(self.body, numbers, forces))

    def condense_dofs(self, f: np.ndarray) -> np.ndarray:
        """Forces (d,) N on the free dofs of the body as a load on the reduced dofs, (b + m,); exact
        as above."""
        return np.concatenate(
            [f[self.boundary] + self.Psi.T @ f[self.interior], self.Phi.T @ f[self.interior]]
        )

    def recover(self, q: np.ndarray) -> np.ndarray:
        """Displacement of every node of the mesh, (n, 3) m, from this body's part of the reduced
        vector, (b + m,)."""
        b = len(self.boundary)
        full = np.zeros(self.body.dofs, dtype=np.asarray(q).dtype)
        full[self.boundary] = q[:b]
        full[self.interior] = self.Psi @ q[:b] + self.Phi @ q[b:]
        out = np.zeros((len(self.body.node), 3), dtype=full.dtype)
        out[self.body.dof_node, self.body.dof_direction] = full
        return out

    def stress(
        self,
        q: np.ndarray,
        mesh: Mesh,
        material: Material,
        other_materials: dict[str, Material] | None = None,
    ) -> np.ndarray:
        """Stress at every node of the mesh that the body was made of, (n, 6) Pa as in
        `tipdamp.modal.stress_recovery`, from (b + m,)."""
        if not np.array_equal(mesh.node, self.body.node):
            raise InputError(
                f"body '{self.body.name}': the mesh {mesh.source} is not the one that it was made "
                "of"
            )
        return nodal_stress(mesh, material, self.recover(q), other_materials)

    @property
    def mode_omega(self) -> np.ndarray:
        """rad/s of the fixed-interface modes."""
        return self.omega[self.contact_shapes : len(self.omega) - self.load_modes]

    def whole_cluster(self, count: int, equal: float = EQUAL) -> int:
        """Number of modes, at least `count`, that does not part modes whose frequencies differ by
        less than `equal`."""
        omega = self.mode_omega
        while 0 < count < len(omega) and omega[count] <= (1 + equal) * omega[count - 1]:
            count += 1
        return count

    def fewer(self, count: int) -> "Reduction":
        """The same reduction with only its `count` lowest fixed-interface modes; contact shapes and
        load modes stay."""
        cut, c, b = self.cut(count), self.contact_shapes, len(self.boundary)
        rest = np.r_[
            np.arange(c + count), np.arange(len(self.omega) - self.load_modes, len(self.omega))
        ]
        return replace(
            self,
            model=self.in_basis(cut),
            omega=cut.omega,
            truncation=cut.truncation,
            Phi=self.Phi @ cut.X[b:, b:] if c else self.Phi[:, rest],
            contact_shapes=len(cut.omega) - count - self.load_modes,
        )

    def cut(self, count: int) -> "Cut":
        """The basis of `fewer` in that of this reduction."""
        true = len(self.mode_omega)
        if not 0 <= count <= true:
            raise InputError(f"{count} modes asked for: the reduction holds {true}")
        if self.truncation is None:
            raise InputError(
                f"body '{self.body.name}': it was reduced without the bound that fewer modes need; "
                "reduce with bound = True"
            )
        b, c = len(self.boundary), self.contact_shapes
        drop = np.arange(c + count, c + true)
        part = np.r_[np.arange(c), drop]
        rest = np.setdiff1d(np.arange(len(self.omega)), part)
        w, omega, T = self.omega[part], np.empty(0), np.empty((len(part), 0))
        if c:  # made again: they were orthogonal to the modes that are dropped
            omega, T = self._shapes_again(b + part, w)
        unit = sp.identity(self.model.size, format="csr")
        X = sp.hstack(
            [unit[:, :b], sp.csr_matrix(unit[:, b + part] @ T), unit[:, b + rest]], format="csr"
        )
        truncation = replace(
            self.truncation,
            size=np.array([X.shape[1]]),
            omega=self.omega[drop[:1]] if len(drop) else self.truncation.omega,
            G=(self._left_out(self.truncation.G[0], b + part, w, omega, T),),
        )
        return Cut(X, np.r_[omega, self.omega[rest]], truncation)

    def _left_out(
        self, G: np.ndarray, part: np.ndarray, w: np.ndarray, omega: np.ndarray, T: np.ndarray
    ) -> np.ndarray:
        """G of `truncation` where the dofs `part`, of frequencies w rad/s, give way to contact
        shapes T of omega."""
        b, c = len(self.boundary), self.contact_shapes
        # what is dropped beside the shapes, by its coupling with masters and shapes
        left = np.vstack([self.model.M[:b, part], T.T]) / w
        energy = w[:, None] * T / omega
        left -= left @ energy @ energy.T
        if c:
            turn = sl.block_diag(np.eye(b), T[:c])
            G = turn.T @ G @ turn
        return G + left @ left.T

    def _shapes_again(self, part: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(omega, T) of the contact shapes in the dofs `part`, of frequencies w rad/s."""
        W = spread(sp.csr_matrix(self.model.points[self.body.name].motion[:, part]), self.tractions)
        # on coordinates of unit stiffness, where weights go with energies
        none = np.empty((len(part), 0))
        omega, T = contact_shapes(
            lambda f: f, sp.diags(1 / w**2), W @ sp.diags(1 / w), np.empty(0), none
        )
        return omega, T / w[:, None]

    def in_basis(self, cut: "Cut") -> ReducedModel:
        """The model of `fewer`."""
        M, K = (
            np.ascontiguousarray(cut.X.T @ matrix @ cut.X)
            for matrix in (self.model.M, self.model.K)
        )
        points = {name: points.onto(cut.X) for name, points in self.model.points.items()}
        return replace(
            labelled(self.body, self.boundary, (M + M.T) / 2, (K + K.T) / 2, len(cut.omega)),
            points=points,
        )


@dataclass(frozen=True)
class Cut:
    """Fewer modes: X (r, new r) basis in the dofs of the reduction; omega : (new m,) rad/s;
    truncation - what is left out then."""

    X: sp.csr_matrix
    omega: np.ndarray
    truncation: Truncation


def labelled(
    body: Body, boundary: np.ndarray, M: np.ndarray, K: np.ndarray, modes: int
) -> ReducedModel:
    """M, K on the boundary dofs of a body and so many modal ones."""
    at, way = body.dof_node[boundary], body.dof_direction[boundary]
    present = set(body.node[at].tolist())
    groups = {f"{body.name}/{k}": v for k, v in body.groups.items() if set(v.tolist()) <= present}
    motions = body.rigid_motions()[boundary] if body.free else np.zeros((len(boundary), 0))
    rigid = np.vstack([motions, np.zeros((modes, motions.shape[1]))])
    return ReducedModel.from_matrices(
        M,
        K,
        body=body.name,
        node=np.concatenate([body.node[at], np.arange(1, modes + 1)]),
        direction=np.concatenate([np.array(DIRECTIONS)[way], np.full(modes, "mode")]),
        position=np.vstack([body.position[at], np.full((modes, 3), np.nan)]),
        groups=groups,
        provenance={body.name: body.provenance.get("mesh", "matrices")},
        rigid={body.name: rigid},
    )


def points_on(
    body: Body, boundary: np.ndarray, interior: np.ndarray, Psi: np.ndarray, Phi: np.ndarray
) -> dict[str, ContactPoints]:
    """The contact points of the body on its masters and modes: of no interior dof where all their
    nodes are masters."""
    if body.points is None:
        return {}
    motion = body.points.motion
    inside = motion[:, interior]
    onto = sp.hstack(
        [motion[:, boundary] + sp.csr_matrix(inside @ Psi), sp.csr_matrix(inside @ Phi)]
    )
    return {body.name: replace(body.points, motion=onto.tocsr())}
