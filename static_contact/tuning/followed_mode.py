"""The followed mode of a model for many sets of springs, each a change of low rank.

In the modes of the model without springs, lam and phi, a set of m springs adds W'W with W (m, r).
What is asked for is the mode of A = diag(lam) + W'W with the largest (f.y)^2, f the followed shape.
The Lanczos process on (A - s)^-1 that starts at f finds just these: the first components of its
eigenvectors, squared, are the MACs of the modes with f [Golub and Meurant 2010, Matrices, moments
and quadrature, sec. 3.1], and with

    (A - s)^-1 = R - R W' (1 + W R W')^-1 W R,     R = 1/(lam - s)        [Sherman, Morrison,
    Woodbury]

a step costs 2 m r. W R W' of all springs there are is made once for a shift s, a set takes its rows
and columns of it. Where there are more springs than modes, A itself is made, from that of the set
before it, and factored.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from tipdamp.hbm.ties import REPEATED, first_largest


@dataclass(frozen=True)
class LanczosSettings:
    """Of the search for one mode."""

    residual: float = 1e-8  # of an eigenvector of (A - s)^-1; its value is good to the square
    fewest: int = 4  # steps before the first look
    # ratio of neighbouring shifts, less 1: a nearer one saves steps, costs a matrix product
    apart: float = 0.03
    beside: float = 1e-4  # the shift keeps this part of itself from a mode without springs


SETTINGS = LanczosSettings()


class FollowedMode:
    """lam (r,), phi (r, r): omega^2 and mass-normalised modes without springs; rows (n, r) - unit
    rows of all springs there are, in the dofs of the model; f (r,): M times the followed shape."""

    def __init__(self, lam: np.ndarray, phi: np.ndarray, rows: np.ndarray, f: np.ndarray) -> None:
        self.lam, self.V, self.f = lam, rows @ phi, phi.T @ f
        self._k, self._A = np.zeros(len(rows)), np.diag(lam)

    def near(self, lam: float) -> "Shifted | Assembled":
        """The search about omega^2 = lam, rad2/s2."""
        if len(self.V) > len(self.lam):
            return Assembled(self, lam)
        shift = lam
        while np.abs(self.lam - shift).min() < SETTINGS.beside * shift:
            shift *= 1 + SETTINGS.beside
        R = 1 / (self.lam - shift)
        return Shifted(self, shift, R, (self.V * R) @ self.V.T)

    def stiffness(self, k: np.ndarray) -> np.ndarray:
        """A (r, r) with springs k (n,) N/m, from that of the last ones by what changes."""
        changed = np.flatnonzero(k != self._k)
        if len(changed) > np.count_nonzero(k):
            self._A, changed = np.diag(self.lam), np.flatnonzero(k)
            self._k = np.zeros(len(k))
        W = self.V[changed]
        self._A, self._k = self._A + (W.T * (k - self._k)[changed]) @ W, k
        return self._A


@dataclass(frozen=True)
class Assembled:
    """As `Shifted`, for more springs than there are modes."""

    model: FollowedMode
    shift: float

    def find(self, k: np.ndarray) -> tuple[float, float]:
        """As of `Shifted`."""
        A = self.model.stiffness(k)
        factor = sl.lu_factor(A - self.shift * np.eye(len(A)), check_finite=False)
        return _lanczos(
            lambda y: sl.lu_solve(factor, y, check_finite=False), self.model.f, self.shift
        )


@dataclass(frozen=True)
class Shifted:
    """R (r,), G (n, n): receptances without springs, of the modes and at the springs, at omega^2 =
    shift."""

    model: FollowedMode
    shift: float
    R: np.ndarray
    G: np.ndarray

    def find(self, k: np.ndarray) -> tuple[float, float]:
        """omega^2 (rad2/s2) of the followed mode with springs k (n,) N/m, and its MAC with the
        followed shape."""
        on = np.flatnonzero(k)
        root = np.sqrt(k[on])
        W = root[:, None] * self.model.V[on]
        factor = sl.lu_factor(
            np.eye(len(on)) + np.outer(root, root) * self.G[np.ix_(on, on)], check_finite=False
        )
        WR = W * self.R
        return _lanczos(
            lambda y: self.R * y - WR.T @ sl.lu_solve(factor, WR @ y, check_finite=False),
            self.model.f,
            self.shift,
        )


def _best(lam: np.ndarray, part: np.ndarray) -> int:
    """The mode of the largest part; of equal parts the lowest one."""
    order = np.argsort(lam)
    return int(order[first_largest(part[order], REPEATED.alike)])


def _lanczos(solve: Callable, f: np.ndarray, shift: float) -> tuple[float, float]:
    """omega^2 = shift + 1/theta, theta the eigenvalue of `solve` (symmetric) whose eigenvector has
    the largest part (f.y)^2, and that part.

    Ends when no other one can have more: the parts add up to f.f, so what is left beside the
    converged ones bounds it. All vectors are kept orthogonal, so that it ends with the last of the
    dofs at the latest.
    """
    size, total = len(f), float(f @ f)
    Q, alpha, beta = np.zeros((size + 1, size)), [], []
    Q[0] = f / np.sqrt(total)
    for j in range(size):
        w = solve(Q[j])
        alpha.append(Q[j] @ w)
        for _ in range(2):
            w = w - (Q[: j + 1] @ w) @ Q[: j + 1]
        beta.append(float(np.linalg.norm(w)))
        whole = j + 1 == size or beta[-1] <= np.finfo(float).eps * np.abs(alpha).max()
        if whole or j + 1 >= SETTINGS.fewest:
            lam, part, sure = _looked_at(alpha, beta, shift, whole)
            if sure:
                break
        Q[j + 1] = w / beta[-1]
    return lam, total * part


def _looked_at(
    alpha: Sequence[float], beta: Sequence[float], shift: float, whole: bool
) -> tuple[float, float, bool]:
    """omega^2 of the eigenvector of the largest part so far, that part of all, and whether no other
    one can have more; whole - there are no others."""
    theta, s = np.linalg.eigh(np.diag(alpha) + np.diag(beta[:-1], 1) + np.diag(beta[:-1], -1))
    part = s[0] ** 2
    good = whole | (beta[-1] * np.abs(s[-1]) <= SETTINGS.residual * np.abs(theta))
    best = _best(shift + 1 / theta, np.where(good, part, 0.0))
    sure = whole or part[best] * (1 - REPEATED.alike) > 1 - part[good].sum()
    return float(shift + 1 / theta[best]), float(part[best]), bool(sure)
