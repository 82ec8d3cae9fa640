"""The lowest modes of several stiffness matrices that differ in a few springs, on one factor and in
one space.

    (K + R' k_s R) x = lambda M x,      s = 1, 2, ...

Each set s has its Ritz vectors in the common space; what is left of their equations, solved with
the stiffness of the mean springs, is added to it until all is small. The forces by which a set
differs from the mean, as a reduced model knows them, are in it from the start.  [Davidson 1975]"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.modal.eigen import Factor


@dataclass(frozen=True)
class CommonSettings:
    """Of the space."""

    # of the stiffness force of a mode: what may be left. lambda is good to its square
    residual: float = 1e-5
    begun: int = 10  # inertia forces of random accelerations that are in it from the start
    most: int = 300  # columns: sets that need more have too little in common
    alone: float = 1e-10  # of the largest energy: less of a new column was in the space already


SETTINGS = CommonSettings()


class _Subspace:
    """Columns U that are orthonormal by K, beside K U, M U and R U; all grow from the left."""

    def __init__(self, factor: Factor, M: sp.csr_matrix, R: sp.csr_matrix, most: int) -> None:
        self.factor, self.M_of, self.R_of = factor, M, R
        self.U, self.KU, self.MU = (np.empty((M.shape[0], most), order="F") for _ in range(3))
        self.RU, self.mass, self.size = np.empty((R.shape[0], most)), np.empty((most, most)), 0

    def add(self, forces: np.ndarray, alone: float) -> bool:
        """K^-1 of the forces (n, m); False where there is no room, or nothing new in them."""
        forces = forces / np.linalg.norm(forces, axis=0)
        x, was = self.factor.solve(forces), slice(0, self.size)
        for _ in range(2):
            known = self.KU[:, was].T @ x
            x, forces = x - self.U[:, was] @ known, forces - self.KU[:, was] @ known
        energy = x.T @ forces
        energy, turn = np.linalg.eigh((energy + energy.T) / 2)
        own = energy > alone * energy[-1]
        new = slice(self.size, self.size + int(own.sum()))
        if new.stop > self.mass.shape[0] or energy[-1] <= 0:
            return False
        turn = turn[:, own] / np.sqrt(energy[own])
        self.U[:, new], self.KU[:, new] = x @ turn, forces @ turn
        self.MU[:, new] = self.M_of @ self.U[:, new]
        self.RU[:, new] = self.R_of @ self.U[:, new]
        self.size = new.stop
        self.mass[: new.stop, new] = self.U[:, : new.stop].T @ self.MU[:, new]
        self.mass[new, : new.start] = self.mass[: new.start, new].T
        return True

    def ritz(self, k: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """omega^2 (m,) of the lowest `count` Ritz vectors with springs k added on R; the rest of
        their equations (n, m), and its part of their stiffness force."""
        now, on = slice(0, self.size), np.flatnonzero(k)
        sprung = self.RU[on, now]
        K, M = np.eye(self.size) + sprung.T @ (k[on, None] * sprung), self.mass[now, now]
        lam, y = sl.eigh((K + K.T) / 2, (M + M.T) / 2)
        lam, y = lam[:count], y[:, :count]
        force = self.KU[:, now] @ y + self.R_of[on].T @ (k[on, None] * (sprung @ y))
        rest = force - self.MU[:, now] @ y * lam
        return lam, rest, np.linalg.norm(rest, axis=0) / np.linalg.norm(force, axis=0)


def lowest_of_sets(
    K: sp.csr_matrix,
    M: sp.csr_matrix,
    R: sp.csr_matrix,
    k: np.ndarray,
    motion: Sequence[np.ndarray],
    settings: CommonSettings = SETTINGS,
) -> list[np.ndarray] | None:
    """omega (m,) rad/s of the lowest modes of K + R' diag(k[s]) R for each set s; None where the
    sets have too little in common, or the modes are too many of all.

    k (s, r) N/m of the rows R (r, n); motion : (r, m) for each set, about what R x is in its m
    lowest modes. That none is missed is for the caller to see.
    """
    mean = k.mean(axis=0)
    begun = M @ np.random.default_rng(0).standard_normal((M.shape[0], settings.begun))
    moved = [R.T @ ((one - mean)[:, None] * m) for one, m in zip(k, motion, strict=True)]
    forces = np.hstack([begun, *moved])
    if 2 * forces.shape[1] + settings.begun > min(settings.most, M.shape[0] // 4):
        return None
    space = _Subspace(Factor(K + R.T @ sp.diags(mean) @ R), M, R, settings.most)
    while True:
        if not space.add(forces[:, forces.any(axis=0)], settings.alone):
            return None
        found = [space.ritz(one - mean, m.shape[1]) for one, m in zip(k, motion, strict=True)]
        missing = [rest[:, ~(part <= settings.residual)] for _, rest, part in found]
        forces = np.hstack(missing)
        if not forces.size:
            return [np.sqrt(lam) for lam, _, _ in found]
