"""One factorisation of a stiffness matrix, for many right-hand sides and for the lowest modes, none of them missed.

CHOLMOD through PETSc and Krylov-Schur through SLEPc, which reuses the same factor; SuperLU and block Lanczos where they
are missing. The modes are counted by a second factorisation at a shift just above the highest of them (inertia.py):
Krylov-Schur can miss one of several equal modes, and what it missed is asked for by block Lanczos (lanczos.py).
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from hbm.errors import InputError
from modal.solvers import petsc, slepc
from modal.solvers.inertia import modes_below
from modal.solvers.lanczos import block_lanczos

RESIDUAL_LIMIT = 1e-8
_COLUMNS = 64
_DENSE = 400  # up to this size all modes come from LAPACK
_PROBES = 4
_BEYOND = 2  # modes beyond those asked for, to see the gap above them


class SingularStiffness(RuntimeError):
    """A linear solve did not satisfy its own equations: the stiffness matrix leaves a motion free."""


@dataclass(frozen=True)
class Modes:
    """omega : (m,) rad/s; phi : (d, m) mass-normalised; free_to : rad/s - there is no further mode below it."""

    omega: np.ndarray
    phi: np.ndarray
    free_to: float


class Factor:
    """Cholesky factor of a symmetric positive definite sparse matrix K (d, d)."""

    def __init__(self, K: sp.csr_matrix):
        self.K = sp.csr_matrix(K)
        PETSc = petsc.start()
        # all nodes may be masters: a matrix of no rows has nothing to factorise
        self._solver = None if not self.K.shape[0] else _Cholmod(PETSc, self.K) if PETSc else _Superlu(self.K)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right for (d,) or (d, m). Raises SingularStiffness when a residual exceeds 1e-8 of its column."""
        right = np.asarray(right, dtype=float)
        if self._solver is None:
            return right
        columns = right[:, None] if right.ndim == 1 else right
        x = np.empty(columns.shape, order="F")
        for first in range(0, columns.shape[1], _COLUMNS):
            part = slice(first, first + _COLUMNS)
            x[:, part] = self._solver.solve(columns[:, part])
            self._check(columns[:, part], x[:, part])
        return x[:, 0] if right.ndim == 1 else x

    def _check(self, right, x):
        """Residual of every column within the limit.

        Many columns are probed first: a Gaussian mixture w of the residuals r_j has E |sum r_j w_j|^2 = sum |r_j|^2,
        and that four mixtures all show less than 1/100 of it has a chance below 1e-8. Where the probe comes within
        1/100 of the limit, each column is looked at by itself.
        """
        size = np.linalg.norm(right, axis=0)
        scale = 1 / np.where(size > 0, size, 1.0)
        if x.shape[1] > 2 * _PROBES:
            mix = scale[:, None] * np.random.default_rng(0).standard_normal((x.shape[1], _PROBES))
            if np.linalg.norm(self.K @ (x @ mix) - right @ mix, axis=0).max() <= RESIDUAL_LIMIT / 100:
                return
        worst = np.max(np.linalg.norm(self.K @ x - right, axis=0) * scale, initial=0.0)
        if not worst <= RESIDUAL_LIMIT:
            raise SingularStiffness(f"the residual of a linear solve is {worst:.1e} of its load (allowed 1e-8): "
                                    "the stiffness matrix leaves a motion free or is badly scaled")

    def lowest_modes(self, M: sp.csr_matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
        """omega (m,) rad/s and mass-normalised shapes (d, m) of the `count` lowest modes of (K, M).

        Raises RuntimeError when a mode's residual exceeds 1e-6 of its stiffness force, or the count by inertia is not
        met.
        """
        modes = self.modes(M, count)
        return modes.omega, modes.phi

    def modes_below(self, M: sp.csr_matrix, hz: float) -> tuple[np.ndarray, np.ndarray]:
        """omega (m,) rad/s and mass-normalised shapes (d, m) of all modes of (K, M) below a frequency, Hz."""
        modes = self.modes(M, below_hz=hz)
        return modes.omega, modes.phi

    def modes(self, M: sp.csr_matrix, count: int | None = None, below_hz: float | None = None) -> "Modes":
        """The `count` lowest modes, or all below a frequency, and the frequency up to which there are no others."""
        size = self.K.shape[0]
        top = None if below_hz is None else (2 * np.pi * below_hz) ** 2
        count = modes_below(self.K, M, np.sqrt(top)) if below_hz is not None else count
        if not 0 <= count <= size:
            raise InputError(f"{count} modes asked for: must be between 0 and the {size} dofs")
        if not size:
            return Modes(np.empty(0), np.empty((0, 0)), np.inf)
        if size <= _DENSE or count > size // 4:
            lam, phi = sl.eigh(self.K.toarray(), M.toarray())
            free = lam[count] if count < size else np.inf
            _refuse_negative(lam)
            return self._checked(M, lam[:count], phi[:, :count], free)
        lam, low, phi = self._solver.lowest(M, max(int(count), 1))
        keep, free = max(int(count), 1), top
        if top is None:
            free = _gap_above(lam, low, keep)
            lam, phi, free = self._complete(M, lam[:keep], phi, free)
        else:
            lam, phi, _ = self._complete(M, lam[:count], phi[:, :count], free, count)
            count = int((lam < top).sum())
        return self._checked(M, lam[:count], phi[:, :count], lam[count] if len(lam) > count else free)

    def _complete(self, M, lam, phi, shift, count=None):
        """All modes below the shift, as many as the inertia counts there, and the shift.

        Those that are missing are asked for with the known ones held out. Where a mode lies on the shift to rounding
        and the two disagree, the shift is raised.
        """
        for attempt in range(8):
            count = modes_below(self.K, M, np.sqrt(shift)) if count is None else count
            lam, phi = self._fill(M, lam, phi, shift, count)
            if int((lam < shift).sum()) == count:
                return lam, phi, shift
            found, tried = int((lam < shift).sum()), count
            shift, count = shift * (1 + 1e-6 * 8**attempt), None
        raise RuntimeError(f"{found} modes found near {np.sqrt(shift) / (2 * np.pi):g} Hz, where the inertia counts "
                           f"{tried}")

    def _fill(self, M, lam, phi, shift, count):
        while (missing := count - int((lam < shift).sum())) > 0:
            more, _, shapes = block_lanczos(self._solver.solve, M, missing, phi)
            more = more[:missing]
            lam, phi = np.concatenate([lam, more]), np.hstack([phi, shapes])
            order = np.argsort(lam)
            lam, phi = lam[order], phi[:, order]
            if more.min() >= shift:
                break
        return lam, phi

    def _checked(self, M, lam, phi, free):
        _refuse_negative(lam)
        phi = phi / np.sqrt(np.einsum("ij,ij->j", phi, M @ phi))
        force = self.K @ phi
        residual = np.linalg.norm(force - M @ phi * lam, axis=0) / np.linalg.norm(force, axis=0)
        if residual.max(initial=0) > 1e-6:
            raise RuntimeError(f"the residual of a mode is {residual.max():.1e} of its stiffness force, allowed 1e-6")
        return Modes(np.sqrt(lam), phi, float(np.sqrt(free)))


def _refuse_negative(lam):
    """omega^2 of a positive definite K are positive: no root is taken of others."""
    if lam.min(initial=np.inf) <= 0:
        raise SingularStiffness(f"K is not positive definite: a mode has omega^2 = {lam.min():.3g} rad2/s2")


def _gap_above(lam, low, count):
    """omega^2 above the top mode asked for, in a gap (by ratio) between it and the estimates that follow.

    High up in the first gap worth the name, else in the widest; an estimate may fall to `low`.
    """
    ratio = low[count:] / lam[count - 1:-1]
    place = 0 if ratio[0] > 1.001 else int(ratio.argmax())
    return lam[count - 1 + place] * max(ratio[place] ** 0.9, 1 + 1e-6)


class _Cholmod:
    def __init__(self, PETSc, K):
        self.PETSc, self.K = PETSc, K
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
            raise SingularStiffness(f"the Cholesky factorisation failed (PETSc error {error.ierr}): "
                                    "the stiffness matrix is not positive definite") from None
        self.factor = self.pc.getFactorMatrix()

    def lowest(self, M, count):
        """omega^2 of a few more modes than asked for, ascending; the same again, since they are converged (see
        block_lanczos); and the shapes (d, count)."""
        if slepc.start() is None:
            return block_lanczos(self.solve, M, count)
        B = petsc.matrix(self.PETSc, M)
        lam, shapes = slepc.lowest(self.A, B, count + _BEYOND, factor=self.factor)
        phi = np.column_stack([shape.getArray() for shape in shapes[:count]])
        for made in (B, *shapes):  # by hand: what Python drops stays in memory
            made.destroy()
        # one step of inverse iteration on all shapes at once: where K is badly conditioned they are good to 1e-7 only
        Y = self.solve(M @ phi)
        best, turn = sl.eigh(Y.T @ (self.K @ Y), Y.T @ (M @ Y))
        lam = np.concatenate([best, lam[count:]])
        return lam, lam, Y @ turn

    def solve(self, right):
        dense = self.PETSc.Mat().createDense(right.shape, array=np.asfortranarray(right), comm=self.PETSc.COMM_SELF)
        x = np.empty(right.shape, order="F")
        out = self.PETSc.Mat().createDense(right.shape, array=x, comm=self.PETSc.COMM_SELF)
        self.factor.matSolve(dense, out)
        dense.destroy()
        out.destroy()
        return x


class _Superlu:
    def __init__(self, K):
        from scipy.sparse.linalg import splu

        try:
            self.factor = splu(K.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                               options={"SymmetricMode": True})
        except RuntimeError as error:
            raise SingularStiffness(f"the factorisation failed: {error}") from None

    def lowest(self, M, count):
        return block_lanczos(self.solve, M, count)

    def solve(self, right):
        return self.factor.solve(np.ascontiguousarray(right))
