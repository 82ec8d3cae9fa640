"""Stuck modes of the full finite-element model: the second opinion on every reduced frequency."""

import numpy as np
import scipy.sparse as sp

from hbm.contact import GROUND, ContactTable
from modal.body import Body
from modal.eigen import Factor
from modal.solvers import petsc
from modal.solvers.inertia import mumps_inertia

_BEYOND = 4    # modes beyond those asked for, to see a gap above them
_TRIALS = 4


def full_stuck_hz(bodies: list[Body], pairs: ContactTable, count: int, springs=(), *, together=False) -> np.ndarray:
    """(count,) Hz: lowest modes of the unreduced bodies joined by the stuck springs of the pairs.

    springs : RollSpring records on rows of `pairs`; together : all ranks of an mpirun share the work on one problem.
    """
    size = sum(b.dofs for b in bodies)
    K = sp.block_diag([b.K for b in bodies], format="csr")
    M = sp.block_diag([b.M for b in bodies], format="csr")
    B = sparse_relative_motion(bodies, pairs, size)
    k = (np.column_stack([pairs.kt, pairs.kt, pairs.kn]) * pairs.weight[:, None]).ravel()
    K = K + B.T @ sp.diags(k) @ B
    for s in springs:
        row = (B[3 * s.high + 2] - B[3 * s.low + 2]) / s.distance
        K = K + s.k * (row.T @ row)
    if together:
        return _shared_modes(K.tocsr(), M.tocsr(), count) / (2 * np.pi)
    omega, _ = Factor(K.tocsr()).lowest_modes(M, count)
    return omega / (2 * np.pi)


def _shared_modes(K, M, count):
    """omega (count,) rad/s with matrices and factor distributed over the ranks; counted by inertia, as on one process.

    Raises RuntimeError when a mode is missed or its residual exceeds 1e-6 of its stiffness force.
    """
    from modal.solvers import slepc

    PETSc = petsc.start()
    A, B = (distributed(PETSc, matrix) for matrix in (K, M))
    asked = count + _BEYOND
    for _ in range(_TRIALS):
        lam, shapes = slepc.lowest(A, B, asked)
        gaps = lam[count:] / lam[count - 1:-1]
        top = count + int(gaps.argmax())                 # modes below the widest gap above those asked for
        shift = np.sqrt(lam[top - 1] * lam[top])
        there = _modes_below(PETSc, A, B, shift)
        if there == top:
            break
        asked += max(there - top, 0) + _BEYOND           # a larger basis finds them, in general
    else:
        raise RuntimeError(f"{top} modes found below {np.sqrt(shift) / (2 * np.pi):g} Hz, where the inertia counts "
                           f"{there}")
    for value, shape in zip(lam[:count], shapes, strict=False):
        rest = A * shape
        size = rest.norm()
        rest.axpy(-float(value), B * shape)
        residual = rest.norm() / size
        if residual > 1e-6:
            raise RuntimeError(f"the residual of a mode is {residual:.1e} of its stiffness force, allowed 1e-6")
    return np.sqrt(lam[:count])


def _modes_below(PETSc, A, B, lam):
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
    trusted = negative is not None and left.norm() <= 1e-6 * right.norm()
    for one in (right, x, left, shifted):
        if one is not None:
            one.destroy()
    if not trusted:
        raise RuntimeError(f"the modes below {np.sqrt(lam) / (2 * np.pi):g} Hz could not be counted: no factor of "
                           "K - omega^2 M solves its own equations")
    return negative


def distributed(PETSc, matrix, comm=None):
    """PETSc matrix of a CSR matrix that every rank holds: each takes its rows."""
    comm = comm or PETSc.COMM_WORLD
    size = matrix.shape[0]
    low, high = PETSc.Vec().createMPI(size, comm=comm).getOwnershipRange()
    rows = matrix[low:high].tocsr()
    rows.sort_indices()
    index = PETSc.IntType
    A = PETSc.Mat().createAIJ(((high - low, size), (high - low, size)), comm=comm,
                              csr=(rows.indptr.astype(index), rows.indices.astype(index), rows.data))
    A.setOption(PETSc.Mat.Option.SPD, True)
    return A


def sparse_relative_motion(bodies, pairs, size):
    """B (3P, dofs of all bodies); a clamped direction simply has no column."""
    start = np.concatenate([[0], np.cumsum([b.dofs for b in bodies])])
    table = {}
    for body, first in zip(bodies, start, strict=False):
        number = body.node[body.dof_node]
        for dof in np.flatnonzero(np.isin(number, np.concatenate([pairs.blade_node, pairs.damper_node]))):
            table[body.name, int(number[dof]), int(body.dof_direction[dof])] = first + dof
    rows, columns, values = [], [], []
    for i in range(len(pairs)):
        for name, node, sign in ((pairs.damper_body[i], pairs.damper_node[i], 1.0),
                                 (pairs.blade_body[i], pairs.blade_node[i], -1.0)):
            for d in range(3):
                column = table.get((str(name), int(node), d)) if name != GROUND else None
                if column is not None:
                    rows += [3 * i, 3 * i + 1, 3 * i + 2]
                    columns += [column] * 3
                    values += list(sign * pairs.frame[i, :, d])
    return sp.csr_matrix((values, (rows, columns)), shape=(3 * len(pairs), size))
