"""Motions that nothing restrains: of one body they are refused, those of a structure that floats as a whole are not."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.linalg.lapack import dlange, dpocon, dpotrf
from scipy.sparse.csgraph import connected_components

from hbm.balance.named_motion import mostly
from hbm.balance.settings import DEFAULT
from hbm.errors import InputError
from hbm.model import BUCKLED

SUPPORT = "keep more contacts or support the body"


def floating_motions(M: np.ndarray, K: np.ndarray, stuck: np.ndarray, B: Any) -> np.ndarray:
    """(r, e) motions, of unit modal mass, of a structure that floats as a whole: neither K nor the contacts resist it.

    stuck (r, r) : K with the springs of the contacts; B (n, r) : relative motion there. Under harmonic forces alone
    mass bounds the vibration along them. Empty where they are not all that K leaves to each of its bodies: a body that
    some of its contacts hold must not move about the others.
    """
    none = np.zeros((len(K), 0))
    motions = _units(stuck)[:, None] * _loose(stuck) if stiff_factor(stuck) is None else none
    if not motions.shape[1]:
        return none
    motions = motions / np.abs(motions).max(axis=0)
    _, seen, ways = np.linalg.svd(B @ motions)
    motions = motions @ ways[np.count_nonzero(seen > DEFAULT.unseen * abs(B).max()):].T
    body = connected_components(sp.csr_matrix(K != 0), directed=False)[1]
    for one in np.unique(body):
        rows = np.flatnonzero(body == one)
        if _loose(K[np.ix_(rows, rows)]).shape[1] != np.linalg.matrix_rank(motions[rows], tol=DEFAULT.unseen):
            return none
    mass = motions.T @ M @ motions
    return motions @ np.linalg.inv(np.linalg.cholesky(mass)).T if np.all(np.diag(mass) > 0) else none


def with_gauge(M: np.ndarray, K: np.ndarray, free: np.ndarray) -> np.ndarray:
    """K (r, r) with a stiffness of its own size along free motions (r, e) of unit modal mass."""
    inertia = M @ free
    return K + np.trace(K) / max(np.sum(inertia**2), 1e-300) * inertia @ inertia.T if free.shape[1] else K


def stiff_factor(K: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """(unit of each dof (r,), Cholesky factor, in the lower triangle of (r, r), of K in these units) where that clearly
    restrains every motion; else None."""
    scale, scaled = _scaled(K)
    size = dlange("1", scaled)
    factor, failed = dpotrf(scaled, lower=1, overwrite_a=1, clean=0)
    least = 0.0 if failed else dpocon(factor, size, uplo="L")[0] * size         # about what the softest one stores
    rounding = DEFAULT.noise * np.finfo(float).eps * size + DEFAULT.loose * len(K)
    return (scale, factor) if least > DEFAULT.restrained * rounding else None


def check_restrained(K: np.ndarray, describe: Callable | None, when: str = "even when every contact sticks",
                     remedy: str = SUPPORT) -> None:
    """InputError where the softest motion stores no more than rounding: of K, or of a body that moves as a whole."""
    if stiff_factor(K) is not None:
        return
    scale, scaled = _scaled(K)
    values, vectors = la.eigh(scaled, subset_by_index=[0, 0])
    softest = np.abs(vectors[:, 0])
    noise = DEFAULT.noise * np.finfo(float).eps * (softest @ np.abs(scaled) @ softest)
    if values[0] >= max(noise, DEFAULT.loose * len(scaled)):
        return
    motion = scale * vectors[:, 0]
    named = describe(motion) if describe else None
    if values[0] < -BUCKLED:
        raise InputError(f"K is indefinite {when}: a motion has a negative stiffness, "
                         f"{-values[0]:.1e} of its diagonal: {named or mostly(motion)}; a sign is wrong, or it buckles")
    if values[0] <= noise or named is not None and named.rigid:
        hold = f", or {named.remedy}" if named is not None and named.rigid and named.motion else ""
        raise InputError(f"a motion is unrestrained {when}: {named or mostly(motion)}; {remedy}{hold}")


def check_rest(K: np.ndarray, static: np.ndarray | None, describe: Callable | None) -> None:
    """InputError where K leaves a motion free that no load presses on: of a model whose contacts are all open at rest.

    static : (r,) N or None. Where it moves what is free, contact may restrain that.
    """
    if static is not None and static.any():
        scale = _units(K)
        if np.linalg.norm(_loose(K).T @ (scale * static)) > 1e-9 * np.linalg.norm(scale * static):
            return
    check_restrained(K, describe, "at rest, where every contact is open", "close contacts by a preload or by a static "
                      "load (origin = 'unloaded'), or support the body, however softly")


def _loose(K):
    """(r, e) unit motions, in units of the dofs, that store next to nothing."""
    return la.eigh(_scaled(K)[1], subset_by_value=(-np.inf, DEFAULT.loose * len(K)))[1]


def _scaled(K):
    """(unit of each dof (r,), K (r, r) in these units), column by column in memory, for LAPACK to take as it is."""
    scale = _units(K)
    scaled = scale[:, None] * K
    scaled *= scale
    return scale, scaled.T


def _units(K):
    """(r,) unit of each dof, in which the diagonal of K is 1."""
    return 1 / np.sqrt(np.maximum(np.abs(np.diag(K)), np.abs(K).max() * 1e-30 or 1.0))
