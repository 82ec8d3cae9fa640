"""Lowest modes by SLEPc: Krylov-Schur on the inverse of K, on one process or on the ranks of an
mpirun."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.solvers import petsc
from tipdamp.modal.solvers.cholesky import Cholmod

if TYPE_CHECKING:
    from petsc4py.PETSc import PC, Mat, Vec


@dataclass(frozen=True)
class SlepcSettings:
    """Of Krylov-Schur."""

    tolerance: float = 1e-8  # of the residual; omega^2 is good to its square
    # vectors per mode: one restart, or none; with three a fifth slower, with five twice
    basis: int = 2
    restarts: int = 500


SETTINGS = SlepcSettings()


def start() -> Any:
    """The SLEPc module, or None where it is not installed."""
    try:
        from slepc4py import SLEPc
    except ImportError:
        return None
    return SLEPc


def lowest_with(
    factor: Cholmod, M: sp.csr_matrix, asked: int, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """omega^2 (asked,) or more of the lowest modes, ascending, and the shapes (d, count), on the
    factor of K."""
    B = petsc.matrix(factor.PETSc, M)
    lam, shapes = lowest(factor.A, B, asked, factor=factor.factor)
    phi = np.column_stack([shape.getArray() for shape in shapes[:count]])
    for made in (B, *shapes):  # by hand: what Python drops stays in memory
        made.destroy()
    return lam, phi


def lowest(A: Any, B: Any, count: int, *, factor: Any = None) -> tuple[np.ndarray, list]:
    """omega^2 (m,) ascending and shapes, m PETSc vectors, of the lowest modes of A x = omega^2 B x:
    m >= count.

    A, B : PETSc matrices, A positive definite; factor : that of A where there is one, which is used
    and left as it is, otherwise MUMPS makes one over the ranks of A. Raises RuntimeError when fewer
    converge.
    """
    eps = _krylov_schur(A, B, count)
    # a back-solve a mode; `Factor` does better with all modes at once
    eps.setPurify(factor is None)
    transform = eps.getST()
    ksp = transform.getKSP()
    ksp.setType("preonly")
    if factor is None:
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType("mumps")
    else:
        ksp.setPC(_lent(A, factor))
    pc = ksp.getPC()
    try:
        eps.solve()
        found = eps.getConverged()
        if found < count:
            raise RuntimeError(f"SLEPc converged {found} of {count} modes")
        shapes = [A.createVecLeft() for _ in range(found)]
        lam = np.array([eps.getEigenpair(i, shapes[i]).real for i in range(found)])
    finally:
        # all by hand: a lent factor of which the last reference is among what Python dropped is
        # never freed
        for one in (eps, transform, ksp, pc):
            one.destroy()
    order = np.argsort(lam)
    return lam[order], [shapes[i] for i in order]


def _krylov_schur(A: "Mat", B: "Mat", count: int) -> Any:
    """SLEPc's solver for the `count` lowest modes, by the inverse of A."""
    SLEPc = start()
    eps = SLEPc.EPS().create(A.comm)
    eps.setOptionsPrefix("tipdamp_")
    eps.setOperators(A, B)
    eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    eps.setDimensions(count, min(max(SETTINGS.basis * count, count + 15), A.size[0]))
    eps.setTolerances(SETTINGS.tolerance, SETTINGS.restarts)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setTarget(0.0)
    transform = eps.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setShift(0.0)
    return eps


def _lent(A: "Mat", factor: "Mat") -> "PC":
    """A preconditioner that lends the factor: one that is given away is reset by SLEPc."""
    from petsc4py import PETSc

    pc = PETSc.PC().createPython(_Lent(factor), comm=A.comm)
    pc.setOperators(A)
    return pc


class _Lent:
    def __init__(self, factor: "Mat") -> None:
        self.factor = factor

    def apply(self, _: "PC", right: "Vec", x: "Vec") -> None:
        self.factor.solve(right, x)
