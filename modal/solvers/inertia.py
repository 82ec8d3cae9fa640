"""How many modes lie below a frequency, counted by the signs of a factorisation: no mode can hide
from it.

K - omega^2 M = L D L' has as many negative pivots as (K, M) has eigenvalues below omega^2
[Sylvester's law of inertia; Parlett, The Symmetric Eigenvalue Problem, sec. 3.3]. MUMPS pivots in
blocks of one and two; SuperLU, where PETSc is missing, stays on the diagonal, which the residual of
a solve must bear out.
"""

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.modal.solvers import petsc
from tipdamp.modal.solvers.cholesky import on_diagonal


@dataclass(frozen=True)
class InertiaSettings:
    """Of a count of negative pivots."""

    dense: int = 300  # up to this size LAPACK gives the signs
    # |A x - b| / (|A| |x| + |b|), infinity norms: the pivots are those of A to that
    backward_error: float = 1e-10
    zero_pivot: float = 1e-15  # of the largest eigenvalue: a smaller one has no sign
    raised_by: float = 1e-7  # of a frequency that hits a mode
    attempts: int = 5


SETTINGS = InertiaSettings()


def modes_below(K: sp.csr_matrix, M: sp.csr_matrix, omega: float) -> int:
    """Number of modes of (K, M) with a frequency below omega, rad/s. K may be singular.

    A frequency that hits a mode is raised by 1e-7 of itself. Raises RuntimeError when no
    trustworthy factor is found."""
    if not K.shape[0]:
        return 0
    for attempt in range(SETTINGS.attempts):
        shifted = (K - (omega * (1 + attempt * SETTINGS.raised_by)) ** 2 * M).tocsr()
        count = _negative_pivots(shifted)
        if count is not None:
            return count
    raise RuntimeError(
        f"the modes below {omega / (2 * np.pi):g} Hz could not be counted: "
        "no factorisation of K - omega^2 M solves its own equations"
    )


def _negative_pivots(A: sp.spmatrix) -> int | None:
    """Number of negative eigenvalues of A, or None where its factor cannot be trusted."""
    if A.shape[0] <= SETTINGS.dense:
        value = sl.eigvalsh(A.toarray())
        unsigned = np.abs(value).min() < SETTINGS.zero_pivot * np.abs(value).max()
        return None if unsigned else int((value < 0).sum())
    PETSc = petsc.start()
    b = np.random.default_rng(1).standard_normal(A.shape[0])
    count, x = _mumps(PETSc, A, b) if PETSc else _superlu(A, b)
    if count is None or x is None or not np.isfinite(x).all():
        return None
    norm = abs(A).sum(axis=1).max()
    error = np.abs(A @ x - b).max() / (norm * np.abs(x).max() + np.abs(b).max())
    return count if error < SETTINGS.backward_error else None


def _mumps(
    PETSc: ModuleType, A: sp.spmatrix, b: np.ndarray
) -> tuple[int | None, np.ndarray | None]:
    matrix = petsc.matrix(PETSc, A)
    right = PETSc.Vec().createWithArray(b, comm=PETSc.COMM_SELF)
    count, x = mumps_inertia(PETSc, matrix, right)
    matrix.destroy()
    return count, None if x is None else x.getArray().copy()


def mumps_inertia(PETSc: Any, matrix: Any, right: Any) -> tuple[int | None, Any]:
    """Negative pivots of a symmetric PETSc matrix over its ranks, None where pivots vanish, and the
    solution for the right-hand side by the same factor; (None, None) without a factor."""
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    # 24: zero pivots are reported, without which there is no inertia; 7: PORD, the best ordering of
    # Debian's MUMPS; 14: room for delayed pivots, in percent
    for control, value in ((24, 1), (7, 4), (14, 50)):
        PETSc.Options()[f"tipdamp_inertia_mat_mumps_icntl_{control}"] = value
    pc = PETSc.PC().create(matrix.comm)
    pc.setOptionsPrefix("tipdamp_inertia_")
    pc.setOperators(matrix)
    pc.setType("cholesky")
    pc.setFactorSolverType("mumps")
    pc.setFromOptions()
    factor = None
    try:
        pc.setUp()
        factor = pc.getFactorMatrix()
        negative, zero, _ = factor.getInertia()
        x = right.duplicate()
        pc.apply(right, x)
        return (None if zero else int(negative)), x
    except PETSc.Error:
        return None, None
    finally:  # all by hand: what Python drops stays in memory, the factor with it
        for one in (factor, pc):
            if one is not None:
                one.destroy()


def _superlu(A: sp.spmatrix, b: np.ndarray) -> tuple[int | None, np.ndarray | None]:
    try:
        factor = on_diagonal(A)
    except RuntimeError:
        return None, None
    if not np.array_equal(factor.perm_r, factor.perm_c):
        return None, None
    return int((factor.U.diagonal() < 0).sum()), factor.solve(b)
