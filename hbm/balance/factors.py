"""LU factors of Newton's matrix; those of many contacts in single precision, and solutions refined.

Refined with residuals in double precision, a solution is that of the matrix to double precision
where its condition leaves single precision some digits, in half the time (Higham, Accuracy and
Stability of Numerical Algorithms, 2nd ed., ch. 12). Elsewhere the matrix is factorised again.
"""

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs, sgetrf, sgetrs

from tipdamp.hbm.balance.kernels import sign_of
from tipdamp.hbm.balance.settings import DEFAULT


class Factors:
    """Of a matrix (n, n), row by row in memory, used up or kept. sign : of its determinant,
    0 where it is singular."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._matrix: np.ndarray | None = None
        if len(matrix) < DEFAULT.few_unknowns:
            self._factorise(matrix)
            return
        self._matrix = matrix
        with np.errstate(over="ignore"):
            single = matrix.astype(np.float32)
        self._lu, self._pivots, _ = sgetrf(single.T, overwrite_a=True)
        self.sign = sign_of(self._lu, self._pivots)

    def _factorise(self, matrix: np.ndarray) -> None:
        self._lu, self._pivots, _ = dgetrf(matrix.T, overwrite_a=True)
        self.sign = sign_of(self._lu, self._pivots)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """(n,) solution for a right side (n,)."""
        if self._matrix is not None:
            if (x := self._refined(self._matrix, right)) is not None:
                return x
            self._factorise(self._matrix)
            self._matrix = None
        return dgetrs(self._lu, self._pivots, right, trans=1)[0]

    def _refined(self, matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
        """The solution by single precision, None where refinement does not converge."""
        if not self.sign:
            return None
        x, before = np.zeros_like(right), float("inf")
        for _ in range(DEFAULT.refinements):
            residual: np.ndarray = right - matrix @ x
            size = np.abs(residual).max() or 1.0  # the range of single precision is small
            change = sgetrs(self._lu, self._pivots, residual / size, trans=1)[0] * size
            x = x + change
            step = float(np.linalg.norm(change))
            if step <= DEFAULT.refined * np.linalg.norm(x):
                return x
            if not step < 0.5 * before:
                return None
            before = step
        return None
