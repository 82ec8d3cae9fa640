"""Contact between unlike meshes: surfaces of blade and damper become a contact table and the points
of both bodies."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.points import ContactPoints
from tipdamp.modal.body import Body
from tipdamp.modal.faces import face_keys
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.checks import check_overlap, line_doubt
from tipdamp.static_contact.surfaces.facets import Surface, facets
from tipdamp.static_contact.surfaces.overlap import overlap
from tipdamp.static_contact.surfaces.pairing import Side, contact_frames, join, new_table
from tipdamp.static_contact.surfaces.records import Overlap
from tipdamp.static_contact.surfaces.stations import stations_and_rows


@dataclass(frozen=True)
class MeshPoints:
    """n contact points on one mesh.

    number : (n,) int; position : (n, 3) m - weighted means of the nodes'; node : (u,) int - the
    mesh's numbers
    weight : (n, u) CSR - of these nodes, rows of sum 1
    """

    number: np.ndarray
    position: np.ndarray
    node: np.ndarray
    weight: sp.csr_matrix

    def on(self, body: Body) -> ContactPoints:
        """The points on the free dofs of the body that was made of the mesh."""
        motion = sp.kron(self.weight, sp.eye(3), format="csr") @ body.motion_of(
            body.name, self.node
        )
        return ContactPoints(self.number, self.position, motion)


class FacingSides(NamedTuple):
    """The faces of one contact side, and its names."""

    side: Side
    blade: Surface
    damper: Surface


def surface_contact(
    surfaces: Sequence[FacingSides],
    *,
    axis: ArrayLike,
    pull: ArrayLike,
    closed: bool = False,
    shown: Callable[[float], str] = lambda metres: f"{metres:.3g} m",
) -> tuple[ContactTable, MeshPoints, MeshPoints]:
    """The contact table of some sides of one mesh of blades and one of a damper, and its points on
    either.

    axis (3,): along the damper; pull (3,): orders the rows, row 0 is the one farthest against it;
    closed - the surfaces count as touching, wherever they lie; shown - how lengths are written in
    messages. kn, kt and mu are still 0; area and gap come from the surfaces. Raises InputError
    where surfaces do not face each other, as `checks` has it, and warns where a round one has no
    point on its line of contact."""
    _check_once(surfaces)
    found = _overlaps(surfaces, closed, shown)
    blade, damper = surfaces[0].blade.mesh, surfaces[0].damper.mesh
    direction = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    numbers = _numbers((blade, damper), [len(met.vertex) for met in found])
    grids = stations_and_rows(
        [damper.position[met.vertex] for met in found],
        [_face_size(one.damper) for one in surfaces],
        direction,
        np.asarray(pull, dtype=float),
    )
    tables = [
        new_table(
            one.side,
            grid,
            (number, number),
            position=met.damper @ damper.position,
            frame=contact_frames(met.normal, direction, one.side),
            gap=np.zeros(len(number)) if closed else met.gap,
            area=met.area,
        )
        for one, met, number, grid in zip(surfaces, found, numbers, grids, strict=True)
    ]
    number = np.concatenate(numbers)
    return (
        join(*tables),
        _points(number, blade, [m.blade for m in found]),
        _points(number, damper, [m.damper for m in found]),
    )


def _overlaps(
    surfaces: Sequence[FacingSides], closed: bool, shown: Callable[[float], str]
) -> list[Overlap]:
    """Of each side, looked at."""
    found = []
    for one in surfaces:
        found.append(overlap(one.damper, one.blade))
        check_overlap(one.side, found[-1], one.blade, one.damper, closed, shown)
        if not closed and (doubt := line_doubt(one.side, found[-1], one.damper, shown)):
            warnings.warn(doubt, Doubt, stacklevel=3)
    return found


def _numbers(meshes: Sequence[Mesh], counts: Sequence[int]) -> list[np.ndarray]:
    """Numbers of so many contact points of each side, which are none of nodes."""
    start = 10 ** len(str(int(max(mesh.node.max() for mesh in meshes))))
    return np.split(start + 1 + np.arange(sum(counts)), np.cumsum(counts)[:-1])


def _face_size(surface: Surface) -> float:
    """m: mean size of the faces."""
    return float(np.mean(np.concatenate([kind.size for kind in facets(surface)])))


def _check_once(surfaces: Sequence[FacingSides]) -> None:
    """InputError where faces of both bodies that meet belong to two sides: their contact would
    count twice."""
    for i, one in enumerate(surfaces):
        for other in surfaces[:i]:
            damper = _shared(one.damper, other.damper)
            blade = _shared(one.blade, other.blade)
            some = all(any(map(len, surface.faces)) for surface in (damper, blade))
            if some and len(overlap(damper, blade).vertex):
                raise InputError(
                    f"sides '{other.side.name}' and '{one.side.name}' share "
                    f"{sum(map(len, damper.faces))} faces of the damper and "
                    f"{sum(map(len, blade.faces))} of the blades, which meet: their contact would "
                    "count twice; make them one side, or take the faces off one of them (a table "
                    "with box = [...] picks some)"
                )


def _shared(one: Surface, other: Surface) -> Surface:
    """The faces that are in both."""
    theirs = {key for block in other.faces for key in map(tuple, face_keys(block).tolist())}
    return Surface(
        one.mesh,
        [
            block[[tuple(key) in theirs for key in face_keys(block).tolist()]]
            for block in one.faces
            if len(block)
        ],
    )


def _points(number: np.ndarray, mesh: Mesh, weights: Sequence[sp.spmatrix]) -> MeshPoints:
    weight = sp.vstack(weights, format="csc")
    used = np.flatnonzero(np.diff(weight.indptr))
    return MeshPoints(number, weight @ mesh.position, mesh.node[used], weight[:, used].tocsr())


def check_faces(
    side: Side,
    what: str,
    group: str,
    mesh: Mesh,
    faces: list[np.ndarray],
    why: str = "none is where it is looked for; widen the limits",
) -> None:
    """InputError where there is no face of a side; what - "blade" or "damper"; why - of faces
    picked by geometry."""
    if any(len(block) for block in faces):
        return
    if group in mesh.groups:
        why = (
            f"none has all its corners among the {len(mesh.groups[group])} nodes of group "
            f"'{group}'; name a surface, or a [contact] tolerance within which its nodes match"
        )
    raise InputError(
        f"[contact.{side.name}] {what}: no face on the surface of {mesh.source}: {why}"
    )
