"""Blocks of cells in dolfinx, and forms on them as CSR matrices. The only file that knows dolfinx:
0.5.2 and 0.9.

What the two versions do differently is in the functions at the end; everything else is the same in
both.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp

if TYPE_CHECKING:
    from dolfinx.cpp.graph import AdjacencyList_int32
    from dolfinx.fem.function import FunctionSpace
    from dolfinx.mesh import Mesh

# shape, degree, quadrature degree: full Gauss integration, stated because the default differs from
# code to code (and moves preloads by 1e-5): 2x2x2 and 3x3x3 points for hexahedra
CELLS = {
    "tetra": ("tetrahedron", 1, 2),
    "hexahedron": ("hexahedron", 1, 3),
    "tetra10": ("tetrahedron", 2, 4),
    "hexahedron27": ("hexahedron", 2, 5),
}


def takes(kind: str) -> bool:
    """Whether dolfinx is installed and assembles cells of this kind."""
    return kind in CELLS and available()


def available() -> bool:
    """Whether dolfinx is installed."""
    try:
        return find_spec("dolfinx") is not None
    except (ImportError, ValueError):
        return False


@dataclass(frozen=True)
class CellBlock:
    """Cells of one type. V - dolfinx space of displacements, or of one direction of them; place :
    (k,) int - node of the mesh of each of its k nodes; nodes - number of nodes of the whole mesh;
    kind - of CELLS."""

    V: Any
    place: np.ndarray
    nodes: int
    kind: str

    @classmethod
    def of(cls, position: np.ndarray, kind: str, cells: np.ndarray) -> "CellBlock":
        """position (n, 3) m of the mesh's nodes; cells (c, k) indices into it, numbered as gmsh
        does."""
        from tipdamp.modal.solvers import petsc

        petsc.start()
        import ufl
        from dolfinx import cpp
        from dolfinx.mesh import CellType, create_mesh
        from mpi4py import MPI

        shape, degree, _ = CELLS[kind]
        used = np.unique(cells)
        # as cell_perm_array of dolfinx.io.gmshio, which loads gmsh
        order = np.array(cpp.io.perm_gmsh(CellType.__members__[shape], cells.shape[1]))
        local = np.searchsorted(used, cells)[:, order].astype(np.int64)
        with _quiet_compiler():
            grid = create_mesh(
                MPI.COMM_SELF, local, position[used], ufl.Mesh(_vector_element(shape, degree))
            )
            V = _space(grid, degree, (3,))
        return cls(V, used[_input_node(grid, V)], len(position), kind)

    def one_direction(self) -> "CellBlock":
        """The same cells with one number a node: for a form that acts on each direction alike, a
        ninth of the work."""
        with _quiet_compiler():
            V = _space(self.V.mesh, CELLS[self.kind][1], ())
        place = np.empty_like(self.place)
        place[_table(V.dofmap.list)] = self.place[_table(self.V.dofmap.list)]
        return replace(self, V=V, place=place)

    @property
    def dx(self) -> Any:
        """Measure of integrals over the cells, with full Gauss integration."""
        import ufl

        return ufl.Measure(
            "dx", domain=self.V.mesh, metadata={"quadrature_degree": CELLS[self.kind][2]}
        )

    def constants(self, *values: float) -> list:
        """Numbers of a form that change from body to body without a new compilation."""
        from dolfinx import fem

        return [fem.Constant(self.V.mesh, np.float64(value)) for value in values]

    def function(self, displacement: np.ndarray) -> Any:
        """A displacement (n, 3) m of the mesh's nodes as a field of forms."""
        from dolfinx import fem

        field = fem.Function(self.V)
        field.x.array[:] = displacement[self.place].ravel()
        return field

    def matrix(self, form: Any) -> sp.csr_matrix:
        """A symmetric bilinear form over all dofs of the mesh (3 i + k for node i), zero rows where
        no cell is.

        One of `one_direction` is taken for each of the three directions.
        """
        from dolfinx import fem
        from dolfinx.fem.petsc import assemble_matrix

        with _quiet_compiler():
            A = assemble_matrix(fem.form(form))
        A.assemble()
        indptr, indices, data = A.getValuesCSR()
        A.destroy()
        A = sp.csr_matrix((data, indices, indptr))
        if A.shape[0] == len(self.place):
            return _in_each_direction(*_symmetric(A, self.place, self.nodes))
        blocks, indices, indptr = _symmetric(A.tobsr((3, 3)), self.place, self.nodes)
        return sp.bsr_matrix((blocks, indices, indptr), shape=(3 * self.nodes,) * 2).tocsr()


def _symmetric(
    A: sp.spmatrix, place: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(A + A') / 2 with the node i put at place[i] of `size`: numbers (or blocks of 3 x 3),
    columns, row pointer.

    The numbers are moved once, each block as one: what is put in order is the pattern, which is
    symmetric, by turning it over twice.
    """
    count = np.zeros(size + 1, dtype=A.indptr.dtype)
    count[place + 1] = np.diff(A.indptr)
    row_of = np.full(size, -1)
    row_of[place] = np.arange(len(place))
    moved = sp.csr_matrix(
        (np.arange(len(A.indices)), place[A.indices], A.indptr), (len(place), size)
    )
    moved = moved[row_of[row_of >= 0]]
    moved = sp.csr_matrix((moved.data, moved.indices, np.cumsum(count)), (size, size))
    there = moved.T.tocsr()
    here = there.T.tocsr()
    data = A.data[here.data]
    data += np.moveaxis(A.data[there.data], -1, -2) if data.ndim == 3 else A.data[there.data]
    data /= 2
    return data, here.indices, here.indptr


def _in_each_direction(data: np.ndarray, indices: np.ndarray, indptr: np.ndarray) -> sp.spmatrix:
    """A matrix by node that acts on each of the three directions alike and couples none, over all
    dofs."""
    n = len(indptr) - 1
    tripled = sp.csr_matrix((data, indices, indptr), (n, n))[np.repeat(np.arange(n), 3)]
    direction = np.repeat(np.tile(np.arange(3, dtype=indices.dtype), n), np.diff(tripled.indptr))
    return sp.csr_matrix(
        (tripled.data, 3 * tripled.indices + direction, tripled.indptr), (3 * n, 3 * n)
    )


@contextmanager
def _quiet_compiler() -> Iterator[None]:
    """The compiler of new forms reports its command lines on the root logger."""
    before = logging.root.manager.disable
    logging.disable(max(before, logging.INFO))
    try:
        yield
    finally:
        logging.disable(before)


# ---- what differs between the versions -----------------------------------------------------------


def _vector_element(shape: str, degree: int) -> Any:
    try:
        from basix.ufl import element
    except ImportError:  # before 0.7
        import ufl

        return ufl.VectorElement("Lagrange", shape, degree)
    return element("Lagrange", shape, degree, shape=(3,))


def _space(grid: "Mesh", degree: int, shape: tuple[int, ...]) -> "FunctionSpace":
    """Functions of three components, shape (3,), or of one, ()."""
    from dolfinx import fem

    try:
        return fem.functionspace(grid, ("Lagrange", degree, shape))
    except AttributeError:  # before 0.7
        return (fem.VectorFunctionSpace if shape else fem.FunctionSpace)(grid, ("Lagrange", degree))


def _table(cells: "AdjacencyList_int32") -> np.ndarray:
    """A table of a row a cell, in one line: lists of lists before 0.7, rectangular arrays since."""
    try:
        return cells.array
    except AttributeError:
        return np.ravel(cells)


def _input_node(grid: "Mesh", V: "FunctionSpace") -> np.ndarray:
    """For each node of V the index of the node in the coordinates that the mesh was made from."""
    geometry, dofs = _table(grid.geometry.dofmap), _table(V.dofmap.list)
    place = np.empty(V.dofmap.index_map.size_local, dtype=int)
    place[dofs] = np.asarray(grid.geometry.input_global_indices)[geometry]
    found = V.tabulate_dof_coordinates()[dofs]
    if np.abs(found - grid.geometry.x[geometry]).max() > 1e-12 * max(1.0, np.abs(found).max()):
        raise RuntimeError(
            "dofs and mesh nodes do not coincide: this dolfinx orders them differently"
        )
    return place
