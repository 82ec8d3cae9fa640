"""The frictionless contact of elastic bodies that may float, in the forces of the pairs and the
motions of the bodies.

    u = u0 - G N + Y a,     E a + Y' N = w,      u = g + c N where closed,  N = 0 where open

u : normal motion, N : contact force, g : gap, c = 1/kn. G is the compliance of the bodies, held
against their loose motions; a are the amplitudes of these, Y their motion at the pairs, E the
stiffness that they meet (0 where the body floats: then Y' N = w is its balance), w the work of the
load on them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from tipdamp.static_contact.normal.closed_factor import ClosedFactor
from tipdamp.static_contact.normal.complementarity import SetSolution, no_equilibrium


@dataclass(frozen=True)
class SetSettings:
    """Of the solution on one set."""

    # of the stiffness of single loose motions: a set below it does not hold the bodies
    singular: float = 1e-12
    # of the largest force: below it the sign of a force is rounding (hard contact of beams)
    rounding: float = 5e-12
    repeats: int = 2  # steps of iterative refinement at most
    # of the terms of the equations of a set: what no refinement makes smaller
    refined: float = 1e-15
    residual: float = 1e-8  # of a solve on one set, of the load


SETTINGS = SetSettings()


class Loading(NamedTuple):
    """What the load does without contact: u0 : (P,) m motion of the pairs; work : (h,) along the
    loose motions
    near : what was solved for it, which `Compliance.displacement` goes on from
    """

    u0: np.ndarray
    work: np.ndarray
    near: Any = ()


@dataclass(frozen=True)
class NormalContact:
    """The bodies and pairs of one problem.

    A : (P, P) m/N, G + diag(c); c : (P,) m/N; Y : (P, h) m; E : (h, h); k0 : (P,) N/m - for the
    scale of forces, and anchors; free : (P,) bool - may close
    """

    A: np.ndarray
    c: np.ndarray
    Y: np.ndarray
    E: np.ndarray
    k0: np.ndarray
    free: np.ndarray
    rounding: float = SETTINGS.rounding

    def solve_set(
        self,
        closed: np.ndarray,
        load: Loading,
        gap: np.ndarray,
        anchor: float = 0.0,
        at: np.ndarray | float = 0.0,
    ) -> SetSolution:
        """With the pairs `closed` (P,) bool closed and all others open.

        anchor : share of k0 that acts as a spring between each pair and its motion `at` (proximal
        term)
        Raises NoEquilibrium where the system of this set is singular.
        """
        if not anchor:
            return self._balanced(closed, load, gap)
        # each pair and its anchor k together: u = g + soft F, with F = N + k (u - at)
        k = anchor * self.k0
        acting = k > 0
        soft = np.where(
            closed, self.c / (1 + k * self.c), np.divide(1.0, k, out=np.ones(len(k)), where=acting)
        )
        together = np.where(closed, (gap + k * self.c * at) / (1 + k * self.c), at)
        A = self.A.copy()
        A[np.diag_indices(len(k))] += soft - self.c
        anchored = NormalContact(A, soft, self.Y, self.E, self.k0, acting)
        u, force, a = anchored.solve_set(acting, load, together)
        return SetSolution(u, np.where(closed, (force - k * (gap - at)) / (1 + k * self.c), 0.0), a)

    def _balanced(self, closed: np.ndarray, load: Loading, gap: np.ndarray) -> SetSolution:
        """As `solve_set`, without anchors."""
        Y = np.where(closed[:, None], self.Y, 0.0)
        right = np.where(closed, load.u0 - gap, 0.0)
        try:
            X = self._factor.solve(closed, np.column_stack([right, Y]))
            T = self.E + Y.T @ X[:, 1:]
            if not self._holds(T):
                raise no_equilibrium(closed)
            a = np.linalg.solve(T, load.work - Y.T @ X[:, 0])
            N = X[:, 0] + X[:, 1:] @ a
            pressed, left, off = self._left(closed, right, load.work, N, a)
            for _ in range(SETTINGS.repeats):
                if off <= SETTINGS.refined:
                    break
                more = self._factor.solve(closed, left[:, None])[:, 0]
                da = np.linalg.solve(T, load.work - self.E @ a - Y.T @ (N + more))
                N, a = N + more + X[:, 1:] @ da, a + da
                pressed, left, off = self._left(closed, right, load.work, N, a)
        except np.linalg.LinAlgError:
            raise no_equilibrium(closed) from None
        if not off <= SETTINGS.residual:
            raise no_equilibrium(closed)
        return SetSolution(
            np.where(closed, gap + self.c * N, load.u0 - pressed + self.c * N + self.Y @ a), N, a
        )

    def _left(
        self, closed: np.ndarray, right: np.ndarray, work: np.ndarray, N: np.ndarray, a: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """A N (P,), what N and a leave of the closed pairs' equations (P,), and how much that, and
        what they leave of the balance, is of the terms."""
        pressed, moved, held = self.A @ N, np.where(closed, self.Y @ a, 0.0), self.E @ a
        left = np.where(closed, right - pressed + moved, 0.0)
        size = np.linalg.norm(right) + np.linalg.norm(moved) + np.linalg.norm(self.A.diagonal() * N)
        sums = np.abs(work) + np.abs(held) + np.abs(N) @ np.abs(self.Y)
        unbalanced = np.abs(work - held - N @ self.Y) / np.where(sums > 0, sums, 1.0)
        return (
            pressed,
            left,
            max(np.linalg.norm(left) / size if size > 0 else 0.0, unbalanced.max(initial=0.0)),
        )

    def held(self) -> bool:
        """Whether all pairs together hold the bodies, were they as stiff as they look one by
        one."""
        return self._holds(self.E + self.Y.T * self._looks @ self.Y)

    @cached_property
    def _looks(self) -> np.ndarray:
        """(P,) N/m: how stiff each pair looks by itself."""
        return np.divide(1.0, self.A.diagonal(), out=np.zeros(len(self.c)), where=self.free)

    @cached_property
    def _factor(self) -> ClosedFactor:
        return ClosedFactor(self.A)

    @cached_property
    def _scale(self) -> np.ndarray:
        """(h,) stiffness of each loose motion, with all pairs closed."""
        return np.sqrt(np.abs(self.E.diagonal()) + self._looks @ self.Y**2)

    def _holds(self, T: np.ndarray) -> bool:
        if not len(T):
            return True
        if not self._scale.all():
            return False
        return (
            np.abs(np.linalg.eigvalsh(T / np.outer(self._scale, self._scale))).min()
            > SETTINGS.singular
        )
