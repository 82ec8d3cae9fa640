"""Linear elasticity: a Mesh and its materials become a Body. It and stiffening.py touch dolfinx, no other.

dolfinx assembles the cells that it can take; the others (20-node hexahedra, wedges), and all where it is not
installed, are assembled by isoparametric.py. Displacements live at the nodes of the mesh whatever the cell, so the
blocks are added by node and nothing is promoted to another element.
"""

import logging
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp

from hbm.errors import InputError
from modal.body import Body
from modal.isoparametric import stiffness_and_mass
from modal.memory import check_memory
from modal.mesh import Mesh

# full Gauss integration, stated here because the default differs from code to code (and moves preloads by 1e-5):
# 2x2x2 and 3x3x3 points for hexahedra
_QUADRATURE = {"tetra": 2, "hexahedron": 3, "tetra10": 4, "hexahedron27": 5}
_SHAPE = {"tetra": ("tetrahedron", 1), "hexahedron": ("hexahedron", 1), "tetra10": ("tetrahedron", 2),
          "hexahedron27": ("hexahedron", 2)}


@dataclass(frozen=True)
class Material:
    """E : Pa - Young's modulus; nu - Poisson's ratio; density : kg/m3."""

    E: float
    nu: float
    density: float

    def __post_init__(self):
        for name, low, high in (("E", 0, np.inf), ("nu", -1, 0.5), ("density", 0, np.inf)):
            if not low < getattr(self, name) < high:
                raise InputError(f"material: {name} = {getattr(self, name):g}, must lie between {low} and {high}")


    @property
    def lame(self) -> float:
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def shear(self) -> float:
        return self.E / (2 * (1 + self.nu))


def elastic_body(mesh: Mesh, material: Material, name: str, *, clamp=None, free: bool = False,
                 other_materials=None) -> Body:
    """Assemble K and M over the free dofs; nodes of the groups `clamp` (a name or several) are fixed in x, y, z.

    other_materials {cell group: Material}: what those cells are made of instead. Raises InputError for an absent or
    empty group, a cell that two materials claim, and a mesh that the memory will not hold.
    """
    check_memory(len(mesh.node), mesh.source)
    clamps = [clamp] if isinstance(clamp, str) else list(clamp or ())
    held = np.zeros(len(mesh.node), dtype=bool)
    for group in clamps:
        held[mesh.index(mesh.group(group))] = True
    K = M = None
    for kind, cells, of in _blocks(mesh, material, other_materials or {}):
        assemble = _dolfinx if kind in _SHAPE and has_dolfinx() else stiffness_and_mass
        k, m = assemble(mesh.position, kind, cells, of.lame, of.shear, of.density)
        K, M = (k, m) if K is None else (K + k, M + m)
    keep, clamped = (np.flatnonzero(np.repeat(m, 3)) for m in (~held, held))
    return Body(name=name, node=mesh.node, position=mesh.position, dof_node=keep // 3, dof_direction=keep % 3,
                K=K[keep][:, keep].tocsr(), M=M[keep][:, keep].tocsr(), groups=dict(mesh.groups), free=free,
                M_clamped=M[keep][:, clamped].tocsr(),
                provenance={"mesh": mesh.source, "cells": ", ".join(f"{len(c)} {k}" for k, c in mesh.cells.items())})


def has_dolfinx() -> bool:
    try:
        return find_spec("dolfinx") is not None
    except (ImportError, ValueError):
        return False


def _blocks(mesh, material, others):
    """(cell type, cells, material) of every block of cells that are alike."""
    owner = {kind: np.zeros(len(cells), dtype=int) for kind, cells in mesh.cells.items()}
    materials, names = [material, *others.values()], list(others)
    for i, group in enumerate(names, start=1):
        for kind, mine in mesh.members(group).items():
            twice = mine & (owner[kind] > 0)
            if twice.any():
                raise InputError(f"{mesh.source}: {int(twice.sum())} {kind} cells are in the groups '{group}' and "
                                 f"'{names[owner[kind][twice][0] - 1]}', which have different materials (first: "
                                 f"element {mesh.number[kind][twice][0]})")
            owner[kind][mine] = i
    for kind, cells in mesh.cells.items():
        for i in np.unique(owner[kind]):
            yield kind, cells[owner[kind] == i], materials[i]


@contextmanager
def _quiet_compiler():
    """The compiler of new forms reports its command lines on the root logger."""
    before = logging.root.manager.disable
    logging.disable(max(before, logging.INFO))
    try:
        yield
    finally:
        logging.disable(before)


@_quiet_compiler()
def _dolfinx(position, kind, cells, lame, shear, density):
    """K, M of one block of cells over all dofs of the mesh (3 i + k for node i), zero rows where it has no cell."""
    from modal import petsc

    petsc.start()
    import dolfinx.io.gmshio
    import ufl
    from dolfinx import fem
    from mpi4py import MPI

    shape, degree = _SHAPE[kind]
    used = np.unique(cells)
    local = np.searchsorted(used, cells)
    order = dolfinx.io.gmshio.cell_perm_array(getattr(dolfinx.mesh.CellType, shape), cells.shape[1])
    domain = ufl.Mesh(ufl.VectorElement("Lagrange", shape, degree))
    grid = dolfinx.mesh.create_mesh(MPI.COMM_SELF, local[:, order].astype(np.int64), position[used], domain)
    V = fem.VectorFunctionSpace(grid, ("Lagrange", degree))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    dx = ufl.Measure("dx", domain=grid, metadata={"quadrature_degree": _QUADRATURE[kind]})
    # material values enter as constants so that the compiled kernel is shared by all bodies
    lame, shear, density = (fem.Constant(grid, np.float64(c)) for c in (lame, shear, density))
    eps = ufl.sym(ufl.grad(u))
    stress = lame * ufl.tr(eps) * ufl.Identity(3) + 2 * shear * eps
    place = used[_dof_to_input(grid, V)]
    blocks = (3 * place[:, None] + np.arange(3)).ravel()
    return tuple(_scatter(fem.form(form), blocks, 3 * len(position))
                 for form in (ufl.inner(stress, ufl.sym(ufl.grad(v))) * dx, density * ufl.inner(u, v) * dx))


def _dof_to_input(grid, V):
    """For each block dof of V the index of the node in the coordinates that the mesh was made from."""
    geometry = np.asarray(grid.geometry.dofmap.array)
    place = np.empty(V.dofmap.index_map.size_local, dtype=int)
    place[np.asarray(V.dofmap.list.array)] = np.asarray(grid.geometry.input_global_indices)[geometry]
    found = V.tabulate_dof_coordinates()[np.asarray(V.dofmap.list.array)]
    if np.abs(found - grid.geometry.x[geometry]).max() > 1e-12 * max(1.0, np.abs(found).max()):
        raise RuntimeError("dofs and mesh nodes do not coincide: this dolfinx orders them differently")
    return place


def _scatter(form, blocks, size):
    from dolfinx import fem

    A = fem.petsc.assemble_matrix(form)
    A.assemble()
    indptr, indices, data = A.getValuesCSR()
    coo = sp.csr_matrix((data, indices, indptr), shape=(len(blocks), len(blocks))).tocoo()
    A.destroy()
    full = sp.coo_matrix((coo.data, (blocks[coo.row], blocks[coo.col])), shape=(size, size)).tocsr()
    return ((full + full.T) / 2).tocsr()
