"""The preload by the other route: Newton on the unreduced finite-element equations, with PETSc, alone or under mpirun.

    K q + B_n' max(0, kn (B_n q - g0)) = f

Nothing is condensed: the dofs of all bodies are the unknowns, shared out over the ranks. Every rank holds the bodies;
matrices, factors and vectors of the solution are distributed (MUMPS under MPI, CHOLMOD alone).
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from hbm.contact import ContactTable
from hbm.errors import InputError
from modal import petsc
from modal.body import Body
from static_contact.free_motions import name_motions
from static_contact.full import distributed, sparse_relative_motion

_RESIDUAL = 1e-10      # of the load
_ITERATIONS = 60


@dataclass(frozen=True)
class FullPreload:
    """pairs - with the preload, the same on every rank; iterations - Newton steps; residual - of the
    equations, of |f|."""

    pairs: ContactTable
    iterations: int
    residual: float


def full_preload(bodies: list[Body], pairs: ContactTable, loads: dict) -> FullPreload:
    """Signed preload of every pair under nodal forces {body: (d,) N}; to be called on all ranks.

    Springs must be finite. Raises InputError when a load acts along a motion that no contact resists, and
    RuntimeError when Newton does not converge.
    """
    if np.isinf(pairs.kn).any():
        raise InputError("the full Newton route needs springs: kn = inf (hard contact) is for the condensed one")
    f = np.concatenate([loads.get(b.name, np.zeros(b.dofs)) for b in bodies])
    B = sparse_relative_motion(bodies, pairs, len(f))[2::3]
    kn = pairs.kn * pairs.weight
    K = sp.block_diag([b.K for b in bodies], format="csr")
    pins = _pins(bodies, B, kn, f, K.diagonal())
    system = _Newton((K + sp.diags(pins)).tocsr(), B.tocsr(), kn, pairs.gap, f)
    u, iterations, residual = system.solve()
    if not residual <= 1e-8:
        raise RuntimeError(f"Newton on the full model ended at a residual of {residual:.1e} of the load")
    return FullPreload(pairs.replace(preload=kn * (u - pairs.gap)), iterations, residual)


def _pins(bodies, B, kn, f, diagonal):
    """(d,) springs to ground that hold each motion no contact resists at one dof: unloaded, they carry nothing."""
    blocks = [b.rigid_motions() if b.free else np.zeros((b.dofs, 0)) for b in bodies]
    rigid = sl.block_diag(*blocks)
    pins = np.zeros(len(f))
    if not rigid.shape[1]:
        return pins
    size = np.linalg.norm(rigid, axis=0)
    motion = B @ (rigid / size)
    values, vectors = np.linalg.eigh(motion.T * kn @ motion)
    free = vectors[:, values < 1e-10 * values[-1]].T / size
    if not len(free):
        return pins
    coefficients, names = name_motions(rigid, free)
    motions = rigid @ coefficients.T
    work = motions.T @ f
    for (name, unit), amount, one in zip(names, work, motions.T, strict=True):
        if abs(amount) > 1e-8 * np.abs(one).max() * np.abs(f).sum():
            raise InputError(f"{name} is loaded: {abs(amount):.3g} {unit}, and no contact resists it")
    pivots = sl.qr(motions.T, mode="r", pivoting=True)[1][:len(free)]
    pins[pivots] = diagonal[pivots]
    return pins


class _Newton:
    """Rows first..last of the equations live on this rank; the few normal motions of the pairs on all."""

    def __init__(self, K, B, kn, gap, f):
        self.PETSc = PETSc = petsc.start()
        if PETSc is None:
            raise InputError("the full Newton route needs petsc4py")
        self.comm = PETSc.COMM_WORLD
        self.K, self.B, self.kn, self.gap = K, B, kn, gap
        self.x = PETSc.Vec().createMPI(len(f), comm=self.comm)
        self.own = slice(*self.x.getOwnershipRange())
        self.f = f[self.own]
        self.load = np.linalg.norm(f)
        self.B_own = B[:, self.own].tocsr()
        self.base = distributed(PETSc, K)
        self.tangent = distributed(PETSc, (K + B.T @ sp.diags(kn) @ B).tocsr())

    def _rows(self, closed):
        """This rank's rows of K + B' kn B of the closed pairs; open ones leave zeros, so that the pattern stays."""
        k = np.where(closed, self.kn, 0.0)
        return (self.K[self.own] + self.B_own.T @ sp.diags(k) @ self.B).tocsr()

    def motion(self, x):
        """Normal motion of all pairs, on every rank."""
        return self.comm.tompi4py().allreduce(self.B_own @ x.getArray(readonly=True))

    def residual(self, _, x, F):
        self.base.mult(x, F)
        force = np.maximum(self.kn * (self.motion(x) - self.gap), 0.0)
        F.getArray()[:] += self.B_own.T @ force - self.f

    def jacobian(self, _, x, J, __):
        self._set(J, self.motion(x) > self.gap)

    def _set(self, J, closed):
        rows = self._rows(closed)
        index = self.PETSc.IntType
        J.zeroEntries()
        J.setValuesCSR(rows.indptr.astype(index), rows.indices.astype(index), rows.data)
        J.assemble()

    def solve(self):
        """Motion of the pairs (P,), Newton steps, residual; from the state with every pair closed."""
        snes = self.PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix("tipdamp_full_")
        F = self.x.duplicate()
        snes.setFunction(self.residual, F)
        snes.setJacobian(self.jacobian, self.tangent)
        snes.setType("newtonls")
        self.PETSc.Options()["tipdamp_full_snes_linesearch_type"] = "basic"
        snes.setFromOptions()
        snes.setTolerances(rtol=0.0, atol=_RESIDUAL * self.load, stol=0.0, max_it=_ITERATIONS)
        ksp = snes.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType("cholmod" if self.comm.size == 1 else "mumps")
        start = F.duplicate()
        start.getArray()[:] = self.f + self.B_own.T @ (self.kn * self.gap)
        ksp.setOperators(self.tangent)
        ksp.solve(start, self.x)
        snes.solve(None, self.x)
        self.residual(None, self.x, F)
        out = self.motion(self.x), snes.getIterationNumber(), F.norm() / self.load
        snes.destroy()
        return out
