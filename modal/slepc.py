"""Lowest modes by SLEPc on the ranks of an mpirun: Krylov-Schur on the inverse of K, which MUMPS factorises."""

import numpy as np

TOLERANCE = 1e-8  # of the residual; omega^2 is good to its square
_BASIS = 2  # vectors per mode: one restart, or none; with three a fifth slower, with five twice


def start():
    """The SLEPc module, or None where it is not installed."""
    try:
        from slepc4py import SLEPc
    except ImportError:
        return None
    return SLEPc


def lowest(A, B, count: int):
    """omega^2 (m,) ascending and shapes, m PETSc vectors, of the lowest modes of A x = omega^2 B x: m >= count.

    A, B : PETSc matrices, A positive definite. Raises RuntimeError when fewer converge.
    """
    SLEPc = start()
    eps = SLEPc.EPS().create(A.comm)
    eps.setOptionsPrefix("tipdamp_")
    eps.setOperators(A, B)
    eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    eps.setType(SLEPc.EPS.Type.KRYLOVSCHUR)
    eps.setDimensions(count, min(max(_BASIS * count, count + 15), A.size[0]))
    eps.setTolerances(TOLERANCE, 500)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setTarget(0.0)
    transform = eps.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.setShift(0.0)
    ksp = transform.getKSP()
    ksp.setType("preonly")
    ksp.getPC().setType("cholesky")
    ksp.getPC().setFactorSolverType("mumps")
    eps.solve()
    found = eps.getConverged()
    if found < count:
        raise RuntimeError(f"SLEPc converged {found} of {count} modes")
    shapes = [A.createVecLeft() for _ in range(found)]
    lam = np.array([eps.getEigenpair(i, shapes[i]).real for i in range(found)])
    eps.destroy()
    order = np.argsort(lam)
    return lam[order], [shapes[i] for i in order]
