"""Static state without load: a position of the floating bodies in which no pair overlaps needs no
contact force."""

from typing import Any

import numpy as np
from scipy.optimize import linprog

FITS = 1e-7  # of the largest gap: overlaps that linear programming takes for none


def unstressed(loose: np.ndarray, B: Any, gap: np.ndarray) -> np.ndarray | None:
    """(r,) m: combination of the motions `loose` (r, m) of the bodies that float with which no pair
    overlaps,
    B q <= gap (P,), and the one that leaves most room, up to the largest gap; None where the bodies
    do not fit.

    B (P, r) normal motion of the pairs. A linear programme in the coefficients of the motions.
    """
    size = np.abs(gap).max()
    if not loose.shape[1] or size == 0:
        return np.zeros(len(loose)) if (gap >= 0).all() else None
    motion = B @ loose
    reach = np.abs(motion).max(axis=0)
    reach[reach == 0] = 1.0
    scaled = np.column_stack([motion / reach, np.ones(len(gap))])  # in units of the largest gap
    answer = linprog(
        np.r_[np.zeros(loose.shape[1]), -1.0],
        A_ub=scaled,
        b_ub=gap / size,
        bounds=[(None, None)] * loose.shape[1] + [(None, 1.0)],
        method="highs",
    )
    if answer.status != 0 or answer.x[-1] < -FITS:
        return None
    return loose @ (size * answer.x[:-1] / reach)
