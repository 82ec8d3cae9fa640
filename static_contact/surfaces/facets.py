"""A contact side as a surface: faces of a mesh, and the flat triangles (facets) that they are cut
into.

Curved and four-sided faces are cut through all their nodes [Puso and Laursen 2004, sec. 4]; what is
integrated on the facets is evaluated on the faces themselves, onto which their points are
projected.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tipdamp.modal.faces import face_corners, face_places, face_shapes
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.settings import DEFAULT

_WHOLE = [(0, 1, 2)]  # a straight triangle; places of nodes as `face_places` has them
_QUARTERS = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
# of straight and of curved four-sided faces, around the centre
_RIM = ((0, 1, 2, 3), (0, 4, 1, 5, 2, 6, 3, 7))


class Surface(NamedTuple):
    """Faces of a mesh: [(f, k) node indices], the corners first, counter-clockwise seen from
    outside."""

    mesh: Mesh
    faces: list[np.ndarray]


@dataclass(frozen=True)
class Facets:
    """t triangles of the faces of one kind.

    faces : (f, k) int - node indices of the faces; place : (f, k, 3) m
    face : (t,) int - the face that each facet is cut from; reference : (t, 3, 2) its corners on it
    corner : (t, 3, 3) m; normal : (t, 3) outward; area : (t,) m2
    """

    faces: np.ndarray
    place: np.ndarray
    face: np.ndarray
    reference: np.ndarray
    corner: np.ndarray
    normal: np.ndarray
    area: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """(t, 3) m."""
        return self.corner.mean(axis=1)

    @property
    def radius(self) -> np.ndarray:
        """(t,) m: largest distance of a corner from the centre."""
        return np.linalg.norm(self.corner - self.centre[:, None], axis=2).max(axis=1)

    @property
    def size(self) -> np.ndarray:
        """(f,) m: largest distance of a node of a face from its first corner."""
        return np.linalg.norm(self.place - self.place[:, :1], axis=2).max(axis=1)


def facets(surface: Surface) -> list[Facets]:
    """The facets of a surface, one record for each number k of nodes of a face."""
    mesh, blocks = surface
    kinds = sorted({block.shape[1] for block in blocks if len(block)})
    return [
        _cut(mesh.position, np.concatenate([b for b in blocks if b.shape[1] == k])) for k in kinds
    ]


def _cut(position: np.ndarray, faces: np.ndarray) -> Facets:
    place, k = position[faces], faces.shape[1]
    corners = face_corners(k)
    curved = bulge(place) > DEFAULT.straight
    cuts = [(np.flatnonzero(curved == bent), _cuts(corners, bent)) for bent in (False, True)]
    face = np.concatenate([np.repeat(mine, len(cut)) for mine, cut in cuts])
    reference = np.concatenate([np.tile(cut, (len(mine), 1, 1)) for mine, cut in cuts])
    shape = face_shapes(k, reference.reshape(-1, 2))[0].reshape(len(face), 3, k)
    corner = np.einsum("tck,tkx->tcx", shape, place[face])
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    twice = np.linalg.norm(across, axis=1)
    return Facets(
        faces,
        place,
        face,
        reference,
        corner,
        across / np.maximum(twice, 1e-300)[:, None],
        twice / 2,
    )


def bulge(place: np.ndarray) -> np.ndarray:
    """(f,): how far the nodes (f, k, 3) of faces are off those of a face with the same corners and
    straight edges, of its size."""
    k = place.shape[1]
    corners = face_corners(k)
    straight = np.einsum("kc,fcx->fkx", face_shapes(corners, face_places(k))[0], place[:, :corners])
    size = np.linalg.norm(place - place[:, :1], axis=2).max(axis=1)
    return np.linalg.norm(place - straight, axis=2).max(axis=1) / np.maximum(size, 1e-300)


def _cuts(corners: int, curved: bool) -> np.ndarray:
    """(n, 3, 2) reference coordinates of the triangles that a face is cut into."""
    if corners == 3:
        return face_places(6)[np.array(_QUARTERS if curved else _WHOLE)]
    rim = face_places(9)[list(_RIM[curved])]
    return np.stack([rim, np.roll(rim, -1, axis=0), np.zeros_like(rim)], axis=1)


def vertex_shapes(corners: int, points: np.ndarray) -> np.ndarray:
    """(m, corners): the functions of the corners, linear on triangles and bilinear on squares."""
    return face_shapes(corners, points)[0]


def barycentric(triangle: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(m, 3) of points (m, 2) in triangles (m, 3, 2)."""
    a, b = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    p = points - triangle[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    second = (p[:, 0] * b[:, 1] - p[:, 1] * b[:, 0]) / area
    third = (a[:, 0] * p[:, 1] - a[:, 1] * p[:, 0]) / area
    return np.column_stack([1 - second - third, second, third])
