"""Stuck modes of the full finite-element model: the cross-check of every reduced frequency."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.modal.body import Body
from tipdamp.modal.eigen import Factor
from tipdamp.modal.solvers import petsc
from tipdamp.modal.solvers.inertia import mumps_inertia
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.static_contact.full.common_space import lowest_of_sets
from tipdamp.static_contact.full.ranks import own_rows
from tipdamp.static_contact.tuning.roll_springs import RollSpring, rolls
from tipdamp.static_contact.tuning.stuck_assembly import stuck_springs

if TYPE_CHECKING:
    from petsc4py.PETSc import Mat


@dataclass(frozen=True)
class StuckModeSettings:
    """Of the modes over the ranks of an mpirun."""

    beyond: int = 4  # modes beyond those asked for, to see a gap above them
    trials: int = 4  # bases tried where the inertia counts more modes than were found
    # of the stiffness force of a mode, and of the load of the solve that backs a count
    residual: float = 1e-6
    bound: float = 1e-6  # of an upper bound of omega, which has its own rounding


SETTINGS = StuckModeSettings()


@dataclass(frozen=True)
class StuckSet:
    """A set of pairs (the rows of one table, with weights of its own) with its roll springs; hz
    (m,), motion (3P, m): its lowest frequencies by a reduction of the same bodies, and the relative
    motion t1, t2, n of the pairs in these modes."""

    pairs: ContactTable
    springs: Sequence[RollSpring]
    hz: np.ndarray
    motion: np.ndarray


def full_stuck_hz(
    bodies: list[Body],
    pairs: ContactTable,
    count: int,
    springs: Sequence[RollSpring] = (),
    *,
    together: bool = False,
) -> np.ndarray:
    """(count,) Hz: lowest modes of the unreduced bodies joined by the stuck springs of the pairs.

    springs : RollSpring records on rows of `pairs`; together : all ranks of an mpirun share the
    work on one problem."""
    K, M, rows = _matrices(bodies, pairs, springs)
    K = K + rows.T @ sp.diags(_stiffness(pairs, springs, springs)) @ rows
    if together:
        return modes_over_ranks(K.tocsr(), M.tocsr(), count) / (2 * np.pi)
    omega, _ = Factor(K.tocsr()).lowest_modes(M, count)
    return omega / (2 * np.pi)


def full_stuck_sets(bodies: list[Body], sets: Sequence[StuckSet]) -> list[np.ndarray]:
    """(m,) Hz of each set as from `full_stuck_hz`, in one space on one factor; by a factor of its
    own where a set has too little in common with the others, or a mode lies above the reduction's:
    one below it was missed."""
    springs = list({(s.low, s.high): s for one in sets for s in one.springs}.values())
    K, M, rows = _matrices(bodies, sets[0].pairs, springs)
    k = np.array([_stiffness(one.pairs, one.springs, springs) for one in sets])
    motion = [np.vstack([one.motion, *rolls(one.motion, springs)]) for one in sets]
    common = lowest_of_sets(K, M, rows, k, motion)

    def found(i: int) -> np.ndarray:
        at_most = 2 * np.pi * sets[i].hz
        if common is not None and (common[i] <= at_most * (1 + SETTINGS.bound)).all():
            return common[i]
        factor = Factor(K + rows.T @ sp.diags(k[i]) @ rows)
        return factor.modes(M, len(at_most), at_most=at_most).omega

    return [found(i) / (2 * np.pi) for i in range(len(sets))]


def _matrices(
    bodies: Sequence[Body], pairs: ContactTable, springs: Sequence[RollSpring]
) -> tuple[sp.spmatrix, sp.spmatrix, sp.spmatrix]:
    """K, M of the bodies, and rows of unit stiffness: relative motion at the pairs, roll at the
    springs."""
    B = relative_motion(AssembledBodies(bodies), pairs)
    return (
        *(_side_by_side(part) for part in ([b.K for b in bodies], [b.M for b in bodies])),
        sp.vstack([B, *rolls(B, springs)], format="csr"),
    )


def _side_by_side(parts: Sequence[sp.spmatrix]) -> sp.spmatrix:
    """Matrices as the blocks of one: `sp.block_diag` takes the way over coordinates, ten times as
    long."""
    starts = np.cumsum([0, *(part.shape[0] for part in parts)])
    rows = np.cumsum([0, *(part.nnz for part in parts)])
    return sp.csr_matrix(
        (
            np.concatenate([part.data for part in parts]),
            np.concatenate([p.indices + start for p, start in zip(parts, starts, strict=False)]),
            np.concatenate([[0], *(p.indptr[1:] + r for p, r in zip(parts, rows, strict=False))]),
        ),
        shape=(starts[-1],) * 2,
    )


def _stiffness(
    pairs: ContactTable, springs: Sequence[RollSpring], places: Sequence[RollSpring]
) -> np.ndarray:
    """(n,) N/m of the rows of `_matrices` with springs at `places`."""
    own = {(s.low, s.high): s.k for s in springs}
    return np.concatenate(
        [stuck_springs(pairs).ravel(), [own.get((s.low, s.high), 0.0) for s in places]]
    )


def modes_over_ranks(
    K: sp.csr_matrix, M: sp.csr_matrix, count: int, settings: StuckModeSettings = SETTINGS
) -> np.ndarray:
    """omega (count,) rad/s with matrices and factor distributed over the ranks; counted by inertia,
    as on one process.

    Raises RuntimeError when a mode is missed or its residual exceeds 1e-6 of its stiffness force.
    """
    from tipdamp.modal.solvers import slepc

    PETSc = petsc.start()
    A, B = (distributed(PETSc, matrix) for matrix in (K, M))
    asked = count + settings.beyond
    for _ in range(settings.trials):
        lam, shapes = slepc.lowest(A, B, asked)
        gaps = lam[count:] / lam[count - 1 : -1]
        top = count + int(gaps.argmax())  # modes below the widest gap above those asked for
        shift = np.sqrt(lam[top - 1] * lam[top])
        there = _modes_below(PETSc, A, B, shift, settings.residual)
        if there == top:
            break
        asked += max(there - top, 0) + settings.beyond  # a larger basis finds them, in general
    else:
        raise RuntimeError(
            f"{top} modes found below {np.sqrt(shift) / (2 * np.pi):g} Hz, where the inertia "
            f"counts {there}"
        )
    for value, shape in zip(lam[:count], shapes, strict=False):
        rest = A * shape
        size = rest.norm()
        rest.axpy(-float(value), B * shape)
        residual = rest.norm() / size
        if not residual <= settings.residual:
            raise RuntimeError(
                f"the residual of a mode is {residual:.1e} of its stiffness force, allowed "
                f"{settings.residual:g}"
            )
    return np.sqrt(lam[:count])


def _modes_below(PETSc: ModuleType, A: "Mat", B: "Mat", lam: float, residual: float) -> int:
    """Modes of (A, B) with omega^2 below lam, by the signs of a factor over all ranks."""
    shifted = A.copy()
    shifted.setOption(PETSc.Mat.Option.SPD, False)
    shifted.axpy(-lam, B, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    right = A.createVecLeft()
    right.setRandom()
    negative, x = mumps_inertia(PETSc, shifted, right)
    left = right.duplicate()
    if x is not None:
        shifted.mult(x, left)
    left.axpy(-1.0, right)
    trusted = negative is not None and left.norm() <= residual * right.norm()
    for one in (right, x, left, shifted):
        if one is not None:
            one.destroy()
    if negative is None or not trusted:
        raise RuntimeError(
            f"the modes below {np.sqrt(lam) / (2 * np.pi):g} Hz could not be counted: no factor of "
            "K - omega^2 M solves its own equations"
        )
    return negative


def distributed(PETSc: Any, matrix: sp.csr_matrix) -> Any:
    """Positive definite PETSc matrix of a CSR matrix that every rank holds: each takes its rows."""
    comm = PETSc.COMM_WORLD
    low, high = own_rows(comm, matrix.shape[0])
    A = petsc.matrix_of_rows(PETSc, matrix[low:high].tocsr(), comm)
    A.setOption(PETSc.Mat.Option.SPD, True)
    return A
