"""The poles of the stuck system that keep their mass, and the multipliers that they give."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigvals

from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.stability.kernels import Poles

if TYPE_CHECKING:
    from tipdamp.hbm.balance.receptance import Receptance


def of_poles(s: np.ndarray, w: float) -> np.ndarray:
    """Multipliers of a system with the poles s (n,), one of each conjugate pair."""
    found = np.exp(2 * np.pi / w * s)
    return np.concatenate([found, found.conj()[s.imag > 0]])


def eigenvalues(matrix: np.ndarray, slow: Poles) -> np.ndarray:
    """Multipliers of a period map (2n + k, 2n + k), without the imaginary part of a real pole,
    which nothing moves and nothing sees; none where the map overflows."""
    if not np.isfinite(matrix).all():
        return np.empty(0)
    moves = np.ones(len(matrix), dtype=bool)
    moves[: 2 * len(slow.s)] = moving_parts(slow)
    return eigvals(matrix[np.ix_(moves, moves)])


def moving_parts(slow: Poles) -> np.ndarray:
    """(2n,) bool, which of the real and imaginary parts of the poles move."""
    return np.concatenate([np.ones(len(slow.s), dtype=bool), slow.s.imag != 0])


def as_poles(s: np.ndarray, out: np.ndarray, into: np.ndarray, static: np.ndarray) -> Poles:
    """Of complex parts."""
    return Poles(
        s,
        np.ascontiguousarray(np.hstack([out.real, -out.imag])),
        np.ascontiguousarray(np.vstack([into.real, into.imag])),
        static,
    )


def system(slow: Poles) -> np.ndarray:
    """(2n, 2n) of z' = A z alone, z = [Re, Im]."""
    real, imaginary = np.diag(slow.s.real), np.diag(slow.s.imag)
    return np.block([[real, -imaginary], [imaginary, real]])


def without_springs(slow: Poles, gone: np.ndarray, springs: np.ndarray) -> Poles:
    """At the other components of those with springs (nc,), without those that are gone (nc,)."""
    rest = ~gone
    k, S = -np.diag(springs[gone]), slow.static[gone]
    held = k @ np.linalg.inv(np.eye(len(k)) + S[:, gone] @ k)  # force by the motion without it
    moves, back = moving_parts(slow), slow.static[rest][:, gone] @ held
    seen, driven = slow.out[:, moves], slow.into[moves]
    alone = system(slow)[np.ix_(moves, moves)]
    s, shapes = np.linalg.eig(alone - driven[:, gone] @ held @ seen[gone])
    out = (seen[rest] - back @ seen[gone]) @ shapes
    into = np.linalg.solve(shapes, driven[:, rest] - driven[:, gone] @ held @ S[:, rest])
    kept = s.imag >= 0
    out = out[:, kept] * np.where(s.imag > 0, 2.0, 1.0)[kept]
    return as_poles(s[kept], out, into[kept], slow.static[rest][:, rest] - back @ S[:, rest])


def springs_alone(balance: HarmonicBalance) -> HarmonicBalance:
    """The balance with springs in the place of what holds a mean."""
    held = balance.problem.with_springs_alone()
    return balance if held is balance.problem else balance.rebuilt(held, balance.forces)


def receptance_at(balance: HarmonicBalance, components: np.ndarray) -> "Receptance":
    """The receptance between components of the contacts, without the motion elsewhere."""
    at, left = balance.contact_receptance, balance.receptance.left
    left = at.into[components] if left.size else left
    return replace(balance.receptance, shapes=at.shapes[components], left=left)
