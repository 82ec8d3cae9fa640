"""Choices among equals: what symmetry makes equal, rounding parts, and in another way on every
processor.

Of values that are the same to rounding the first counts, so that a choice depends on the order in
which a user gives things and not on the last digit.
"""

import numpy as np
from numpy.typing import ArrayLike

# of the largest: far above rounding of sums and solves, far below what anybody tells apart
SAME = 1e-9


def first_largest(values: ArrayLike, same: float = SAME) -> int:
    """Index of the first of the largest values (n,), those within `same` of the largest magnitude
    being equal."""
    values = np.asarray(values, dtype=float)
    finite = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    return int((values >= np.nanmax(values, initial=-np.inf) - same * finite).argmax())


def levels(values: ArrayLike, same: float = SAME) -> np.ndarray:
    """(n,) 0, 1, ... ascending with the values (n,): those that follow each other within `same` of
    the largest magnitude share a level."""
    values = np.asarray(values, dtype=float)
    order = np.argsort(values)
    found = np.empty(len(values), dtype=np.int64)
    gap = same * np.abs(values[np.isfinite(values)]).max(initial=0.0)
    ahead, behind = values[order[1:]], values[order[:-1]]
    found[order] = np.cumsum(
        np.r_[False, (ahead != behind) & ~(ahead <= behind + gap)][: len(values)]
    )
    return found


def in_order(values: ArrayLike, same: float = SAME) -> np.ndarray:
    """(n,) indices that sort the values (n,), equal ones in the order in which they stand."""
    return np.argsort(levels(values, same), kind="stable")
