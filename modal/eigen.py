"""One factorisation of a stiffness matrix, for many right-hand sides and for the lowest modes, none
of them missed.

Krylov-Schur through SLEPc reuses the factor; ARPACK where SLEPc is missing. A Krylov method can
miss one of several equal modes: the modes are counted by a second factorisation at a shift just
above the highest of them (inertia.py), and what is missing is asked for again with the known modes
deflated.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.linalg import ArpackError

from tipdamp.hbm.errors import InputError
from tipdamp.modal.solvers import arpack, slepc
from tipdamp.modal.solvers.cholesky import Cholmod, SingularStiffness, sparse_factor
from tipdamp.modal.solvers.inertia import modes_below

__all__ = ["EigenSettings", "Factor", "Modes", "SingularStiffness"]


@dataclass(frozen=True)
class EigenSettings:
    """Tolerances of the linear solves and of the modes."""

    solve_residual: float = 1e-8  # of a load: a solve that leaves more, and more than rounding,
    singular: float = 1e-4  # or more than this, has met a singular matrix
    mode_residual: float = 1e-6  # of the stiffness force of a mode, omega^2 is good to its square
    columns: int = 64  # right-hand sides solved at once, which bounds the memory
    probes: int = 4  # random mixtures of columns in place of all residuals
    dense: int = 400  # up to this size LAPACK computes all modes
    # up to this size LAPACK helps where few distinct modes leave ARPACK no subspace
    degenerate: int = 10_000
    beyond: int = 2  # modes beyond those asked for, to see the gap above them
    recounts: int = 8  # shifts tried where a mode lies on one to rounding
    bound: float = 1e-6  # of an upper bound of omega, which has its own rounding


SETTINGS = EigenSettings()


@dataclass(frozen=True)
class Modes:
    """omega : (m,) rad/s; phi : (d, m) mass-normalised; free_to : rad/s - there is no further mode
    below it."""

    omega: np.ndarray
    phi: np.ndarray
    free_to: float


class Factor:
    """Cholesky factor of a symmetric positive definite sparse matrix K (d, d)."""

    def __init__(self, K: sp.csr_matrix) -> None:
        self.K = sp.csr_matrix(K)
        # all nodes may be masters: a matrix of no rows has nothing to factorise
        self._solver: Any = sparse_factor(self.K) if self.K.shape[0] else None

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right for (d,) or (d, m). Raises SingularStiffness when a residual exceeds 1e-8 of
        its column and the rounding of K x: a long, slender body moves far under a small load."""
        right = np.asarray(right, dtype=float)
        if self._solver is None:
            return right
        columns = right[:, None] if right.ndim == 1 else right
        width = SETTINGS.columns
        x = np.empty(columns.shape, order="F")
        for first in range(0, columns.shape[1], width):
            part = slice(first, first + width)
            x[:, part] = self._solver.solve(columns[:, part])
            self._check(columns[:, part], x[:, part])
        return x[:, 0] if right.ndim == 1 else x

    def _check(self, right: np.ndarray, x: np.ndarray) -> None:
        """Residual of every column within the limit.

        Many columns are probed first: a Gaussian mixture w of the residuals r_j has E |sum r_j
        w_j|^2 = sum |r_j|^2, and that four mixtures all show less than 1/100 of it has a chance
        below 1e-8. Where the probe comes within 1/100 of the limit, each column is looked at by
        itself.
        """
        size = np.linalg.norm(right, axis=0)
        if not np.isfinite(size).all():
            raise RuntimeError(
                "a load of a linear solve is not a number: what it was made of has overflowed, "
                "or is the root of a negative number"
            )
        scale, allowed = 1 / np.where(size > 0, size, 1.0), SETTINGS.solve_residual
        if x.shape[1] > 2 * SETTINGS.probes:
            mix = scale[:, None] * np.random.default_rng(0).standard_normal(
                (x.shape[1], SETTINGS.probes)
            )
            if np.linalg.norm(self.K @ (x @ mix) - right @ mix, axis=0).max() <= allowed / 100:
                return
        left = np.linalg.norm(self.K @ x - right, axis=0) * scale
        if (left <= allowed).all():
            return
        rounding = (
            np.finfo(float).eps * abs(self.K).sum(axis=0).max() * np.linalg.norm(x, axis=0) * scale
        )
        over = ~(left <= np.maximum(allowed, np.minimum(rounding, SETTINGS.singular)))
        if over.any():
            raise SingularStiffness(
                f"the residual of a linear solve is {left[over].max():.1e} of its load (allowed "
                f"{allowed:g}): the stiffness matrix leaves a motion free or is badly scaled"
            )

    def lowest_modes(self, M: sp.csr_matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
        """omega (m,) rad/s and mass-normalised shapes (d, m) of the `count` lowest modes of (K, M).

        Raises RuntimeError when a mode's residual exceeds 1e-6 of its stiffness force, or the count
        by inertia is not met.
        """
        modes = self.modes(M, count)
        return modes.omega, modes.phi

    def modes_below(self, M: sp.csr_matrix, hz: float) -> tuple[np.ndarray, np.ndarray]:
        """omega (m,) rad/s and mass-normalised shapes (d, m) of all modes of (K, M) below a
        frequency, Hz."""
        modes = self.modes(M, below_hz=hz)
        return modes.omega, modes.phi

    def modes(
        self,
        M: sp.csr_matrix,
        count: int | None = None,
        below_hz: float | None = None,
        at_most: np.ndarray | None = None,
    ) -> Modes:
        """The `count` lowest modes, or all below a frequency, and the frequency up to which there
        are no others.

        at_most (count,) rad/s: upper bounds from a reduction of the same bodies (Rayleigh, Ritz). A
        mode that is missed lifts all above it over theirs; where none is, the modes are not counted
        by a second factorisation.
        """
        size = self.K.shape[0]
        top = None if below_hz is None else (2 * np.pi * below_hz) ** 2
        if top is not None:
            count = modes_below(self.K, M, np.sqrt(top))
        if count is None or not 0 <= count <= size:
            raise InputError(f"{count} modes asked for: must be between 0 and the {size} dofs")
        if not size:
            return Modes(np.empty(0), np.empty((0, 0)), np.inf)
        if size <= SETTINGS.dense or count > size // 4:
            return self._of_dense(M, count)
        keep = max(int(count), 1)
        lam, phi = self._lowest(M, keep)
        if at_most is not None and (np.sqrt(lam[:count]) <= at_most * (1 + SETTINGS.bound)).all():
            return self._checked(M, lam[:count], phi[:, :count], lam[count])
        if top is None:
            free = _gap_above(lam, keep)
            lam, phi, free = self._complete(M, lam[:keep], phi, free)
        else:
            lam, phi, _ = self._complete(M, lam[:count], phi[:, :count], top, count)
            count, free = int((lam < top).sum()), top
        return self._checked(
            M, lam[:count], phi[:, :count], lam[count] if len(lam) > count else free
        )

    def _of_dense(self, M: sp.spmatrix, count: int) -> Modes:
        """The `count` lowest of all modes, by LAPACK."""
        lam, phi = sl.eigh(self.K.toarray(), M.toarray())
        free = lam[count] if count < len(lam) else np.inf
        _refuse_negative(lam)
        return self._checked(M, lam[:count], phi[:, :count], free)

    def _lowest(self, M: sp.spmatrix, count: int) -> tuple[np.ndarray, np.ndarray]:
        """omega^2 of the `count` lowest modes and a few more, ascending, and the shapes (d, count):
        some copies of a repeated mode may be missing."""
        asked = count + SETTINGS.beyond
        if isinstance(self._solver, Cholmod) and slepc.start():
            lam, phi = slepc.lowest_with(self._solver, M, asked, count)
        else:
            try:
                lam, phi = arpack.lowest(self._solver.solve, M, asked)
            except ArpackError:
                return self._by_lapack(M, asked)
        # one step of inverse iteration on all shapes at once: where K is badly conditioned they are
        # good to 1e-7 only
        Y = self._solver.solve(M @ phi[:, :count])
        best, turn = sl.eigh(Y.T @ (self.K @ Y), Y.T @ (M @ Y))
        return np.concatenate([best, lam[count:]]), Y @ turn

    def _by_lapack(self, M: sp.spmatrix, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The `count` lowest modes where they are so few distinct ones that a Krylov method has no
        subspace to find."""
        if M.shape[0] > SETTINGS.degenerate:
            raise RuntimeError(
                f"{count} modes asked for that are repeated so often that ARPACK does not find "
                f"them, of {M.shape[0]} dofs, too many for LAPACK"
            )
        return sl.eigh(self.K.toarray(), M.toarray(), subset_by_index=(0, count - 1))

    def _complete(
        self,
        M: sp.spmatrix,
        lam: np.ndarray,
        phi: np.ndarray,
        shift: float,
        count: int | None = None,
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """All modes below the shift, as many as the inertia counts there, and the shift.

        Those that are missing are asked for with the known ones deflated. Where a mode lies on the
        shift to rounding and the two disagree, the shift is raised.
        """
        for attempt in range(SETTINGS.recounts):
            count = modes_below(self.K, M, np.sqrt(shift)) if count is None else count
            lam, phi = self._fill(M, lam, phi, shift, count)
            if int((lam < shift).sum()) == count:
                return lam, phi, shift
            found, tried = int((lam < shift).sum()), count
            shift, count = shift * (1 + 1e-6 * 8**attempt), None
        raise RuntimeError(
            f"{found} modes found near {np.sqrt(shift) / (2 * np.pi):g} Hz, where the inertia "
            f"counts {tried}"
        )

    def _fill(
        self, M: sp.spmatrix, lam: np.ndarray, phi: np.ndarray, shift: float, count: int
    ) -> tuple[np.ndarray, np.ndarray]:
        while (missing := count - int((lam < shift).sum())) > 0:
            if missing > M.shape[0] // 4:
                return self._by_lapack(M, count)
            try:
                more, shapes = arpack.lowest(self._solver.solve, M, missing, phi)
            except ArpackError:
                return self._by_lapack(M, count)
            lam, phi = np.concatenate([lam, more]), np.hstack([phi, shapes])
            order = np.argsort(lam)
            lam, phi = lam[order], phi[:, order]
            if more.min() >= shift:
                break
        return lam, phi

    def _checked(self, M: sp.spmatrix, lam: np.ndarray, phi: np.ndarray, free: float) -> Modes:
        _refuse_negative(lam)
        phi = phi / np.sqrt(np.einsum("ij,ij->j", phi, M @ phi))
        force = self.K @ phi
        residual = np.linalg.norm(force - M @ phi * lam, axis=0) / np.linalg.norm(force, axis=0)
        if not residual.max(initial=0) <= SETTINGS.mode_residual:
            raise RuntimeError(
                f"the residual of a mode is {residual.max():.1e} of its stiffness force, allowed "
                f"{SETTINGS.mode_residual:g}"
            )
        return Modes(np.sqrt(lam), phi, float(np.sqrt(free)))


def _refuse_negative(lam: np.ndarray) -> None:
    """omega^2 of a positive definite K are positive: no root is taken of others."""
    if lam.min(initial=np.inf) <= 0:
        raise SingularStiffness(
            f"K is not positive definite: a mode has omega^2 = {lam.min():.3g} rad2/s2"
        )


def _gap_above(lam: np.ndarray, count: int) -> float:
    """omega^2 above the top mode asked for, in a gap (by ratio) between it and those that follow:
    high up in the first gap worth the name, else in the widest."""
    ratio = lam[count:] / lam[count - 1 : -1]
    place = 0 if ratio[0] > 1.001 else int(ratio.argmax())
    return lam[count - 1 + place] * max(ratio[place] ** 0.9, 1 + 1e-6)
