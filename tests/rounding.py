"""Another processor's rounding, on this one: TIPDAMP_ROUNDING=SEED pytest ...

Eigensolvers and singular value decompositions return the vectors of equal values as any mixture of them, and every
vector with any sign; the last digits of solutions are noise. Here both are drawn at random, by the seed and by the
matrix, so that the same call gives the same bits. A test that then fails has found a result that hangs on rounding.
"""

import zlib
from functools import wraps

import numpy as np
import scipy.linalg as sl

EQUAL = 1e-10       # of the largest value, and of a value: nearer ones have any mixture of vectors
DIGITS = 4.0        # noise of solutions and of values, in units of the last digit
SOLVES = ("solve", "lu_solve", "cho_solve", "solve_triangular", "lstsq", "inv")


def install(seed: int) -> None:
    """For what is called as np.linalg.f or sl.f, and what is imported by name after this."""
    for home in (np.linalg, sl):
        for name in ("eigh", *SOLVES):
            if hasattr(home, name):
                change = _mixed if name == "eigh" else _noisy
                setattr(home, name, _changed(getattr(home, name), change, seed))


def _changed(function, change, seed):
    @wraps(function)
    def other(*args, **kwargs):
        found = function(*args, **kwargs)
        return change(found, lambda a: np.random.default_rng([seed, zlib.crc32(np.ascontiguousarray(a).tobytes())]))
    return other


def _noisy(found, random):
    if isinstance(found, tuple):
        return (_noisy(found[0], random), *found[1:])
    found = np.asarray(found)
    return found * (1 + DIGITS * np.finfo(float).eps * random(found).uniform(-1, 1, found.shape))


def _mixed(found, random):
    if not isinstance(found, tuple):
        return _noisy(found, random)
    values, vectors = found
    if values.ndim > 1 or not values.size:
        return found
    turned, draw = vectors.copy(), random(values)
    apart = np.flatnonzero(np.diff(values) > EQUAL * np.abs(values[1:]) + 1e-15 * np.abs(values).max()) + 1
    for own in np.split(np.arange(len(values)), apart):
        turned[:, own] = vectors[:, own] @ np.linalg.qr(draw.normal(size=(len(own), len(own))))[0]
    return type(found)(values, turned) if hasattr(found, "_fields") else (values, turned)
