"""Bodies as their contact pairs see them: the compliance of what is held, and the loose motions.

K q + B' N = f with a stiffness K that may leave bodies floating: a gauge holds the loose motions Z
(orthonormal), H = K + g Z Z', and X = g H^-1 Z are these motions with what K makes of them (Z
itself where it floats exactly). Then

    q = H^-1 (f - B' N) + X a,    X' K Z a = X' (f - B' N)

is the same problem: the balance of the loose motions stands alone, and keeps its digits whatever
moves how far. Springs k that hold motions s = a' q are pairs that are always closed: their forces k
s are eliminated from it."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.factored import DenseBodies, FactoredBodies
from tipdamp.static_contact.bodies.loose_motions import Loose, beside, spring_rows
from tipdamp.static_contact.bodies.rigid_motions import RigidMotionSettings
from tipdamp.static_contact.normal.normal_contact import Loading

# of the stiffness of single dofs: a motion that meets less is loose, or pushed (negative)
DOUBTFUL = 1e-10


class HeldBodies(FactoredBodies, Protocol):
    """H of bodies that are held against their loose motions Z (r, h), and K Z (r, h), zero of what
    floats."""

    Z: np.ndarray
    resisted: np.ndarray

    def moved(self, q: np.ndarray) -> np.ndarray:
        """q (r,) without what holding the free motions has made of them."""


class GaugedBodies(DenseBodies):
    """K + g Z Z' of a reduced model. What else K does not hold is loose too, since contact alone
    may; raises InputError where K is indefinite beyond that."""

    def __init__(self, model: ReducedModel, B: sp.csr_matrix, loose: Loose, gauge: float) -> None:
        K, self.Z, self.resisted = model.K, loose.Z, loose.resisted
        gauged = np.hstack([self.Z, loose.idle])
        H = K + gauge * (gauged @ gauged.T)
        try:
            super().__init__(H, B)
            return
        except np.linalg.LinAlgError:
            pass
        size = np.sqrt(np.where(H.diagonal() > 0, H.diagonal(), gauge))
        value, shape = np.linalg.eigh(H / np.outer(size, size))
        more = beside(gauged, shape[:, value < DOUBTFUL] / size[:, None])
        self.Z, self.resisted = np.hstack([self.Z, more]), np.hstack([self.resisted, K @ more])
        try:
            super().__init__(H + gauge * (1 + np.abs(value).max()) * (more @ more.T), B)
        except np.linalg.LinAlgError:
            raise InputError(
                "K is indefinite beyond what contact could restrain: check its signs"
            ) from None

    def moved(self, q: np.ndarray) -> np.ndarray:
        """q: a gauge adds nothing to a motion that no load drives."""
        return q


class Compliance:
    """Bodies and their pairs, factored once.

    B : (P, r) CSR normal motion of the pairs; G : (P, P) m/N; Y : (P, h), E : (h, h) - as in
    `normal_contact`"""

    def __init__(
        self,
        model: ReducedModel,
        pairs: ContactTable,
        kn: np.ndarray,
        held: Sequence[HeldMotion],
        settings: RigidMotionSettings,
        factored: Callable[..., HeldBodies] = GaugedBodies,
    ) -> None:
        """factored : how the bodies are held, `sparse_bodies.PinnedBodies` for a SparseBodies.
        Raises InputError where a motion that is not known to be rigid meets no stiffness."""
        motion = relative_motion(model, pairs)
        self.K, self.B = model.K, motion[2::3].tocsr()
        pushed = 3 * np.flatnonzero(kn > 0) + 2
        self.loose = Loose.of(model, motion, pushed, held, settings)
        diagonal = model.K.diagonal()
        self.gauge = float(np.median(diagonal[diagonal > 0])) if (diagonal > 0).any() else 1.0
        self.factored = factored(model, self.B, self.loose, self.gauge)
        self.Z, self.resisted = self.factored.Z, self.factored.resisted
        weak = self.resisted.any(axis=0)  # what floats exactly is its own shape
        self.X = self.Z.copy()
        self.X[:, weak] = self.gauge * self.factored.solve(self.Z[:, weak])
        self.Y, self.E0 = self.B @ self.X, self.X.T @ self.resisted
        self.G = self.factored.take_compliance()
        self._with_springs(held)

    def _with_springs(self, held: Sequence[HeldMotion]) -> None:
        """Eliminates the forces of the springs: F = S (U' (f - B' N) + held X a)."""
        self.held = spring_rows(held, self.K.shape[0])
        self.U = self.factored.solve(self.held.T)
        self.E0 = self.E = (self.E0 + self.E0.T) / 2
        if not len(held):
            return
        self.S = np.linalg.inv(np.diag([1 / one.stiffness for one in held]) + self.held @ self.U)
        self.pushed, self.turned = self.B @ self.U, self.held @ self.X
        self.G -= self.pushed @ self.S @ self.pushed.T
        self.Y = self.Y - self.pushed @ self.S @ self.turned
        self.E = self.E0 + self.turned.T @ self.S @ self.turned

    def loading(self, load: np.ndarray) -> Loading:
        """Of a load (r,) N."""
        (u, near), work = self.factored.swept(load), self.X.T @ load
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
        near = self.factored.back(loading.near, force) - self.U @ spring
        return (
            self.factored.moved(near + self.X @ amount),
            self.K @ near + self.Z @ (self.E0 @ amount) + self.held.T @ spring,
        )  # K X = Z E
