"""The last digits of a balance where bodies move far: soft springs hold them, or pairs much softer than they are.

The small elastic part of a displacement loses its digits beside a large rigid one, and with them the forces K q.
Kept apart, q = rigid c + near, both keep theirs; what the balance then lacks is solved for again.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from static_contact.complementarity import NotHeld
from static_contact.rigid_motions import WEAK, floating

_ZERO = 1e-13              # of the largest entry of K: forces of a rigid motion that are rounding
_REFINED = 1e-11           # of the load: what rounding leaves above it is solved for again,
_AGAIN = 4                 # so often
_LOST = 1e3                # rounding of K q in eps |K| |q|: what is left above it is no rounding


@dataclass(frozen=True)
class Apart:
    """rigid : (r, m) - orthonormal basis of the rigid motions that the bodies resist weakly or not
    resisted : (r, m) N/m - K rigid, columns of zeros where that is no more than rounding"""

    rigid: np.ndarray
    resisted: np.ndarray

    @classmethod
    def of(cls, rigid, K) -> "Apart":
        """rigid (r, 6 b) as from `free_motions.rigid_motions`; K (r, r)."""
        basis = np.linalg.qr(rigid @ floating(rigid, K, WEAK))[0]
        resisted = K @ basis
        return cls(basis, resisted * (np.abs(resisted).max(axis=0, initial=0.0) > _ZERO * np.abs(K).max()))


def refined(statics, applied, q, u, force, closed):
    """q and K q (r,), motion and force of the pairs (P,) on the set `closed` that balance the forces `applied` (r,) to
    the last digits. statics - a `preload.StaticContact`.

    More than rounding is not solved for again: it is an error of the factor, and stays to be seen. Where a step leaves
    no less than the one before, that one is the answer.
    """
    K, apart = statics.model.K, statics.apart
    far = apart.rigid.T @ q
    near = q - apart.rigid @ far
    most = _LOST * np.finfo(float).eps * np.abs(K).max() * np.linalg.norm(q)
    least = _REFINED * np.linalg.norm(applied)
    best, fewest = None, np.inf
    for again in range(_AGAIN + 1):
        elastic = K @ near + apart.resisted @ far
        left = applied - elastic - statics.gauge @ q - statics.B.T @ force
        size = np.linalg.norm(left)
        if best is not None and not size < fewest:
            break
        best, fewest = (q, elastic, u, force), size
        if again == _AGAIN or not least < size < most:
            break
        more = sl.cho_solve(statics.factor, left)
        try:
            du, dN = statics.normal.on_set(closed, statics.B @ more, np.zeros(len(u)))
        except NotHeld:                                     # anchors hold this answer
            break
        dq = more - statics.by_pair @ (dN - statics.normal.k0 * du)
        u, force = u + du, force + dN
        step = apart.rigid.T @ dq
        far, near = far + step, near + dq - apart.rigid @ step
        q = apart.rigid @ far + near
    return best
