"""The overlap of two surfaces: pieces of facets that lie opposite to each other, and the contact
points on them.

Each facet of the damper is a plane onto which the blade's facets are projected and clipped [Puso
and Laursen 2004]; at the quadrature points of the pieces both faces are met along the facet's
normal, so that the forces and moments of both sides are in balance, whatever is integrated
(weights.py). Which facets may overlap, near each other and facing each other, is found by trees.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

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
    mine, theirs = [], []
    for level in np.unique(octave):
        group = np.flatnonzero(octave == level)
        tree = cKDTree(other.centre[group])
        found = tree.query_ball_point(one.centre, one.radius + other.radius[group].max() + gap)
        length = np.array([len(f) for f in found])
        mine.append(np.repeat(np.arange(len(one.centre)), length))
        theirs.append(group[np.concatenate([np.asarray(f, dtype=np.int64) for f in found])])
    i, j = np.concatenate(mine), np.concatenate(theirs)
    opposed = np.einsum("ij,ij->i", one.normal[i], other.normal[j]) < -np.cos(
        np.radians(DEFAULT.facing)
    )
    order = np.lexsort((j[opposed], i[opposed]))
    return i[opposed][order], j[opposed][order]


def reach_of(damper: Mesh, reach: float = DEFAULT.reach) -> float:
    """m: a wider gap is no contact; reach - of the damper's size."""
    return reach * float(np.ptp(damper.position, axis=0).max())


def overlap(damper: Surface, blade: Surface, reach: float = DEFAULT.reach) -> Overlap:
    """The contact points of two surfaces; reach - as of `reach_of`."""
    mine = facets(damper)
    theirs = facets(blade)
    reach = reach_of(damper.mesh, reach)
    local = Corners.of(mine)
    sums = Sums(local.first[-1], len(damper.mesh.node), len(blade.mesh.node))
    doubled = [np.empty((0, 3))]
    layers = [np.empty((0, 2))]
    total = 0.0
    covered = 0.0
    its, others = (smooth_normals([(F.faces, F.place) for F in kinds]) for kinds in (mine, theirs))
    for D, normals, first in zip(mine, its, local.first, strict=False):
        cover = np.zeros(len(D.area))
        gaps = np.tile([np.inf, -np.inf], (len(D.area), 1))
        for B, opposite in zip(theirs, others, strict=True):
            for points, pair, area, gap in _pieces(
                (D, B),
                (normals, opposite),
                (first, *sums.damper.shape, len(blade.mesh.node)),
                reach,
            ):
                sums.add(points)
                np.add.at(cover, pair, area)
                np.minimum.at(gaps[:, 0], pair[area > 0], gap[area > 0])
                np.maximum.at(gaps[:, 1], pair[area > 0], gap[area > 0])
        twice = cover > DEFAULT.doubled * D.area
        doubled.append(D.centre[twice])
        layers.append(gaps[twice])
        total, covered = total + D.area.sum(), covered + np.minimum(cover, D.area).sum()
    return replace(
        sums.points(mine, local, damper.mesh.position, blade.mesh.position),
        covered=covered / total if total else 0.0,
        doubled=np.concatenate(doubled),
        layers=np.concatenate(layers),
    )


def _pieces(
    both: tuple[Facets, Facets],
    smooth: tuple[np.ndarray, np.ndarray],
    sizes: tuple[int, int, int, int],
    reach: float,
) -> Iterator[tuple[QuadraturePoints, np.ndarray, np.ndarray, np.ndarray]]:
    """QuadraturePoints of the overlap of both, facets D of the damper and B of the blade; and of
    the pieces the facet of the damper, area and mean gap (s,). smooth - the normals at the nodes of
    their faces; sizes - first of the Corners of D, their number, nodes of both."""
    D, B = both
    i, j = candidates(D, B, reach)
    rule = triangle_rule(
        3 if face_corners(D.faces.shape[1]) == face_corners(B.faces.shape[1]) == 3 else 4
    )
    for start in range(0, len(i), DEFAULT.block):
        block = slice(start, start + DEFAULT.block)
        found = _integrate(D, B, i[block], j[block], rule)
        if found is not None:
            yield _within(found, both, smooth, sizes, reach)


def _within(
    found: "tuple[tuple[np.ndarray, np.ndarray], np.ndarray, _Landed, _Landed]",
    both: tuple[Facets, Facets],
    smooth: tuple[np.ndarray, np.ndarray],
    sizes: tuple[int, int, int, int],
    reach: float,
) -> tuple[QuadraturePoints, np.ndarray, np.ndarray, np.ndarray]:
    """The points found by `_integrate` whose gap is small enough, the covered areas and gaps."""
    ((i, j), weight, on_damper, on_blade), (D, B) = found, both
    q = len(weight) // len(i)
    gap = np.einsum("mx,mx->m", on_blade.place - on_damper.place, np.repeat(D.normal[i], q, axis=0))
    near = np.abs(gap) <= reach
    per_piece = np.add.reduceat(weight * near, np.arange(0, len(weight), q))
    face, other = np.repeat(D.face[i], q)[near], np.repeat(B.face[j], q)[near]
    first, corners, damper, blade = sizes
    width = face_corners(D.faces.shape[1])
    own = first + width * face[:, None] + np.arange(width)
    psi = vertex_shapes(width, on_damper.reference[near])
    normal, high = bulge(on_damper.shape[near], D.place[face], smooth[0][face])
    beyond, higher = bulge(on_blade.shape[near], B.place[other], smooth[1][other])
    arm = np.column_stack(
        [
            arms(on_damper.shape[near], D.place[face], smooth[0][face]),
            arms(on_blade.shape[near], B.place[other], smooth[1][other]),
        ]
    )
    apart = np.einsum(
        "mx,mx->m", on_blade.place[near] - on_damper.place[near], normal
    ) / np.linalg.norm(normal, axis=1)
    points = QuadraturePoints(
        (weight / on_damper.slant)[near],
        _rows(psi, own, corners),
        _rows(on_damper.shape[near], D.faces[face], damper),
        _rows(on_blade.shape[near], B.faces[other], blade),
        on_damper.normal[near],
        on_blade.normal[near],
        normal,
        beyond,
        arm,
        apart - high - higher,
    )
    return points, i, per_piece, gap.reshape(-1, q).mean(axis=1)


def _rows(values: np.ndarray, columns: np.ndarray, size: int) -> sp.spmatrix:
    """CSR with the values (m, k) in the columns (m, k)."""
    m, k = values.shape
    return sp.csr_matrix(
        (values.ravel(), columns.ravel(), np.arange(0, m * k + 1, k)), shape=(m, size)
    )


def _integrate(
    D: Facets, B: Facets, i: np.ndarray, j: np.ndarray, rule: tuple[np.ndarray, np.ndarray]
) -> "tuple[tuple[np.ndarray, np.ndarray], np.ndarray, _Landed, _Landed] | None":
    """Quadrature points of the pieces of pairs of facets, q a piece in turn: (facet of D, of B) of
    each piece, weights (m,) m2, the points on both faces; None where no two facets overlap."""
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
    return (i[pair], j[pair]), weight, *faces


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
        """Where the lines through `place` (m, 3), normal to axes (m, 2, 3), meet the faces:
        Newton's method from the reference coordinates `start`. InputError where a face is so
        distorted that they do not."""
        xi, k, left = start.copy(), F.faces.shape[1], np.arange(len(face))
        limit = DEFAULT.landed * F.size
        for _ in range(DEFAULT.steps):
            shape, slope = face_shapes(k, xi[left])
            off = np.einsum("mk,mkx->mx", shape, F.place[face[left]]) - place[left]
            flat = np.einsum("mx,max->ma", off, axes[left])
            far = np.abs(flat).max(axis=1) > limit[face[left]]
            left, flat, slope = left[far], flat[far], slope[far]
            if not len(left):
                break
            J = np.einsum(
                "mrx,max->mar", np.einsum("mrk,mkx->mrx", slope, F.place[face[left]]), axes[left]
            )
            xi[left] -= _solved_in_plane(J, flat)
        else:
            at = np.round(place[left[0]], 6).tolist()
            raise InputError(
                f"a face near {at} m is so distorted that points near it have no place on it; "
                "refine the mesh there"
            )
        shape, slope = face_shapes(k, xi)
        normal = np.cross(*np.einsum("mrk,mkx->rmx", slope, F.place[face]))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return cls(
            xi,
            shape,
            np.einsum("mk,mkx->mx", shape, F.place[face]),
            normal,
            np.abs(np.einsum("mx,mx->m", normal, np.cross(axes[:, 0], axes[:, 1]))),
        )
