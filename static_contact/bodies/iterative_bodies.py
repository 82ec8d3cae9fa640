"""Bodies with springs at thousands of pairs, for the history of friction without any dense matrix
of the pairs.

G = B A^-1 B' is applied by the sparse factor of A = K + B' k B, and Newton's systems [E + G D] dz =
-F are solved by GMRES [Saad and Schultz 1986]. D vanishes where a pair does what its springs k do.
Where many pairs have come to do otherwise, and the iterations have become many, k follows the
tangents of the pairs and A is factored again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.solvers.cholesky import sparse_factor
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies, sparse_stuck_bodies
from tipdamp.static_contact.bodies.stuck_bodies import BodiesOnSprings


@dataclass(frozen=True)
class IterationSettings:
    """Of the linear solver, and of the springs that it starts from."""

    most: int = 100  # iterations: a system that takes more has no answer, or wants other springs
    slow: int = 12  # iterations in each of some steps that take as long as a new factor
    worse: float = 2.0  # times those with new springs: so many pairs have changed that these pay
    # of the spring that stays where a pair slips or is open: A is never singular
    share: float = 1e-3
    many: int = 2000  # pairs: from so many on the dense compliance takes gigabytes
    # of the residual: a step that exact is as good as an exact one, until pairs change
    reduced: float = 1e-4


SETTINGS = IterationSettings()


class IterativeBodies:
    """Bodies on springs of a SparseBodies, in little more memory than one sparse factor: what some
    thousand pairs need, and slower than `sparse_stuck_bodies` with fewer of them."""

    def __init__(
        self,
        model: SparseBodies,
        B: sp.csr_matrix,
        k0: np.ndarray,
        settings: IterationSettings = SETTINGS,
    ) -> None:
        self.K, self.B, self.k0, self.settings = model.K, B, k0, settings
        self.count: int = 0  # iterations of the last step
        self.usual: int | None = 0  # and of the first with these springs, where they are not k0
        self._factor(k0)

    def _factor(self, k: np.ndarray) -> None:
        self.k = k
        self.factor: Any = None  # the old factor goes before the new one comes
        self.factor = sparse_factor((self.K + self.B.T @ sp.diags(k) @ self.B).tocsr())

    def solve(self, load: np.ndarray) -> np.ndarray:
        """A^-1 load, (r,)."""
        return self.factor.solve(load[:, None])[:, 0]

    def felt(self, load: np.ndarray) -> np.ndarray:
        """B A^-1 load, (3P,)."""
        return self.B @ self.solve(load)

    def push(self, force: np.ndarray) -> np.ndarray:
        """G force, (3P,)."""
        return self.felt(self.B.T @ force)

    def renew(self, tangent: np.ndarray) -> bool:
        """Whether the springs k are others now, nearer to the tangents (P, 3, 3) of the pairs."""
        if self.count <= max(self.settings.slow, self.settings.worse * (self.usual or 0)):
            return False
        self._factor(
            np.clip(np.einsum("pii->pi", tangent).ravel(), self.settings.share * self.k0, self.k0)
        )
        self.count, self.usual = 0, None
        return True

    def step(
        self, F: np.ndarray, E: np.ndarray, D: np.ndarray, opened: np.ndarray, enough: float
    ) -> np.ndarray:
        """-[E + G D]^-1 F to `enough` m, or to a small part of F."""

        def apply(x: np.ndarray) -> np.ndarray:
            x = x.reshape(-1, 3, 1)
            return (E @ x).ravel() + self.push((D @ x).ravel())

        enough = max(enough, self.settings.reduced * float(np.linalg.norm(F)))
        dz, self.count = gmres(apply, -F, enough, self.settings.most)
        self.usual = self.count if self.usual is None else self.usual
        return dz


def bodies_on_springs(
    model: SparseBodies, B: sp.csr_matrix, k0: np.ndarray, many: int = SETTINGS.many
) -> BodiesOnSprings:
    """Bodies with `many` pairs or more by iterations, others by the dense compliance of their
    pairs."""
    return (IterativeBodies if B.shape[0] >= 3 * many else sparse_stuck_bodies)(model, B, k0)


def gmres(apply: Callable, right: np.ndarray, enough: float, most: int) -> tuple[np.ndarray, int]:
    """x with |right - apply(x)| <= enough, or the best of `most` iterations, and how many it
    took."""
    size = np.linalg.norm(right)
    Q, H = [right / size], np.zeros((most + 1, most))
    for j in range(most):
        w = apply(Q[j])
        for _ in range(2):  # twice: orthogonal to rounding
            for i, q in enumerate(Q):
                more = q @ w
                H[i, j] += more
                w = w - more * q
        H[j + 1, j] = np.linalg.norm(w)
        y, *_ = np.linalg.lstsq(H[: j + 2, : j + 1], size * np.eye(j + 2)[0], rcond=None)
        left = np.linalg.norm(H[: j + 2, : j + 1] @ y - size * np.eye(j + 2)[0])
        if left <= enough or H[j + 1, j] <= np.finfo(float).eps * np.abs(H[: j + 1, j]).max():
            break
        Q.append(w / H[j + 1, j])
    return y @ np.array(Q[: j + 1]), j + 1
