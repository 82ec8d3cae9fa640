"""Start PETSc once, without the options files and environment that could change what a solver does."""

import os


def start():
    """Import and initialise petsc4py; returns the PETSc module, or None where it is not installed.

    What Python dropped since the last call is freed: petsc4py only collects it until it is asked.
    """
    os.environ.pop("PETSC_OPTIONS", None)
    for variable in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"):
        os.environ.setdefault(variable, "1")
    try:
        import petsc4py
    except ImportError:
        return None
    petsc4py.init(["tipdamp", "-skip_petscrc"])
    from petsc4py import PETSc

    if hasattr(PETSc, "garbage_cleanup"):  # since 3.18
        PETSc.garbage_cleanup(PETSc.COMM_SELF)
    return PETSc


def matrix(PETSc, A):
    """A SciPy sparse matrix as a PETSc matrix of one process."""
    A = A.tocsr()
    A.sort_indices()
    index = PETSc.IntType
    return PETSc.Mat().createAIJ(A.shape, csr=(A.indptr.astype(index), A.indices.astype(index), A.data),
                                 comm=PETSc.COMM_SELF)
