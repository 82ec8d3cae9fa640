"""Solutions of Newton's bordered system.

A small one by its LU factors. A large one by GMRES, preconditioned by inverses order by order,
without what couples the orders: each iteration costs products with small matrices, where factors of
the whole need the cube of its size. Iterations are in single precision, and the solution is refined
with residuals in double precision (Carson, Higham, SIAM J. Sci. Comput. 39 (2017) A2834).
"""

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dgetrf, dgetrs

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.condensation import ActiveContacts, by_orders, times_orders
from tipdamp.hbm.balance.kernels import condensed, rotated, sign_of
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.memory import check_matrix_fits


def flops(components: float, orders: int) -> tuple[float, float]:
    """Of a solution by LU factors, and by iterations, for so many active components and orders, 0
    included."""
    factors = 2 / 3 * ((2 * orders - 1) * components) ** 3
    inverses = 8 * orders * components**3
    products = 16 * orders * components**2 + DEFAULT.iteration
    return factors, DEFAULT.beside * inverses + DEFAULT.usual * products


class BorderedSystem(NamedTuple):
    """[I + D G, column; row, corner] on the active rows, n of them with nh coefficients each.

    acting : the contacts with D; G (a nd, n, K) : receptance between their components and the
    active ones; column, row (n nh,)
    """

    acting: ActiveContacts
    G: np.ndarray
    column: np.ndarray
    row: np.ndarray
    corner: float

    def matrix(self) -> np.ndarray:
        """(n nh + 1, n nh + 1), row by row in memory."""
        size = len(self.row) + 1
        system = np.empty((size, size))
        condensed(self.acting.D, self.acting.places, self.G, system)
        system[:-1, -1], system[-1, :-1], system[-1, -1] = self.column, self.row, self.corner
        return system

    def product(self, G: np.ndarray, real: type) -> Callable[[np.ndarray], np.ndarray]:
        """What multiplies a vector (n nh + 1,) of a precision by the matrix, which is not made;
        G (K, a nd, n) : the receptance by orders."""
        places = self.acting.places
        nh = 2 * len(G) - 1
        D = self.acting.D.reshape(len(self.acting.D), self.acting.D.shape[1] * nh, -1)
        G = G.astype(np.result_type(real, np.complex64), copy=False)
        D = D.astype(real, copy=False)
        column: np.ndarray = self.column.astype(real)
        row: np.ndarray = self.row.astype(real)

        def times(v: np.ndarray) -> np.ndarray:
            dg = v[:-1].reshape(-1, nh)
            u = fourier.to_real(times_orders(G, fourier.to_complex(dg))).reshape(len(D), -1, 1)
            change = np.matmul(D, u).reshape(-1, nh)[places] + dg
            last = row @ v[:-1] + real(self.corner) * v[-1]
            return np.append(change.ravel() + column * v[-1], last)

        return times


def solver_of(system: BorderedSystem) -> "DirectSolver | IterativeSolver":
    """The one that takes less time."""
    direct, iterative = flops(len(system.acting.rows), system.G.shape[2])
    return DirectSolver(system.matrix()) if direct < iterative else IterativeSolver(system)


class DirectSolver:
    """By the LU factors of a matrix (n, n), row by row in memory, which is used up; sign : of its
    determinant, 0 where it is singular."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._lu, self._pivots, _ = dgetrf(matrix.T, overwrite_a=True)
        self.sign = sign_of(self._lu, self._pivots)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """(n,) solution for a right side (n,); not a number where the matrix is singular."""
        if not self.sign:
            return np.full_like(right, np.nan)
        return dgetrs(self._lu, self._pivots, right, trans=1)[0]


class IterativeSolver:
    """By GMRES; where it does not converge, by LU factors."""

    def __init__(self, system: BorderedSystem) -> None:
        self._system = system
        G = by_orders(system.G)
        self._factors: DirectSolver | None = None  # many points are kept: only where they must be
        self._roughly = system.product(G, np.float32)
        self._times = system.product(np.moveaxis(system.G, 2, 0), np.float64)  # seldom: no copy
        D = system.acting.D
        places = system.acting.places
        rows = system.acting.rows
        alone = np.matmul(_each_order(D), G.reshape(len(G), len(D), -1, len(rows)))
        alone = alone.reshape(len(G), -1, len(rows))[:, places] + np.eye(len(rows))
        with np.errstate(all="ignore"):
            self._sign = float(np.linalg.slogdet(alone[0].real)[0])  # the other orders are squares
            try:
                self._inverses = np.linalg.inv(alone.astype(np.complex64))
            except np.linalg.LinAlgError:
                self._sign = 0.0

    def solve(self, right: np.ndarray) -> np.ndarray:
        """(n,) solution for a right side (n,); not a number where the matrix is singular."""
        if self._factors is None:
            if (x := self._solved(right)) is not None:
                return x
            self._factors = self._factorised()
        return self._factors.solve(right)

    def _solved(self, right: np.ndarray) -> np.ndarray | None:
        """The solution, None where it does not converge."""
        x = np.zeros_like(right)
        for _ in range(DEFAULT.refinements if self._sign else 0):
            residual = right - self._times(x)
            size = np.abs(residual).max() or 1.0  # the range of single precision is small
            start = self._preconditioned((residual / size).astype(np.float32))
            away = size * float(np.linalg.norm(start))
            enough = DEFAULT.refined * float(np.linalg.norm(x))
            if away <= enough:
                return x
            share = max(DEFAULT.inner, 0.2 * enough / away)
            step, _, left = gmres(self._step, start, DEFAULT.iterations, share)
            if not np.isfinite(step).all() or left > max(share, DEFAULT.slow):
                return None
            x = x + size * step.astype(float)
        return None

    @cached_property
    def sign(self) -> float:
        """Of the determinant of the matrix: that of its part order by order, and of the negative
        eigenvalues of the matrix times the inverse of that part. A Krylov space from a start that
        has them all finds those that are far from the others, around 1; one next to zero asks for
        the factors."""
        if self._sign and not self._factors:
            start = np.random.default_rng(0).normal(size=len(self._system.row) + 1)
            start = start.astype(np.float32)
            _, projected, left = gmres(self._step, start, DEFAULT.iterations, DEFAULT.inner)
            values = np.linalg.eigvals(projected) if left <= DEFAULT.inner else np.zeros(1)
            if np.abs(values).min() > DEFAULT.next_to_zero:
                negative = ((values.imag == 0) & (values.real < 0)).sum()
                return self._sign * (-1.0) ** negative
        return (self._factors or self._factorised()).sign

    def _factorised(self) -> DirectSolver:
        check_matrix_fits(len(self._system.row) + 1)
        return DirectSolver(self._system.matrix())

    def _step(self, v: np.ndarray) -> np.ndarray:
        return self._preconditioned(self._roughly(v))

    def _preconditioned(self, v: np.ndarray) -> np.ndarray:
        """The border stays as it is."""
        orders = fourier.to_complex(v[:-1].reshape(self._inverses.shape[1], -1))
        return np.append(fourier.to_real(times_orders(self._inverses, orders)), v[-1])


def _each_order(D: np.ndarray) -> np.ndarray:
    """(K, a, nd, nd) complex: of the derivatives D (a, nd, nh, nd, nh) what takes an order to
    itself."""
    cosine, sine = np.arange(1, D.shape[2], 2), np.arange(2, D.shape[2], 2)
    real = D[:, :, cosine, :, cosine] + D[:, :, sine, :, sine]
    imaginary = D[:, :, sine, :, cosine] - D[:, :, cosine, :, sine]
    return np.concatenate([D[None, :, :, 0, :, 0], 0.5 * (real + 1j * imaginary)])


def gmres(
    times: Callable[[np.ndarray], np.ndarray], right: np.ndarray, most: int, enough: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """x (n,) with times(x) = right (n,) but for a share, the matrix (m, m) projected on the Krylov
    space, and that share of the right side: at most `enough`, or m is `most`."""
    size = float(np.linalg.norm(right))
    if not size:
        return right, np.eye(1), 0.0
    basis = np.empty((most + 1, len(right)), right.dtype)
    H = np.zeros((most + 1, most))
    R = np.zeros((most, most))
    rotations = np.zeros((most, 2))
    target = np.zeros(most + 1)
    basis[0] = right / size
    target[0] = 1.0
    for m in range(1, most + 1):
        v = times(basis[m - 1])
        for _ in range(2):  # orthogonal to rounding
            along = basis[:m] @ v
            v = v - along @ basis[:m]
            H[:m, m - 1] += along
        H[m, m - 1] = np.linalg.norm(v)
        if not np.isfinite(H[m, m - 1]):
            return np.full_like(right, np.nan), H[:m, :m], np.inf
        R[:m, m - 1] = rotated(H[: m + 1, m - 1], rotations, target)
        left = abs(target[m])
        if left <= enough or H[m, m - 1] == 0:
            break
        basis[m] = v / H[m, m - 1]
    y = solve_triangular(R[:m, :m], target[:m], check_finite=False)
    return size * (y.astype(basis.dtype) @ basis[:m]), H[:m, :m], float(left)
