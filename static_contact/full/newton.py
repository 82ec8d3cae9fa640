"""The preload by the other route: Newton on the unreduced finite-element equations, with PETSc,
alone or under mpirun.

    K q + B_n' N = f,    N = max(0, kn (B_n q - g0));    hard pairs (kn = inf):  N = max(0, k (p +
    B_n q - g0)) = k p

Nothing is condensed: the dofs of all bodies are the unknowns, distributed over the ranks, and with
them p of the hard pairs. Their second line is the augmented Lagrangian of the unilateral condition:
its solution does not depend on k > 0, and Newton's matrix stays symmetric, though indefinite. Where
SNES ends without an answer, because a set of closed pairs on its way holds nothing or the sets
cycle, pivoting and the proximal point method of `complementarity.py` go on with the same matrices.
Every rank needs only its own rows of K (`ranks.py`);
factors and vectors are distributed (CHOLMOD alone; MUMPS under MPI and for hard pairs).
"""

from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.solvers import petsc
from tipdamp.static_contact.bodies.free_motions import FreeMotions, unresisted
from tipdamp.static_contact.bodies.rigid_motions import moving
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.static_contact.bodies.stuck_bodies import normal_springs
from tipdamp.static_contact.full.closed_sets import FullSets
from tipdamp.static_contact.full.ranks import own_rows
from tipdamp.static_contact.normal.complementarity import unstressed
from tipdamp.static_contact.normal.normal_contact import SETTINGS as SETS

if TYPE_CHECKING:
    from petsc4py.PETSc import Comm, Mat


@dataclass(frozen=True)
class FullSettings:
    """Of Newton's method on the full model."""

    tolerance: float = 1e-10  # of the load, at which SNES stops
    iterations: int = 60
    residual: float = SETS.residual  # of the load, in an answer that is accepted
    # of the right-hand side, in the solve on one set of closed pairs
    set_residual: float = SETS.residual
    # of the load's reach along a free motion: smaller constraint reactions are rounding
    reported: float = 1e-8


SETTINGS = FullSettings()


@dataclass(frozen=True)
class FullPreload:
    """pairs - with the preload, the same on every rank (hard pairs: the contact force, 0 = open);
    force : (P,) N iterations - Newton steps, or matrices factored where these did not end; residual
    - of the equations, of |f|
    reactions : {name: N or N m} - of loads and contact forces along motions that no contact
    resists, as
    inexact coordinates leave them; as in `preload.Preload`."""

    pairs: ContactTable
    force: np.ndarray
    iterations: int
    residual: float
    reactions: dict[str, float]


def full_preload(
    bodies: list[Body],
    pairs: ContactTable,
    loads: dict[str, np.ndarray],
    settings: FullSettings = SETTINGS,
) -> FullPreload:
    """Signed preload of every pair under nodal forces {body: (d,) N}; to be called on all ranks.

    bodies - whole, or with the rows of this rank only (`ranks.distributed_bodies`). Raises
    InputError when forces do more than 1e-3 of what the load could along a motion that no contact
    resists, NoEquilibrium (an InputError) when the load lifts the damper off, and RuntimeError when
    the residual stays above 1e-8 of the load. Without load both are measured against the contact
    forces (of overlaps that no motion of the damper takes back).
    """
    PETSc = petsc.start()
    if PETSc is None:
        raise InputError("the full Newton route needs petsc4py")
    f = np.concatenate([loads.get(b.name, np.zeros(b.dofs)) for b in bodies])
    motion = relative_motion(AssembledBodies(bodies), pairs)
    B = motion[2::3].tocsr()
    k = normal_springs(pairs)
    hard = np.flatnonzero(np.isinf(k))
    own = own_rows(PETSc.COMM_WORLD, len(f) + len(hard))
    K, diagonal = _own_stiffness(PETSc.COMM_WORLD, bodies, len(hard), own)
    k[hard] = (B.power(2) @ diagonal)[hard]  # the bodies' own stiffness, for the scale alone
    may_close = pairs.carrying & (k > 0)
    rigid = sl.block_diag(*(b.rigid_motions() if b.free else np.zeros((b.dofs, 0)) for b in bodies))
    floats = moving(rigid)
    if not f.any():
        q = unstressed(rigid @ floats, B[may_close], pairs.gap[may_close])
        if q is not None:
            return _result(pairs, k * (B @ q - pairs.gap), np.zeros(len(pairs)), 0, 0.0, {})
    owner = np.repeat([b.name for b in bodies], [b.dofs for b in bodies])
    motions = unresisted(rigid, floats, motion, 3 * np.flatnonzero(may_close) + 2, owner)
    work = motions.shape.T @ f
    motions.refuse(work, f)
    pinned = np.concatenate([_pins(motions, diagonal), -k[hard]])
    equations = Equations(
        (K + sp.diags(pinned, format="csr")[slice(*own)]).tocsr(),
        _with_multipliers(B, hard),
        k,
        pairs.gap,
        np.concatenate([f - motions.taken_up(work), np.zeros(len(hard))]),
        definite=not len(hard),
    )
    u, iterations, residual = _solved(ContactNewton(PETSc, own, equations, settings), B, may_close)
    signed = k * (u - pairs.gap)
    force = np.maximum(signed, 0.0)
    reactions = _reactions(motions, f, B, force, settings.reported)
    return _result(pairs, signed, force, iterations, residual, reactions)


def _reactions(
    motions: FreeMotions, f: np.ndarray, B: sp.spmatrix, force: np.ndarray, above: float
) -> dict[str, float]:
    """Of loads f (d,) and contact forces (P,) along motions that no contact resists, above a share
    of their reach; refused where they are no rounding."""
    reaction = motions.shape.T @ (f - B.T @ force)
    scale = f if f.any() else abs(B).T @ force
    motions.refuse(reaction, scale)
    return motions.reactions(reaction, scale, above)


def _own_stiffness(
    comm: "Comm", bodies: list[Body], multipliers: int, own: tuple[int, int]
) -> tuple[sp.csr_matrix, np.ndarray]:
    """This rank's rows of K, behind it zeros of so many multipliers, and its whole diagonal (d,),
    on every rank."""
    blocks = [*(b.K for b in bodies), sp.csr_matrix((multipliers, multipliers))]
    K = sp.block_diag(blocks, format="csr")[slice(*own)]
    mine = np.zeros(K.shape[1])
    mine[slice(*own)] = K.diagonal(own[0])
    return K, comm.tompi4py().allreduce(mine)[: K.shape[1] - multipliers]


def _with_multipliers(B: sp.spmatrix, hard: np.ndarray) -> sp.spmatrix:
    """C (P, dofs and multipliers): the motion of the pairs, and for each hard pair its unknown
    p."""
    own = sp.csr_matrix((np.ones(len(hard)), (hard, range(len(hard)))), (B.shape[0], len(hard)))
    return sp.hstack([B, own]).tocsr()


def _result(
    pairs: ContactTable,
    signed: np.ndarray,
    force: np.ndarray,
    iterations: int,
    residual: float,
    reaction: dict[str, float],
) -> FullPreload:
    return FullPreload(
        pairs.replace(preload=np.where(np.isinf(pairs.kn), force, signed)),
        force,
        iterations,
        residual,
        reaction,
    )


def _solved(
    system: "ContactNewton", B: sp.spmatrix, carrying: np.ndarray
) -> tuple[np.ndarray, int, float]:
    """Motion of the pairs, Newton steps or matrices factored, residual; the system is destroyed."""
    u, iterations, residual = system.solve()
    if not residual <= system.settings.residual:
        pivoting = FullSets(system, B, carrying)
        u, residual = pivoting.solve()
        iterations += pivoting.factored
    system.destroy()
    if not residual <= system.settings.residual:
        raise RuntimeError(
            f"Newton on the full model ended at a residual of {residual:.1e} of the load"
        )
    return u, iterations, residual


def _pins(motions: FreeMotions, diagonal: np.ndarray) -> np.ndarray:
    """(d,) springs to ground that hold each free motion at one dof: what normals tilted by inexact
    coordinates do along it is all that they carry."""
    pins, shape = np.zeros(len(diagonal)), motions.shape
    if shape.shape[1]:
        pivots = sl.qr(shape.T, mode="r", pivoting=True)[1][: shape.shape[1]]
        pins[pivots] = diagonal[pivots]
    return pins


@dataclass(frozen=True)
class Equations:
    """K x + C' max(0, k (C x - gap)) = f; K : this rank's rows; C : (P, n); k, gap : (P,) N/m, m; f
    : (n,) N definite - without multipliers of hard pairs"""

    K: sp.csr_matrix
    C: sp.csr_matrix
    k: np.ndarray
    gap: np.ndarray
    f: np.ndarray
    definite: bool


class ContactNewton:
    """The equations with the rows low..high on this rank; the motions C x of the pairs on all."""

    def __init__(
        self,
        PETSc: ModuleType,
        own: tuple[int, int],
        equations: Equations,
        settings: FullSettings = SETTINGS,
    ) -> None:
        self.PETSc, self.comm, self.settings = PETSc, PETSc.COMM_WORLD, settings
        self.K, self.C, self.k, self.gap = equations.K, equations.C, equations.k, equations.gap
        f, C, k, gap, self.definite = equations.f, self.C, self.k, self.gap, equations.definite
        self.x = PETSc.Vec().createMPI((own[1] - own[0], len(f)), comm=self.comm)
        self.f = f[slice(*own)]
        overlap = k * np.maximum(-gap, 0.0)
        self.load = np.linalg.norm(f) if f.any() else np.linalg.norm(abs(C).T @ overlap)
        self.C_own = C[:, slice(*own)].tocsr()
        self.base, self.tangent = self._matrix(self.K), self._matrix(self._pattern())

    def _matrix(self, rows: sp.spmatrix) -> "Mat":
        A = petsc.matrix_of_rows(self.PETSc, rows, self.comm)
        A.setOption(self.PETSc.Mat.Option.SYMMETRIC, True)
        if self.definite:
            A.setOption(self.PETSc.Mat.Option.SPD, True)
        return A

    def _pattern(self) -> sp.spmatrix:
        """Every entry that `_rows` may have: none cancels, whatever the signs of the motions."""
        return (abs(self.K) + abs(self.C_own).T @ sp.diags(self.k) @ abs(self.C)).tocsr()

    def _rows(self, closed: np.ndarray) -> sp.spmatrix:
        """This rank's rows of K + C' k C with the pairs' `closed`, 0 or 1."""
        return (self.K + self.C_own.T @ sp.diags(closed * self.k) @ self.C).tocsr()

    def direct(self, ksp: Any) -> Any:
        """The linear solver: one factorisation each."""
        ksp.setType("preonly")
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType(
            "cholmod" if self.comm.size == 1 and self.definite else "mumps"
        )
        return ksp

    def motion(self, x: Any) -> np.ndarray:
        """C x of all pairs, on every rank."""
        return self.comm.tompi4py().allreduce(self.C_own @ x.getArray(readonly=True))

    def residual(self, _: Any, x: Any, F: Any) -> None:
        """K x + C' max(0, k (C x - gap)) - f in F."""
        self.base.mult(x, F)
        force = np.maximum(self.k * (self.motion(x) - self.gap), 0.0)
        F.getArray()[:] += self.C_own.T @ force - self.f

    def jacobian(self, _: Any, x: Any, J: Any, __: Any) -> None:
        """The derivative of `residual` in J."""
        self.set_closed(J, self.motion(x) > self.gap)

    def set_closed(self, J: Any, closed: np.ndarray, more: Any = None) -> None:
        """New values in the old pattern: what is open, or cancels, stays there as zero. more - rows
        to be added."""
        rows = self._rows(closed) if more is None else (self._rows(closed) + more).tocsr()
        rows.sort_indices()
        index = self.PETSc.IntType
        J.zeroEntries()
        J.setValuesCSR(rows.indptr.astype(index), rows.indices.astype(index), rows.data)
        J.assemble()

    def solve(self) -> tuple[np.ndarray, int, float]:
        """Motion of the pairs (P,), Newton steps, residual; from the state with every pair
        closed."""
        F = self.x.duplicate()
        snes = self._newton(F)
        ksp = self.direct(snes.getKSP())
        start = F.duplicate()
        start.getArray()[:] = self.f + self.C_own.T @ (self.k * self.gap)
        self.set_closed(self.tangent, np.ones(len(self.k)))
        ksp.setOperators(self.tangent)
        ksp.solve(start, self.x)
        try:
            snes.solve(None, self.x)
            self.residual(None, self.x, F)
            left = F.norm() / self.load
        except self.PETSc.Error:  # no factor: the pairs that are closed hold nothing
            left = np.inf
        out = self.motion(self.x), snes.getIterationNumber(), left
        for one in (snes, F, start):  # on all ranks alike: the collector is not
            one.destroy()
        return out

    def _newton(self, F: Any) -> Any:
        """PETSc's solver; F - where it puts the residual."""
        snes = self.PETSc.SNES().create(self.comm)
        snes.setOptionsPrefix("tipdamp_full_")
        snes.setFunction(self.residual, F)
        snes.setJacobian(self.jacobian, self.tangent)
        snes.setType("newtonls")
        self.PETSc.Options()["tipdamp_full_snes_linesearch_type"] = "basic"
        snes.setFromOptions()
        snes.setTolerances(
            rtol=0.0,
            atol=self.settings.tolerance * self.load,
            stol=0.0,
            max_it=self.settings.iterations,
        )
        return snes

    def destroy(self) -> None:
        """Free what PETSc holds."""
        for one in (self.x, self.base, self.tangent):
            one.destroy()
