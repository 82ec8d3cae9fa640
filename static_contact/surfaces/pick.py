"""Faces of a mesh that form a contact side: of a group, or picked by geometry."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.modal.faces import boundary_faces, face_corners, group_faces
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.facets import Facets, Surface, facets
from tipdamp.static_contact.surfaces.settings import DEFAULT

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class FacePick:
    """Boundary faces that fulfil all that is stated.

    plane : normal of a plane through `point`; cylinder : axis of a cylinder through `point` with
    `radius` m
    tolerance : m - how far nodes may be off plane or cylinder; None: a hundredth of the size of the
    face
    within : m - no farther from the other body, and facing it; box : two corners, all nodes between
    them
    group : faces of this group only
    """

    plane: Vector | None = None
    cylinder: Vector | None = None
    point: Vector = (0.0, 0.0, 0.0)
    radius: float | None = None
    tolerance: float | None = None
    within: float | None = None
    box: tuple[Vector, Vector] | None = None
    group: str = ""

    def faces(self, mesh: Mesh, other: Mesh) -> list[np.ndarray]:
        """(f, k) node indices of the faces, in the blocks of `boundary_faces`; all empty where
        there are none."""
        blocks = faces_of(mesh, self.group) if self.group else boundary_faces(mesh)
        found = []
        for block in blocks:
            place = mesh.position[block]
            size = np.linalg.norm(place - place[:, :1], axis=2).max(axis=1, initial=0.0)
            found.append(block[self._on_form(place, size) & self._in_box(place)])
        return found if self.within is None else _near(mesh, found, other, self.within)

    def why_none(self, mesh: Mesh, other: Mesh, shown: Callable[[float], str]) -> str:
        """What is nearest where `faces` finds none, and the remedy; shown - how a length in m is
        written."""
        if self.within is not None and (
            left := sum(map(len, replace(self, within=None).faces(mesh, other)))
        ):
            return (
                f"{left} faces fulfil the rest, but none of them lies within {shown(self.within)} "
                f"of a face of {other.source} that faces it; enlarge within, or see whether the "
                "meshes are in place"
            )
        boxed = replace(self, plane=None, cylinder=None, within=None).faces(mesh, other)
        if not any(map(len, boxed)):
            return (
                "none has all its nodes in the box; enlarge it"
                if self.box
                else f"group '{self.group}' has none"
            )
        nearest = map(self._nearest, facets(Surface(mesh, boxed)))
        off, angle = min(nearest, key=lambda one: one[0])
        form = "plane" if self.cylinder is None else "cylinder"
        return (
            f"the nearest lies {shown(off)} off the {form} and its normal {angle:.2g} "
            f"degrees; correct the {form}, or state tolerance, how far nodes may be off (now "
            + (
                "a hundredth of the face's size)"
                if self.tolerance is None
                else f"{shown(self.tolerance)})"
            )
        )

    def _nearest(self, part: Facets) -> tuple[float, float]:
        """m that the nearest of the faces lies off the form, and degrees of its normal."""
        off = self._off(part.place).max(axis=1)
        t = int(np.flatnonzero(part.face == off.argmin())[0])
        normal = self.plane
        if self.cylinder is not None:
            axis, arm = _unit(self.cylinder), part.centre[t] - np.array(self.point)
            normal = arm - (arm @ axis) * axis
        cosine = abs(part.normal[t] @ _unit(normal))
        return float(off.min()), float(np.degrees(np.arccos(np.clip(cosine, 0, 1))))

    def _on_form(self, place: np.ndarray, size: np.ndarray) -> np.ndarray:
        return self._off(place).max(axis=1, initial=0.0) <= (
            0.01 * size if self.tolerance is None else self.tolerance
        )

    def _off(self, place: np.ndarray) -> np.ndarray:
        off = np.zeros(place.shape[:2])
        arm = place - np.array(self.point)
        if self.plane is not None:
            off = np.abs(arm @ _unit(self.plane))
        if self.cylinder is not None and self.radius is not None:
            axis = _unit(self.cylinder)
            from_axis = np.linalg.norm(arm - (arm @ axis)[..., None] * axis, axis=2)
            off = np.maximum(off, np.abs(from_axis - self.radius))
        return off

    def _in_box(self, place: np.ndarray) -> np.ndarray:
        if self.box is None:
            return np.ones(len(place), dtype=bool)
        low, high = np.sort(np.array(self.box), axis=0)
        return ((place >= low) & (place <= high)).all(axis=(1, 2))


def faces_of(mesh: Mesh, group: str) -> list[np.ndarray]:
    """Boundary faces of a group, in the blocks of `boundary_faces`: its face set, or those with all
    nodes in it, or, where the group holds corner nodes alone, those with all corners in it."""
    found = group_faces(mesh, group)
    if any(len(block) for block in found):
        return found
    member = np.zeros(len(mesh.node), dtype=bool)
    member[mesh.index(mesh.group(group))] = True
    return [b[member[b[:, : face_corners(b.shape[1])]].all(axis=1)] for b in boundary_faces(mesh)]


def _unit(direction: Any) -> np.ndarray:
    return np.array(direction) / np.linalg.norm(direction)


def _near(
    mesh: Mesh, blocks: Sequence[np.ndarray], other: Mesh, distance: float
) -> list[np.ndarray]:
    """The faces of which a part lies within `distance` of a face of the other body that faces
    them."""
    theirs = facets(Surface(other, boundary_faces(other)))
    found = []
    for block in blocks:
        near = np.zeros(len(block), dtype=bool)
        for mine in facets(Surface(mesh, [block])):  # one, or none of an empty block
            points = _spread(mine)
            normals = np.tile(mine.normal, (len(points) // len(mine.normal), 1))
            for facet in theirs:
                seen, _ = _facing(points, normals, facet, distance)
                _, met = _facing(facet.centre, facet.normal, mine, distance)
                near[mine.face[np.r_[seen % len(mine.normal), met]]] = True
        found.append(block[near])
    return found


def _spread(mine: Facets) -> np.ndarray:
    """(7 t, 3): the centre of every facet and points just inside of its corners and of the middles
    of its edges."""
    ends = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))
    return np.concatenate(
        [
            mine.centre,
            *(
                0.05 * mine.centre + 0.475 * (mine.corner[:, a] + mine.corner[:, b])
                for a, b in ends
            ),
        ]
    )


def _facing(
    points: np.ndarray, normals: np.ndarray, theirs: Facets, distance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Of points (m, 3) with normals those near a facet that faces them, and these facets."""
    _, nearest = cKDTree(theirs.centre).query(points, min(DEFAULT.near, len(theirs.centre)))
    nearest = nearest.reshape(len(points), -1)
    facing = np.einsum("tx,tkx->tk", normals, theirs.normal[nearest]) < -np.cos(
        np.radians(DEFAULT.facing)
    )
    apart = np.stack(
        [triangle_distance(theirs.corner[nearest[:, k]], points) for k in range(nearest.shape[1])],
        1,
    )
    met = facing & (apart <= distance)
    return np.flatnonzero(met.any(axis=1)), nearest[met]


def triangle_distance(corner: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(m,) m: distance of points (m, 3) from triangles (m, 3, 3)."""
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    best, over = np.full(len(point), np.inf), np.ones(len(point), dtype=bool)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        along, arm = corner[:, b] - corner[:, a], point - corner[:, a]
        share = np.einsum("mx,mx->m", arm, along) / np.einsum("mx,mx->m", along, along)
        away = arm - np.clip(share, 0, 1)[:, None] * along
        best = np.minimum(best, np.linalg.norm(away, axis=1))
        over &= np.einsum("mx,mx->m", np.cross(along, arm), normal) >= 0
    height = np.abs(np.einsum("mx,mx->m", point - corner[:, 0], normal))
    return np.where(over, height, best)
