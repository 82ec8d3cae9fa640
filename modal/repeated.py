"""Modes of one frequency: any mixture of their shapes is a mode too, and which one a solver returns
is rounding.

What moves along a row b of the motion in such a set is the same for every mixture: the shapes are
turned so that the first of the set has all of it, the others none [Golub and Van Loan, Matrix
Computations, sec. 5.1, Householder]."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RepeatedSettings:
    """Of modes that cannot be told apart."""

    # of a frequency: nearer ones have no shapes of their own, by the digits of K
    equal: float = 1e-7
    alike: float = 1e-6  # of a MAC or a share of a motion: of equal ones the lowest mode is taken


SETTINGS = RepeatedSettings()


def turned(
    hz: np.ndarray, shapes: np.ndarray, row: np.ndarray, settings: RepeatedSettings = SETTINGS
) -> np.ndarray:
    """(r, m) shapes of the modes hz (m,), ascending, of each set of equal ones the first with all
    of the motion along the row (r,) that the set has, which is positive."""
    found = shapes.copy()
    apart = np.flatnonzero(np.diff(hz) > settings.equal * hz[1:]) + 1
    for own in np.split(np.arange(len(hz)), apart):
        motion = row @ shapes[:, own]
        size = np.linalg.norm(motion)
        if size:
            away = motion + np.copysign(size, motion[0]) * np.eye(len(own))[0]
            found[:, own] -= np.outer(shapes[:, own] @ away, 2 / (away @ away) * away)
            found[:, own[0]] *= -np.copysign(1.0, motion[0])
    return found
