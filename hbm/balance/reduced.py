"""Receptance of a large stuck system in the few modes that some forces excite.

The response of (K, M, C) to forces in the span of given columns lies, up to a frequency, in the
space of the first moments of (K + i w C - w^2 M)^-1 about w = 0, the second-order Krylov space
[Bai, Su 2005]; the matrices projected on it have a receptance of the same form. With damping ratios
the damping is a square root of K^-1 M, for which moments converge slowly: the solutions of (K + s
M) q = f for a few s help [rational Krylov space, Guettel 2013]. The space grows until the response
to the columns repeats; what they do not excite is left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.linalg.blas import dtrmm, dtrsm
from scipy.linalg.lapack import dpotrf, dpotrs

from tipdamp.hbm.balance.receptance import Receptance, of_modes
from tipdamp.hbm.balance.settings import DEFAULT


@dataclass(frozen=True)
class StuckMatrices:
    """The stuck system, and the coordinates z = L' q / scale in which its stiffness is the unit
    matrix.

    M, K : (r, r); C : (r, r), or None where `ratio` is the damping ratio of every mode
    scale : (r,) unit of each dof; factor : L (r, r), lower, of K in these units
    """

    M: np.ndarray
    K: np.ndarray
    C: np.ndarray | None
    ratio: float
    scale: np.ndarray
    factor: np.ndarray

    @cached_property
    def mass(self) -> np.ndarray | sp.csr_matrix:
        """M, for products: sparse where few of its entries are not zero."""
        few = np.count_nonzero(self.M) <= DEFAULT.few_entries * self.M.size
        return sp.csr_matrix(self.M) if few else self.M

    def force(self, f: np.ndarray) -> np.ndarray:
        """(r, n) forces in these coordinates."""
        return dtrsm(1.0, self.factor, self.scale[:, None] * f, lower=1)

    def motion(self, z: np.ndarray) -> np.ndarray:
        """(r, n) q of z."""
        return self.scale[:, None] * dtrsm(1.0, self.factor, z, lower=1, trans_a=1)

    def times(self, matrix: np.ndarray | sp.csr_matrix, z: np.ndarray) -> np.ndarray:
        """(r, n) product of z with a matrix of the dofs in these coordinates."""
        return self.force(matrix @ self.motion(z))

    def shifted(self, f: np.ndarray, w: float) -> np.ndarray:
        """(r, n) z of the solutions of (K + w^2 M) q = f."""
        shifted = w**2 * self.M
        shifted += self.K
        factor = dpotrf(shifted.T, lower=1, overwrite_a=1, clean=0)[0]
        q = dpotrs(factor, f, lower=1)[0]
        return dtrmm(1.0, self.factor, q / self.scale[:, None], lower=1, trans_a=1)


class Space:
    """An orthonormal basis (r, m) in these coordinates that grows, and the projected force b, mass
    and damping."""

    def __init__(self, system: StuckMatrices, b: np.ndarray) -> None:
        self.system = system
        self.force = b
        self.basis = np.empty((len(b), 0))
        self.matrices = [system.mass] if system.C is None else [system.mass, system.C]
        self.products = [self.basis] * len(self.matrices)

    def add(self, new: np.ndarray) -> None:
        """Take in the directions (r, n)."""
        new = orthonormal(new, self.basis)
        self.basis = np.hstack([self.basis, new])
        self.products = [
            np.hstack([products, self.system.times(matrix, new)])
            for products, matrix in zip(self.products, self.matrices, strict=True)
        ]

    def projected(self) -> list[np.ndarray]:
        """[mass, damping if a matrix] (m, m)."""
        found = [self.basis.T @ products for products in self.products]
        return [0.5 * (matrix + matrix.T) for matrix in found]

    def receptance(self) -> Receptance:
        """Of the projected system."""
        mass, *damping = self.projected()
        period2, modes = la.eigh(mass)
        shapes = self.basis @ modes[:, ::-1]
        modal = modes[:, ::-1].T @ damping[0] @ modes[:, ::-1] if damping else None
        return of_modes(
            self.system.motion(shapes), period2[::-1], modal, np.full(len(mass), self.system.ratio)
        )

    def response(self, w: np.ndarray) -> np.ndarray:
        """(m, n len(w)) coordinates of the response to b at the frequencies w, relative to it and
        to the static one."""
        mass, *damping = self.projected()
        b = self.basis.T @ self.force
        one = np.eye(len(mass))
        if damping:
            found = [np.linalg.solve(one - v**2 * mass + 1j * v * damping[0], b) for v in w]
        else:
            t, modes = la.eigh(mass)
            t = np.maximum(t, 0.0)
            b = modes.T @ b
            found = [
                modes @ (b / (1 - v**2 * t + 2j * self.system.ratio * v * np.sqrt(t))[:, None])
                for v in w
            ]
        static = np.linalg.norm(self.force, axis=0).max()
        return np.hstack([y / max(static, np.linalg.norm(y, axis=0).max()) for y in found])


def reduced_receptance(system: StuckMatrices, columns: np.ndarray, top: float) -> Receptance | None:
    """Receptance for forces in the span of the columns (r, n) at frequencies up to `top` rad/s.

    None where that takes so many modes that all of them are less work.
    """
    size = np.linalg.norm(columns, axis=0)
    b = system.force(columns[:, size > 0] / size[size > 0])
    space = Space(system, b)
    w = top * np.array(DEFAULT.reduced_checks)
    enough = DEFAULT.reduced_change if system.C is not None else DEFAULT.reduced_change_of_ratio
    space.add(b)
    found = space.response(w)
    for new in directions(system, columns, b, top):
        space.add(new)
        if space.basis.shape[1] > DEFAULT.reduced_share * len(b):
            return None
        before, found = found, space.response(w)
        change = np.vstack([found[: len(before)] - before, found[len(before) :]])
        if np.linalg.norm(change, axis=0).max() <= enough:
            return space.receptance()
    return None


def directions(
    system: StuckMatrices, columns: np.ndarray, b: np.ndarray, top: float
) -> Iterator[np.ndarray]:
    """The moments of the response to b one after the other; with damping ratios the shifted
    solutions after a few."""
    series = moments(system, b, top)
    if system.C is None:
        yield from islice(series, DEFAULT.reduced_moments)
        heavy = system.M.diagonal() > 0
        fastest = np.sqrt((system.K.diagonal()[heavy] / system.M.diagonal()[heavy]).max())
        for share in DEFAULT.reduced_shifts:
            yield system.shifted(
                columns, (DEFAULT.reduced_slowest * top) ** (1 - share) * (2 * fastest) ** share
            )
    yield from series


def moments(system: StuckMatrices, b: np.ndarray, top: float) -> Iterator[np.ndarray]:
    """Blocks (r, n) of y_{k+1} = -C y_k - M y_{k-1} from y_0 = b, orthonormal as pairs (y_k,
    y_{k-1}) in units of top; without C those of -M alone."""
    r = len(b)
    C = system.C
    last = known = orthonormal(
        b if C is None else np.vstack([b, 0 * b]), np.empty((r if C is None else 2 * r, 0))
    )
    while True:
        y, before = last[:r], last[-r:]
        new = -(top**2) * system.times(system.mass, before)
        if C is not None:
            new = np.vstack([new - top * system.times(C, y), y])
        last = orthonormal(new, known)
        known = np.hstack([known, last])
        yield last[:r]


def orthonormal(new: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(r, k) basis of what the columns of `new` add to those of `known`, which are orthonormal."""
    size = np.linalg.norm(new, axis=0)
    new = new[:, size > 0] / size[size > 0]
    for _ in range(2):
        new = new - known @ (known.T @ new)
    new, R, _ = la.qr(new, mode="economic", pivoting=True, check_finite=False)
    new = new[:, np.abs(R.diagonal()) > DEFAULT.reduced_rounding]
    return la.qr(new - known @ (known.T @ new), mode="economic", check_finite=False)[0]
