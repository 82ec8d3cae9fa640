"""Linear elasticity: a Mesh and its materials become a Body.

dolfinx assembles the cell types that it supports, isoparametric.py the others (20-node hexahedra,
wedges), and all where dolfinx is not installed. Displacements belong to the nodes of the mesh for
every cell type, so the
blocks add by node.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.elements import dolfinx_compat
from tipdamp.modal.elements.isoparametric import stiffness_and_mass
from tipdamp.modal.memory import check_memory
from tipdamp.modal.mesh import Mesh

if TYPE_CHECKING:
    import scipy.sparse as sp


@dataclass(frozen=True)
class Material:
    """Isotropic and linear elastic.

    E : Pa - Young's modulus; nu - Poisson's ratio; density : kg/m3.

    >>> Material(E=210e9, nu=0.3, density=7850).nu
    0.3
    """

    E: float
    nu: float
    density: float

    def __post_init__(self) -> None:
        for name, low, high in (("E", 0, np.inf), ("nu", -1, 0.5), ("density", 0, np.inf)):
            if not low < vars(self)[name] < high:
                raise InputError(
                    f"material: {name} = {vars(self)[name]:g}, must lie between {low} and {high}"
                )

    @property
    def lame(self) -> float:
        """First Lame modulus, Pa."""
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def shear(self) -> float:
        """Shear modulus, Pa."""
        return self.E / (2 * (1 + self.nu))


def elastic_body(
    mesh: Mesh,
    material: Material,
    name: str,
    *,
    clamp: str | Sequence[str] | None = None,
    free: bool = False,
    other_materials: dict[str, Material] | None = None,
) -> Body:
    """Assemble K and M over the free dofs; nodes of the groups `clamp` (a name or several) are
    fixed in x, y, z.

    other_materials {cell group: Material}: what those cells are made of instead. Raises InputError
    for an absent or empty group, a cell that two materials claim, and a mesh that the memory will
    not hold.

    >>> corners = 0.01 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> mesh = Mesh(np.arange(1, 5), corners, {"tetra": np.array([[0, 1, 2, 3]])})
    >>> body = elastic_body(mesh, Material(E=210e9, nu=0.3, density=7850), "blade", free=True)
    >>> body.K.shape
    (12, 12)
    """
    check_memory((len(mesh.node), 0, mesh.source))
    fixed = fixed_nodes(mesh, clamp)
    K, M = _assembled(mesh, material, other_materials or {})
    keep, clamped = (np.flatnonzero(np.repeat(m, 3)) for m in (~fixed, fixed))
    return Body(
        name=name,
        node=mesh.node,
        position=mesh.position,
        dof_node=keep // 3,
        dof_direction=keep % 3,
        K=K[keep][:, keep].tocsr(),
        M=M[keep][:, keep].tocsr(),
        groups=dict(mesh.groups),
        free=free,
        M_clamped=M[keep][:, clamped].tocsr(),
        provenance={
            "mesh": mesh.source,
            "cells": ", ".join(f"{len(c)} {k}" for k, c in mesh.cells.items()),
        },
    )


def _assembled(
    mesh: Mesh, material: Material, others: dict[str, Material]
) -> "tuple[sp.spmatrix, sp.spmatrix]":
    """K and M over all dofs of the mesh."""
    K: Any = None
    M: Any = None
    for kind, cells, of in blocks(mesh, material, others):
        assemble = _dolfinx if dolfinx_compat.takes(kind) else stiffness_and_mass
        k, m = assemble(mesh.position, kind, cells, of.lame, of.shear, of.density)
        K, M = (k, m) if K is None else (K + k, M + m)
    return K, M


def fixed_nodes(mesh: Mesh, clamp: str | Sequence[str] | None) -> np.ndarray:
    """(n,) bool: nodes of the groups `clamp`, a name or several."""
    fixed = np.zeros(len(mesh.node), dtype=bool)
    for group in [clamp] if isinstance(clamp, str) else list(clamp or ()):
        fixed[mesh.index(mesh.group(group))] = True
    return fixed


def blocks(
    mesh: Mesh, material: Material, others: dict[str, Material]
) -> Iterator[tuple[str, np.ndarray, Material]]:
    """(cell type, cells, material) of every block of cells that are alike."""
    owner = {kind: np.zeros(len(cells), dtype=int) for kind, cells in mesh.cells.items()}
    materials, names = [material, *others.values()], list(others)
    for i, group in enumerate(names, start=1):
        for kind, mine in mesh.members(group).items():
            twice = mine & (owner[kind] > 0)
            if twice.any():
                raise InputError(
                    f"{mesh.source}: {int(twice.sum())} {kind} cells are in the groups '{group}' "
                    f"and '{names[owner[kind][twice][0] - 1]}', which have different materials "
                    f"(first: element {mesh.number[kind][twice][0]})"
                )
            owner[kind][mine] = i
    for kind, cells in mesh.cells.items():
        for i in np.unique(owner[kind]):
            yield kind, cells[owner[kind] == i], materials[i]


def _dolfinx(
    position: np.ndarray, kind: str, cells: np.ndarray, lame: float, shear: float, density: float
) -> "tuple[sp.spmatrix, sp.spmatrix]":
    """K, M of one block of cells over all dofs of the mesh (3 i + k for node i), zero rows where it
    has no cell."""
    block = dolfinx_compat.CellBlock.of(position, kind, cells)
    import ufl

    lame, shear, density = block.constants(lame, shear, density)
    u, v = ufl.TrialFunction(block.V), ufl.TestFunction(block.V)
    K = block.matrix(ufl.inner(stress(u, lame, shear), strain(v)) * block.dx)
    block = block.one_direction()
    u, v = ufl.TrialFunction(block.V), ufl.TestFunction(block.V)
    return K, block.matrix(density * u * v * block.dx)


def strain(u: Any) -> Any:
    """Small strain of a displacement, in dolfinx forms."""
    import ufl

    return ufl.sym(ufl.grad(u))


def stress(u: Any, lame: Any, shear: Any) -> Any:
    """Stress of a displacement by Hooke's law, in dolfinx forms; Lame's moduli in Pa."""
    import ufl

    return lame * ufl.tr(strain(u)) * ufl.Identity(3) + 2 * shear * strain(u)
