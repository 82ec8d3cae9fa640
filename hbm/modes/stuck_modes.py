"""The stuck system in its real modes, with a damping proportional to the mass that drives the
motion: K - W^2 M + i W (C - 2 zeta w M) at the orders W = 0, w .. H w."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.floating import modes_beside
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.errors import InputError

REPEATED = 1e-8  # of a frequency: two modes are one
UNMOVED = 1e-10  # of the most that a mode moves the contacts: nothing excites a mode that has less


@dataclass(frozen=True)
class StuckModalSystem:
    """m shapes of the stuck system, the lowest mode first.

    shapes : (r, m); at_contacts : (nc, m), the same at the components of the contacts
    stiffness, mass : (m,); damping : (m,), or (m, m) where it couples them
    moves : (2, m) bool, whether a shape takes part in order 0, and in the others: a free motion has
        no mean, and what is held in the mean nothing else
    """

    shapes: np.ndarray
    at_contacts: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    moves: np.ndarray

    @property
    def frequencies(self) -> np.ndarray:
        """(m,) rad/s of those that are modes, undamped."""
        vibrates = self.moves.all(axis=0) & (self.mass > 0)
        return np.sqrt(self.stiffness[vibrates] / self.mass[vibrates])

    def impedance(self, w: float, zeta: float, H: int) -> np.ndarray:
        """(H+1, m), or (H+1, m, m) where damping couples the shapes."""
        W = w * np.arange(H + 1)[:, None]
        own = self.stiffness - (W**2 + 2j * W * zeta * w) * self.mass
        if self.damping.ndim == 1:
            return own + 1j * W * self.damping
        coupled = 1j * W[:, :, None] * self.damping
        every = np.arange(len(self.mass))
        coupled[:, every, every] += own
        return coupled

    def impedance_rates(
        self, w: float, zeta: float, Q: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the impedance by w and by zeta, times the coordinates Q (H+1, m)."""
        k = np.arange(len(Q))[:, None]
        inertia = self.mass * Q
        drag = self.damping * Q if self.damping.ndim == 1 else Q @ self.damping.T
        return 1j * k * drag - (2 * k + 4j * zeta) * k * w * inertia, -2j * k * w**2 * inertia

    @cached_property
    def unmoved(self) -> np.ndarray:
        """(m,) bool : shapes that no contact sees, nor moves by way of the damping: they are at
        rest in all orders but 0, also at a resonance."""
        size = np.linalg.norm(self.at_contacts, axis=0)
        found = size <= UNMOVED * size.max(initial=0.0)
        if self.damping.ndim == 2:
            apart = np.abs(self.damping - np.diag(np.diag(self.damping)))
            scale = UNMOVED * np.abs(self.damping).max(initial=0.0)
            found &= (apart.max(axis=0) <= scale) & (apart.max(axis=1) <= scale)
        return found

    def flexibility(self, Z: np.ndarray, mode: int) -> np.ndarray:
        """Inverse of an impedance, in order 1 with coordinate `mode` in the place of its force."""
        still = self.unmoved
        if Z.ndim == 2:
            takes_part = np.repeat([self.moves[0], self.moves[1] & ~still], [1, len(Z) - 1], axis=0)
            Z = np.where(takes_part, Z, np.inf)
            Z[1, mode] = 1.0
            return 1 / Z
        Z = Z.copy()
        Z[1:, still, still] = 1.0
        Z[1, mode] = np.arange(Z.shape[1]) == mode
        return np.linalg.inv(Z)


def times(A: np.ndarray, X: np.ndarray) -> np.ndarray:
    """(K, m) A X at K orders; A (K, m) diagonal or (K, m, m)."""
    return A * X if A.ndim == 2 else (A @ X[..., None])[..., 0]


def stuck_modes(problem: ContactProblem) -> StuckModalSystem:
    """Of a problem; InputError where a damping matrix stands beside motions that are free or held
    in the mean."""
    known = problem.receptance()
    held = len(known.constraint_forces)
    e = known.free
    if not known.poles.size:
        m = len(known.mass)
        moves = np.ones((2, m + e + held), dtype=bool)
        moves[0, m : m + e] = False
        moves[1, m + e :] = False
        return StuckModalSystem(
            known.shapes,
            np.ascontiguousarray(problem.B @ known.shapes),
            np.r_[known.stiffness, np.zeros(e), -np.ones(held)],
            np.r_[known.mass, known.free_mass, np.zeros(held)],
            np.r_[known.damping, known.free_damping, np.zeros(held)],
            moves,
        )
    if held or e:
        raise InputError(
            "C couples the modes, and a motion is free or held in the mean: a nonlinear mode needs "
            "damping_ratio, or a support of that motion"
        )
    shapes, mass = modes_beside(problem.M, problem.stuck_stiffness, np.zeros((len(problem.K), 0)))
    return StuckModalSystem(
        shapes,
        np.ascontiguousarray(problem.B @ shapes),
        np.ones(len(mass)),
        np.maximum(mass, 0.0),
        shapes.T @ problem.C @ shapes,
        np.ones((2, len(mass)), dtype=bool),
    )


def seen_alone(modes: StuckModalSystem, index: int, row: np.ndarray) -> StuckModalSystem:
    """With the shapes of a repeated frequency turned so that an output, row (r,), sees that of
    `index` alone: of a round beam any pair of directions is one of modes."""
    if modes.damping.ndim == 2:
        return modes
    w = modes.frequencies
    alike = np.flatnonzero(np.abs(w - w[index]) <= REPEATED * w[index])
    seen = row @ modes.shapes[:, alike]
    if len(alike) == 1 or not seen.any() or np.ptp(modes.damping[alike]) > REPEATED:
        return modes
    turn = la.qr(np.column_stack([seen, np.eye(len(alike))]), mode="economic")[0]
    turn = np.roll(turn, int(np.flatnonzero(alike == index)[0]), axis=1)
    shapes, at_contacts = modes.shapes.copy(), modes.at_contacts.copy()
    shapes[:, alike] = shapes[:, alike] @ turn
    at_contacts[:, alike] = at_contacts[:, alike] @ turn
    return replace(modes, shapes=shapes, at_contacts=at_contacts)
