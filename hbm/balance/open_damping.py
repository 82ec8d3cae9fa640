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


class OpenModes(NamedTuple):
    """Of all modes that leave the contacts open that are open at rest, (r,) each, ascending: the
    damping ratio asked for with every contact closed, the one that follows, and Hz. What couples
    the modes is left out."""

    asked: np.ndarray
    own: np.ndarray
    hz: np.ndarray

    @property
    def farthest(self) -> OtherRatio | None:
        """Of the lowest modes the one whose ratio is farthest from what is asked for; None where
        none is far."""
        away = np.abs(self.own - self.asked)[:SEEN_MODES]
        i = int(away.argmax())
        if away[i] <= OTHER_RATIO * self.asked[i]:
            return None
        return OtherRatio(float(self.asked[i]), i + 1, float(self.hz[i]), float(self.own[i]))


def open_modes(problem: ContactProblem, most: int = MOST_LOOKED_AT) -> OpenModes | None:
    """None where no contact is open at rest, or there are more dofs than `most`."""
    is_open = problem.contacts.preload < 0
    r = len(problem.K)
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
    return OpenModes(asked, own, np.sqrt(w2) / (2 * np.pi))
