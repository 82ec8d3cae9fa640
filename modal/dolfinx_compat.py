"""Blocks of cells in dolfinx, and forms on them as CSR matrices. The only file that knows dolfinx: 0.5.2 and 0.9.

What the two versions do differently is in the three functions at the end; everything else is the same in both.
"""

import logging
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp

# shape, degree, quadrature degree: full Gauss integration, stated because the default differs from code to code (and
# moves preloads by 1e-5): 2x2x2 and 3x3x3 points for hexahedra
CELLS = {"tetra": ("tetrahedron", 1, 2), "hexahedron": ("hexahedron", 1, 3), "tetra10": ("tetrahedron", 2, 4),
         "hexahedron27": ("hexahedron", 2, 5)}


def takes(kind: str) -> bool:
    """Whether dolfinx is installed and assembles cells of this kind."""
    return kind in CELLS and available()


def available() -> bool:
    try:
        return find_spec("dolfinx") is not None
    except (ImportError, ValueError):
        return False


@dataclass(frozen=True)
class Block:
    """Cells of one type. V - dolfinx space of displacements; place : (k,) int - node of the mesh of each of its k
    nodes; nodes - number of nodes of the whole mesh; degree - of the quadrature."""

    V: object
    place: np.ndarray
    nodes: int
    degree: int

    @classmethod
    def of(cls, position, kind: str, cells) -> "Block":
        """position (n, 3) m of the mesh's nodes; cells (c, k) indices into it, numbered as gmsh does."""
        from modal import petsc

        petsc.start()
        import ufl
        from dolfinx.io.gmshio import cell_perm_array
        from dolfinx.mesh import CellType, create_mesh
        from mpi4py import MPI

        shape, degree, quadrature = CELLS[kind]
        used = np.unique(cells)
        order = cell_perm_array(getattr(CellType, shape), cells.shape[1])
        local = np.searchsorted(used, cells)[:, order].astype(np.int64)
        with _quiet_compiler():
            grid = create_mesh(MPI.COMM_SELF, local, position[used], ufl.Mesh(_vector_element(shape, degree)))
            V = _vector_space(grid, degree)
        return cls(V, used[_input_node(grid, V)], len(position), quadrature)

    @property
    def dx(self):
        import ufl

        return ufl.Measure("dx", domain=self.V.mesh, metadata={"quadrature_degree": self.degree})

    def constants(self, *values) -> list:
        """Numbers of a form that change from body to body without a new compilation."""
        from dolfinx import fem

        return [fem.Constant(self.V.mesh, np.float64(value)) for value in values]

    def function(self, displacement):
        """A displacement (n, 3) m of the mesh's nodes as a field of forms."""
        from dolfinx import fem

        field = fem.Function(self.V)
        field.x.array[:] = displacement[self.place].ravel()
        return field

    def matrix(self, form) -> sp.csr_matrix:
        """A symmetric bilinear form over all dofs of the mesh (3 i + k for node i), zero rows where no cell is."""
        from dolfinx import fem
        from dolfinx.fem.petsc import assemble_matrix

        with _quiet_compiler():
            A = assemble_matrix(fem.form(form))
        A.assemble()
        indptr, indices, data = A.getValuesCSR()
        A.destroy()
        dof = (3 * self.place[:, None] + np.arange(3)).ravel()
        return _symmetric(sp.csr_matrix((data, indices, indptr), shape=(len(dof),) * 2), dof, 3 * self.nodes)


def _symmetric(A, dof, size):
    """(A + A') / 2 with row and column i put at dof[i] of a larger matrix."""
    start = np.zeros(size + 1, dtype=A.indptr.dtype)
    start[dof + 1] = np.diff(A.indptr)
    rows = A[np.argsort(dof)]
    placed = sp.csr_matrix((rows.data, dof.astype(A.indices.dtype)[rows.indices], np.cumsum(start)), (size, size))
    flipped = placed.T.tocsr()  # turning it over twice sorts the columns
    placed = flipped.T.tocsr()
    return ((placed + flipped) / 2).tocsr()


@contextmanager
def _quiet_compiler():
    """The compiler of new forms reports its command lines on the root logger."""
    before = logging.root.manager.disable
    logging.disable(max(before, logging.INFO))
    try:
        yield
    finally:
        logging.disable(before)


# ---- what differs between the versions -------------------------------------------------------------------------

def _vector_element(shape, degree):
    try:
        from basix.ufl import element
    except ImportError:  # before 0.7
        import ufl

        return ufl.VectorElement("Lagrange", shape, degree)
    return element("Lagrange", shape, degree, shape=(3,))


def _vector_space(grid, degree):
    from dolfinx import fem

    if hasattr(fem, "functionspace"):
        return fem.functionspace(grid, ("Lagrange", degree, (3,)))
    return fem.VectorFunctionSpace(grid, ("Lagrange", degree))  # before 0.7


def _input_node(grid, V):
    """For each node of V the index of the node in the coordinates that the mesh was made from."""
    # lists of lists before 0.7, rectangular arrays since
    geometry, dofs = (np.asarray(getattr(table, "array", table)).ravel() for table in (grid.geometry.dofmap,
                                                                                      V.dofmap.list))
    place = np.empty(V.dofmap.index_map.size_local, dtype=int)
    place[dofs] = np.asarray(grid.geometry.input_global_indices)[geometry]
    found = V.tabulate_dof_coordinates()[dofs]
    if np.abs(found - grid.geometry.x[geometry]).max() > 1e-12 * max(1.0, np.abs(found).max()):
        raise RuntimeError("dofs and mesh nodes do not coincide: this dolfinx orders them differently")
    return place
