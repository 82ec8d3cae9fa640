"""Integrals over the overlap of two surfaces: for each corner of the damper's faces, the weighted mean motions there.

    area_A = int psi_A dA,    u_A = int psi_A u dA / area_A        on the blade and on the damper

psi_A are the functions of the corners of the damper's faces, linear on triangles and bilinear on squares: positive, so
that areas are, on quadratic faces too, and of sum 1, so that a uniform pressure p on the points is p on both surfaces:
sum_A p area_A N_Ai = int p N_i dA.                   [Puso and Laursen 2004; Puso, Laursen and Solberg 2008, sec. 3]
Each facet of the damper is a plane onto which the blade's facets are projected and clipped; at the quadrature points
of the pieces both faces are met along the facet's normal, so that forces and moments of both sides are in balance.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from hbm.errors import InputError
from modal.faces import face_corners, face_places, face_shapes, triangle_rule
from modal.mesh import Mesh
from static_contact.surfaces.clip import areas, intersections
from static_contact.surfaces.facets import Facets, barycentric, facets, vertex_shapes
from static_contact.surfaces.search import candidates
from static_contact.surfaces.settings import DEFAULT, SurfaceSettings


@dataclass(frozen=True)
class Overlap:
    """n contact points, those corners of the damper's faces around which the surfaces overlap.

    vertex : (n,) int - node index in the damper's mesh; area : (n,) m2
    damper, blade : (n, nodes) CSR - weights of the nodes of either mesh, rows of sum 1
    normal : (n, 3) - from the damper into the blade, that of the damper's faces at the corner
    gap : (n,) m - mean, negative: overlapping
    opposed : (n,) degrees - mean normals of damper and blade off opposition; least : (n,) m - smallest gap
    covered : share of the damper's facets that the blade covers
    doubled : (c, 3) m - centres of facets that lie opposite to two blade faces at once
    """

    vertex: np.ndarray
    area: np.ndarray
    damper: sp.csr_matrix
    blade: sp.csr_matrix
    normal: np.ndarray
    gap: np.ndarray
    opposed: np.ndarray
    least: np.ndarray
    covered: float
    doubled: np.ndarray


@dataclass(frozen=True)
class _Points:
    """m quadrature points; shapes (m, nodes) of the corners and of the nodes of both meshes."""

    weight: np.ndarray
    corners: sp.csr_matrix
    damper: sp.csr_matrix
    blade: sp.csr_matrix
    normal: np.ndarray
    opposite: np.ndarray
    gap: np.ndarray


def overlap(damper: Mesh, damper_faces: list[np.ndarray], blade: Mesh, blade_faces: list[np.ndarray], reach: float,
            settings: SurfaceSettings = DEFAULT) -> Overlap:
    """The contact points of two surfaces, faces (f, k) of two meshes; gaps above `reach` m are no contact."""
    mine, theirs = facets(damper, damper_faces, settings), facets(blade, blade_faces, settings)
    corners, sums = len(damper.node), _Sums(len(damper.node), len(blade.node))
    doubled, total, covered = [], 0.0, 0.0
    for D in mine:
        cover = np.zeros(len(D.area))
        for B in theirs:
            for points, pair, area in _pieces(D, B, len(blade.node), corners, reach, settings):
                sums.add(points)
                np.add.at(cover, pair, area)
        doubled.append(D.centre[cover > settings.doubled * D.area])
        total, covered = total + D.area.sum(), covered + np.minimum(cover, D.area).sum()
    return sums.points(_corners(mine, corners), settings.dropped, covered / total if total else 0.0,
                       np.concatenate(doubled) if doubled else np.empty((0, 3)))


class _Sums:
    """Integrals over the pieces so far."""

    def __init__(self, damper, blade):
        self.area, self.gap, self.normal, self.opposite = (np.zeros(shape) for shape in (
            damper, damper, (damper, 3), (damper, 3)))
        self.least = np.full(damper, np.inf)
        self.damper, self.blade = sp.csr_matrix((damper, damper)), sp.csr_matrix((damper, blade))

    def add(self, points):
        weighted = (sp.diags(points.weight) @ points.corners).T.tocsr()
        self.area += np.asarray(weighted.sum(axis=1)).ravel()
        self.normal += weighted @ points.normal
        self.opposite += weighted @ points.opposite
        self.gap += weighted @ points.gap
        self.damper, self.blade = self.damper + weighted @ points.damper, self.blade + weighted @ points.blade
        near = points.corners.tocoo()
        np.minimum.at(self.least, near.col, points.gap[near.row])

    def points(self, corners, dropped, covered, doubled) -> Overlap:
        whole, outward = corners
        vertex = np.flatnonzero(self.area > dropped * whole)
        area = self.area[vertex]
        outward, normal, opposite = (mean[vertex] / np.linalg.norm(mean[vertex], axis=1)[:, None]
                                     for mean in (outward, self.normal, self.opposite))
        scale = sp.diags(1 / area)
        angle = np.degrees(np.arccos(np.clip(-np.einsum("nx,nx->n", normal, opposite), -1, 1)))
        return Overlap(vertex, area, _without_zeros(scale @ self.damper[vertex]),
                       _without_zeros(scale @ self.blade[vertex]), outward, self.gap[vertex] / area, angle,
                       self.least[vertex], covered, doubled)


def _without_zeros(matrix):
    matrix = matrix.tocsr()
    matrix.eliminate_zeros()
    return matrix


def _corners(kinds, nodes):
    """Of whole faces, whatever lies opposite: area (nodes,) of each corner, and normal (nodes, 3) there, which
    interpolated is that of a curved side to the second order; a mean over the area would be to the first."""
    area, normal = np.zeros(nodes), np.zeros((nodes, 3))
    for D in kinds:
        corners, k = face_corners(D.faces.shape[1]), D.faces.shape[1]
        mean = vertex_shapes(corners, D.reference.reshape(-1, 2)).reshape(-1, 3, corners).mean(axis=1)
        np.add.at(area, D.faces[D.face, :corners], D.area[:, None] * mean)
        slope = face_shapes(k, face_places(k)[:corners])[1]
        tangent = np.einsum("crk,fkx->rfcx", slope, D.place)
        np.add.at(normal, D.faces[:, :corners], np.cross(*tangent))
    return area, normal


def _pieces(D, B, nodes, corners, reach, settings):
    """_Points of the overlap of the facets D of the damper with B of the blade; and of the pieces, the facet of the
    damper (s,) and the area (s,)."""
    i, j = candidates(D, B, reach, settings)
    rule = triangle_rule(3 if face_corners(D.faces.shape[1]) == face_corners(B.faces.shape[1]) == 3 else 4)
    for start in range(0, len(i), settings.block):
        block = slice(start, start + settings.block)
        found = _integrate(D, B, i[block], j[block], rule, settings)
        if found is not None:
            yield _within(*found, D, B, (corners, nodes), reach)


def _within(pair, weight, on_damper, on_blade, D, B, nodes, reach):
    """The points whose gap is small enough, and the covered areas."""
    (i, j), q = pair, len(weight) // len(pair[0])
    gap = np.einsum("mx,mx->m", on_blade.place - on_damper.place, np.repeat(D.normal[i], q, axis=0))
    near = np.abs(gap) <= reach
    per_piece = np.add.reduceat(weight * near, np.arange(0, len(weight), q))
    face_d, face_b = np.repeat(D.faces[D.face[i]], q, axis=0)[near], np.repeat(B.faces[B.face[j]], q, axis=0)[near]
    corners = face_corners(D.faces.shape[1])
    psi = vertex_shapes(corners, on_damper.reference[near])
    points = _Points((weight / on_damper.slant)[near], _rows(psi, face_d[:, :corners], nodes[0]),
                     _rows(on_damper.shape[near], face_d, nodes[0]), _rows(on_blade.shape[near], face_b, nodes[1]),
                     on_damper.normal[near], on_blade.normal[near],
                     gap[near])
    return points, i, per_piece


def _rows(values, columns, size):
    """CSR with the values (m, k) in the columns (m, k)."""
    m, k = values.shape
    return sp.csr_matrix((values.ravel(), columns.ravel(), np.arange(0, m * k + 1, k)), shape=(m, size))


def _integrate(D, B, i, j, rule, settings):
    """Quadrature points of the pieces of pairs of facets, q a piece in turn: (facet of D, of B) of each piece, weights
    (m,) m2, the points on both faces; None where no two facets overlap."""
    origin, axes = D.corner[i, 0], _axes(D.normal[i])
    mine = np.einsum("mcx,max->mca", D.corner[i] - origin[:, None], axes)
    theirs = np.einsum("mcx,max->mca", B.corner[j] - origin[:, None], axes)
    turned = theirs[:, ::-1]                               # the blade's facets face the other way
    piece, pair = intersections(turned, mine)
    area = areas(piece)
    solid = area > settings.sliver * D.area[i[pair]]
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
    faces = [_Landed.on(F, F.face[k[rows]], np.einsum("mc,mcr->mr", barycentric(flat[rows], at), F.reference[k[rows]]),
                        place, axes[rows], settings) for F, k, flat in ((D, i, mine), (B, j, theirs))]
    return (i[pair], j[pair]), weight, *faces


@dataclass(frozen=True)
class _Landed:
    """m points on faces: reference (m, 2), shape (m, k) functions, place (m, 3) m, normal (m, 3), slant (m,) - cosine
    of the normal to the direction of projection."""

    reference: np.ndarray
    shape: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    slant: np.ndarray

    @classmethod
    def on(cls, F: Facets, face: np.ndarray, start: np.ndarray, place: np.ndarray, axes: np.ndarray,
           settings: SurfaceSettings) -> "_Landed":
        """Where the lines through `place` (m, 3), normal to axes (m, 2, 3), meet the faces: Newton's method from the
        reference coordinates `start`. InputError where a face is so distorted that they do not."""
        xi, k, left = start.copy(), F.faces.shape[1], np.arange(len(face))
        limit = settings.landed * F.size
        for _ in range(settings.steps):
            shape, slope = face_shapes(k, xi[left])
            off = np.einsum("mk,mkx->mx", shape, F.place[face[left]]) - place[left]
            flat = np.einsum("mx,max->ma", off, axes[left])
            far = np.abs(flat).max(axis=1) > limit[face[left]]
            left, flat, slope = left[far], flat[far], slope[far]
            if not len(left):
                break
            J = np.einsum("mrx,max->mar", np.einsum("mrk,mkx->mrx", slope, F.place[face[left]]), axes[left])
            det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
            xi[left] -= np.column_stack([J[:, 1, 1] * flat[:, 0] - J[:, 0, 1] * flat[:, 1],
                                         J[:, 0, 0] * flat[:, 1] - J[:, 1, 0] * flat[:, 0]]) / det[:, None]
        else:
            at = np.round(place[left[0]], 6).tolist()
            raise InputError(f"a face near {at} m is so distorted that points near it have no place on it; refine the "
                             "mesh there")
        shape, slope = face_shapes(k, xi)
        normal = np.cross(*np.einsum("mrk,mkx->rmx", slope, F.place[face]))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return cls(xi, shape, np.einsum("mk,mkx->mx", shape, F.place[face]), normal,
                   np.abs(np.einsum("mx,mx->m", normal, np.cross(axes[:, 0], axes[:, 1]))))


def _axes(normal):
    """(m, 2, 3): two axes of the planes with the normals (m, 3), so that axis 1 x axis 2 is the normal."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = np.cross(normal, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normal, first)], axis=1)
