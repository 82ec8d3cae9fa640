"""Another processor's rounding, on this one: TIPDAMP_ROUNDING=SEED pytest ...

Eigensolvers and singular value decompositions return the vectors of equal values as any mixture of
them, and every vector with any sign; the last digits of solutions are noise. Here both are drawn at
random, by the seed and by the values, so that the same call gives the same bits. A test that then
fails has found a result that hangs on rounding. Processes that a test starts are left alone.
"""

import zlib
from functools import wraps

import numpy as np
import scipy.linalg as sl

EQUAL = 1e-10  # of a value: nearer ones have any mixture of vectors
ZERO = 1e-15  # of the largest value: so are those nearer to each other than that
DIGITS = 4.0  # noise of solutions, in units of the last digit
SOLVES = ("solve", "lu_solve", "cho_solve", "solve_triangular", "lstsq", "inv")


def install(seed: int) -> None:
    """For what is called as np.linalg.f or sl.f, and what is imported by name after this."""
    for home in (np.linalg, sl):
        for name, change in (
            ("eigh", _eigenvectors),
            ("svd", _singular_vectors),
            *((name, _noisy) for name in SOLVES),
        ):
            if hasattr(home, name):
                setattr(home, name, _changed(getattr(home, name), change, seed))


def _changed(function, change, seed):
    @wraps(function)
    def other(*args, **kwargs):
        return change(function(*args, **kwargs), seed)

    return other


def _random(values, seed):
    return np.random.default_rng([seed, zlib.crc32(np.ascontiguousarray(values).tobytes())])


def _noisy(found, seed):
    if isinstance(found, tuple):
        return (_noisy(found[0], seed), *found[1:])
    found = np.asarray(found)
    return found * (
        1 + DIGITS * np.finfo(float).eps * _random(found, seed).uniform(-1, 1, found.shape)
    )


def _eigenvectors(found, seed):
    if not isinstance(found, tuple) or found[0].ndim > 1:
        return found
    return found[0], found[1] @ _mixture(found[0], found[1].shape[1], seed)


def _singular_vectors(found, seed):
    if not isinstance(found, tuple) or found[1].ndim > 1:
        return found
    left, values, right = found
    return (
        left @ _mixture(values, left.shape[1], seed),
        values,
        _mixture(values, len(right), seed).T @ right,
    )


def _mixture(values, count, seed):
    """(count, count) orthogonal: of vectors of equal values any, of others any sign; what is beyond
    the values is one set more."""
    random, Q = _random(values, seed), np.eye(count)
    apart = np.abs(np.diff(values)) > EQUAL * np.abs(values[1:]) + ZERO * np.abs(values).max(
        initial=0.0
    )
    for own in np.split(np.arange(count), np.r_[np.flatnonzero(apart) + 1, len(values)]):
        Q[np.ix_(own, own)] = (
            np.linalg.qr(random.normal(size=(len(own), len(own))))[0] if len(own) else 0.0
        )
    return Q
