"""Contact candidates: where faces of the damper lie near faces of the blades that face them, patch
by patch."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from tipdamp.hbm.ties import in_order
from tipdamp.modal.faces import (
    boundary_faces,
    face_corners,
    face_keys,
    face_rule,
    group_faces,
)
from tipdamp.modal.mesh import Mesh, offered
from tipdamp.static_contact.surfaces.facets import Facets, Surface, bulge, facets
from tipdamp.static_contact.surfaces.pick import FacePick


@dataclass(frozen=True)
class ProposalSettings:
    """What counts as a contact candidate."""

    # of the damper's median face size: farther faces do not touch; facets of a curve lie nearer
    near: float = 0.1
    # degrees between neighbouring faces of one patch, beyond it an edge begins: above the 22.5
    bend: float = 25.0
    # of a pin with 16 faces a turn, below the 30 between a flank of 60 degrees and its wall
    # degrees that faces of a patch may be off opposition to those that they meet
    opposed: float = 30.0
    small: float = 0.1  # of the largest patch: smaller ones are rims
    # of the faces of a patch that a group must have: the plane of a side may go on beyond it
    covered: float = 0.6
    larger: float = 4.0  # times as many faces as the patch a group may have
    round: float = 10.0  # degrees that the normals of a flat side may differ, ...
    turn: float = 1.0  # ... and of a side whose normals turn in proportion to the place
    fan: float = 0.1  # of the width: how far from that proportion they may be
    # of a face's size that its middle nodes are off a straight one: normals then turn inside of it,
    # by half a degree and more, and not by the rounding of places in a file
    curved: float = 1e-3
    whole: float = 0.95  # of the faces of a patch: a group with them beats one of a part


SETTINGS = ProposalSettings()


@dataclass(frozen=True)
class Patch:
    """A candidate. damper, blades : (f, 4) keys of the faces, as `faces.face_keys` of the user's
    node numbers
    normal : (3,) mean, out of the damper; spread - degrees of a face from it; box : (2, 3) of its
    nodes, area, and radius where the normals are those of a cylinder, in the units of the mesh"""

    damper: np.ndarray
    blades: np.ndarray
    normal: np.ndarray
    spread: float
    box: np.ndarray
    area: float
    radius: float = np.inf

    @property
    def flat(self) -> bool:
        """Whether the side is flat rather than round."""
        return self.spread <= SETTINGS.round and np.isinf(self.radius)


def reach_of(damper: Mesh) -> float:
    """Distance within which faces count as candidates, in the unit of the mesh."""
    sizes = [f.size for f in facets(Surface(damper, boundary_faces(damper)))]
    return float(SETTINGS.near * np.median(np.concatenate(sizes)))


def contact_patches(damper: Mesh, blades: Mesh, reach: float) -> list[Patch]:
    """Candidates, the largest first."""
    mine = _Faces(damper, FacePick(within=reach).faces(damper, blades))
    theirs = _Faces(blades, FacePick(within=reach).faces(blades, damper))
    if not len(mine.key):
        return []
    label = mine.pieces()
    nearest = cKDTree(mine.centre).query(theirs.centre)[1] if len(theirs.key) else np.empty(0, int)
    opposed = np.einsum("ij,ij->i", theirs.normal, mine.normal[nearest]) < -np.cos(
        np.radians(SETTINGS.opposed)
    )
    met = np.where(opposed, label[nearest], -1)
    found = []
    for i in range(label.max() + 1):
        found.append(_patch(damper, mine, label == i, theirs.key[met == i]))
    largest = max(p.area for p in found)
    found = [p for p in found if p.area > SETTINGS.small * largest and len(p.blades)]
    return [found[i] for i in in_order([-p.area for p in found])]


def within_group(damper: Mesh, patch: Patch, group: str) -> Patch:
    """The part of a patch that a group of the damper has: faces that lie near beside it are none of
    the side."""
    mine = _Faces(damper, group_faces(damper, group))
    return _patch(damper, mine, _among(mine.key, patch.damper), patch.blades)


def as_one(damper: Mesh, patches: list[Patch]) -> Patch:
    """Several patches as one."""
    mine = _Faces(damper, boundary_faces(damper))
    return _patch(
        damper,
        mine,
        _among(mine.key, np.concatenate([p.damper for p in patches])),
        np.unique(np.concatenate([p.blades for p in patches]), axis=0),
    )


def in_one_piece(mesh: Mesh, group: str) -> bool:
    """Whether the faces of a group hang together without a bend."""
    return bool(_Faces(mesh, group_faces(mesh, group)).pieces().max(initial=-1) == 0)


def _patch(damper: Mesh, mine: "_Faces", own: np.ndarray, blades: np.ndarray) -> Patch:
    normal = mine.area[own] @ mine.normal[own]
    normal /= np.linalg.norm(normal)
    spread = np.degrees(np.arccos(np.clip(mine.normal[own] @ normal, -1, 1))).max()
    nodes = damper.position[damper.index(np.setdiff1d(mine.key[own], [-1]))]
    return Patch(
        mine.key[own],
        blades,
        normal,
        float(spread),
        np.array([nodes.min(axis=0), nodes.max(axis=0)]),
        float(mine.area[own].sum()),
        _radius(mine, own, normal),
    )


def _radius(mine: "_Faces", own: np.ndarray, mean: np.ndarray) -> float:
    """Of the cylinder on which the faces lie: what their places differ by over what their normals
    do, along the direction in which these turn; inf where that is no proportion, and of a flat."""
    taken = own[mine.sample_of]
    normal, weight = mine.sample_normal[taken] - mean, mine.sample_area[taken]
    _, _, ways = np.linalg.svd(np.sqrt(weight)[:, None] * normal, full_matrices=False)
    turned, place = normal @ ways[0], mine.sample[taken] @ ways[0]
    turned, place = (v - np.average(v, weights=weight) for v in (turned, place))
    steps = len(np.unique(np.round(turned, 4)))
    if steps < 3 or np.ptp(turned) < 2 * np.sin(np.radians(SETTINGS.turn)):
        return np.inf
    radius = (weight * turned) @ place / ((weight * turned) @ turned)
    off = weight @ (place - radius * turned) ** 2
    return float(radius) if off <= SETTINGS.fan**2 * (weight @ place**2) else np.inf


def _among(keys: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    return np.isin(
        keys.view([("", keys.dtype)] * 4)[:, 0],
        np.ascontiguousarray(wanted).view([("", keys.dtype)] * 4),
    )


def group_of(mesh: Mesh, faces: np.ndarray) -> str:
    """The smallest group that has these faces (f, 4), or else most of them; '' where there is
    none."""
    wanted, found = {tuple(k) for k in faces.tolist()}, {}
    for name in offered(mesh.groups):
        if mesh.dimension.get(name, 0) in (0, 2):
            own = {
                tuple(k)
                for block in group_faces(mesh, name)
                for k in face_keys(mesh.node[block]).tolist()
            }
            if len(own & wanted) >= SETTINGS.covered * len(wanted) and len(
                own
            ) <= SETTINGS.larger * len(wanted):
                part = len(own & wanted) < SETTINGS.whole * len(wanted)
                found[name] = part, len(own)
    return min(found, key=lambda name: found[name], default="")


class _Faces:
    """Faces of a mesh with key, centre, normal and area of each, and samples of their normals:
    points with the face that each lies on, its normal there and its share of the area."""

    def __init__(self, mesh: Mesh, blocks: list[np.ndarray]) -> None:
        parts = facets(Surface(mesh, blocks))
        self.key = np.concatenate(
            [face_keys(mesh.node[p.faces]) for p in parts] or [np.empty((0, 4), int)]
        )
        sums = np.concatenate([_sums(p) for p in parts] or [np.empty((0, 7))])
        self.area, centre, normal = sums[:, 0], sums[:, 1:4], sums[:, 4:]
        self.centre = centre / np.maximum(self.area, 1e-300)[:, None]
        self.normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        self.corners = [np.array(p.faces[:, : face_corners(p.faces.shape[1])]) for p in parts]
        self._take_samples(parts)

    def _take_samples(self, parts: list[Facets]) -> None:
        """The centre of a straight face; of a curved one Gauss points, over which its normals are
        off those of an arc through its nodes to both sides."""
        curved = np.concatenate(
            [bulge(p.place) > SETTINGS.curved for p in parts] or [np.empty(0, bool)]
        )
        straight, first = np.flatnonzero(~curved), 0
        found = [(straight, self.centre[straight], self.normal[straight], self.area[straight])]
        for part in parts:
            bent = np.flatnonzero(curved[first : first + len(part.faces)])
            of, place, normal, area = _gauss(part, bent)
            found.append((first + of, place, normal, area))
            first += len(part.faces)
        self.sample_of, self.sample, self.sample_normal, self.sample_area = (
            np.concatenate(values) for values in zip(*found, strict=True)
        )

    def pieces(self) -> np.ndarray:
        """(f,) label of what hangs together over edges without a bend."""
        face, ends = self._edges()
        _, edge = np.unique(ends, axis=0, return_inverse=True)
        order = np.argsort(edge.ravel(), kind="stable")
        a, b = face[order[:-1]], face[order[1:]]
        joined = np.diff(edge.ravel()[order]) == 0
        joined &= np.einsum("ij,ij->i", self.normal[a], self.normal[b]) > np.cos(
            np.radians(SETTINGS.bend)
        )
        count = len(self.key)
        graph = sp.coo_matrix((np.ones(joined.sum()), (a[joined], b[joined])), shape=(count, count))
        return sp.csgraph.connected_components(graph, directed=False)[1]

    def _edges(self) -> tuple[np.ndarray, np.ndarray]:
        """(e,) the face of each edge, and (e, 2) its ends, the smaller first."""
        ends = [
            np.stack([block, np.roll(block, -1, axis=1)], axis=2).reshape(-1, 2)
            for block in self.corners
        ]
        sides = np.concatenate([np.full(len(block), block.shape[1]) for block in self.corners])
        return np.repeat(np.arange(len(sides)), sides), np.sort(np.concatenate(ends), axis=1)


def _sums(part: Facets) -> np.ndarray:
    """(f, 7): area of each face, and centre and normal times it."""
    out = np.zeros((len(part.faces), 7))
    values = np.column_stack([np.ones(len(part.area)), part.centre, part.normal])
    np.add.at(out, part.face, part.area[:, None] * values)
    return out


def _gauss(part: Facets, bent: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of the Gauss points of the faces `bent`: the face of each, its place, normal and share of the
    area."""
    shape, slope, weight = face_rule(part.faces.shape[1])
    place = part.place[bent]
    across = np.cross(*np.einsum("gdk,fkx->dfgx", slope, place))
    size = np.linalg.norm(across, axis=2)
    return (
        np.repeat(bent, len(weight)),
        np.einsum("gk,fkx->fgx", shape, place).reshape(-1, 3),
        (across / np.maximum(size, 1e-300)[..., None]).reshape(-1, 3),
        (weight * size).ravel(),
    )
