"""Cholesky factor of a body's stiffness that carries some rows W with it: W K^-1 W' and W K^-1 f
without back-solves.

The augmented matrix [K W'; W 0] is eliminated on K, front by front of a nested dissection: a row of
W takes part in the fronts alone that its dofs lead to, and what the elimination leaves is -W K^-1
W'.  [Duff and Reid 1983: multifrontal]"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.linalg.blas import dgemm, dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf

from tipdamp.hbm.compiled import njit
from tipdamp.modal.solvers.cholesky import SingularStiffness

CHUNK = 1 << 22  # numbers of the factor that lie together: small fronts are solved in one go


class _Update(NamedTuple):
    """What a front leaves to the next one, its update matrix: of its later dofs (b,), the lower
    part of (b, b), and of its rows of W, (c, b)."""

    later: np.ndarray
    rows: np.ndarray
    square: np.ndarray
    rest: np.ndarray


class _Chunk(NamedTuple):
    """Fronts, one behind the other. sizes (k, 2): of pivots, and of them with later dofs and rows
    of W; places: all of these, rows counted behind the dofs; values: the columns of the factor at
    each pivot, from the diagonal on."""

    sizes: np.ndarray
    places: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, fronts: Sequence[tuple[tuple, np.ndarray, np.ndarray]]) -> "_Chunk":
        sizes, places, values = zip(*fronts, strict=True)
        return cls(
            np.array(sizes),
            np.concatenate(places),
            values[0] if len(values) == 1 else np.concatenate(values),
        )


class CarryingFactor:
    """K (d, d) > 0 with W (n, d), CSR; sets : dofs in the order of their elimination and the number
    of children of each, as of `dissection`. Raises SingularStiffness where K is not positive
    definite."""

    def __init__(
        self, K: sp.csr_matrix, W: sp.csr_matrix, sets: Sequence[tuple[np.ndarray, int]]
    ) -> None:
        assembly = _FrontAssembly(K, W.T.tocsr(), np.concatenate([one for one, _ in sets]))
        self.dofs, self.rows = K.shape[0], W.shape[0]
        self.compliance = np.zeros((self.rows,) * 2, order="F")
        self.chunks: list[_Chunk] = []
        waiting: list[_Update] = []
        fronts: list[tuple] = []
        for i, (pivots, children) in enumerate(sets):
            split = len(waiting) - children
            dofs, *matrices = assembly.front(pivots, waiting[split:])
            left, values, first = _eliminated(*dofs[1:], *matrices)
            waiting[split:] = [left]
            if len(first):
                _add(self.compliance, left.rows, left.rows, dsyrk(1.0, first, lower=1), True)
            index = np.concatenate([*dofs[:2], self.dofs + dofs[2]])
            fronts.append(((len(pivots), len(index)), index, values))
            if i + 1 == len(sets) or sum(len(one[2]) for one in fronts) > CHUNK:
                self.chunks.append(_Chunk.of(fronts))
                fronts = []

    def take_compliance(self) -> np.ndarray:
        """(n, n) the lower part of W K^-1 W', which is given away: it is large."""
        given, self.compliance = self.compliance, np.zeros((0, 0))
        return given

    def swept(self, load: np.ndarray) -> np.ndarray:
        """(d + n,): what the elimination makes of a load (d,), and -W K^-1 load."""
        x = np.concatenate([load, np.zeros(self.rows)])
        for one in self.chunks:
            _forward(*one, x)
        return x

    def back(self, swept: np.ndarray, force: np.ndarray) -> np.ndarray:
        """K^-1 (load - W' force), (d,), of a load that was swept and of (n,)."""
        x = np.concatenate([swept[: self.dofs], force])
        for one in reversed(self.chunks):
            _backward(*one, x)
        return x[: self.dofs]

    def solve(self, right: np.ndarray) -> np.ndarray:
        """K^-1 right, (d, m)."""
        none = np.zeros(self.rows)
        return np.column_stack([self.back(self.swept(one), none) for one in right.T])

    def felt(self, load: np.ndarray) -> np.ndarray:
        """W K^-1 load, (n,) of (d,), without the way back."""
        return -self.swept(load)[self.dofs :]


class _FrontAssembly:
    """Rows of K, of W' and of what was eliminated before, put together front by front."""

    def __init__(self, K: sp.spmatrix, Wt: sp.spmatrix, order: np.ndarray) -> None:
        self.K, self.Wt, self.order, self.rank = K, Wt, order, np.argsort(order)
        self.at, self.row_at = (
            np.zeros(len(order), dtype=np.int64),
            np.zeros(Wt.shape[1], dtype=np.int64),
        )

    def front(self, pivots: np.ndarray, children: Sequence[_Update]) -> tuple:
        """Pivots, later dofs and rows of a front, and its matrices: (f, f), (b, f), (b, b) and (c,
        f), (c, b) of W."""
        f = len(pivots)
        K = self._entries(self.K, pivots)
        W = self._entries(self.Wt, pivots)
        ahead = self.rank[K[0]] >= self.rank[pivots[0]]
        row, column, value = (one[ahead] for one in K)
        met = np.concatenate([self.rank[row], *(self.rank[one.later] for one in children)])
        later = self.order[np.unique(met[met > self.rank[pivots[-1]]])]
        rows = np.unique(np.concatenate([W[0], *(one.rows for one in children)]))
        self.at[pivots], self.at[later] = np.arange(f), f + np.arange(len(later))
        self.row_at[rows] = np.arange(len(rows))
        b, c = len(later), len(rows)
        shapes = (f, f), (b, f), (b, b), (c, f), (c, b)
        matrices = own, below, _, first, _ = [np.zeros(shape, order="F") for shape in shapes]
        row = self.at[row]
        inside = row < f
        own[row[inside], column[inside]] = value[inside]
        below[row[~inside] - f, column[~inside]] = value[~inside]
        first[self.row_at[W[0]], W[1]] = W[2]
        for one in children:
            self._take_in(one, f, *matrices)
        return (pivots, later, rows), *matrices

    def _take_in(
        self,
        child: _Update,
        f: int,
        own: np.ndarray,
        below: np.ndarray,
        square: np.ndarray,
        first: np.ndarray,
        rest: np.ndarray,
    ) -> None:
        """Add what a child has left to the matrices of a front of f pivots."""
        at, here = self.at[child.later], self.row_at[child.rows]
        k = int(np.searchsorted(at, f))
        _add(own, at[:k], at[:k], child.square[:k, :k], True)
        _add(below, at[k:] - f, at[:k], child.square[k:, :k], False)
        _add(square, at[k:] - f, at[k:] - f, child.square[k:, k:], True)
        _add(first, here, at[:k], child.rest[:, :k], False)
        _add(rest, here, at[k:] - f, child.rest[:, k:], False)

    @staticmethod
    def _entries(
        matrix: sp.spmatrix, pivots: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Column of each entry in the rows `pivots` of a CSR matrix, position of its row among
        them, and value."""
        some = matrix[pivots]
        return some.indices, np.repeat(np.arange(len(pivots)), np.diff(some.indptr)), some.data


def _eliminated(
    later: np.ndarray,
    rows: np.ndarray,
    own: np.ndarray,
    below: np.ndarray,
    square: np.ndarray,
    first: np.ndarray,
    rest: np.ndarray,
) -> tuple[_Update, np.ndarray, np.ndarray]:
    """What a front leaves, the columns of its factor, and those at the rows of W (c, f)."""
    L, failed = dpotrf(own, lower=1, overwrite_a=1)
    if failed:
        raise SingularStiffness(
            "the Cholesky factorisation failed: the stiffness matrix is not positive definite"
        )
    below, first = (
        dtrsm(1.0, L, one, side=1, lower=1, trans_a=1, overwrite_b=1) if len(one) else one
        for one in (below, first)
    )
    if len(below):
        square = dsyrk(-1.0, below, beta=1.0, c=square, lower=1, overwrite_c=1)
        if len(first):
            rest = dgemm(-1.0, first, below, beta=1.0, c=rest, trans_b=1, overwrite_c=1)
    return _Update(later, rows, square, rest), _columns(L, below, first), first


@njit(cache=True)
def _columns(L: np.ndarray, below: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Columns of the factor from the diagonal on, one behind the other."""
    f, b, c = len(L), len(below), len(first)
    values, at = np.empty(f * (f + 1) // 2 + f * (b + c)), 0
    for j in range(f):
        values[at : at + f - j] = L[j:, j]
        values[at + f - j : at + f - j + b] = below[:, j]
        at += f - j + b + c
        values[at - c : at] = first[:, j]
    return values


@njit(cache=True, fastmath={"reassoc", "contract"})
def _forward(sizes: np.ndarray, index: np.ndarray, values: np.ndarray, x: np.ndarray) -> None:
    """Eliminates the pivots of a chunk from the right-hand side x (d + n,), in place."""
    at, here = 0, 0
    for f, n in sizes:
        rows = index[here : here + n]
        w = x[rows]
        for j in range(f):
            y = w[j] / values[at]
            w[j] = y
            # indices that are seen to be in range: vectorised
            column, rest = values[at + 1 : at + n - j], w[j + 1 :]
            for i in range(len(column)):
                rest[i] -= y * column[i]
            at += n - j
        for i in range(n):
            x[rows[i]] = w[i]
        here += n


@njit(cache=True, fastmath={"reassoc", "contract"})
def _backward(sizes: np.ndarray, index: np.ndarray, values: np.ndarray, x: np.ndarray) -> None:
    """Solves for the pivots of a chunk, in place, with what x (d + n,) has behind them."""
    at, here = len(values), len(index)
    for k in range(len(sizes) - 1, -1, -1):
        f, n = sizes[k]
        here -= n
        rows = index[here : here + n]
        w = x[rows]
        for j in range(f - 1, -1, -1):
            at -= n - j
            column, rest, known = values[at + 1 : at + n - j], w[j + 1 :], 0.0
            for i in range(len(column)):
                known += column[i] * rest[i]
            w[j] = (w[j] - known) / values[at]
            x[rows[j]] = w[j]


@njit(cache=True)
def _add(
    matrix: np.ndarray, rows: np.ndarray, columns: np.ndarray, block: np.ndarray, lower: bool
) -> None:
    """Adds a block to the rows and columns of a matrix, or of a square block the lower part
    alone."""
    for j in range(len(columns)):
        for i in range(j if lower else 0, len(rows)):
            matrix[rows[i], columns[j]] += block[i, j]
