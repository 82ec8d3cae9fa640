"""Contact points from the integrals over the pieces of an overlap.

    area_A = int psi_A dA,    u_A = int w_A u dA / area_A        on the blade and on the damper

psi_A are the functions of the corners of the damper's faces, linear on triangles and bilinear on
squares: positive, so that areas are, on quadratic faces too, and of sum 1, so that a uniform
pressure p on the points is p on both surfaces: sum_A p area_A N_Ai = int p N_i dA.
[Puso and Laursen 2004; Puso, Laursen and Solberg 2008, sec. 3]

With w_A = psi_A a motion is read at the centre of the area of a corner, with the dual functions of
the psi_A [Wohlmuth 2000] at the corner itself. int x^2 dA, by which a flank resists rolling, comes
out too small in one case and too large in the other, by the same amount: w_A is the mean of both,
and where surfaces part from each other such that it reads at the corner (lines.py).
On each face, with M = int psi psi' dA over what is covered of it and D = diag int psi dA, that is w
= (I + D M^-1) psi / 2, again of sum 1 and with the integrals area_A. Of a face that is covered in
part less of the second is taken, so that places stay in the part that is covered; second moments do
not lose by it, since on each face the sum of area_A u_A is that of the corners whatever the share.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tipdamp.modal.faces import face_corners
from tipdamp.static_contact.surfaces.facets import Facets, vertex_shapes
from tipdamp.static_contact.surfaces.lines import FaceCorners, changes, least_changes
from tipdamp.static_contact.surfaces.normals import above, unit
from tipdamp.static_contact.surfaces.records import Overlap, QuadraturePoints
from tipdamp.static_contact.surfaces.settings import DEFAULT


@dataclass(frozen=True)
class Corners:
    """The n corners of every face for themselves.

    first : (kinds + 1,) - where those of each kind of faces begin, and n; width - corners of a face
    of each kind
    vertex : (n,) - node index of each
    """

    first: np.ndarray
    width: tuple[int, ...]
    vertex: np.ndarray

    @classmethod
    def of(cls, kinds: list[Facets]) -> "Corners":
        """Of the faces that the facets are cut from."""
        width = tuple(face_corners(D.faces.shape[1]) for D in kinds)
        return cls(
            np.cumsum([0, *(len(D.faces) * w for D, w in zip(kinds, width, strict=True))]),
            width,
            np.concatenate(
                [
                    np.empty(0, int),
                    *(D.faces[:, :w].ravel() for D, w in zip(kinds, width, strict=True)),
                ]
            ),
        )

    @property
    def kinds(self) -> Iterator[tuple[int, slice]]:
        """Width and place of each kind."""
        for w, start, end in zip(self.width, self.first[:-1], self.first[1:], strict=True):
            yield w, slice(start, end)

    def owners(self, kept: np.ndarray, area: np.ndarray) -> np.ndarray:
        """(n,) the vertex whose point takes what is covered of each corner: its own where that is
        kept (nodes,) bool, or else the one most covered, area (n,) m2, of the face."""
        found = self.vertex.copy()
        for w, mine in self.kinds:
            vertex, share = (one[mine].reshape(-1, w) for one in (self.vertex, area))
            most = np.take_along_axis(vertex, share.argmax(axis=1)[:, None], axis=1)
            found[mine] = np.where(kept[vertex], vertex, most).ravel()
        return found

    def weights(self, mass: sp.csr_matrix, most: np.ndarray) -> sp.csr_matrix:
        """(n, n): the functions w in the psi, I + shift (D M^-1 - I) on each face; mass (n, n) - M
        of all faces; most (n,) - largest psi where the face is covered, beyond which none is read
        at its place."""
        found = []
        for w, mine in self.kinds:
            block = mass[mine, mine].tobsr((w, w))
            data = _shifted(block.data, most[mine].reshape(-1, w)[block.indices])
            found.append(sp.bsr_matrix((data, block.indices, block.indptr), shape=block.shape))
        return sp.block_diag(found, format="csr")


def _shifted(mass: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """(f, w, w): I + shift (D M^-1 - I) of faces of one kind with masses (f, w, w) and the largest
    psi where they are covered, (f, w)."""
    one = np.eye(mass.shape[1])
    good = np.linalg.cond(mass) < DEFAULT.conditioned
    M = np.where(good[:, None, None], mass, one)
    own = M.sum(axis=2)
    dual = own[:, :, None] * np.linalg.inv(M)
    mean = np.einsum("faa->fa", M) / own
    within = ((covered - mean) / np.maximum(1 - mean, DEFAULT.dropped)).min(axis=1, initial=1.0)
    # 0.5: halfway at most
    shift = (DEFAULT.shift * np.clip(within / 0.5, 0, 1) * good)[:, None, None]
    return (1 - shift) * one + shift * dual


class Sums:
    """Integrals over the pieces so far, on so many corners and on the nodes of damper and blade."""

    def __init__(self, corners: int, damper: int, blade: int) -> None:
        self.area, self.arm = np.zeros(corners), np.zeros((corners, 2))
        self.normal, self.opposite, self.smooth, self.beyond = np.zeros((4, corners, 3))
        self.least, self.most = np.full(corners, np.inf), np.zeros(corners)
        self.mass, self.damper, self.blade = (
            sp.csr_matrix((corners, columns)) for columns in (corners, damper, blade)
        )

    def add(self, points: QuadraturePoints) -> None:
        """Points of further pieces."""
        weighted = (sp.diags(points.weight) @ points.corners).T.tocsr()
        self.area += np.asarray(weighted.sum(axis=1)).ravel()
        self.mass = self.mass + weighted @ points.corners
        self.normal += weighted @ points.normal
        self.opposite += weighted @ points.opposite
        self.smooth += weighted @ points.smooth
        self.beyond += weighted @ points.beyond
        self.arm += weighted @ points.arm
        self.damper = self.damper + weighted @ points.damper
        self.blade = self.blade + weighted @ points.blade
        near = points.corners.tocoo()
        np.minimum.at(self.least, near.col, points.gap[near.row])
        np.maximum.at(self.most, near.col, near.data)

    def points(
        self, kinds: list[Facets], corners: Corners, damper: np.ndarray, blade: np.ndarray
    ) -> Overlap:
        """The contact points; how much of the faces is covered, and what twice, is left open.
        damper, blade (nodes, 3) m - places of the nodes."""
        vertex, gather = self._gathered(
            corners, DEFAULT.dropped * whole_corners(kinds, len(damper))
        )
        area, least = gather @ self.area, np.full(len(damper), np.inf)
        mean = sp.diags(1 / area) @ self._read(corners, gather, damper)
        np.minimum.at(least, corners.vertex, self.least)
        normal, opposite = gather @ self.normal, gather @ self.opposite
        smooth, beyond = (unit(mean @ one) for one in (self.smooth, self.beyond))
        cosine = (
            np.einsum("nx,nx->n", normal, opposite)
            / np.linalg.norm(normal, axis=1)
            / np.linalg.norm(opposite, axis=1)
        )
        on_damper, on_blade = _without_zeros(mean @ self.damper), _without_zeros(mean @ self.blade)
        return Overlap(
            vertex,
            area,
            on_damper,
            on_blade,
            smooth,
            smooth + beyond,
            self._gap(mean, on_damper @ damper, on_blade @ blade),
            np.degrees(np.arccos(np.clip(-cosine, -1, 1))),
            least[vertex],
        )

    def _gathered(self, corners: Corners, dropped: np.ndarray) -> tuple[np.ndarray, sp.csr_matrix]:
        """Vertices (points,) of which more than `dropped` (nodes,) m2 is covered, and what of the
        corners of faces belongs to each, (points, n)."""
        n, nodes = len(corners.vertex), len(dropped)
        kept = np.bincount(corners.vertex, self.area, nodes) > dropped
        owner = corners.owners(kept, self.area)
        gather = sp.csr_matrix((np.ones(n), (owner, np.arange(n))), shape=(nodes, n))
        vertex = np.flatnonzero(gather @ self.area > dropped)
        return vertex, gather[vertex]

    def _read(self, corners: Corners, gather: sp.csr_matrix, place: np.ndarray) -> sp.csr_matrix:
        """(points, n) of the n corners of faces: the functions w of each point in the psi, on lines
        of contact moved onto its vertex."""
        weights, found = corners.weights(self.mass, self.most), []
        turned, read = self.smooth + self.beyond, self.damper @ place
        normal = gather.T @ unit(gather @ self.smooth)
        normal[~normal.any(axis=1)] = [0, 0, 1]  # what belongs to no point
        moves, off = np.zeros((2, *turned.shape))
        by_corner = turned, read, place[corners.vertex], normal
        for w, mine in corners.kinds:
            M, W = (one[mine, mine].tobsr((w, w)) for one in (self.mass, weights))
            there = M.indices
            own = (one[mine].reshape(-1, w, 3)[there] for one in by_corner)
            change, *both = changes(FaceCorners(M.data, W.data, *own))
            for one, its in zip((moves, off), both, strict=True):
                one[mine].reshape(-1, w, 3)[there] = its
            found.append(sp.bsr_matrix((change, there, M.indptr), shape=M.shape))
        share = least_changes(gather, normal, moves, off)
        return gather @ (weights + sp.diags(share) @ sp.block_diag(found, format="csr"))

    def _gap(self, mean: sp.csr_matrix, damper: np.ndarray, blade: np.ndarray) -> np.ndarray:
        """(points,) m between the smooth surfaces at the places (points, 3) m that are read on
        either body, as normals.bulge has it: so that it is that of the place, like the normal."""
        n, beyond = mean @ self.smooth, mean @ self.beyond
        apart = np.einsum("nx,nx->n", blade - damper, n) / np.linalg.norm(n, axis=1)
        mine, theirs = (mean @ self.arm).T
        return apart - above(mine, damper, n) - above(theirs, blade, beyond)


def _without_zeros(matrix: sp.spmatrix) -> sp.spmatrix:
    matrix = matrix.tocsr()
    matrix.eliminate_zeros()
    return matrix


def whole_corners(kinds: Sequence[Facets], nodes: int) -> np.ndarray:
    """(nodes,) m2: area of each corner of whole faces, whatever lies opposite."""
    area = np.zeros(nodes)
    for D in kinds:
        corners = face_corners(D.faces.shape[1])
        mean = (
            vertex_shapes(corners, D.reference.reshape(-1, 2)).reshape(-1, 3, corners).mean(axis=1)
        )
        np.add.at(area, D.faces[D.face, :corners], D.area[:, None] * mean)
    return area
