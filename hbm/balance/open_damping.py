"""The damping ratios of modes that leave contacts open.

Ratios are those of the modes with every contact closed. A contact that is open at rest has no
spring, and the modes without it have others, as a rule larger ones."""

from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.receptance import ratios

MOST_LOOKED_AT = 300  # dofs up to which the damping of open contacts is looked at
SEEN_MODES = 5  # the lowest ones, of which it is told
OTHER_RATIO = 0.05  # of a damping ratio: a larger difference is told


class OtherRatio(NamedTuple):
    """A mode that leaves contacts open: asked, its damping ratio with every contact closed; number,
    Hz and own ratio of the mode."""

    asked: float
    mode: int
    hz: float
    own: float


def damping_of_what_is_open(
    problem: ContactProblem, most: int = MOST_LOOKED_AT
) -> OtherRatio | None:
    """Of the lowest modes that leave the contacts open that are open at rest, the one whose damping
    ratio is farthest from what is asked for; None where none is far, or there are more dofs than
    `most`."""
    found = _modes(problem, most)
    if found is None:
        return None
    asked, own, hz = found
    few = slice(0, SEEN_MODES)
    i = int(np.abs(own[few] - asked[few]).argmax())
    if abs(own[i] - asked[i]) <= OTHER_RATIO * asked[i]:
        return None
    return OtherRatio(float(asked[i]), i + 1, float(hz[i]), float(own[i]))


def ratios_of_what_is_open(
    problem: ContactProblem, most: int = MOST_LOOKED_AT
) -> np.ndarray | None:
    """(r,) damping ratios of all modes that leave the contacts open that are open at rest, as the
    damping with every contact closed gives them; None where none is open, or there are more dofs
    than `most`. What couples the modes is left out."""
    found = _modes(problem, most)
    return None if found is None else found[1]


def _modes(problem: ContactProblem, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """(asked, own (r,) damping ratios, Hz) of the modes that leave contacts open."""
    is_open, r = problem.contacts.preload < 0, len(problem.K)
    known = problem.damping_ratio is not None and problem.preloaded
    if not known or not is_open.any() or r > most:
        return None
    springs = problem.law.stuck_stiffness(problem.contacts)
    left = np.where(is_open[:, None], 0.0, springs)
    try:
        stuck, shapes = la.eigh(problem.stuck_stiffness, problem.M)
        w2, modes = la.eigh(problem.with_contact_springs(problem.stiffness, left), problem.M)
    except la.LinAlgError:
        return None
    if not (w2[0] > 0 and stuck[0] > 0):
        return None
    asked = ratios(problem.damping_ratio, r)
    own = (2 * asked * np.sqrt(stuck)) @ (shapes.T @ problem.M @ modes) ** 2 / (2 * np.sqrt(w2))
    return asked, own, np.sqrt(w2) / (2 * np.pi)
