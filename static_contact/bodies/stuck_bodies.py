"""Bodies with the springs of all their pairs, factored for the history of friction."""

from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.bodies.factored import DenseBodies, FactoredBodies
from tipdamp.static_contact.normal.closed_factor import ClosedFactor


class BodiesOnSprings(Protocol):
    """A = K + B' k B of bodies with the springs k (3P,) N/m at all pairs, B (3P, r), and G = B A^-1
    B' (3P, 3P)."""

    k: np.ndarray

    def solve(self, load: np.ndarray) -> np.ndarray:
        """A^-1 load, (r,)."""

    def felt(self, load: np.ndarray) -> np.ndarray:
        """B A^-1 load, (3P,)."""

    def push(self, force: np.ndarray) -> np.ndarray:
        """G force, (3P,)."""

    def renew(self, tangent: np.ndarray) -> bool:
        """Whether the springs k are others now, nearer to the tangents (P, 3, 3) of the pairs."""

    def step(
        self, F: np.ndarray, E: np.ndarray, D: np.ndarray, opened: np.ndarray, enough: float
    ) -> np.ndarray:
        """-[E + G D]^-1 F to `enough` m, F (3P,); E, D (P, 3, 3) of the pairs, of which most are I,
        0. opened (P,) bool - pairs with E = I, D = -k."""


class StuckBodies:
    """Bodies on springs k, factored, with the compliance G of all their pairs."""

    def __init__(self, factored: FactoredBodies, k: np.ndarray) -> None:
        self.factored, self.k, self.G = factored, k, factored.take_compliance()

    def solve(self, load: np.ndarray) -> np.ndarray:
        """A^-1 load, (r,)."""
        return self.factored.solve(load)

    def felt(self, load: np.ndarray) -> np.ndarray:
        """B A^-1 load, (3P,)."""
        return self.factored.swept(load)[0]

    def push(self, force: np.ndarray) -> np.ndarray:
        """G force, (3P,)."""
        return self.G @ force

    def renew(self, tangent: np.ndarray) -> bool:
        """False: the springs stay."""
        return False

    def step(
        self, F: np.ndarray, E: np.ndarray, D: np.ndarray, opened: np.ndarray, enough: float
    ) -> np.ndarray:
        """As of `BodiesOnSprings`, exact; pairs with E = I, D = -k have a factor that is kept."""
        moved = D.any(axis=(1, 2)) | (E != np.eye(3)).any(axis=(1, 2))
        try:
            return self._step(F, E, D, moved & ~opened, np.repeat(opened, 3) & (self.k > 0))
        except np.linalg.LinAlgError:
            return self._step(F, E, D, moved, np.zeros(len(F), dtype=bool))

    def _step(
        self, F: np.ndarray, E: np.ndarray, D: np.ndarray, moved: np.ndarray, opened: np.ndarray
    ) -> np.ndarray:
        """With the pairs `moved` (P,) in one system behind the open rows (3P,)."""
        rows = (3 * np.flatnonzero(moved)[:, None] + np.arange(3)).ravel()
        V = (
            self._opened.solve(opened, np.column_stack([F, self.G[:, rows]]))
            if opened.any()
            else np.zeros((len(F), 1 + len(rows)))
        )
        own, felt = np.arange(len(rows)).reshape(-1, 3), self.G[np.ix_(rows, opened)]
        system = _times(self.G[np.ix_(rows, rows)] + felt @ V[opened, 1:], D[moved])
        system[own[:, :, None], own[:, None]] += E[moved]
        y = _solved(system, -F[rows] - felt @ V[opened, 0])
        push = np.einsum("pij,pj->pi", D[moved], y.reshape(-1, 3)).ravel()
        dz = -F - self.G[:, rows] @ push - self.G @ (V[:, 0] + V[:, 1:] @ push)
        dz[rows] = y
        return dz

    @cached_property
    def _opened(self) -> ClosedFactor:
        """1/k - G: what the springs of open pairs leave where they are taken away again."""
        A = -self.G
        A[np.diag_indices(len(A))] += np.divide(1.0, self.k, out=np.ones(len(A)), where=self.k > 0)
        return ClosedFactor(A)


def _solved(system: np.ndarray, right: np.ndarray) -> np.ndarray:
    """By least squares where the system is singular."""
    try:
        return np.linalg.solve(system, right)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(system, right, rcond=None)[0]


def _times(G: np.ndarray, D: np.ndarray) -> np.ndarray:
    """(n, 3m): G (n, 3m) by the blocks D (m, 3, 3)."""
    return np.einsum("npi,pij->npj", G.reshape(len(G), len(D), 3), D).reshape(G.shape)


def stuck_bodies(model: ReducedModel, B: sp.csr_matrix, k0: np.ndarray) -> StuckBodies:
    """A reduced model with the springs k0 (3P,) N/m at all pairs, B (3P, r). Raises LinAlgError
    where that leaves a motion free."""
    A = model.K + (B.T @ sp.diags(k0) @ B).toarray()
    return StuckBodies(DenseBodies(A, B), k0)


def stuck_springs(
    model: ReducedModel, pairs: ContactTable, B: sp.csr_matrix
) -> tuple[np.ndarray, np.ndarray]:
    """(3P,) N/m the springs of stuck pairs, t1, t2, n pair by pair, and (3P,) bool - rigid ones,
    for which the bodies' own stiffness at the pair stands in, the same for both tangents."""
    given = np.column_stack([pairs.kt, pairs.kt, pairs.kn])
    carried = pairs.weight[:, None] > 0
    k = np.multiply(given, pairs.weight[:, None], out=np.zeros_like(given), where=carried).ravel()
    k0 = np.where(np.isinf(k), reference_stiffness(model.K, B, k), k).reshape(-1, 3)
    k0[:, :2] = k0[:, :2].min(axis=1, keepdims=True)
    return k0.ravel(), np.isinf(k)


def normal_springs(pairs: ContactTable) -> np.ndarray:
    """(P,) N/m: kn of the pairs times their weight, may be inf; 0 of those that do not carry."""
    return np.multiply(pairs.kn, pairs.weight, out=np.zeros(len(pairs)), where=pairs.carrying)


def reference_stiffness(
    K: np.ndarray, B: np.ndarray | sp.spmatrix, spring: np.ndarray
) -> np.ndarray:
    """(P,) N/m: the pair's own spring, but no stiffer than the bodies at the pair, so that the sum
    stays well scaled.

    K (r, r); B (P, r) one row for each pair; spring (P,) N/m, may be inf, 0 where nothing acts.
    """
    B = sp.csr_matrix(B)
    size = np.asarray(B.multiply(B).sum(axis=1)).ravel()
    local = np.divide(
        np.asarray(B.multiply(B @ K).sum(axis=1)).ravel(),
        size**2,
        out=np.zeros(B.shape[0]),
        where=size > 0,
    )
    local = np.where(local > 0, local, local.max(initial=0.0))
    finite = spring[np.isfinite(spring)]
    return np.minimum(spring, np.where(local > 0, local, finite.max(initial=1.0)))
