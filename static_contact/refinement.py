"""Iterative refinement of a static balance in which bodies move far: soft springs hold them, or soft pairs.

The small elastic part of a displacement loses its digits beside a large rigid one, and with them the forces K q.
Kept apart, q = rigid c + near, both keep theirs; what the balance then lacks is solved for again.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg as sl

from static_contact.complementarity import ContactSolution, NoEquilibrium
from static_contact.rigid_motions import SETTINGS as RIGID
from static_contact.rigid_motions import floating


@dataclass(frozen=True)
class RefinementSettings:
    """When the balance is solved for again."""

    rounding: float = 1e-13     # of the largest entry of K: forces of a rigid motion that are rounding
    enough: float = 1e-11       # of the load: a smaller rest stays
    repeats: int = 4
    lost: float = 1e3           # times eps |K| |q|, the rounding of K q: a larger rest is an error, not rounding


SETTINGS = RefinementSettings()


class Balance(NamedTuple):
    """q, elastic : (r,) displacement m and K q N; u, force : (P,) motion m and force N of the pairs"""

    q: np.ndarray
    elastic: np.ndarray
    u: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class RigidSplit:
    """rigid : (r, m) - orthonormal basis of the rigid motions that the bodies resist weakly or not
    resisted : (r, m) N/m - K rigid, columns of zeros where that is no more than rounding"""

    rigid: np.ndarray
    resisted: np.ndarray

    @classmethod
    def of(cls, rigid: np.ndarray, K: np.ndarray, settings: RefinementSettings = SETTINGS) -> "RigidSplit":
        """rigid (r, 6 b) as from `rigid_motions.rigid_motions`; K (r, r)."""
        basis = np.linalg.qr(rigid @ floating(rigid, K, RIGID.weak))[0]
        resisted = K @ basis
        return cls(basis, resisted * (np.abs(resisted).max(axis=0, initial=0.0) > settings.rounding * np.abs(K).max()))


def refined(statics: Any, applied: np.ndarray, start: np.ndarray, contact: ContactSolution,
            settings: RefinementSettings = SETTINGS) -> Balance:
    """The balance of the forces `applied` (r,) on the closed set of the solution `contact` to the last digits, from the
    displacement `start` (r,).

    statics - a `preload.StaticContact`; contact - its ContactSolution. More than rounding is not solved for again: it
    is an error of the factor, and stays to be seen. Where a step leaves no less than the one before, that one is the
    answer.
    """
    K, split, q, u, force = statics.model.K, statics.split, start, contact.u, contact.N
    far = split.rigid.T @ q
    near = q - split.rigid @ far
    most = settings.lost * np.finfo(float).eps * np.abs(K).max() * np.linalg.norm(q)
    enough = settings.enough * np.linalg.norm(applied)
    best, smallest = Balance(q, np.zeros_like(q), u, force), np.inf
    for again in range(settings.repeats + 1):
        elastic = K @ near + split.resisted @ far
        left = applied - elastic - statics.gauge @ q - statics.B.T @ force
        size = float(np.linalg.norm(left))
        if again and not size < smallest:
            break
        best, smallest = Balance(q, elastic, u, force), size
        if again == settings.repeats or not enough < size < most:
            break
        more = sl.cho_solve(statics.factor, left)
        try:
            du, dN = statics.normal.solve_set(contact.closed, statics.B @ more, np.zeros(len(u)))
        except NoEquilibrium:                                     # anchors hold this answer
            break
        dq = more - statics.by_pair @ (dN - statics.normal.k0 * du)
        u, force = u + du, force + dN
        step = split.rigid.T @ dq
        far, near = far + step, near + dq - split.rigid @ step
        q = split.rigid @ far + near
    return best
