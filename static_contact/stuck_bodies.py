"""Bodies with the springs of all their pairs, factored for the history of friction."""

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from hbm.contact import ContactTable
from hbm.model import ReducedModel
from static_contact.preload import reference_stiffness


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


def stuck_springs(model: ReducedModel, pairs: ContactTable, B: sp.csr_matrix) -> tuple[np.ndarray, np.ndarray]:
    """(3P,) N/m the springs of stuck pairs, t1, t2, n pair by pair, and (3P,) bool - rigid ones, for which the bodies'
    own stiffness at the pair stands in, the same for both tangents."""
    given = np.column_stack([pairs.kt, pairs.kt, pairs.kn])
    carried = pairs.weight[:, None] > 0
    k = np.multiply(given, pairs.weight[:, None], out=np.zeros_like(given), where=carried).ravel()
    k0 = np.where(np.isinf(k), reference_stiffness(model.K, B, k), k).reshape(-1, 3)
    k0[:, :2] = k0[:, :2].min(axis=1, keepdims=True)
    return k0.ravel(), np.isinf(k)
