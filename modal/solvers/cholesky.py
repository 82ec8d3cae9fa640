"""Sparse factors of a positive definite matrix: CHOLMOD through PETSc, SuperLU where PETSc is
missing.

Both have `solve(right)` -> K^-1 right for (d, m).
"""

from types import ModuleType
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.solvers import petsc


class SingularStiffness(RuntimeError):
    """A linear solve did not satisfy its own equations: the stiffness matrix leaves a motion
    free."""


def sparse_factor(K: sp.csr_matrix) -> "Cholmod | SuperLU":
    """The factor of K (d, d), d > 0. Raises SingularStiffness where there is none."""
    PETSc = petsc.start()
    return Cholmod(PETSc, K) if PETSc else SuperLU(K)


class Cholmod:
    """Cholesky factor of K; A : K as a PETSc matrix, factor : PETSc's factored matrix."""

    def __init__(self, PETSc: ModuleType, K: sp.csr_matrix) -> None:
        self.PETSc = PETSc
        self.A = petsc.matrix(PETSc, K)
        self.A.setOption(PETSc.Mat.Option.SPD, True)
        self.pc = PETSc.PC().create(PETSc.COMM_SELF)
        self.pc.setOptionsPrefix("tipdamp_")
        self.pc.setOperators(self.A)
        self.pc.setType("cholesky")
        self.pc.setFactorSolverType("cholmod")
        try:
            self.pc.setUp()
        except PETSc.Error as error:
            raise SingularStiffness(
                f"the Cholesky factorisation failed (PETSc error {error.ierr}): "
                "the stiffness matrix is not positive definite"
            ) from None
        self.factor = self.pc.getFactorMatrix()

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right, (d, m)."""
        dense = self.PETSc.Mat().createDense(
            right.shape, array=np.asfortranarray(right), comm=self.PETSc.COMM_SELF
        )
        x = np.empty(right.shape, order="F")
        out = self.PETSc.Mat().createDense(right.shape, array=x, comm=self.PETSc.COMM_SELF)
        self.factor.matSolve(dense, out)
        dense.destroy()
        out.destroy()
        return x


def on_diagonal(K: sp.spmatrix) -> Any:
    """SuperLU's factor of K, whose pivots stay on the diagonal where they can. RuntimeError where
    there is none."""
    from scipy.sparse.linalg import splu

    return splu(
        K.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


class SuperLU:
    """L D L' factor of K that stays on the diagonal."""

    def __init__(self, K: sp.csr_matrix) -> None:
        try:
            self.factor = on_diagonal(K)
        except RuntimeError as error:
            raise SingularStiffness(f"the factorisation failed: {error}") from None

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right, (d, m)."""
        return self.factor.solve(np.ascontiguousarray(right))
