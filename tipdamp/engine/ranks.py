"""Processes that mpirun has started. One verb shares its work over them; the others belong into one
process."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tipdamp.hbm.errors import InputError
from tipdamp.modal.solvers import petsc

# how launchers tell a process of their number and its own place: Open MPI; MPICH, Intel MPI
_TOLD = (("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"), ("PMI_SIZE", "PMI_RANK"))


def count() -> int:
    """How many processes run this command; 1 without mpirun."""
    return _told(0, 1)


def number() -> int:
    """Which of them this one is; 0 speaks and writes."""
    return _told(1, 0)


def _told(which: int, otherwise: int) -> int:
    return next(
        (int(os.environ[names[which]]) for names in _TOLD if names[0] in os.environ), otherwise
    )


def world() -> Any:
    """MPI's communicator of all of them; starts MPI."""
    if petsc.start() is None:
        raise InputError("the full model needs petsc4py; run: tipdamp doctor")
    from mpi4py import MPI

    return MPI.COMM_WORLD


@contextmanager
def together() -> Iterator[None]:
    """What only one process meets must end all of them: the others would wait for it for ever.
    Errors of the input and of a solver come to all alike."""
    try:
        yield
    except (InputError, RuntimeError):
        raise
    except BaseException:
        if count() > 1:
            import traceback

            traceback.print_exc()
            world().Abort(3)
        raise
