"""Craig-Bampton reduction: a Body and its master nodes become a ReducedModel, and back to the full mesh.

    q_B = master dofs,  q_I = Psi q_B + Phi eta,   Psi = -K_II^-1 K_IB   (constraint modes)
    S = K_BB + K_BI Psi   (the Schur stiffness, exact in statics)                       [Craig and Bampton 1968]

One factorisation of K_II serves Psi, the fixed-interface modes Phi and interior loads. A free body needs no springs
to ground: K_II is positive definite because its boundary is held, and S keeps the six rigid motions.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from hbm.errors import InputError
from hbm.model import DIRECTIONS, ReducedModel
from modal.body import Body, check_support
from modal.eigen import Factor


@dataclass(frozen=True)
class Reduction:
    """model - the body's ReducedModel; boundary, interior : (b,), (i,) int - dofs of the body
    Psi : (i, b); Phi : (i, m); omega : (m,) rad/s - fixed-interface modes; rigid - number of rigid modes."""

    body: Body
    model: ReducedModel
    boundary: np.ndarray
    interior: np.ndarray
    Psi: np.ndarray
    Phi: np.ndarray
    omega: np.ndarray
    rigid: int

    def condense(self, numbers, forces) -> np.ndarray:
        """Nodal forces (n, 3) N on any nodes of the mesh as a load on the reduced dofs, (b + m,).

        f_B + Psi' f_I is exact for the static displacement of the master nodes.
        """
        body = self.body
        full = np.zeros((len(body.node), 3))
        index = {int(n): i for i, n in enumerate(body.node)}
        for number, force in zip(numbers, forces, strict=True):
            full[index[int(number)]] += force
        return self.condense_dofs(full[body.dof_node, body.dof_direction])

    def condense_dofs(self, f) -> np.ndarray:
        """Forces (d,) N on the free dofs of the body as a load on the reduced dofs, (b + m,); exact as above."""
        return np.concatenate([f[self.boundary] + self.Psi.T @ f[self.interior], self.Phi.T @ f[self.interior]])

    def recover(self, q: np.ndarray) -> np.ndarray:
        """Displacement of every node of the mesh, (n, 3) m, from this body's part of the reduced vector, (b + m,)."""
        b = len(self.boundary)
        full = np.zeros(self.body.dofs, dtype=np.asarray(q).dtype)
        full[self.boundary] = q[:b]
        full[self.interior] = self.Psi @ q[:b] + self.Phi @ q[b:]
        out = np.zeros((len(self.body.node), 3), dtype=full.dtype)
        out[self.body.dof_node, self.body.dof_direction] = full
        return out


def craig_bampton(body: Body, masters, modes: int) -> Reduction:
    """Reduce a body onto its master nodes (numbers of the user's mesh) and its `modes` lowest fixed-interface modes.

    modes = 0 is Guyan's static reduction. Raises InputError when a master does not exist or is clamped, and when the
    body's support is not as declared.
    """
    masters = np.unique(np.asarray(masters, dtype=np.int64))
    absent = np.setdiff1d(masters, body.node[body.dof_node])
    if len(absent):
        raise InputError(f"body '{body.name}': master node {absent[0]} does not exist or is clamped")
    rigid = check_support(body)
    boundary = body.node_dofs(masters)
    interior = np.setdiff1d(np.arange(body.dofs), boundary)
    if rigid and np.linalg.matrix_rank(body.rigid_motions()[boundary]) < rigid:
        raise InputError(f"body '{body.name}': it is free and its master nodes do not hold it; name at least three "
                         "that are not on one line")
    K, M = body.K.tocsr(), body.M.tocsr()
    K_IB, K_II = K[interior][:, boundary], K[interior][:, interior]
    M_IB, M_II = M[interior][:, boundary], M[interior][:, interior]
    factor = Factor(K_II)
    Psi = -factor.solve(K_IB.toarray(order="F"))
    omega, Phi = factor.lowest_modes(M_II, modes)

    S = K[boundary][:, boundary].toarray() + K_IB.T @ Psi
    M_Psi = M_II @ Psi + M_IB
    M_BB = M[boundary][:, boundary].toarray() + M_IB.T @ Psi + Psi.T @ M_Psi
    M_BM = (M_Psi.T @ Phi)
    mass = np.block([[(M_BB + M_BB.T) / 2, M_BM], [M_BM.T, np.eye(len(omega))]])
    stiffness = sl.block_diag((S + S.T) / 2, np.diag(omega**2))
    model = _label(body, boundary, mass, stiffness, len(omega))
    reduction = Reduction(body, model, boundary, interior, Psi, Phi, omega, rigid)
    _check_rigid(reduction)
    return reduction


def _label(body, boundary, M, K, modes):
    node = np.concatenate([body.node[body.dof_node[boundary]], np.arange(1, modes + 1)])
    direction = np.concatenate([np.array(DIRECTIONS)[body.dof_direction[boundary]], np.full(modes, "mode")])
    position = np.vstack([body.position[body.dof_node[boundary]], np.full((modes, 3), np.nan)])
    present = set(node[:len(boundary)].tolist())
    groups = {f"{body.name}/{k}": v for k, v in body.groups.items() if set(v.tolist()) <= present}
    return ReducedModel.from_matrices(M, K, body=body.name, node=node, direction=direction, position=position,
                                      groups=groups, provenance={body.name: body.provenance.get("mesh", "matrices")})


def _check_rigid(reduction):
    """The reduced stiffness of a free body must still let it float, to rounding."""
    if not reduction.rigid:
        return
    S = reduction.model.K[:len(reduction.boundary), :len(reduction.boundary)]
    R = reduction.body.rigid_motions()[reduction.boundary]
    lost = np.abs(S @ R).max() / (np.abs(S).max() * np.abs(R).max())
    if lost > 1e-9:
        raise RuntimeError(f"body '{reduction.body.name}': its rigid motions meet a stiffness of {lost:.1e}")


def assemble(*models: ReducedModel) -> ReducedModel:
    """Bodies side by side in one model, not yet connected."""
    names = [n for m in models for n in dict.fromkeys(m.body.tolist())]
    if len(set(names)) < len(names):
        raise InputError(f"bodies must have different names, got {', '.join(names)}")
    C = None
    if any(m.C is not None for m in models):
        C = sl.block_diag(*(np.zeros_like(m.K) if m.C is None else m.C for m in models))
    join = np.concatenate
    return ReducedModel.from_matrices(
        sl.block_diag(*(m.M for m in models)), sl.block_diag(*(m.K for m in models)), C,
        body=join([m.body for m in models]), node=join([m.node for m in models]),
        direction=join([m.direction for m in models]), position=join([m.position for m in models]),
        groups={k: v for m in models for k, v in m.groups.items()}, loads=_side_by_side(models),
        provenance={k: v for m in models for k, v in m.provenance.items()})


def _side_by_side(models):
    """Loads of every model on the joined dofs; a name that several bodies carry is one load case."""
    loads, start, size = {}, 0, sum(m.size for m in models)
    for m in models:
        for name, load in m.loads.items():
            loads.setdefault(name, np.zeros(size))[start:start + m.size] += load
        start += m.size
    return loads
