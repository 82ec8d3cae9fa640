"""The speed of this machine, measured on small bodies and small arrays in the same run."""

import time
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import scipy.sparse as sp

SIDE = 14  # hexahedra along an edge of the block
SMALL = 12  # rows of the matrices whose operations make an evaluation
OPERATIONS = 250  # of numpy on them that take about as long as one
EVALUATIONS = 64  # that are measured


@dataclass(frozen=True)
class Machine:
    """factor, solve - s for the factor of a solid of `dofs` dofs and for one right-hand side; flops
    - dense, per s; evaluation - s for the equations of a curve on which all contacts stick."""

    factor: float
    solve: float
    flops: float
    dofs: int = 10125
    evaluation: float = 1.5e-3


# one core of an office machine with a tuned BLAS
COMMON = Machine(factor=0.25, solve=2.5e-3, flops=1e10)


@cache
def measured() -> Machine:
    """The yardstick: a block of 14 x 14 x 14 hexahedra is factorised and solved, a dense matrix
    factorised, and small arrays are worked on."""
    import scipy.linalg as sl

    from tipdamp.modal.eigen import Factor

    K = _block()
    began = time.process_time()
    factor = Factor(K)
    factored = time.process_time()
    factor.solve(np.ones((K.shape[0], 32)))
    solved = time.process_time()
    along = np.arange(700.0)[:, None] // (SIDE + 1) ** 2
    dense = np.eye(700) + 1e-3 * along @ along.T
    sl.lu_factor(dense)
    done = time.process_time()
    return Machine(
        factored - began,
        (solved - factored) / 32,
        2 / 3 * 700**3 / max(done - solved, 1e-4),
        K.shape[0],
        _evaluation(),
    )


def _block() -> "sp.csr_matrix":
    """Stiffness of the block, which rests on springs."""
    import scipy.sparse as sp

    from tipdamp.modal.elements.isoparametric import stiffness_and_mass

    n = SIDE
    at = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    # fmt: off
    corners = [
        (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
        (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
    ]
    # fmt: on
    cells = np.stack([at[a : n + a, b : n + b, c : n + c].ravel() for a, b, c in corners], axis=1)
    place = np.stack(np.meshgrid(*[np.arange(n + 1.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    K = stiffness_and_mass(place, "hexahedron", cells, 1.0, 1.0, 1.0)[0]
    return (K + sp.identity(K.shape[0])).tocsr()


def _evaluation() -> float:
    """What limits it is less arithmetic than the calls of numpy."""
    matrix, vector = np.eye(SMALL, dtype=complex), np.ones(SMALL)
    began = time.process_time()
    for _ in range(EVALUATIONS * OPERATIONS):
        vector = (matrix @ np.where(vector > 0, vector, 1.0)).real
    return max(time.process_time() - began, 1e-4) / EVALUATIONS
