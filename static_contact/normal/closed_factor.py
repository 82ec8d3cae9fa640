"""One Cholesky factor for many sets of closed pairs: rows that come and go are bordered, until they
are many.

With the factor L L' = A of the rows of a base set, a set that differs by the rows j solves

    [A  V] [x]   [b]      V : columns of A where j came, unit columns where j went (there x = 0)
    [V' D] [y] = [d]      D : the block of A where j came, 0 where j went

through the Schur complement D - (L^-1 V)' (L^-1 V) of the size of j.  [Gill, Murray, Saunders and
Wright 1990]"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from scipy.linalg.lapack import dpotrf


@dataclass(frozen=True)
class FactorSettings:
    """When a set gets a factor of its own."""

    share: float = 0.1  # of the base set: so many changed rows cost about as much as a new factor
    few: int = 64  # a set that small always has its own


SETTINGS = FactorSettings()


class ClosedFactor:
    """A (P, P) symmetric, positive definite on every set that is solved for; it is not copied
    whole."""

    def __init__(self, A: np.ndarray) -> None:
        self.A = A
        self.base = np.zeros(0, dtype=int)
        self.L = np.zeros((0, 0))
        self.changed: np.ndarray = np.zeros(0, dtype=int)  # rows that have a column in `bordered`
        self.bordered = np.zeros((0, 0), order="F")  # L^-1 V

    def solve(self, closed: np.ndarray, right: np.ndarray) -> np.ndarray:
        """(P, k): A^-1 right (P, k) on the rows `closed` (P,) bool, zero elsewhere. LinAlgError
        where A is singular there."""
        rows = np.flatnonzero(closed)
        change = np.setxor1d(rows, self.base, assume_unique=True)
        if (
            len(change) > SETTINGS.share * len(self.base)
            or len(rows) <= SETTINGS.few
            and len(change)
        ):
            self._factor(rows)
            change = rows[:0]
        x = np.zeros(right.shape)
        if not len(rows):
            return x
        z = sl.solve_triangular(self.L, right[self.base], lower=True, check_finite=False)
        if len(change):
            came = closed[change]
            V = self._columns(change)
            D = np.where(np.outer(came, came), self.A[np.ix_(change, change)], 0.0)
            y = np.linalg.solve(D - V.T @ V, np.where(came[:, None], right[change], 0.0) - V.T @ z)
            z -= V @ y
        x[self.base] = sl.solve_triangular(self.L, z, lower=True, trans="T", check_finite=False)
        if len(change):
            x[change] = np.where(came[:, None], y, 0.0)
        return x

    def _factor(self, rows: np.ndarray) -> None:
        """Makes `rows` the base."""
        self.L, self.base = np.zeros((0, 0)), rows[:0]
        block = np.asfortranarray(self.A[np.ix_(rows, rows)])
        self.L, failed = dpotrf(block, lower=1, overwrite_a=1, clean=0)
        if failed:
            raise np.linalg.LinAlgError("the compliance of the closed pairs is singular")
        self.base, self.changed = rows, rows[:0]
        self.bordered = np.zeros((len(rows), 0), order="F")

    def _columns(self, change: np.ndarray) -> np.ndarray:
        """L^-1 V of the rows `change`; what was solved for once is kept."""
        new = np.setdiff1d(change, self.changed, assume_unique=True)
        if len(new):
            V = np.asfortranarray(self.A[np.ix_(self.base, new)])
            went = np.isin(new, self.base, assume_unique=True)
            V[:, went] = self.base[:, None] == new[went]
            V = sl.solve_triangular(self.L, V, lower=True, overwrite_b=True, check_finite=False)
            self.changed, self.bordered = np.r_[self.changed, new], np.hstack([self.bordered, V])
        order = np.argsort(self.changed)
        return self.bordered[:, order[np.searchsorted(self.changed, change, sorter=order)]]
