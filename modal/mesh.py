"""Mesh: nodes and cells with the user's numbers, named node groups and cell groups.

Files become meshes in tipdamp/readers; what a mesh must fulfil is checked in mesh_checks.py.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.errors import InputError, nearest, shown

DIMENSION = ("nodes", "a curve", "a surface", "a volume")


SI = {1.0: (1.0, 1.0), 1e-3: (1e6, 1e12)}  # Pa and kg/m3 that are 1 of a file in m, and in mm


class GivenMaterial(NamedTuple):
    """An isotropic material as a mesh file has it, in the units of the file."""

    name: str
    E: float
    nu: float
    density: float

    def in_si(self, length_unit: float) -> tuple[float, float, float]:
        """E in Pa, nu, and density in kg/m3, of a file in m (N, kg) or in mm (N, t); NaN in others,
        which have no usual ones. length_unit - m"""
        pascal, kilogram = SI.get(length_unit, (np.nan, np.nan))
        return pascal * self.E, self.nu, kilogram * self.density


@dataclass(frozen=True)
class Mesh:
    """Nodes and solid cells of a file, with their numbers and groups.

    node : (n,) int - the user's node numbers; position : (n, 3) m; cells : {type of cells.CELLS:
    (c, k) int} - indices into `node`, in gmsh's order; groups : {name: (g,) int node numbers};
    unused : what the file holds and this record does not; number : {type: (c,) int} - the user's
    element numbers; cell_groups : {name: element numbers}; dimension : {group: 0 nodes, 1 curve, 2
    surface, 3 volume} where known; warnings : what was repaired or looks wrong; format : of the
    file; face_groups : {name: (f, 4) int} - the faces of a surface as the file lists them: node
    numbers of the corners, sorted, -1 in front of triangles (`faces.group_faces`); materials :
    {group of cells: what the file says that it is made of}.

    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> mesh = Mesh(np.arange(1, 5), np.array(corners), {"tetra": np.array([[0, 1, 2, 3]])})
    >>> mesh.index([4, 1])
    array([3, 0])
    """

    node: np.ndarray
    position: np.ndarray
    cells: dict
    groups: dict = field(default_factory=dict)
    unused: tuple = ()
    source: str = ""
    number: dict = field(default_factory=dict)
    cell_groups: dict = field(default_factory=dict)
    dimension: dict = field(default_factory=dict)
    warnings: tuple = ()
    format: str = ""
    face_groups: dict = field(default_factory=dict)
    materials: dict = field(default_factory=dict)

    def index(self, numbers: "ArrayLike") -> np.ndarray:
        """Indices into `node` of the given node numbers."""
        order = np.argsort(self.node)
        found = np.searchsorted(self.node, numbers, sorter=order)
        found = order[np.minimum(found, len(order) - 1)]
        wrong = np.asarray(numbers)[self.node[found] != numbers]
        if len(wrong):
            raise InputError(f"{self.source}: node {wrong[0]} does not exist")
        return found

    def group(self, name: str, dimensions: tuple[int, ...] = (0, 1, 2, 3)) -> np.ndarray:
        """Node numbers of a group; raises InputError with the groups that exist, or with what the
        group holds when it is empty or not of the allowed dimensions."""
        if name not in self.groups:
            raise InputError(
                f"{self.source}: no group '{shown(name)}'; {nearest(name, offered(self.groups))}"
            )
        has, count = self.dimension.get(name, 0), len(self.groups[name])
        holds = f"{DIMENSION[has]} (dimension {has}) with {count} nodes"
        if not count:
            raise InputError(
                f"{self.source}: group '{shown(name)}' is empty: it holds {holds} of solid cells"
            )
        if has not in dimensions:
            raise InputError(
                f"{self.source}: group '{shown(name)}' holds {holds}; "
                f"wanted: {' or '.join(DIMENSION[d] for d in dimensions)}"
            )
        return self.groups[name]

    def members(self, name: str) -> dict:
        """{type: (c,) bool} - which cells belong to a cell group; raises InputError with the groups
        that exist."""
        if name not in self.cell_groups:
            raise InputError(
                f"{self.source}: no group of cells '{shown(name)}'; "
                f"{nearest(name, offered(self.cell_groups))}"
            )
        return {
            kind: np.isin(number, self.cell_groups[name]) for kind, number in self.number.items()
        }


def offered(names: Iterable[str]) -> list[str]:
    """Names of groups, sorted, to choose from: without those that a pre-processor keeps for itself,
    as Abaqus '_Surf-1_S1'; these can be named all the same."""
    return sorted(name for name in names if not name.startswith("_"))
