"""Poles of a system with a general damping matrix, in the modes of its stiffness and mass."""

from collections.abc import Iterator

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.errors import InputError


def state_space_modes(
    shapes: np.ndarray, period2: np.ndarray, C: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (r, n) and poles (n,) of s^2 diag(period2) + s C + I, scaled so that the receptance is
    sum z z'/(i w - s).

    With the state (y, sqrt(period2) y') that is a standard eigenvalue problem for -1/s. Motions
    without mass have poles of first order; those without damping either follow statically, and no
    others then act on them (C is not negative). Where two poles meet they have one mode: there it
    is the mean of the receptances for a little more and a little less damping, where they are
    apart.
    """
    shapes, period2, C, still = _without_mass(shapes, period2, C)
    # exp(growth t): no resonance is near, however light the damping
    growth = 1 / np.sqrt(period2.max())
    system = np.diag(1 + period2 * growth**2) + growth * C
    for changed, allowed in apart():
        parts = [_poles(period2, factor * C) for factor in changed]
        poles, Z = (np.concatenate(part, axis=-1) for part in zip(*parts, strict=True))
        Z = Z / np.sqrt(len(parts))
        error = np.abs(system @ ((Z / (growth - poles)) @ Z.T) - np.eye(len(C))).max()
        if error < allowed:
            break
    else:
        raise InputError(
            f"the damping matrix has no full set of modes (defect {error:.1e}): "
            "change it a little, or give damping_ratio instead"
        )
    static = np.full(still.shape[1], -DEFAULT.static_pole / np.sqrt(period2.max()))
    return np.hstack([shapes @ Z, still * np.sqrt(np.abs(static))]), np.r_[poles, static]


def apart() -> Iterator[tuple[tuple[float, ...], float]]:
    """(factors on the damping of which the mean is taken, defect that is allowed): where two poles
    meet they have one mode, and a little more and a little less damping keeps them apart."""
    changes = (0.0,), (DEFAULT.apart, -DEFAULT.apart)
    for change, allowed in zip(changes, DEFAULT.defect, strict=True):
        yield tuple(1 + one for one in change), allowed


def _poles(period2: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) poles and (m, n) scaled shapes; of no use where poles meet that have one mode.

    Left modes are the right ones with -v: products Y'Y - V'V are diagonal, as the receptance takes
    them to be. Those of close poles are mixed by rounding over their distance, and made so.
    """
    m = len(period2)
    heavy = np.flatnonzero(period2)
    coupling = np.zeros((m, len(heavy)))
    coupling[heavy, np.arange(len(heavy))] = np.sqrt(period2[heavy])
    inverse, state = la.eig(
        np.block([[C, coupling], [-coupling.T, np.zeros((len(heavy),) * 2)]]),
        overwrite_a=True,
        check_finite=False,
    )
    state = _separated(state, np.r_[np.ones(m), -np.ones(len(heavy))][:, None])
    y, v = state[:m], state[m:]
    with np.errstate(divide="ignore", invalid="ignore"):
        return -1 / inverse, y / np.sqrt(np.einsum("ij,ij->j", y, C @ y + 2 * (coupling @ v)))


def _separated(state: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Modes (k, n) whose products with each other, under signs (k, 1), vanish."""
    for _ in range(DEFAULT.separations):
        products = state.T @ (signs * state)
        size = np.sqrt(products.diagonal())
        with np.errstate(divide="ignore", invalid="ignore"):
            products = products / size / size[:, None]
            mixed = np.abs(products - np.eye(len(size))).max()
            if not DEFAULT.mixed[0] < mixed < np.inf:
                break
            state = state / size
        if mixed < DEFAULT.mixed[1]:
            state = 1.5 * state - 0.5 * state @ products
        else:
            values, vectors = la.eig(products)
            state = state @ (vectors / np.sqrt(values)) @ la.pinv(vectors)
    return state


def _without_mass(
    shapes: np.ndarray, period2: np.ndarray, C: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """shapes, period2 (0 where there is no mass) and C of the motions with mass or damping; shapes
    of the others."""
    light = period2 <= 1e-14 * period2.max()
    if not light.any():
        return shapes, period2, C, shapes[:, :0]
    damping, turn = la.eigh(C[np.ix_(light, light)])
    T = np.eye(len(period2))
    T[np.ix_(light, light)] = turn
    damped = np.ones(len(period2), dtype=bool)
    damped[light] = damping > 1e-12 * np.abs(C).max()
    shapes, C = shapes @ T, T.T @ C @ T
    return (
        shapes[:, damped],
        np.where(light, 0.0, period2)[damped],
        C[np.ix_(damped, damped)],
        shapes[:, ~damped],
    )
