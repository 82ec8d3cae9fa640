"""Bodies as their contact pairs see them: the compliance of what is held, and the loose motions.

K q + B' N = f with a stiffness K that may leave bodies floating: a gauge holds the loose motions Z
(orthonormal), H = K + g Z Z', and X = g H^-1 Z are these motions with what K makes of them (Z
itself where it floats exactly). Then

    q = H^-1 (f - B' N) + X a,    X' K Z a = X' (f - B' N)

is the same problem: the balance of the loose motions stands alone, and keeps its digits whatever
moves how far. Springs k that hold motions s = a' q are pairs that are always closed: their forces k
s are eliminated from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.free_motions import FreeMotions, free_motions
from tipdamp.static_contact.bodies.rigid_motions import RigidMotionSettings, loose, rigid_motions
from tipdamp.static_contact.normal.normal_contact import Loading

UNFELT = 1e-9  # of a motion: what a spring feels of it by rounding
# of the stiffness of single dofs: a motion that meets less is loose, or pushed (negative)
DOUBTFUL = 1e-10


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
        floating = _beside(idle, floating)
        weak = _beside(
            np.hstack([idle, floating]), rigid @ loose(model, rigid, settings.weak, settings)
        )
        Z = np.hstack([floating, weak])
        return cls(
            rigid, floats, free, Z, idle, np.hstack([np.zeros(floating.shape), model.K @ weak])
        )


def spring_rows(held: Sequence[HeldMotion], size: int) -> np.ndarray:
    """(s, r): rows of the held motions."""
    return np.array([one.row for one in held]).reshape(-1, size)


def _unfelt(springs, motions):
    """(m, k) combinations of the motions (r, m) that none of the springs (s, r) feels."""
    if not len(springs) or not motions.shape[1]:
        return np.eye(motions.shape[1])
    size = np.linalg.norm(motions, axis=0)
    felt = springs / np.linalg.norm(springs, axis=1)[:, None] @ (motions / size)
    return sl.null_space(felt, rcond=UNFELT) / size[:, None]


def _beside(Q, motions):
    """(r, m) orthonormal basis of what the motions have beside the orthonormal Q."""
    size = np.linalg.norm(motions, axis=0)
    motions = motions / np.where(size > 0, size, 1.0)
    for _ in range(2):
        motions = motions - Q @ (Q.T @ motions)
    U, amount, _ = np.linalg.svd(motions, full_matrices=False)
    return U[:, amount > 1e-6]


class Compliance:
    """A reduced model and its pairs, factored once.

    B : (P, r) CSR normal motion of the pairs; G : (P, P) m/N; Y : (P, h), E : (h, h) - as in
    `normal_contact`"""

    def __init__(
        self,
        model: ReducedModel,
        pairs: ContactTable,
        kn: np.ndarray,
        held: Sequence[HeldMotion],
        settings: RigidMotionSettings,
    ):
        """Raises InputError where a motion that is not known to be rigid meets no stiffness."""
        motion = relative_motion(model, pairs)
        self.K, self.B = model.K, motion[2::3].tocsr()
        pushed = 3 * np.flatnonzero(kn > 0) + 2
        self.loose = Loose.of(model, motion, pushed, held, settings)
        self.Z, self.resisted = self.loose.Z, self.loose.resisted
        diagonal = model.K.diagonal()
        self.gauge = float(np.median(diagonal[diagonal > 0])) if (diagonal > 0).any() else 1.0
        self.factor = self._factored(model)
        weak = self.resisted.any(axis=0)  # what floats exactly is its own shape
        self.X = self.Z.copy()
        self.X[:, weak] = self.gauge * self._solve(self.Z[:, weak])
        self.Y, self.E0, self.G = self.B @ self.X, self.X.T @ self.resisted, self._compliance()
        self._with_springs(held)

    def _with_springs(self, held):
        """Eliminates the forces of the springs: F = S (U' (f - B' N) + held X a)."""
        self.held = spring_rows(held, self.K.shape[0])
        self.U = self._solve(self.held.T)
        self.E0 = self.E = (self.E0 + self.E0.T) / 2
        if not len(held):
            return
        self.S = np.linalg.inv(np.diag([1 / one.stiffness for one in held]) + self.held @ self.U)
        self.pushed, self.turned = self.B @ self.U, self.held @ self.X
        self.G -= self.pushed @ self.S @ self.pushed.T
        self.Y = self.Y - self.pushed @ self.S @ self.turned
        self.E = self.E0 + self.turned.T @ self.S @ self.turned

    def _solve(self, right):
        """H^-1 right, (r,) or (r, m)."""
        return sl.cho_solve(self.factor, right)

    def _near(self, load):
        """The motion of the pairs (P,) under a load, and what the displacement follows from."""
        return self.B @ self._solve(load), ()

    def _pushed(self, near, load, force):
        """(r,) H^-1 (load - B' force)"""
        return self._solve(load - self.B.T @ force)

    def _compliance(self):
        return self.B @ self._solve(self.B.T.toarray(order="F"))

    def _factored(self, model):
        K = model.K
        gauged = np.hstack([self.Z, self.loose.idle])
        H = K + self.gauge * (gauged @ gauged.T)
        try:
            return sl.cho_factor(H, check_finite=False)
        except np.linalg.LinAlgError:
            pass
        # what else K does not hold: contact alone may
        size = np.sqrt(np.where(H.diagonal() > 0, H.diagonal(), self.gauge))
        value, shape = np.linalg.eigh(H / np.outer(size, size))
        more = _beside(gauged, shape[:, value < DOUBTFUL] / size[:, None])
        self.Z, self.resisted = np.hstack([self.Z, more]), np.hstack([self.resisted, K @ more])
        try:
            return sl.cho_factor(
                H + self.gauge * (1 + np.abs(value).max()) * (more @ more.T), check_finite=False
            )
        except np.linalg.LinAlgError:
            raise InputError(
                "K is indefinite beyond what contact could restrain: check its signs"
            ) from None

    def loading(self, load: np.ndarray) -> Loading:
        """Of a load (r,) N."""
        (u, near), work = self._near(load), self.X.T @ load
        if len(self.held):
            first = self.S @ (self.U.T @ load)
            u, work = u - self.pushed @ first, work - self.turned.T @ first
        return Loading(u, work, near)

    def spring_forces(
        self, applied: np.ndarray, force: np.ndarray, amount: np.ndarray
    ) -> np.ndarray:
        """(s,) N or N m on the springs that hold motions, as of `displacement`."""
        if not len(self.held):
            return np.zeros(0)
        return self.S @ (self.U.T @ (applied - self.B.T @ force) + self.turned @ amount)

    def displacement(
        self, loading: Loading, applied: np.ndarray, force: np.ndarray, amount: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """q (r,) m and the forces (r,) N of bodies, K q, and springs under applied (r,), of which
        `loading` was made, and contact forces (P,)."""
        spring = self.spring_forces(applied, force, amount)
        near = self._pushed(loading.near, applied, force) - self.U @ spring
        return (
            near + self.X @ amount,
            self.K @ near + self.Z @ (self.E0 @ amount) + self.held.T @ spring,
        )  # K X = Z E
