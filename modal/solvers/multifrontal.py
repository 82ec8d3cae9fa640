"""Cholesky factor of a body's stiffness that carries some rows W with it: W K^-1 W' and W K^-1 f without back-solves.

The augmented matrix [K W'; W 0] is eliminated on K, front by front of a nested dissection: a row of W takes part in the
fronts alone that its dofs lead to, and what the elimination leaves is -W K^-1 W'.  [Duff and Reid 1983: multifrontal]
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numba import njit
from scipy.linalg.blas import dgemm, dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf

from modal.solvers.cholesky import SingularStiffness


@dataclass(frozen=True)
class Front:
    """pivots (f,), later (b,) dofs in the order of elimination, rows (c,) of W, ascending

    L (f, f), below (b, f), carried (c, f): columns of the factor at the pivots, at later dofs and at the rows of W
    """

    pivots: np.ndarray
    later: np.ndarray
    rows: np.ndarray
    L: np.ndarray
    below: np.ndarray
    carried: np.ndarray


class _Left(NamedTuple):
    """What a front leaves to the next one: matrices of its later dofs, (b, b), lower part, and of its rows, (c, b)."""

    front: Front
    square: np.ndarray
    rows: np.ndarray


class CarryingFactor:
    """K (d, d) > 0 with W (n, d), CSR; sets : dofs in the order of their elimination and the number of children of
    each, as of `dissection`. Raises SingularStiffness where K is not positive definite."""

    def __init__(self, K: sp.csr_matrix, W: sp.csr_matrix, sets: Sequence[tuple[np.ndarray, int]]):
        assembly = _Assembly(K, W.T.tocsr(), np.concatenate([one for one, _ in sets]))
        self.rows = W.shape[0]
        self.compliance = np.zeros((self.rows,) * 2, order="F")
        self.fronts: list[Front] = []
        waiting: list[_Left] = []
        for pivots, children in sets:
            split = len(waiting) - children
            waiting[split:] = [_eliminated(*assembly.front(pivots, waiting[split:]))]
            front = waiting[-1].front
            if len(front.rows):
                _add(self.compliance, front.rows, front.rows, dsyrk(1.0, front.carried, lower=1), True)
            self.fronts.append(front)

    def take_compliance(self) -> np.ndarray:
        """(n, n) the lower part of W K^-1 W', which is given away: it is large."""
        given, self.compliance = self.compliance, np.zeros((0, 0))
        return given

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right, (d, m)."""
        x = right.astype(float, copy=True)
        for one in self.fronts:
            y = x[one.pivots] = dtrsm(1.0, one.L, x[one.pivots], lower=1)
            x[one.later] -= one.below @ y
        for one in reversed(self.fronts):
            x[one.pivots] = dtrsm(1.0, one.L, x[one.pivots] - one.below.T @ x[one.later], lower=1, trans_a=1)
        return x

    def felt(self, right: np.ndarray) -> np.ndarray:
        """W K^-1 right, (n,) of (d,), without the way back."""
        x, u = right.astype(float, copy=True), np.zeros(self.rows)
        for one in self.fronts:
            y = dtrsm(1.0, one.L, x[one.pivots, None], lower=1)[:, 0]
            x[one.later] -= one.below @ y
            u[one.rows] += one.carried @ y
        return u


class _Assembly:
    """Rows of K, of W' and of what was eliminated before, put together front by front."""

    def __init__(self, K, Wt, order):
        self.K, self.Wt, self.order, self.rank = K, Wt, order, np.argsort(order)
        self.at, self.row_at = np.zeros(len(order), dtype=np.int64), np.zeros(Wt.shape[1], dtype=np.int64)

    def front(self, pivots, children):
        """Pivots, later dofs and rows of a front, and its matrices: (f, f), (b, f), (b, b) and (c, f), (c, b) of W."""
        f, K, W = len(pivots), self._entries(self.K, pivots), self._entries(self.Wt, pivots)
        ahead = self.rank[K[0]] >= self.rank[pivots[0]]
        row, column, value = (one[ahead] for one in K)
        met = np.concatenate([self.rank[row], *(self.rank[one.front.later] for one in children)])
        later = self.order[np.unique(met[met > self.rank[pivots[-1]]])]
        rows = np.unique(np.concatenate([W[0], *(one.front.rows for one in children)]))
        self.at[pivots], self.at[later] = np.arange(f), f + np.arange(len(later))
        self.row_at[rows] = np.arange(len(rows))
        own, below, square, first, rest = (np.zeros(shape, order="F") for shape in (
            (f, f), (len(later), f), (len(later),) * 2, (len(rows), f), (len(rows), len(later))))
        row = self.at[row]
        inside = row < f
        own[row[inside], column[inside]] = value[inside]
        below[row[~inside] - f, column[~inside]] = value[~inside]
        first[self.row_at[W[0]], W[1]] = W[2]
        for one in children:
            at, here = self.at[one.front.later], self.row_at[one.front.rows]
            k = int(np.searchsorted(at, f))
            _add(own, at[:k], at[:k], one.square[:k, :k], True)
            _add(below, at[k:] - f, at[:k], one.square[k:, :k], False)
            _add(square, at[k:] - f, at[k:] - f, one.square[k:, k:], True)
            _add(first, here, at[:k], one.rows[:, :k], False)
            _add(rest, here, at[k:] - f, one.rows[:, k:], False)
        return (pivots, later, rows), own, below, square, first, rest

    @staticmethod
    def _entries(matrix, pivots):
        """Column of each entry in the rows `pivots` of a CSR matrix, position of its row among them, and value."""
        some = matrix[pivots]
        return some.indices, np.repeat(np.arange(len(pivots)), np.diff(some.indptr)), some.data


def _eliminated(dofs, own, below, square, first, rest):
    """What is left behind a front, in place."""
    L, failed = dpotrf(own, lower=1, overwrite_a=1)
    if failed:
        raise SingularStiffness("the Cholesky factorisation failed: the stiffness matrix is not positive definite")
    below, first = (dtrsm(1.0, L, one, side=1, lower=1, trans_a=1, overwrite_b=1) if len(one) else one
                    for one in (below, first))
    if len(below):
        square = dsyrk(-1.0, below, beta=1.0, c=square, lower=1, overwrite_c=1)
        if len(first):
            rest = dgemm(-1.0, first, below, beta=1.0, c=rest, trans_b=1, overwrite_c=1)
    return _Left(Front(*dofs, L, below, first), square, rest)


@njit(cache=True)
def _add(matrix, rows, columns, block, lower):
    """Adds a block to the rows and columns of a matrix, or of a square block the lower part alone."""
    for j in range(len(columns)):
        for i in range(j if lower else 0, len(rows)):
            matrix[rows[i], columns[j]] += block[i, j]
