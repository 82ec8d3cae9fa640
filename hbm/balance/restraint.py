"""Motions that nothing restrains: of one body they are refused, those of a structure that floats as
a whole are not."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.linalg.lapack import dlange, dpocon, dpotrf
from scipy.sparse.csgraph import connected_components

from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.named_motion import mostly
from tipdamp.hbm.model import BUCKLED

EPS = np.finfo(float).eps
SUPPORT = "keep more contacts or support the body"


class FloatingMotions(NamedTuple):
    """Motions that nothing resists.

    shapes : (r, e) of unit modal mass
    unsure : share of a motion, in units of the dofs, that may be another one: rounding of the
        stiffness mixes the softest elastic motions with the rigid ones
    """

    shapes: np.ndarray
    unsure: float = 0.0


def floating_motions(M: np.ndarray, K: np.ndarray, stuck: np.ndarray, B: Any) -> FloatingMotions:
    """Motions of a structure that floats as a whole: neither K nor the contacts resist them.

    stuck (r, r) : K with the springs of the contacts; B (n, r) : relative motion there. Under
    harmonic forces alone mass bounds the vibration along them. None where they are not all that K
    leaves to each of its bodies: a body that some of its contacts hold must not move about the
    others.
    """
    none = FloatingMotions(np.zeros((len(K), 0)))
    scale, scaled = in_units(stuck)
    motions, unsure = _loose(scaled)
    if not motions.shape[1]:
        return none
    rows = _unit_rows(sp.csr_matrix(B).multiply(scale))
    _, seen, ways = np.linalg.svd(rows @ motions)
    motions = motions @ ways[np.count_nonzero(seen > unsure * np.sqrt(rows.shape[0])) :].T
    body = connected_components(sp.csr_matrix(K != 0), directed=False)[1]
    for one in np.unique(body):
        mine = np.flatnonzero(body == one)
        own = _loose(in_units(K[np.ix_(mine, mine)])[1])[0]
        if own.shape[1] != np.linalg.matrix_rank(motions[mine], tol=unsure):
            return none
    mass = motions.T @ (scale[:, None] * M * scale) @ motions
    if not np.all(np.diag(mass) > 0):
        return none
    return FloatingMotions(
        scale[:, None] * motions @ np.linalg.inv(np.linalg.cholesky(mass)).T, unsure
    )


def with_gauge(M: np.ndarray, K: np.ndarray, free: np.ndarray) -> np.ndarray:
    """K (r, r) with a stiffness of its own size along free motions (r, e): M makes of them the
    forces that it gives, which move nothing else."""
    if not free.shape[1]:
        return K
    scale = units(K)
    held = la.qr(scale[:, None] * (M @ free), mode="economic")[0] / scale[:, None]
    return K + held @ held.T


def acts_along(free: FloatingMotions, K: np.ndarray, load: np.ndarray) -> np.ndarray | None:
    """The first free motion (r,) along which a load (r,) acts by more than rounding; None where
    there is none."""
    scale = units(K)
    for motion in free.shapes.T:
        rounding = free.unsure * np.linalg.norm(motion / scale) * np.linalg.norm(scale * load)
        if abs(motion @ load) > rounding + DEFAULT.unseen * (np.abs(motion) @ np.abs(load)):
            return motion
    return None


def stiff_factor(K: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """(unit of each dof (r,), Cholesky factor, in the lower triangle of (r, r), of K in these
    units) where that clearly restrains every motion; else None."""
    scale, scaled = in_units(K)
    size = dlange("1", scaled)
    factor, failed = dpotrf(scaled, lower=1, overwrite_a=1, clean=0)
    # about what the softest one stores
    least = 0.0 if failed else dpocon(factor, size, uplo="L")[0] * size
    rounding = DEFAULT.noise * EPS * size + DEFAULT.loose * len(K)
    return (scale, factor) if least > DEFAULT.restrained * rounding else None


def check_restrained(
    K: np.ndarray,
    describe: Callable | None,
    when: str = "even when every contact sticks",
    remedy: str = SUPPORT,
) -> None:
    """InputError where the softest motion stores no more than rounding: of K, or of a body that
    moves as a whole."""
    if stiff_factor(K) is not None:
        return
    scale, scaled = in_units(K)
    values, vectors = la.eigh(scaled, subset_by_index=[0, 0])
    softest = np.abs(vectors[:, 0])
    noise = DEFAULT.noise * EPS * (softest @ np.abs(scaled) @ softest)
    if values[0] >= max(noise, DEFAULT.loose * len(scaled)):
        return
    motion = scale * vectors[:, 0]
    named = describe(motion) if describe else None
    if values[0] < -BUCKLED:
        raise InputError(
            f"K is indefinite {when}: a motion has a negative stiffness, {-values[0]:.1e} of its "
            f"diagonal: {named or mostly(motion)}; a sign is wrong, or it buckles"
        )
    if values[0] <= noise or named is not None and named.rigid:
        hold = f", or {named.remedy}" if named is not None and named.rigid and named.motion else ""
        raise InputError(
            f"a motion is unrestrained {when}: {named or mostly(motion)}; {remedy}{hold}"
        )


def check_rest(K: np.ndarray, static: np.ndarray | None, describe: Callable | None) -> None:
    """InputError where K leaves a motion free that no load presses on: of a model whose contacts
    are all open at rest.

    static : (r,) N or None. Where it moves what is free, contact may restrain that.
    """
    if static is not None and static.any():
        scale, scaled = in_units(K)
        loose, unsure = _loose(scaled)
        if np.linalg.norm(loose.T @ (scale * static)) > unsure * np.linalg.norm(scale * static):
            return
    check_restrained(
        K,
        describe,
        "at rest, where no contact has stiffness",
        "close contacts by a preload or by a static "
        "load (origin = 'unloaded'), or support the body, however softly",
    )


def loose_motions(K: np.ndarray) -> np.ndarray:
    """(r, e) motions, orthonormal in units of the dofs, that K does not resist."""
    scale, scaled = in_units(K)
    return scale[:, None] * _loose(scaled)[0]


def _loose(scaled: np.ndarray) -> tuple[np.ndarray, float]:
    """(r, e) unit motions that store no more than rounding of a stiffness in units of the dofs, and
    how far they may be off. Reduction rounds too: what stores a little more counts where all others
    store far more, as fine meshes bend softly."""
    few = DEFAULT.loose * len(scaled)
    values, motions = la.eigh(scaled, subset_by_value=(-np.inf, DEFAULT.far_more * few))
    size = np.abs(motions)
    noise = DEFAULT.noise * EPS * np.einsum("ij,ij->j", size, np.abs(scaled) @ size)
    following = np.r_[values[1:], DEFAULT.far_more * few]
    rigid = (values <= noise) | (values <= few) & (following >= DEFAULT.far_more * values)
    e = len(rigid) - int(rigid[::-1].argmax()) if rigid.any() and values[0] >= -few else 0
    if not 0 < e < len(scaled):
        return motions[:, :e], DEFAULT.unseen
    softest = la.eigvalsh(scaled, subset_by_index=[e, e])[0]
    return motions[:, :e], max(
        DEFAULT.unseen, DEFAULT.noise * EPS * np.linalg.norm(scaled, 1) / softest
    )


def _unit_rows(B: Any) -> sp.csr_matrix:
    """The rows (n, r) of a sparse matrix that are not zero, each of length 1."""
    B = sp.csr_matrix(B)
    size = np.sqrt(np.asarray(B.multiply(B).sum(axis=1)).ravel())
    return sp.diags(1 / size[size > 0]) @ B[size > 0]


def in_units(K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(unit of each dof (r,), K (r, r) in these units), column by column in memory, for LAPACK to
    take as it is."""
    scale = units(K)
    scaled = scale[:, None] * K
    scaled *= scale
    return scale, scaled.T


def units(K: np.ndarray) -> np.ndarray:
    """(r,) unit of each dof, in which the diagonal of K is 1."""
    return 1 / np.sqrt(np.maximum(np.abs(np.diag(K)), np.abs(K).max() * 1e-30 or 1.0))
