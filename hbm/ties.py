"""Choices among equals: what symmetry makes equal, rounding parts, and in another way on every
processor.

Of values that are the same to rounding the first counts, so that a choice depends on the order in
which a user gives things and not on the last digit.

Modes of one frequency: any mixture of their shapes is a mode too, and which one a solver returns is
rounding. What moves along a row b of the motion in such a set is the same for every mixture: the
shapes are turned so that the first of the set has all of it, the others none [Golub and Van Loan,
Matrix Computations, sec. 5.1, Householder].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

# of the largest: far above rounding of sums and solves, far below what anybody tells apart
SAME = 1e-9


@dataclass(frozen=True)
class RepeatedSettings:
    """Of modes that cannot be told apart."""

    # of a frequency: nearer ones have no shapes of their own, by the digits of K
    equal: float = 1e-7
    alike: float = 1e-6  # of a MAC or a share of a motion: of equal ones the lowest mode is taken


REPEATED = RepeatedSettings()


def first_largest(values: ArrayLike, same: float = SAME) -> int:
    """Index of the first of the largest values (n,), those within `same` of the largest magnitude
    being equal."""
    values = np.asarray(values, dtype=float)
    finite = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    return int((values >= np.nanmax(values, initial=-np.inf) - same * finite).argmax())


def levels(values: ArrayLike) -> np.ndarray:
    """(n,) 0, 1, ... ascending with the values (n,): those that follow each other within SAME of
    the largest magnitude share a level."""
    values = np.asarray(values, dtype=float)
    order = np.argsort(values)
    found = np.empty(len(values), dtype=np.int64)
    gap = SAME * np.abs(values[np.isfinite(values)]).max(initial=0.0)
    ahead, behind = values[order[1:]], values[order[:-1]]
    found[order] = np.cumsum(
        np.r_[False, (ahead != behind) & ~(ahead <= behind + gap)][: len(values)]
    )
    return found


def in_order(values: ArrayLike) -> np.ndarray:
    """(n,) indices that sort the values (n,), equal ones in the order in which they stand."""
    return np.argsort(levels(values), kind="stable")


def turned(hz: np.ndarray, shapes: np.ndarray, row: np.ndarray) -> np.ndarray:
    """(r, m) shapes of the modes hz (m,), ascending, of each set of equal ones the first with all
    of the motion along the row (r,) that the set has, which is positive."""
    found = shapes.copy()
    apart = np.flatnonzero(np.diff(hz) > REPEATED.equal * hz[1:]) + 1
    for own in np.split(np.arange(len(hz)), apart):
        motion = row @ shapes[:, own]
        size = np.linalg.norm(motion)
        if size:
            away = motion + np.copysign(size, motion[0]) * np.eye(len(own))[0]
            found[:, own] -= np.outer(shapes[:, own] @ away, 2 / (away @ away) * away)
            found[:, own[0]] *= -np.copysign(1.0, motion[0])
    return found
