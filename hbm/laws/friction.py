"""Coulomb's limit, stated once: what a slider carries of the force that its spring would have.

A slider at w behind a spring kt would carry kt (u - w). Within mu N, N = max(0, preload + kn u_n),
it carries that and rests; beyond, it carries the limit, and w follows so that kt (u - w) is it. An
open contact has no limit, and its slider follows the motion. Each tangent has the limit by itself,
or the resultant of all has it, and then the direction of the force stays.

Steps in time, the start of a cycle and the static solution are made of these functions. What is
compiled or tabulated says the same in closed form; tests/test_one_friction.py names all such places
and holds them to this. Analytic where they are smooth, so that complex steps give their
derivatives.
"""

from collections.abc import Callable

import numpy as np

# (trial (P, nt) N, limit (P,) N) -> force (P, nt) N, slips (P, nt) bool
FrictionLimit = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def each_limited(trial: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force (P, nt) N of the trial force (P, nt) N under the limit (P,) N of each tangent by
    itself, and which of them slip."""
    most = limit[:, None]
    slips = np.abs(trial.real) > most.real
    return np.where(slips, np.sign(trial.real) * most, trial), slips


def resultant_limited(trial: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As `each_limited`, with one limit of the resultant: all tangents slip together."""
    most, size = limit[:, None], np.sqrt((trial * trial).sum(axis=1, keepdims=True))
    slips = size.real > most.real
    along = np.divide(trial, size, out=np.zeros_like(trial), where=slips)
    return np.where(slips, most * along, trial), slips & np.ones(trial.shape, dtype=bool)
