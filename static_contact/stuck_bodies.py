"""Bodies with the springs of all their pairs, factored for the history of friction."""

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from hbm.model import ReducedModel


class StuckBodies:
    """The bodies K (r, r) with the springs k0 (3P,) N/m at all pairs, B (3P, r): A = K + B' k0 B, factored.

    Raises LinAlgError or SingularStiffness where A is singular.
    """

    def __init__(self, model: ReducedModel, B: sp.csr_matrix, k0: np.ndarray):
        self.B, self.factor = B, sl.cho_factor(model.K + (B.T @ sp.diags(k0) @ B).toarray())

    def compliance(self) -> np.ndarray:
        """(3P, 3P) B A^-1 B'."""
        return self.B @ self.solve(self.B.T.toarray())

    def solve(self, load: np.ndarray) -> np.ndarray:
        """A^-1 load, (r,)."""
        return sl.cho_solve(self.factor, load)

    def felt(self, load: np.ndarray) -> np.ndarray:
        """B A^-1 load, (3P,)."""
        return self.B @ self.solve(load)
