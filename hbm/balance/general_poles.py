"""Poles of a system whose damping or stiffness is not symmetric, or whose stiffness is complex.

With gyroscopic or circulatory forces, or with structural damping, a pole has a right mode z, by
which the structure moves, and a left one y, by which forces act on it: the receptance is
sum z y'/(i w - s).
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.damped_poles import apart
from tipdamp.hbm.balance.restraint import SUPPORT, check_restrained
from tipdamp.hbm.errors import InputError


def general_poles(
    M: np.ndarray,
    C: np.ndarray,
    K: np.ndarray,
    describe: Callable | None = None,
    remedy: str = SUPPORT,
) -> tuple:
    """(right (r, n), left (r, n), poles (n,), shapes (r, m)) of s^2 M + s C + K, K real or complex.

    Where K is real the poles come in conjugate pairs, where it is complex they hold for w > 0
    alone. shapes : of unit stiffness, of the symmetric real part of K.
    In these shapes, with the state (y, s sqrt(m) y), -1/s are the eigenvalues of a matrix: low
    poles are known to the last digits [Tisseur, Meerbergen 2001, sec. 3].
    Raises InputError where the symmetric part of K leaves a motion free, M is not positive, or the
    poles have no full set of modes.
    """
    symmetric = 0.5 * (K.real + K.real.T)
    check_restrained(symmetric, describe, remedy=remedy)
    period2, shapes = la.eigh(M, symmetric)
    if period2[0] <= 1e-14 * period2[-1]:
        dof = np.abs(shapes[:, 0]).argmax()
        raise InputError(
            f"M leaves a motion mostly of dof {dof} without mass: with matrices that are not "
            "symmetric, or structural damping, every motion needs mass; condense it statically"
        )
    modal = shapes.T @ C @ shapes
    stiff = np.eye(len(period2)) + shapes.T @ (K - symmetric) @ shapes
    growth = 1 / np.sqrt(period2[-1])
    system = growth**2 * np.diag(period2) + growth * modal + stiff
    for changed, allowed in apart():
        parts = [_poles(period2, factor * modal, stiff) for factor in changed]
        right, left, poles = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        right = right / len(parts)
        error = np.abs(system @ ((right / (growth - poles)) @ left.T) - np.eye(len(period2))).max()
        if error < allowed:
            return shapes @ right, shapes @ left, poles, shapes
    raise InputError(
        f"the matrices have no full set of modes (defect {error:.1e}): two poles meet; change the "
        "damping or the speed a little"
    )


def _poles(
    period2: np.ndarray, C: np.ndarray, stiff: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(right (m, n), left (m, n), poles (n,)); of no use where poles meet that have one mode."""
    m = len(period2)
    root = np.diag(np.sqrt(period2))
    inverse = np.linalg.inv(stiff)
    state = np.block([[inverse @ C, inverse @ root], [-root, np.zeros((m, m))]])
    values, X = la.eig(state, check_finite=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        poles = -1 / values
    try:
        left = (np.linalg.inv(X)[:, :m] @ inverse) * -poles[:, None]
    except np.linalg.LinAlgError:
        left = np.full((2 * m, m), np.nan)
    return X[:m], left.T, poles
