"""What matrices must be to be those of an elastic body, checked at input.

body : a `body.Body` throughout.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError


@dataclass(frozen=True)
class MatrixTolerances:
    """How far the matrices of a body may be from their ideal."""

    symmetry: float = 1e-10  # of the largest entry
    isotropy: float = 1e-6  # of the mass: matrices from text files have eight digits
    indefinite: float = 1e-8  # of the diagonal of M: a more negative mass is no rounding
    dense: int = 600  # up to this size LAPACK computes the lowest eigenvalue of M


TOLERANCES = MatrixTolerances()


def dof_name(body: Any, i: int) -> str:
    """'dof 7 (node 12, x)' with the user's node number."""
    return f"dof {i} (node {body.node[body.dof_node[i]]}, {'xyz'[body.dof_direction[i]]})"


def check_nodes(body: Any) -> None:
    """Whole numbers, each node once, each at a place."""
    for label in ("node", "dof_node", "dof_direction"):
        column = vars(body)[label]
        if column.dtype.kind not in "iu" or column.ndim != 1:
            raise InputError(
                f"body '{body.name}': {label} is an array of {column.dtype}, {column.shape}: "
                "allowed is one column of whole numbers"
            )
    number, count = np.unique(body.node, return_counts=True)
    if (count > 1).any():
        raise InputError(
            f"body '{body.name}': node {number[count > 1][0]} is in the table of nodes "
            f"{count[count > 1][0]} times ({int((count > 1).sum())} such nodes)"
        )
    lost = ~np.isfinite(body.position).all(axis=1)
    if lost.any():
        i = int(lost.argmax())
        raise InputError(
            f"body '{body.name}': node {body.node[i]} is at {body.position[i].tolist()}: every "
            f"position must be finite ({int(lost.sum())} such nodes)"
        )


def check_table(body: Any) -> None:
    """Every dof is a direction 0..2 of a node that is there, and none stands there twice."""
    for label, column, size in (
        ("node index", body.dof_node, len(body.node)),
        ("direction", body.dof_direction, 3),
    ):
        wrong = (column < 0) | (column >= size)
        if wrong.any():
            raise InputError(
                f"body '{body.name}': dof {int(wrong.argmax())} has {label} {column[wrong][0]}, "
                f"which does not exist or is eliminated; allowed: 0 to {size - 1}"
            )
    key = 3 * body.dof_node.astype(np.int64) + body.dof_direction
    unique, count = np.unique(key, return_counts=True)
    if (count > 1).any():
        raise InputError(
            f"body '{body.name}': {dof_name(body, int((key == unique[count > 1][0]).argmax()))} "
            "is in the dof table twice"
        )


def sparse(name: str, label: str, A: Any) -> sp.csr_matrix:
    """The matrix as CSR; InputError for what is none."""
    try:
        out = sp.csr_matrix(A)
        if out.dtype.kind in "biufc":
            return out
    except (TypeError, ValueError):
        pass
    what = f"an array of {A.dtype}, {A.shape}" if isinstance(A, np.ndarray) else f"{A!r}"[:60]
    raise InputError(f"body '{name}': {label} is {what}: must be a square matrix of numbers")


def check_matrix(body: Any, label: str, A: sp.csr_matrix) -> None:
    """Real, finite and symmetric."""
    if np.iscomplexobj(A):
        raise InputError(
            f"body '{body.name}': {label} is complex ({A.dtype}): must be real; structural "
            "damping is given with the response, as a damping ratio or C"
        )
    entries = A.tocoo()
    bad = ~np.isfinite(entries.data)
    if bad.any():
        i, j = int(entries.row[bad][0]), int(entries.col[bad][0])
        raise InputError(
            f"body '{body.name}': {label}[{i}, {j}] is {entries.data[bad][0]}: not a finite "
            f"number, at {dof_name(body, i)}"
        )
    gap, scale = abs(A - A.T).tocoo(), max(abs(A).max(), 1e-300)
    if gap.nnz and gap.data.max() > TOLERANCES.symmetry * scale:
        worst = int(gap.data.argmax())
        i, j = int(gap.row[worst]), int(gap.col[worst])
        raise InputError(
            f"body '{body.name}': {label} is not symmetric: |{label}[{i}, {j}] - {label}[{j}, "
            f"{i}]| is {gap.data[worst] / scale:.1e} of its largest entry, allowed "
            f"{TOLERANCES.symmetry:g}; at {dof_name(body, i)}"
        )


def check_mass(body: Any) -> None:
    """M is positive definite. Scaled to a unit diagonal it is well conditioned: no factor is
    needed."""
    diagonal = body.M.diagonal()
    if (diagonal <= 0).any():
        i = int((diagonal <= 0).argmax())
        empty = not abs(body.M[i]).sum()
        raise InputError(
            f"body '{body.name}': M has "
            f"{'a row of zeros' if empty else f'{diagonal[i]:g} on its diagonal'} at "
            f"{dof_name(body, i)}: every dof must have mass ({int((diagonal <= 0).sum())} such "
            "dofs)"
        )
    scale = sp.diags(1 / np.sqrt(diagonal))
    lowest, shape = _lowest((scale @ body.M @ scale).tocsr())
    if lowest < -TOLERANCES.indefinite:
        raise InputError(
            f"body '{body.name}': M is indefinite: a motion mostly of "
            f"{dof_name(body, int(np.abs(shape).argmax()))} "
            f"has negative mass ({lowest:.1e} of its diagonal)"
        )


def check_mass_by_direction(body: Any) -> None:
    """The same mass along x, y and z: of a free body, and of nodes with all three dofs where M
    couples no directions, as the M of finite elements does not. (The M of a clamped body condensed
    on some nodes may differ.)"""
    whole = np.bincount(body.dof_node, minlength=len(body.node)) == 3
    dofs = np.flatnonzero(whole[body.dof_node])
    M, direction = body.M[dofs][:, dofs].tocoo(), body.dof_direction[dofs]
    across = direction[M.row] != direction[M.col]
    coupled = np.abs(M.data[across]).max(initial=0.0) > TOLERANCES.symmetry * np.abs(M.data).max(
        initial=0.0
    )
    if not len(dofs) or (coupled and not body.free):
        return
    mass = np.bincount(direction[M.row[~across]], M.data[~across], minlength=3)
    if np.ptp(mass) > TOLERANCES.isotropy * mass.max():
        raise InputError(
            f"body '{body.name}': its mass along x, y, z is {', '.join(f'{m:.7g}' for m in mass)} "
            f"kg: must be the same to {TOLERANCES.isotropy:g}; are the directions of the dof "
            "table those of M?"
        )


def _lowest(A: sp.spmatrix) -> tuple[float, np.ndarray]:
    if A.shape[0] <= TOLERANCES.dense:
        value, vector = np.linalg.eigh(A.toarray())
        return value[0], vector[:, 0]
    value, vector = sp.linalg.eigsh(A, k=1, which="SA", tol=1e-3, v0=np.ones(A.shape[0]))
    return value[0], vector[:, 0]
