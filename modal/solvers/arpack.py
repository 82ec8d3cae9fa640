"""Lowest modes by ARPACK: implicitly restarted Lanczos on K^-1 M, with a factor of K that is there
already.

Used where SLEPc is missing, and for repeated modes of which a first answer lacks some.
Source: Lehoucq, Sorensen and Yang, ARPACK Users' Guide (1998), shift-invert mode.
"""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh


def lowest(
    solve: Callable, M: sp.csr_matrix, count: int, known: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """omega^2 (count,) ascending and M-orthonormal shapes (d, count) of the lowest modes of K phi =
    omega^2 M phi.

    solve(B) -> K^-1 B for (d, m); known : (d, k) modes that are left out, M-orthonormal. Of a mode
    that is repeated some copies may be missed, as by every Krylov method with one starting vector:
    count by inertia.
    Raises ArpackError where the iteration does not converge.
    """
    size = M.shape[0]
    known = np.empty((size, 0)) if known is None else known
    M_known = M @ known

    def without_known(x: np.ndarray) -> np.ndarray:
        return x - known @ (M_known.T @ x)

    inverse = LinearOperator(
        (size, size), lambda b: without_known(solve(b.reshape(-1, 1))[:, 0]), dtype=float
    )
    start = without_known(np.random.default_rng(known.shape[1]).standard_normal(size))
    # only the shape of the first argument is looked at where the inverse is given
    lam, shapes = eigsh(
        M, count, M, sigma=0.0, OPinv=inverse, v0=start, ncv=min(size, max(2 * count + 1, 20))
    )
    order = np.argsort(lam)
    return lam[order], shapes[:, order]
