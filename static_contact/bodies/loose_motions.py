"""The loose motions of bodies: rigid ones that float, that weak stiffness holds, or that nothing
resists."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.free_motions import FreeMotions, free_motions
from tipdamp.static_contact.bodies.rigid_motions import RigidMotionSettings, loose, rigid_motions

UNFELT = 1e-9  # of a motion: what a spring feels of it by rounding


@dataclass(frozen=True)
class Loose:
    """rigid : (r, 6 b) - unit rigid motions; floats : (6 b, m) coefficients of those that K does
    not resist free - of them, those that no pair and no spring resists either
    Z : (r, h) orthonormal - those that pairs, springs or weak stiffness hold; idle : (r, i) - the
    free ones
    resisted : (r, h) - K Z, zero of what floats
    """

    rigid: np.ndarray
    floats: np.ndarray
    free: FreeMotions
    Z: np.ndarray
    idle: np.ndarray
    resisted: np.ndarray

    @classmethod
    def of(
        cls,
        model: ReducedModel,
        motion: sp.csr_matrix,
        pushed: np.ndarray,
        held: Sequence[HeldMotion],
        settings: RigidMotionSettings,
    ) -> "Loose":
        """motion (3P, r) of the pairs, of which springs act on the rows `pushed`; held - springs
        that hold motions."""
        rigid = rigid_motions(model)
        floats = loose(model, rigid, settings=settings)
        floating = rigid @ floats
        left = _unfelt(spring_rows(held, model.size), floating)
        free = free_motions(model, rigid, floats @ left, motion, pushed, settings)
        idle = np.linalg.qr(free.shape)[0]
        floating = beside(idle, floating)
        weak = beside(
            np.hstack([idle, floating]), rigid @ loose(model, rigid, settings.weak, settings)
        )
        Z = np.hstack([floating, weak])
        return cls(
            rigid, floats, free, Z, idle, np.hstack([np.zeros(floating.shape), model.K @ weak])
        )


def spring_rows(held: Sequence[HeldMotion], size: int) -> np.ndarray:
    """(s, r): rows of the held motions."""
    return np.array([one.row for one in held]).reshape(-1, size)


def _unfelt(springs: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """(m, k) combinations of the motions (r, m) that none of the springs (s, r) feels."""
    if not len(springs) or not motions.shape[1]:
        return np.eye(motions.shape[1])
    size = np.linalg.norm(motions, axis=0)
    felt = springs / np.linalg.norm(springs, axis=1)[:, None] @ (motions / size)
    return sl.null_space(felt, rcond=UNFELT) / size[:, None]


def beside(Q: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """(r, m) orthonormal basis of what the motions have beside the orthonormal Q."""
    size = np.linalg.norm(motions, axis=0)
    motions = motions / np.where(size > 0, size, 1.0)
    for _ in range(2):
        motions = motions - Q @ (Q.T @ motions)
    U, amount, _ = np.linalg.svd(motions, full_matrices=False)
    return U[:, amount > 1e-6]
