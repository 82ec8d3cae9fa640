"""The overlap of two surfaces: pieces of facets that lie opposite to each other, and the contact
points on them.

Each facet of the damper is a plane onto which the blade's facets are projected and clipped [Puso
and Laursen 2004]; at the quadrature points of the pieces both faces are met along the facet's
normal, so that the forces and moments of both sides are in balance, whatever is integrated
(weights.py). Which facets may overlap, near each other and facing each other, is found by trees.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from tipdamp.hbm.errors import InputError
from tipdamp.modal.faces import face_corners, face_shapes, triangle_rule
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.clip import areas, intersections
from tipdamp.static_contact.surfaces.facets import (
    Facets,
    Surface,
    barycentric,
    facets,
    vertex_shapes,
)
from tipdamp.static_contact.surfaces.normals import arms, bulge, smooth_normals, tangents
from tipdamp.static_contact.surfaces.records import Overlap, QuadraturePoints
from tipdamp.static_contact.surfaces.settings import DEFAULT
from tipdamp.static_contact.surfaces.weights import Corners, Sums


def candidates(one: Facets, other: Facets, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices of facets of both, pair by pair: their spheres meet along the gap, which is at most
    `reach` m, and their normals oppose each other. The facets of the other surface are sorted by
    size, so that one large face among small ones does not make all of them neighbours."""
    gap = np.minimum(cKDTree(other.centre).query(one.centre)[0], reach)
    octave = np.floor(np.log2(other.radius)).astype(int)
    groups = (np.flatnonzero(octave == level) for level in np.unique(octave))
    found = [_near(one, other, group, gap) for group in groups]
    i, j = (np.concatenate(part) for part in zip(*found, strict=True))
    cosine = np.einsum("ij,ij->i", one.normal[i], other.normal[j])
    opposed = cosine < -np.cos(np.radians(DEFAULT.facing))
    i, j = i[opposed], j[opposed]
    order = np.lexsort((j, i))
    return i[order], j[order]


def _near(
    one: Facets, other: Facets, group: np.ndarray, gap: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """As `candidates`, with those of a group of the other's, whatever their normals; gap (t,) m."""
    tree = cKDTree(other.centre[group])
    found = tree.query_ball_point(one.centre, one.radius + other.radius[group].max() + gap)
    mine = np.repeat(np.arange(len(one.centre)), np.array([len(f) for f in found]))
    return mine, group[np.concatenate([np.asarray(f, dtype=np.int64) for f in found])]


def reach_of(damper: Mesh, reach: float = DEFAULT.reach) -> float:
    """m: a wider gap is no contact; reach - of the damper's size."""
    return reach * float(np.ptp(damper.position, axis=0).max())


def overlap(damper: Surface, blade: Surface, reach: float = DEFAULT.reach) -> Overlap:
    """The contact points of two surfaces; reach - as of `reach_of`."""
    mine, theirs = _Smooth.of(damper), _Smooth.of(blade)
    kinds = [one.facets for one in mine]
    corners = Corners.of(kinds)
    sums = Sums(corners.first[-1], len(damper.mesh.node), len(blade.mesh.node))
    covers = []
    gap = reach_of(damper.mesh, reach)
    for one, first in zip(mine, corners.first, strict=False):
        covers.append(_Cover(one.facets))
        for other in theirs:
            for points, *pieces in _pieces(one, other, (first, corners.first[-1]), gap):
                sums.add(points)
                covers[-1].add(*pieces)
    return _with_covers(
        sums.points(kinds, corners, damper.mesh.position, blade.mesh.position), covers
    )


def _with_covers(points: Overlap, covers: "list[_Cover]") -> Overlap:
    """The contact points with how much is covered, and what twice."""
    whole = sum((one.facets.area.sum() for one in covers), 0.0)
    met = sum((np.minimum(one.area, one.facets.area).sum() for one in covers), 0.0)
    return replace(
        points,
        covered=met / whole if whole else 0.0,
        doubled=np.concatenate(
            [np.empty((0, 3)), *(one.facets.centre[one.twice] for one in covers)]
        ),
        layers=np.concatenate([np.empty((0, 2)), *(one.gaps[one.twice] for one in covers)]),
    )


class _Cover:
    """What of facets is covered: area (t,) m2, and the smallest and the largest gap, gaps (t, 2)
    m."""

    def __init__(self, facets: Facets) -> None:
        self.facets, self.area = facets, np.zeros(len(facets.area))
        self.gaps = np.tile([np.inf, -np.inf], (len(facets.area), 1))

    def add(self, facet: np.ndarray, area: np.ndarray, gap: np.ndarray) -> None:
        """Pieces (s,) of facets, with their areas and mean gaps."""
        np.add.at(self.area, facet, area)
        met = area > 0
        np.minimum.at(self.gaps[:, 0], facet[met], gap[met])
        np.maximum.at(self.gaps[:, 1], facet[met], gap[met])

    @property
    def twice(self) -> np.ndarray:
        """(t,) bool."""
        return self.area > DEFAULT.doubled * self.facets.area


class _Smooth(NamedTuple):
    """Facets of the faces of one kind, the smooth normals (f, k, 3) at the nodes of these, and the
    number of nodes of the mesh."""

    facets: Facets
    normals: np.ndarray
    nodes: int

    @classmethod
    def of(cls, surface: Surface) -> "list[_Smooth]":
        kinds = facets(surface)
        normals = smooth_normals([(F.faces, F.place) for F in kinds])
        return [cls(F, n, len(surface.mesh.node)) for F, n in zip(kinds, normals, strict=True)]

    def at(
        self, face: np.ndarray, shape: np.ndarray
    ) -> tuple[sp.spmatrix, np.ndarray, np.ndarray, np.ndarray]:
        """At points (m,) on faces with the functions (m, k) of their nodes: these as rows of all
        nodes, normals and height above the face as of `bulge`, and `arms`."""
        F, normals = self.facets, self.normals[face]
        n, high = bulge(shape, F.place[face], normals)
        rows = _rows(shape, F.faces[face], self.nodes)
        return rows, n, high, arms(shape, F.place[face], normals)


def _pieces(
    damper: _Smooth, blade: _Smooth, corners: tuple[int, int], reach: float
) -> Iterator[tuple[QuadraturePoints, np.ndarray, np.ndarray, np.ndarray]]:
    """QuadraturePoints of the overlap of both; and of the pieces the facet of the damper, area and
    mean gap (s,). corners - first of the Corners of the damper's faces, and the number of all."""
    D, B = damper.facets, blade.facets
    i, j = candidates(D, B, reach)
    rule = triangle_rule(
        3 if face_corners(D.faces.shape[1]) == face_corners(B.faces.shape[1]) == 3 else 4
    )
    for start in range(0, len(i), DEFAULT.block):
        block = slice(start, start + DEFAULT.block)
        found = _integrate(D, B, i[block], j[block], rule)
        if found is not None:
            yield _within(found, damper, blade, corners, reach)


def _within(
    found: "_Pieces", damper: _Smooth, blade: _Smooth, corners: tuple[int, int], reach: float
) -> tuple[QuadraturePoints, np.ndarray, np.ndarray, np.ndarray]:
    """The points of pieces whose gap is small enough; facets, covered areas and gaps of these."""
    i, j, weight, on_damper, on_blade = found
    D, B, q = damper.facets, blade.facets, len(weight) // len(i)
    apart = on_blade.place - on_damper.place
    gap = np.einsum("mx,mx->m", apart, np.repeat(D.normal[i], q, axis=0))
    near = np.abs(gap) <= reach
    per_piece = np.add.reduceat(weight * near, np.arange(0, len(weight), q))
    face, other = np.repeat(D.face[i], q)[near], np.repeat(B.face[j], q)[near]
    width = face_corners(D.faces.shape[1])
    first, count = corners
    psi = vertex_shapes(width, on_damper.reference[near])
    mine, normal, high, arm = damper.at(face, on_damper.shape[near])
    theirs, beyond, higher, other_arm = blade.at(other, on_blade.shape[near])
    apart = np.einsum("mx,mx->m", apart[near], normal) / np.linalg.norm(normal, axis=1)
    points = QuadraturePoints(
        (weight / on_damper.slant)[near],
        _rows(psi, first + width * face[:, None] + np.arange(width), count),
        mine,
        theirs,
        on_damper.normal[near],
        on_blade.normal[near],
        normal,
        beyond,
        np.column_stack([arm, other_arm]),
        apart - high - higher,
    )
    return points, i, per_piece, gap.reshape(-1, q).mean(axis=1)


def _rows(values: np.ndarray, columns: np.ndarray, size: int) -> sp.spmatrix:
    """CSR with the values (m, k) in the columns (m, k)."""
    m, k = values.shape
    return sp.csr_matrix(
        (values.ravel(), columns.ravel(), np.arange(0, m * k + 1, k)), shape=(m, size)
    )


class _Pieces(NamedTuple):
    """Pieces (s,) of facets of damper and blade, with q quadrature points a piece in turn: weights
    (m,) m2, and the points on both faces."""

    damper: np.ndarray
    blade: np.ndarray
    weight: np.ndarray
    on_damper: "_Landed"
    on_blade: "_Landed"


def _integrate(
    D: Facets, B: Facets, i: np.ndarray, j: np.ndarray, rule: tuple[np.ndarray, np.ndarray]
) -> _Pieces | None:
    """Of pairs of facets; None where no two overlap."""
    origin, axes = D.corner[i, 0], tangents(D.normal[i])
    mine = np.einsum("mcx,max->mca", D.corner[i] - origin[:, None], axes)
    theirs = np.einsum("mcx,max->mca", B.corner[j] - origin[:, None], axes)
    turned = theirs[:, ::-1]  # the blade's facets face the other way
    piece, pair = intersections(turned, mine)
    area = areas(piece)
    solid = area > DEFAULT.sliver * D.area[i[pair]]
    piece, pair, area = piece[solid], pair[solid], area[solid]
    if not len(pair):
        return None
    points, weights = rule
    shares = np.column_stack([1 - points.sum(axis=1), points])
    at = np.einsum("qc,sca->sqa", shares, piece).reshape(-1, 2)
    weight = (2 * area[:, None] * weights).ravel()
    q = len(weights)
    rows = np.repeat(pair, q)
    place = origin[rows] + np.einsum("ma,max->mx", at, axes[rows])
    faces = [
        _Landed.on(
            F,
            F.face[k[rows]],
            np.einsum("mc,mcr->mr", barycentric(flat[rows], at), F.reference[k[rows]]),
            place,
            axes[rows],
        )
        for F, k, flat in ((D, i, mine), (B, j, theirs))
    ]
    return _Pieces(i[pair], j[pair], weight, *faces)


def _solved_in_plane(J: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(m, 2): J^-1 right of matrices (m, 2, 2), by Cramer's rule."""
    det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    first = J[:, 1, 1] * right[:, 0] - J[:, 0, 1] * right[:, 1]
    second = J[:, 0, 0] * right[:, 1] - J[:, 1, 0] * right[:, 0]
    return np.column_stack([first, second]) / det[:, None]


@dataclass(frozen=True)
class _Landed:
    """m points on faces: reference (m, 2), shape (m, k) functions, place (m, 3) m, normal (m, 3),
    slant (m,) - cosine of the normal to the direction of projection."""

    reference: np.ndarray
    shape: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    slant: np.ndarray

    @classmethod
    def on(
        cls, F: Facets, face: np.ndarray, start: np.ndarray, place: np.ndarray, axes: np.ndarray
    ) -> "_Landed":
        """Where the lines through `place` (m, 3), normal to axes (m, 2, 3), meet the faces, from
        the reference coordinates `start`. InputError where a face is so distorted that they do
        not."""
        xi = _met(F, face, start, place, axes)
        shape, slope = face_shapes(F.faces.shape[1], xi)
        normal = np.cross(*np.einsum("mrk,mkx->rmx", slope, F.place[face]))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return cls(
            xi,
            shape,
            np.einsum("mk,mkx->mx", shape, F.place[face]),
            normal,
            np.abs(np.einsum("mx,mx->m", normal, np.cross(axes[:, 0], axes[:, 1]))),
        )


def _met(
    F: Facets, face: np.ndarray, start: np.ndarray, place: np.ndarray, axes: np.ndarray
) -> np.ndarray:
    """(m, 2) reference coordinates of `_Landed.on`, by Newton's method."""
    xi, k, left = start.copy(), F.faces.shape[1], np.arange(len(face))
    limit = DEFAULT.landed * F.size
    for _ in range(DEFAULT.steps):
        shape, slope = face_shapes(k, xi[left])
        off = np.einsum("mk,mkx->mx", shape, F.place[face[left]]) - place[left]
        flat = np.einsum("mx,max->ma", off, axes[left])
        far = np.abs(flat).max(axis=1) > limit[face[left]]
        left, flat, slope = left[far], flat[far], slope[far]
        if not len(left):
            return xi
        slope = np.einsum("mrk,mkx->mrx", slope, F.place[face[left]])
        xi[left] -= _solved_in_plane(np.einsum("mrx,max->mar", slope, axes[left]), flat)
    raise InputError(
        f"a face near {np.round(place[left[0]], 6).tolist()} m is so distorted that points near it "
        "have no place on it; refine the mesh there"
    )
