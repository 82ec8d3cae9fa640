"""The stiffness of bodies, factored together with the motions of their contact pairs.

All that static contact asks of bodies, whether they are condensed on their pairs (`DenseBodies`) or
have all their dofs (`sparse_bodies.SideBySide`)."""

from typing import Any, Protocol

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp


class FactoredBodies(Protocol):
    """A (r, r), positive definite, and the motions B (P, r) of the pairs."""

    def solve(self, right: np.ndarray) -> np.ndarray:
        """A^-1 right, (r,) or (r, m)."""

    def swept(self, load: np.ndarray) -> tuple[np.ndarray, Any]:
        """B A^-1 load (P,) of a load (r,), and what `back` goes on from."""

    def back(self, near: Any, force: np.ndarray) -> np.ndarray:
        """A^-1 (load - B' force), (r,), of a load that was swept and of (P,)."""

    def take_compliance(self) -> np.ndarray:
        """B A^-1 B' (P, P), which is given away: it is large."""


class DenseBodies:
    """A (r, r) dense, B (P, r) CSR. Raises LinAlgError where A is not positive definite."""

    def __init__(self, A: np.ndarray, B: sp.csr_matrix) -> None:
        self.B, self.factor = B, sl.cho_factor(A, check_finite=False)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """A^-1 right, (r,) or (r, m)."""
        return sl.cho_solve(self.factor, right)

    def swept(self, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """B A^-1 load (P,) of a load (r,), and the load."""
        return self.B @ self.solve(load), load

    def back(self, near: np.ndarray, force: np.ndarray) -> np.ndarray:
        """A^-1 (near - B' force), (r,)."""
        return self.solve(near - self.B.T @ force)

    def take_compliance(self) -> np.ndarray:
        """B A^-1 B' (P, P)."""
        return self.B @ self.solve(self.B.T.toarray(order="F"))
