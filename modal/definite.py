"""Is a stiffness positive definite? On its diagonal, with the masters fixed, and condensed on them:
together, all.

body : a `body.Body` throughout.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.linalg import ArpackError, eigsh

from tipdamp.hbm.errors import InputError
from tipdamp.modal.eigen import Factor, SingularStiffness
from tipdamp.modal.matrix_checks import dof_name
from tipdamp.modal.solvers.inertia import modes_below


@dataclass(frozen=True)
class DefinitenessSettings:
    """Of the search for negative stiffness."""

    # of the stiffness of a single dof: a more negative stiffness is no rounding
    negative: float = 1e-9
    # of the body's ratio of stiffness to mass: a rigid motion that meets less is free
    floating: float = 1e-9
    # nodes up to which negative modes are counted at once: it takes less than 0.1 s
    counted: int = 5000


SETTINGS = DefinitenessSettings()


def negative_stiffness(body: Any, what: str) -> InputError:
    """The error that says what meets negative stiffness, and that it is the speed where the body
    turns."""
    speed = body.provenance.get("speed")
    cause = (
        f"unstable at this speed ({speed}): spin softening and compression exceed the elastic "
        "stiffness"
        if speed
        else "K is indefinite"
    )
    return InputError(f"body '{body.name}': negative stiffness, {what}; {cause}")


def check_stiffness_diagonal(body: Any) -> None:
    """InputError where a dof meets no stiffness, or a negative one, with all others fixed."""
    diagonal = body.K.diagonal()
    if (diagonal < 0).any():
        raise negative_stiffness(
            body,
            f"K is {diagonal.min():.3g} on its diagonal at "
            f"{dof_name(body, int(diagonal.argmin()))}",
        )
    if (diagonal == 0).any():
        i = int((diagonal == 0).argmax())
        empty = not abs(body.K[i]).sum()
        raise InputError(
            f"body '{body.name}': K has {'a row of zeros' if empty else 'a zero on its diagonal'} "
            f"at {dof_name(body, i)}: nothing holds it ({int((diagonal == 0).sum())} such dofs)"
        )


def check_condensed(body: Any, boundary: np.ndarray, S: np.ndarray) -> None:
    """InputError where the stiffness S (b, b) condensed on the dofs `boundary` has a motion with
    negative stiffness.

    Rounding goes with the diagonal of K: where the other masters are an axis of a free body, S
    itself is zero to rounding. With a definite stiffness of the other dofs the whole of K is then
    semidefinite.
    """
    own = body.K.diagonal()[boundary]
    scaled = S / np.sqrt(np.outer(own, own))
    i = int(scaled.diagonal().argmin())
    if scaled[i, i] < -SETTINGS.negative:
        raise negative_stiffness(
            body, f"{S[i, i]:.3g} N/m at {dof_name(body, boundary[i])} with the other masters held"
        )
    try:
        sl.cholesky(scaled + SETTINGS.negative * np.eye(len(S)), check_finite=False)
    except np.linalg.LinAlgError:
        lam, shape = sl.eigh(scaled, subset_by_index=(0, 0))
        raise negative_stiffness(
            body,
            f"{lam[0]:.1e} of the stiffness of single dofs, in a motion mostly of "
            f"{dof_name(body, boundary[int(np.abs(shape).argmax())])}",
        ) from None


def definite_factor(
    body: Any, interior: np.ndarray, K_II: sp.csr_matrix, M_II: sp.csr_matrix
) -> Factor:
    """Factor of the stiffness with the masters fixed. Raises InputError where a motion meets
    negative stiffness.

    A large matrix has one only where it is positive definite, but of one with little fill CHOLMOD
    keeps LDL', as SuperLU does of all: negative modes of small ones are counted here, those of
    others when the modes are.
    """
    try:
        factor = Factor(K_II)
    except SingularStiffness as error:
        factor, reason = None, error
    negative = (
        modes_below(K_II, M_II, 0.0)
        if factor is None or len(body.dof_node) < SETTINGS.counted
        else 0
    )
    if negative:
        meet = "motion meets" if negative == 1 else "motions meet"
        raise negative_stiffness(
            body, f"{negative} {meet} it with the masters fixed" + _mostly(body, interior, K_II)
        )
    if factor is None:
        raise reason
    return factor


def _mostly(body: Any, dofs: np.ndarray, K: sp.csr_matrix) -> str:
    """', mostly of dof ...': where the motion with the most negative stiffness is largest; empty if
    it is not found."""
    if K.shape[0] < 2:
        return ""
    root = sp.diags(1 / np.sqrt(K.diagonal()))
    try:
        shape = eigsh(root @ K @ root, k=1, which="SA", v0=np.ones(K.shape[0]))[1]
    except ArpackError:
        return ""
    return f", the worst mostly of {dof_name(body, dofs[int(np.abs(shape).argmax())])}"
