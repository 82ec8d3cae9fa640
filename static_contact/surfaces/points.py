"""Contact between unlike meshes: surfaces of blade and damper become a contact table and the points of both bodies."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.points import ContactPoints
from modal.body import Body
from modal.mesh import Mesh
from static_contact.pairing import Side, contact_frames, join
from static_contact.surfaces.checks import check_overlap
from static_contact.surfaces.overlap import Overlap, overlap
from static_contact.surfaces.settings import DEFAULT, SurfaceSettings
from static_contact.surfaces.stations import stations_and_rows


@dataclass(frozen=True)
class MeshPoints:
    """n contact points on one mesh.

    number : (n,) int; position : (n, 3) m - weighted means of the nodes'; node : (u,) int - the mesh's numbers
    weight : (n, u) CSR - of these nodes, rows of sum 1
    """

    number: np.ndarray
    position: np.ndarray
    node: np.ndarray
    weight: sp.csr_matrix

    def nodes_of(self, numbers: np.ndarray) -> np.ndarray:
        """Numbers of the nodes that some of the points are means of."""
        return self.node[np.unique(self.weight[np.isin(self.number, numbers)].indices)]

    def on(self, body: Body) -> ContactPoints:
        """The points on the free dofs of the body that was made of the mesh."""
        motion = sp.kron(self.weight, sp.eye(3), format="csr") @ body.motion_of(body.name, self.node)
        return ContactPoints(self.number, self.position, motion)


@dataclass(frozen=True)
class Surfaces:
    """The faces of one contact side: side - its names; blade, damper : [(f, k) node indices] of either mesh."""

    side: Side
    blade: list[np.ndarray]
    damper: list[np.ndarray]


def surface_contact(blade: Mesh, damper: Mesh, surfaces: Sequence[Surfaces], *, axis: ArrayLike, pull: ArrayLike,
                    closed: bool = False, shown: Callable[[float], str] = lambda metres: f"{metres:.3g} m",
                    settings: SurfaceSettings = DEFAULT) -> tuple[ContactTable, MeshPoints, MeshPoints]:
    """The contact table of some sides, and its points on the blades and on the damper.

    axis (3,): along the damper; pull (3,): orders the rows, row 0 is the one farthest against it; closed - the surfaces
    count as touching, wherever they lie; shown - how lengths are written in messages. kn, kt and mu are still 0; area
    and gap come from the surfaces. Raises InputError where surfaces do not face each other, as `checks` has it.
    """
    reach = settings.reach * float(np.ptp(damper.position, axis=0).max())
    found = []
    for one in surfaces:
        met = overlap(damper, one.damper, blade, one.blade, reach, settings)
        check_overlap(one.side, met, blade, one.blade, damper, one.damper, reach, closed, shown, settings)
        found.append(met)
    direction = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    start = 10 ** len(str(int(max(blade.node.max(), damper.node.max()))))
    counts = [len(met.vertex) for met in found]
    numbers = np.split(start + 1 + np.arange(sum(counts)), np.cumsum(counts)[:-1])
    places = [damper.position[met.vertex] for met in found]
    sizes = [float(np.sqrt(met.area.mean())) for met in found]
    grid = stations_and_rows(places, sizes, direction, np.asarray(pull, dtype=float))
    tables = [_table(one.side, met, number, damper, direction, at, closed)
              for one, met, number, at in zip(surfaces, found, numbers, grid, strict=True)]
    number = np.concatenate(numbers)
    return join(*tables), _points(number, blade, [m.blade for m in found]), _points(number, damper,
                                                                                    [m.damper for m in found])


def _table(side, met: Overlap, number, damper, axis, at, closed) -> ContactTable:
    station, row = at
    order, P = np.lexsort((row, station)), len(number)
    return ContactTable(side=np.full(P, side.name), station=station, row=row, blade_body=np.full(P, side.blade_body),
                        blade_node=number, damper_body=np.full(P, side.damper_body), damper_node=number,
                        position=met.damper @ damper.position, frame=contact_frames(met.normal, axis, side),
                        gap=np.zeros(P) if closed else met.gap, kn=np.zeros(P), kt=np.zeros(P), mu=np.zeros(P),
                        preload=np.zeros(P), weight=np.ones(P), area=met.area).select(order)


def _points(number, mesh, weights) -> MeshPoints:
    weight = sp.vstack(weights, format="csc")
    used = np.flatnonzero(np.diff(weight.indptr))
    return MeshPoints(number, weight @ mesh.position, mesh.node[used], weight[:, used].tocsr())


def check_faces(side: Side, what: str, group: str, mesh: Mesh, faces: list[np.ndarray]) -> None:
    """InputError where there is no face of a side; what - "blade" or "damper"."""
    if not any(len(block) for block in faces):
        held = f"none has all its corners among the {len(mesh.groups[group])} nodes of group '{group}'" \
            if group in mesh.groups else "none is where it is looked for"
        raise InputError(f"[contact.{side.name}] {what}: no face on the surface of {mesh.source}: {held}; name a "
                         "surface, or widen the limits")
