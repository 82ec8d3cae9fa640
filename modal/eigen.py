"""One factorisation of a stiffness matrix, for many right-hand sides and for the lowest modes.

CHOLMOD through PETSc and Krylov-Schur through SLEPc, which reuses the same factor; scipy where they are missing.
"""

import numpy as np
import scipy.sparse as sp

from hbm.errors import InputError
from modal import petsc

RESIDUAL_LIMIT = 1e-8
_COLUMNS = 128


class SingularStiffness(RuntimeError):
    """A linear solve did not satisfy its own equations: the stiffness matrix leaves a motion free."""


class Factor:
    """Cholesky factor of a symmetric positive definite sparse matrix K (d, d)."""

    def __init__(self, K: sp.csr_matrix):
        self.K = sp.csr_matrix(K)
        PETSc = petsc.start()
        self._solver = _Petsc(PETSc, self.K) if PETSc else _Scipy(self.K)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right for (d,) or (d, m). Raises SingularStiffness when a residual exceeds 1e-8 of its column."""
        right = np.asarray(right, dtype=float)
        columns = right[:, None] if right.ndim == 1 else right
        x = np.empty(columns.shape, order="F")
        for first in range(0, columns.shape[1], _COLUMNS):
            part = slice(first, first + _COLUMNS)
            x[:, part] = self._solver.solve(columns[:, part])
            size = np.linalg.norm(columns[:, part], axis=0)
            residual = np.linalg.norm(self.K @ x[:, part] - columns[:, part], axis=0)
            worst = np.max(residual / np.where(size > 0, size, 1.0), initial=0.0)
            if not worst <= RESIDUAL_LIMIT:
                raise SingularStiffness(f"the residual of a linear solve is {worst:.1e} of its load (allowed 1e-8): "
                                        "the stiffness matrix leaves a motion free or is badly scaled")
        return x[:, 0] if right.ndim == 1 else x

    def lowest_modes(self, M: sp.csr_matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
        """omega (m,) rad/s and mass-normalised shapes (d, m) of the `count` lowest modes of (K, M).

        Raises RuntimeError when fewer converge or a mode's residual exceeds 1e-6 of its stiffness force.
        """
        count = _check_count(count, self.K.shape[0])
        if count == 0:
            return np.empty(0), np.empty((self.K.shape[0], 0))
        lam, phi = self._solver.modes(sp.csr_matrix(M), count)
        order = np.argsort(lam)[:count]
        lam, phi = lam[order], phi[:, order]
        phi = phi / np.sqrt(np.einsum("ij,ij->j", phi, M @ phi))
        force = self.K @ phi
        residual = np.linalg.norm(force - M @ phi * lam, axis=0) / np.linalg.norm(force, axis=0)
        if len(lam) < count or residual.max() > 1e-6:
            raise RuntimeError(f"{len(lam)} of {count} modes found, largest residual {residual.max():.1e}")
        return np.sqrt(lam), phi


def _check_count(count, size):
    if count < 0 or count > size:
        raise InputError(f"{count} modes asked for: must be between 0 and the {size} dofs")
    return int(count)


class _Petsc:
    def __init__(self, PETSc, K):
        self.PETSc = PETSc
        self.A = self._matrix(K)
        self.A.setOption(PETSc.Mat.Option.SPD, True)
        self.ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self.ksp.setOptionsPrefix("tipdamp_")
        self.ksp.setOperators(self.A)
        self.ksp.setType("preonly")
        self.pc = self.ksp.getPC()
        self.pc.setType("cholesky")
        self.pc.setFactorSolverType("cholmod")
        try:
            self.pc.setUp()
        except PETSc.Error as error:
            raise SingularStiffness(f"the Cholesky factorisation failed (PETSc error {error.ierr}): "
                                    "the stiffness matrix is not positive definite") from None

    def _matrix(self, A):
        A = sp.csr_matrix(A)
        A.sort_indices()
        index = self.PETSc.IntType
        return self.PETSc.Mat().createAIJ(A.shape, csr=(A.indptr.astype(index), A.indices.astype(index), A.data),
                                          comm=self.PETSc.COMM_SELF)

    def solve(self, right):
        dense = self.PETSc.Mat().createDense(right.shape, array=np.asfortranarray(right), comm=self.PETSc.COMM_SELF)
        out = self.PETSc.Mat().createDense(right.shape, comm=self.PETSc.COMM_SELF)
        out.setUp()
        self.pc.getFactorMatrix().matSolve(dense, out)
        x = out.getDenseArray().copy()
        dense.destroy()
        out.destroy()
        return x

    def modes(self, M, count):
        from slepc4py import SLEPc

        B = self._matrix(M)
        eps = SLEPc.EPS().create(self.PETSc.COMM_SELF)
        eps.setOptionsPrefix("tipdamp_")
        eps.setOperators(self.A, B)
        eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
        eps.setDimensions(count)
        eps.setTolerances(1e-10, 500)
        eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        eps.setTarget(0.0)
        transform = eps.getST()
        transform.setType(SLEPc.ST.Type.SINVERT)
        transform.setShift(0.0)
        transform.getKSP().setPC(self.pc)
        transform.getKSP().setType("preonly")
        eps.solve()
        found = eps.getConverged()
        lam, phi = np.empty(found), np.empty((M.shape[0], found), order="F")
        vector = self.A.createVecLeft()
        for i in range(found):
            lam[i] = eps.getEigenpair(i, vector).real
            phi[:, i] = vector.getArray()
        eps.destroy()
        B.destroy()
        return lam, phi


class _Scipy:
    def __init__(self, K):
        from scipy.sparse.linalg import splu

        self.K = K
        try:
            self.factor = splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                               options={"SymmetricMode": True})
        except RuntimeError as error:
            raise SingularStiffness(f"the factorisation failed: {error}") from None

    def solve(self, right):
        return self.factor.solve(np.ascontiguousarray(right))

    def modes(self, M, count):
        from scipy.linalg import eigh
        from scipy.sparse.linalg import LinearOperator, eigsh

        size = self.K.shape[0]
        if count >= size - 1:
            return eigh(self.K.toarray(), M.toarray(), subset_by_index=(0, count - 1))
        inverse = LinearOperator(self.K.shape, matvec=self.factor.solve)
        return eigsh(self.K, k=count, M=M, sigma=0.0, OPinv=inverse, tol=1e-10)
