"""How the matrices of a problem change with a parameter of one's own."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import ModelParameter
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import check_kind

STEP = 1e-3  # of the parameter; exact where the matrices are linear in it
STENCIL = np.array([-2.0, -1.0, 1.0, 2.0])
SLOPES = np.array([1.0, -8.0, 8.0, -1.0]) / 12  # by them: the derivative, to fourth order
SAME = 1e-9  # of the largest entry of a matrix: two are one


@dataclass(frozen=True)
class MatrixRates:
    """Derivatives (r, r) of M, of the viscous damping C, of the stuck stiffness K, and of the
    structural damping D."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    D: np.ndarray

    def push(self, here: Linearisation) -> np.ndarray:
        """(m, H+1) modal force that a motion resists more."""
        q = here.displacement()
        w = here.w * np.arange(here.balance.H + 1)
        push = (
            self.K @ q + 1j * w * (self.C @ q) - w**2 * (self.M @ q) + 1j * (self.D @ q) * (w > 0)
        )
        return here.balance.receptance.into.T @ push


def rates_of(
    problem: ContactProblem, parameters: Iterable[ModelParameter], taken: Iterable[str]
) -> dict[str, MatrixRates]:
    """{name: by a change of the parameter} at the value 1, which must be the problem itself;
    InputError where it is not, where contacts change, or a name is one of those taken."""
    found: dict[str, MatrixRates] = {}
    for one in parameters:
        check_kind("parameters", one, ModelParameter, "ModelParameter(name, of_value)")
        if one.name in found or one.name in taken:
            raise InputError(f"parameter '{one.name}': the name is taken, give it another")
        found[one.name] = _rates(problem, one)
    return found


def _rates(problem: ContactProblem, parameter: ModelParameter) -> MatrixRates:
    said = f"parameter '{parameter.name}'"
    if problem.varying is not None and problem.varying.of_matrices:
        raise InputError(
            f"{said}: the matrices of the problem depend on the frequency; fix them at one first"
        )

    def at(value: float) -> list[np.ndarray]:
        made = parameter.rebuild(problem, {}, value)[0]
        if not _same_contacts(made, problem):
            raise InputError(
                f"{said}: changes contacts; for these there are kn, kt, mu and preload"
            )
        D = made.structural
        return [made.M, made.damping_matrix, made.stuck_stiffness, 0 * made.M if D is None else D]

    here = [problem.M, problem.damping_matrix, problem.stuck_stiffness]
    for mine, own in zip(at(1.0), here, strict=False):
        if mine.shape != own.shape or np.abs(mine - own).max() > SAME * np.abs(own).max():
            raise InputError(
                f"{said}: is not the problem of the curve at the value 1; make it a factor"
            )
    beside = [at(1 + STEP * s) for s in STENCIL]
    return MatrixRates(
        *(np.tensordot(SLOPES, part, 1) / STEP for part in zip(*beside, strict=True))
    )


def _same_contacts(a: ContactProblem, b: ContactProblem) -> bool:
    settings = zip(vars(a.contacts).values(), vars(b.contacts).values(), strict=True)
    same = type(a.law) is type(b.law) and a.B.shape == b.B.shape
    return same and not abs(a.B - b.B).max() and all(np.array_equal(x, y) for x, y in settings)
