"""Load modes: static shapes of interior loads beside the fixed-interface modes [MacNeal 1971,
residual flexibility]."""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.body import Body
from tipdamp.modal.eigen import Factor, Modes
from tipdamp.modal.loads import nodal_load

# of a load's own energy: less is a shape that the modes and the other loads have
LOAD_ENERGY = 1e-8


def with_load_modes(
    body: Body,
    interior: np.ndarray,
    factor: Factor,
    M_II: sp.csr_matrix,
    found: Modes,
    loads: Sequence,
) -> tuple[np.ndarray, np.ndarray]:
    """omega, Phi with the static shapes of the loads added, orthogonal to the modes and to each
    other in K and M.

    loads : as of `craig_bampton`. What the modes leave of K_II^-1 f stays orthogonal to them in
    both; a small eigenvalue problem among the shapes makes each of them a mode of its own with a
    (high) frequency.
    """
    if not loads or not len(interior):
        return found.omega, found.phi
    f = np.column_stack(
        [
            (load if isinstance(load, np.ndarray) else nodal_load(body, *load))[interior]
            for load in loads
        ]
    )
    Z = factor.solve(f)
    size = np.sqrt(np.einsum("ij,ij->j", Z, f))  # 0 for a load on master nodes alone
    Z, f = Z[:, size > 0] / size[size > 0], f[:, size > 0] / size[size > 0]
    for _ in range(2):
        Z = Z - found.phi @ (found.phi.T @ (M_II @ Z))
    K_ZZ, M_ZZ = Z.T @ (factor.K @ Z), Z.T @ (M_II @ Z)
    value, U = np.linalg.eigh((K_ZZ + K_ZZ.T) / 2)
    good = value > LOAD_ENERGY
    U = U[:, good] / np.sqrt(value[good])
    compliance, V = np.linalg.eigh(U.T @ (M_ZZ + M_ZZ.T) @ U / 2)
    return (
        np.concatenate([found.omega, 1 / np.sqrt(compliance)]),
        np.hstack([found.phi, Z @ (U @ V) / np.sqrt(compliance)]),
    )
