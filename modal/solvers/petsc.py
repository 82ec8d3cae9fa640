"""Start PETSc once, without the options files and environment that could change what a solver
does."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the command line looks at the memory before anything heavy is imported
    import scipy.sparse as sp

_M_MMAP_MAX, _DEFAULT = -4, 65536  # malloc.h of glibc


def start() -> Any:
    """Import and initialise petsc4py; returns the PETSc module, or None where it is not installed.

    Objects that Python dropped since the last call are freed: petsc4py collects them and waits for
    this request."""
    PETSc = _initialised()
    if PETSc is None:
        return None
    with suppress(AttributeError):  # absent before 3.18
        PETSc.garbage_cleanup(PETSc.COMM_SELF)
    if PETSc.COMM_WORLD.size == 1:
        _give_memory_back()
    return PETSc


@cache
def _initialised() -> ModuleType | None:
    """Once: each call of `init` registers a collective clean-up at exit, and all ranks need as
    many."""
    os.environ.pop("PETSC_OPTIONS", None)
    for variable in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"):
        os.environ.setdefault(variable, "1")
    try:
        import petsc4py
    except ImportError:
        return None
    petsc4py.init(["tipdamp", "-skip_petscrc", "-no_signal_handler"])
    from petsc4py import PETSc

    return PETSc


def _give_memory_back() -> None:
    """Return large arrays to the system when they are freed. MPI, which starts with PETSc, turns
    that off for fast messages, and a reduction then holds several times its memory."""
    with suppress(AttributeError):  # glibc only
        ctypes.CDLL(None).mallopt(_M_MMAP_MAX, _DEFAULT)


def matrix(PETSc: Any, A: Any) -> Any:
    """A SciPy sparse matrix as a PETSc matrix of one process, on the same memory where the types
    agree."""
    A = A.tocsr()
    A.sort_indices()
    index = [i.astype(PETSc.IntType, copy=False) for i in (A.indptr, A.indices)]
    return PETSc.Mat().createAIJWithArrays(
        A.shape, (*index, A.data.astype(float, copy=False)), comm=PETSc.COMM_SELF
    )


def matrix_of_rows(PETSc: Any, rows: sp.csr_matrix, comm: Any) -> Any:
    """PETSc matrix over the ranks of `comm` from a CSR matrix (own rows, n) of the rows that this
    rank holds."""
    own, size = rows.shape
    rows.sort_indices()
    index = PETSc.IntType
    return PETSc.Mat().createAIJ(
        ((own, size), (own, size)),
        comm=comm,
        csr=(rows.indptr.astype(index), rows.indices.astype(index), rows.data),
    )
