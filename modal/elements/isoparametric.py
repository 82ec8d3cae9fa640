"""K, M and K_g of a block of isoparametric cells, in numpy: any type of `cells.py`, for those
dolfinx cannot take."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.elements.cells import tables

CHUNK = 2000  # cells at a time


def chunks(cells: np.ndarray) -> Iterator[np.ndarray]:
    """The rows of a table of cells, so many at a time."""
    for first in range(0, len(cells), CHUNK):
        yield cells[first : first + CHUNK]


def stiffness_and_mass(
    position: np.ndarray, kind: str, cells: np.ndarray, lame: float, shear: float, density: float
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """K (N/m) and consistent M (kg) over all dofs of the mesh (3 i + k for node i), CSR, isotropic
    linear elasticity.

    position (n, 3) m; cells (c, k) indices into it; lame and shear are Lame's moduli in Pa, density
        in kg/m3. K_ai,bj = integral of lame dN_a/dx_i dN_b/dx_j + shear (dN_a/dx_j dN_b/dx_i +
        delta_ij grad N_a . grad N_b)
    """
    n = len(position)
    indptr, indices, slot = _pattern(cells, n)
    K = np.zeros((9, len(indices)))
    M = np.zeros(len(indices))
    for part, place in zip(chunks(cells), map(np.ravel, chunks(slot)), strict=True):
        k, m = _cell_matrices(position[part], kind, lame, shear, density)
        low, high = place.min(), place.max() + 1
        for into, values in ((M, m), *zip(K, np.moveaxis(k, 3, 0), strict=True)):
            into[low:high] += np.bincount(place - low, values.ravel(), high - low)
    blocks = np.ascontiguousarray(K.T).reshape(-1, 3, 3)
    K = sp.bsr_matrix((blocks, indices, indptr), shape=(3 * n, 3 * n)).tocsr()
    return ((K + K.T) / 2).tocsr(), _in_each_direction(M, indices, indptr)


def stress_stiffness(
    position: np.ndarray,
    kind: str,
    cells: np.ndarray,
    lame: float,
    shear: float,
    displacement: np.ndarray,
) -> sp.csr_matrix:
    """K_g (N/m) over all dofs of the mesh, CSR: integral of grad N_a . stress grad N_b, the same in
    each direction, with the linear stress of a displacement (n, 3) m."""
    n = len(position)
    indptr, indices, slot = _pattern(cells, n)
    G = np.zeros(len(indices))
    for part, place in zip(chunks(cells), chunks(slot), strict=True):
        gradient, volume = gradients(position[part], kind)
        stress = hooke(gradient @ displacement[part][:, None], lame, shear)
        cell = np.einsum(
            "cqia,cq,cqij,cqjb->cab", gradient, volume, stress, gradient, optimize=True
        )
        G += np.bincount(place.ravel(), cell.ravel(), len(G))
    return _in_each_direction(G, indices, indptr)


def _in_each_direction(
    values: np.ndarray, indices: np.ndarray, indptr: np.ndarray
) -> sp.csr_matrix:
    """Symmetric matrix over all dofs of numbers by node pair that act on each direction alike."""
    A = sp.bsr_matrix(
        (values[:, None, None] * np.eye(3), indices, indptr), shape=(3 * (len(indptr) - 1),) * 2
    ).tocsr()
    A.eliminate_zeros()
    return ((A + A.T) / 2).tocsr()


def _pattern(cells: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Row pointer and columns of the node-to-node pattern, and the slot of each cell's (a, b) in
    it, (c, k, k)."""
    c, k = cells.shape
    key = (cells[:, :, None].astype(np.int64) * n + cells[:, None, :]).ravel()
    pairs, slot = np.unique(key, return_inverse=True)
    indptr = np.searchsorted(pairs, np.arange(n + 1, dtype=np.int64) * n)
    return indptr, pairs % n, slot.reshape(c, k, k)


def _cell_matrices(
    corner: np.ndarray, kind: str, lame: float, shear: float, density: float
) -> tuple[np.ndarray, np.ndarray]:
    """(c, k, k, 9) stiffness by node pair and directions (3 i + j), (c, k, k) mass."""
    c, k = corner.shape[:2]
    gradient, volume = gradients(corner, kind)
    g = gradient.transpose(0, 1, 3, 2).reshape(c, -1, 3 * k)
    G = (
        ((g * volume[:, :, None]).transpose(0, 2, 1) @ g)
        .reshape(c, k, 3, k, 3)
        .transpose(0, 1, 3, 2, 4)
    )
    stiffness = lame * G + shear * G.swapaxes(3, 4)
    stiffness += shear * np.einsum("cabii->cab", G)[..., None, None] * np.eye(3)
    N = tables(kind)[0]
    mass = density * ((N.T * volume[:, None, :]) @ N)
    return stiffness.reshape(c, k, k, 9), mass


def hooke(slope: np.ndarray, lame: float, shear: float) -> np.ndarray:
    """(..., 3, 3) Pa: stress of the displacement gradients (..., 3, 3), isotropic, linear; Lame's
    moduli in Pa."""
    strain = (slope + slope.swapaxes(-1, -2)) / 2
    return 2 * shear * strain + lame * np.trace(strain, axis1=-2, axis2=-1)[
        ..., None, None
    ] * np.eye(3)


def gradients(corner: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the shape functions (c, q, 3, n) 1/m and volumes (c, q) m3 at the integration
    points of cells with nodes at `corner` (c, n, 3) m."""
    _, dN, weight = tables(kind)
    J = np.einsum("qin,cnj->cqij", dN, corner, optimize=True)
    return np.linalg.solve(J, np.broadcast_to(dN, (len(corner), *dN.shape))), np.linalg.det(
        J
    ) * weight
