"""Modes of a structure that floats, beside the motions that nothing resists; damping may resist
these."""

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.damped_poles import state_space_modes
from tipdamp.hbm.balance.restraint import EPS, FloatingMotions, in_units, units, with_gauge
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.errors import InputError


class Drag(NamedTuple):
    """Damping along free motions, which answer a force by 1/(i w c - m w^2).

    shapes (r, e), mass m and damping c (e,) of each; coupled : whether damping couples them with
    the modes
    """

    shapes: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    coupled: bool


def modes_beside(M: np.ndarray, K: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (r, m) of unit stiffness, and masses (m,) of these, the longest period first, of the
    modes of (K, M) beside motions (r, e) that K resists by a gauge alone.

    Raises InputError where a mode has negative mass.
    """
    if free.shape[1]:
        mass, shapes = _deflated(M, K, free)
    else:
        mass, shapes = la.eigh(M, K)
    if mass[0] < -1e-10 * mass[-1]:
        dof = np.abs(shapes[:, 0]).argmax()
        raise InputError(f"M is not positive: a motion mostly of dof {dof} has negative mass")
    return np.ascontiguousarray(shapes[:, ::-1]), mass[::-1]


def _deflated(M: np.ndarray, K: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Masses and shapes of the modes, the free motions moved out of them below all others: no
    projection of K, whose rounding would spread from stiff elements over the whole structure."""
    scale, scaled = in_units(K)
    L = la.cholesky(scaled, lower=True)
    half = la.solve_triangular(L, scale[:, None] * M * scale, lower=True)
    mass = la.solve_triangular(L, half.T, lower=True)
    Z = la.qr(L.T @ (free / scale[:, None]), mode="economic")[0]
    beside = mass - Z @ (Z.T @ mass)
    beside = beside - (beside @ Z) @ Z.T - np.linalg.norm(mass) * Z @ Z.T
    found, shapes = la.eigh(0.5 * (beside + beside.T))
    e = free.shape[1]
    return found[e:], scale[:, None] * la.solve_triangular(L, shapes[:, e:], trans="T", lower=True)


def damping_of_free(C: np.ndarray, K: np.ndarray, free: FloatingMotions, modes: tuple) -> Drag:
    """What a damping matrix does along free motions; modes : (shapes (r, m), their damping (m, m)).

    Damping by mass resists them and couples them with no mode; that by stiffness does not resist
    them.
    """
    shapes, modal = modes
    R = free.shapes
    scale = units(K)
    if not R.shape[1]:
        return Drag(R, np.empty(0), np.empty(0), False)
    damping, turn = la.eigh(R.T @ C @ R)
    R = R @ turn
    # of each motion, as the root of a power: what rounding mixes into it, and its own rounding
    scaled = np.linalg.norm(scale[:, None] * C * scale, 1)
    mixed = free.unsure * np.linalg.norm(R / scale[:, None], axis=0) * np.sqrt(scaled)
    own = DEFAULT.noise * EPS * np.einsum("ij,ij->j", np.abs(R), np.abs(C) @ np.abs(R))
    damping = np.where(damping > mixed**2 + own, damping, 0.0)
    least = np.sqrt(np.maximum(np.diag(modal), 0.0))[:, None] * (mixed + np.sqrt(own))
    return Drag(
        R,
        np.ones(len(damping)),
        damping,
        bool((np.abs(shapes.T @ C @ R) > least)[:, damping > 0].any()),
    )


def coupled_poles(
    matrices: tuple, slowest: float, drag: Drag
) -> tuple[np.ndarray, np.ndarray, Drag]:
    """Shapes (r, n), poles (n,) and the free motions where damping couples these with the modes, as
    of a dashpot to the ground; slowest : squared period over (2 pi)^2 of the slowest mode.

    With s = s' + shift the matrices of s' are M, C + 2 shift M and K + shift C + shift^2 M, which
    restrain all motions. Each damped free motion has a pole at s = 0, and answers a force by 1/(i
    w).
    """
    M, C, K = matrices
    shift = 1 / np.sqrt(slowest)
    still = drag.shapes[:, drag.damping == 0]
    stiff = with_gauge(M, K, still) + shift * C + shift**2 * M
    shapes, mass = modes_beside(M, stiff, still)
    Z, poles = state_space_modes(shapes, mass, shapes.T @ (C + 2 * shift * M) @ shapes)
    order = np.argsort(np.abs(poles + shift))
    gone, kept = np.split(order, [drag.shapes.shape[1] - still.shape[1]])
    e = still.shape[1]
    n = len(gone)
    return (
        Z[:, kept],
        poles[kept] + shift,
        Drag(
            np.hstack([still, Z[:, gone]]),
            np.r_[np.ones(e), np.zeros(n)],
            np.r_[np.zeros(e), np.ones(n)],
            True,
        ),
    )
