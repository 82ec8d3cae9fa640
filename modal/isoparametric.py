"""K and M of a block of isoparametric cells, in numpy: any type of `cells.py`, for those that dolfinx cannot take."""

import numpy as np
import scipy.sparse as sp

from modal.cells import tables

_CHUNK = 2000  # cells at a time


def stiffness_and_mass(position, kind: str, cells, lame: float, shear: float, density: float):
    """K (N/m) and consistent M (kg) over all dofs of the mesh (3 i + k for node i), CSR, isotropic linear elasticity.

    position (n, 3) m; cells (c, k) indices into it; lame and shear are Lame's moduli in Pa, density in kg/m3.
        K_ai,bj = integral of lame dN_a/dx_i dN_b/dx_j + shear (dN_a/dx_j dN_b/dx_i + delta_ij grad N_a . grad N_b)
    """
    n = len(position)
    indptr, indices, slot = _pattern(cells, n)
    K = np.zeros((9, len(indices)))
    M = np.zeros(len(indices))
    for first in range(0, len(cells), _CHUNK):
        part = slice(first, first + _CHUNK)
        k, m = _cell_matrices(position[cells[part]], kind, lame, shear, density)
        place = slot[part].ravel()
        low, high = place.min(), place.max() + 1
        M[low:high] += np.bincount(place - low, m.ravel(), high - low)
        for ij in range(9):
            K[ij, low:high] += np.bincount(place - low, k[:, :, :, ij].ravel(), high - low)
    blocks = np.ascontiguousarray(K.T).reshape(-1, 3, 3)
    K = sp.bsr_matrix((blocks, indices, indptr), shape=(3 * n, 3 * n)).tocsr()
    M = sp.bsr_matrix((M[:, None, None] * np.eye(3), indices, indptr), shape=(3 * n, 3 * n)).tocsr()
    M.eliminate_zeros()
    return ((K + K.T) / 2).tocsr(), ((M + M.T) / 2).tocsr()


def _pattern(cells, n):
    """Row pointer and columns of the node-to-node pattern, and the slot of each cell's (a, b) in it, (c, k, k)."""
    c, k = cells.shape
    key = (cells[:, :, None].astype(np.int64) * n + cells[:, None, :]).ravel()
    pairs, slot = np.unique(key, return_inverse=True)
    indptr = np.searchsorted(pairs, np.arange(n + 1, dtype=np.int64) * n)
    return indptr, pairs % n, slot.reshape(c, k, k)


def _cell_matrices(corner, kind, lame, shear, density):
    """(c, k, k, 9) stiffness by node pair and directions (3 i + j), (c, k, k) mass."""
    N, dN, weight = tables(kind)
    c, k = corner.shape[:2]
    J = np.einsum("qin,cnj->cqij", dN, corner, optimize=True)
    volume = np.linalg.det(J) * weight
    gradient = np.linalg.solve(J, np.broadcast_to(dN, (c, *dN.shape)))  # (c, q, 3, n)
    g = gradient.transpose(0, 1, 3, 2).reshape(c, len(weight), 3 * k)
    G = ((g * volume[:, :, None]).transpose(0, 2, 1) @ g).reshape(c, k, 3, k, 3).transpose(0, 1, 3, 2, 4)
    stiffness = lame * G + shear * G.swapaxes(3, 4)
    stiffness += shear * np.einsum("cabii->cab", G)[..., None, None] * np.eye(3)
    mass = density * ((N.T * volume[:, None, :]) @ N)
    return stiffness.reshape(c, k, k, 9), mass
