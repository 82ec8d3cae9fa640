"""Normals of the smooth surface that the nodes of faces lie on, exact on planes, and on spheres
and circular cylinders of faces that meet at less than `SurfaceSettings.crease` degrees.

The normals at two points of a circle make the same angle with the chord between them, on either
side of it:

    (x_i - x_j) . (n_i + n_j) = 0,    |n_i| = 1

which is solved by least squares over all nodes near each other [the symmetric objective of
Rusinkiewicz 2019, A symmetric objective function for ICP, eq. 6]. Means of the normals of faces are
wrong to the first order of the face size at the rim of a side and where faces differ in size: a
round side would resist rolling.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import lsmr

from tipdamp.modal.faces import face_corners, face_places, face_shapes
from tipdamp.static_contact.surfaces.settings import DEFAULT

Faces = Sequence[tuple[np.ndarray, np.ndarray]]


class _Sheet(NamedTuple):
    """s nodes of faces; those on a crease are there once for each side of it.

    of : (i,) int - the one of each node of each face in turn; place : (s, 3) m; mean : (s, 3) unit
    normals of the faces
    known : (s,) bool - inside of a plane part, where the mean is exact
    """

    of: np.ndarray
    place: np.ndarray
    mean: np.ndarray
    known: np.ndarray


def smooth_normals(kinds: Faces) -> list[np.ndarray]:
    """(f, k, 3) at the nodes of faces [(f, k) node indices, (f, k, 3) m their places]: outward, of
    length 1 at corners.

    The shape functions interpolate them as they do the places: a node halfway between two corners
    has the mean of their normals. Nothing is smooth across edges where faces meet at more than
    `crease` degrees.
    """
    between = [_between_corners(place) for _, place in kinds]
    sheet = _sheet(kinds)
    normal = _chordal(sheet, _near(kinds, sheet, between))
    found, start = [], 0
    for (faces, place), mean in zip(kinds, between, strict=True):
        own = normal[sheet.of[start : start + faces.size]].reshape(place.shape)
        found.append(np.where(mean[:, :, None], _from_corners(own), own))
        start += faces.size
    return found


def bulge(
    shape: np.ndarray, place: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """At points with the functions `shape` (m, k) of the nodes of their faces, whose places and
    smooth normals are (m, k, 3): normals (m, 3), and by how much the smooth surface lies above the
    faces there (m,) m.

    h (1 + |n|) = sum_k N_k x_k . n_k - x . n: on a circle, of which a face is a chord, h is
    R - |x|."""
    local = place - place[:, :1]
    n, x = (np.einsum("mk,mkx->mx", shape, one) for one in (normal, local))
    return n, above(arms(shape, local, normal), x, n)


def arms(shape: np.ndarray, place: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(m,) m: sum_k N_k x_k . n_k, as of `bulge`."""
    return np.einsum("mk,mkx,mkx->m", shape, place, normal)


def above(arm: np.ndarray, place: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(m,) m: by how much a smooth surface lies above means (m, 3) of places on it, with those of
    its normals (m, 3) and of its `arms` (m,) m."""
    size = np.linalg.norm(normal, axis=1)
    return (arm - np.einsum("mx,mx->m", place, normal)) / (1 + size)


def unit(vectors: np.ndarray) -> np.ndarray:
    """(m, 3) of length 1 along vectors (m, 3); 0 of none."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]


def tangents(normal: np.ndarray) -> np.ndarray:
    """(m, 2, 3): two axes of the planes with the normals (m, 3), so that axis 1 x axis 2 is the
    normal."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = np.cross(normal, least)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normal, first)], axis=1)


def _from_corners(values: np.ndarray) -> np.ndarray:
    """(f, k, 3): what values (f, k, 3) are at the nodes of straight faces with the same corners."""
    k = values.shape[1]
    corners = face_corners(k)
    return np.einsum("kc,fcx->fkx", face_shapes(corners, face_places(k))[0], values[:, :corners])


def _between_corners(place: np.ndarray) -> np.ndarray:
    """(f, k) bool - nodes that lie between the corners as those of a straight face do."""
    size = np.linalg.norm(place - place[:, :1], axis=2).max(axis=1, initial=0.0)
    found = np.linalg.norm(place - _from_corners(place), axis=2) <= DEFAULT.straight * size[:, None]
    found[:, : face_corners(place.shape[1])] = False
    return found


def _sheet(kinds: Faces) -> _Sheet:
    """The _Sheet of the faces."""
    across = np.concatenate([_outward(place) for _, place in kinds])
    own = unit(across)
    edges, one, other = _smooth_edges(kinds, own)
    a, b = edges[one].ravel(), edges[other].ravel()
    count, of = connected_components(
        sp.csr_matrix((np.ones(len(a)), (a, b)), shape=(len(own),) * 2), directed=False
    )
    mean = np.zeros((count, 3))
    place = np.empty((count, 3))
    known = np.ones(count, dtype=bool)
    np.add.at(mean, of, across)
    mean = unit(mean)
    place[of] = np.concatenate([p.reshape(-1, 3) for _, p in kinds])
    known[of[np.linalg.norm(own - mean[of], axis=1) > DEFAULT.straight]] = False
    known[of[np.delete(edges, np.r_[one, other], axis=0)]] = False
    return _Sheet(of, place, mean, known)


def _outward(place: np.ndarray) -> np.ndarray:
    """(f k, 3) normals at the nodes of each face for itself, as long as the face is large there;
    where it is drawn together so much that it has none, that of the whole face."""
    k = place.shape[1]
    found = np.cross(*np.einsum("crk,fkx->rfcx", face_shapes(k, face_places(k))[1], place))
    size, whole = np.linalg.norm(found, axis=2)[:, :, None], found.mean(axis=1)[:, None]
    return np.where(
        size > DEFAULT.straight * np.linalg.norm(whole, axis=2)[:, :, None], found, whole
    ).reshape(-1, 3)


def _smooth_edges(kinds: Faces, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (h, 3) as of `_edges_of` of all faces in turn, and pairs (e,), (e,) of those that are
    one edge across which the normals (i, 3) at the nodes of the faces turn little."""
    starts = np.cumsum([0, *(faces.size for faces, _ in kinds)])
    ends, nodes = zip(
        *(_edges_of(faces, start) for (faces, _), start in zip(kinds, starts, strict=False)),
        strict=True,
    )
    edges = np.concatenate(ends)
    _, label, count = np.unique(
        np.concatenate(nodes), axis=0, return_inverse=True, return_counts=True
    )
    order = np.argsort(label.ravel(), kind="stable")
    first = (np.cumsum(count) - count)[count == 2]
    one, other = order[first], order[first + 1]
    cosine = np.einsum("emx,emx->em", normal[edges[one]], normal[edges[other]])
    smooth = cosine.min(axis=1, initial=1.0) > np.cos(np.radians(DEFAULT.crease))
    return edges, one[smooth], other[smooth]


def _edges_of(faces: np.ndarray, start: int) -> tuple[np.ndarray, np.ndarray]:
    """(h, 3) int: first, last and middle node of the edges of faces (f, k), whose nodes are counted
    face by face from `start`, the one of the lower index first (and again where there is none in
    the middle); (h, 2) indices of the ends."""
    k = faces.shape[1]
    side = np.arange(face_corners(k))
    local = np.column_stack([side, np.roll(side, -1), side + len(side) if k > len(side) else side])
    its = start + k * np.arange(len(faces))[:, None, None] + local
    turned = faces[:, local[:, 0]] > faces[:, local[:, 1]]
    its[turned, :2] = its[turned, 1::-1]
    if k == len(side):
        its[:, :, 2] = its[:, :, 0]
    return its.reshape(-1, 3), np.sort(faces[:, local[:, :2]], axis=2).reshape(-1, 2)


def _near(
    kinds: Faces, sheet: _Sheet, between: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (p,), (p,) of nodes of the sheet that are in one face, or in two that have a node in
    common; without those between corners."""
    face = np.concatenate(
        [np.full(0, 0), *(np.repeat(np.arange(len(f)), f.shape[1]) for f, _ in kinds)]
    )
    starts = np.cumsum([0, *(len(f) for f, _ in kinds)])
    face = face + np.repeat(starts[:-1], [f.size for f, _ in kinds])
    own = ~np.concatenate([b.ravel() for b in between])
    there = sp.csr_matrix(
        (np.ones(own.sum()), (face[own], sheet.of[own])), shape=(starts[-1], len(sheet.place))
    )
    ring = there.T @ there
    return sp.triu(ring @ ring, 1).nonzero()


def _chordal(sheet: _Sheet, pairs: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(s, 3) unit normals that meet the chords between pairs (p,), (p,) of nodes alike, the nearer
    the better."""
    normal, free = sheet.mean.copy(), np.flatnonzero(~sheet.known)
    i, j = pairs
    weighed = _weighed(sheet.place[i] - sheet.place[j])
    for _ in range(DEFAULT.turns if len(free) and len(i) else 0):
        axes = tangents(normal)
        A = (_along(weighed, axes, i) + _along(weighed, axes, j))[
            :, np.column_stack([2 * free, 2 * free + 1]).ravel()
        ]
        off = np.einsum("px,px->p", weighed, normal[i] + normal[j])
        turn, *_ = lsmr(
            A, -off, atol=DEFAULT.solved, btol=DEFAULT.solved, maxiter=DEFAULT.most_steps
        )
        turn = turn.reshape(-1, 2)
        normal[free] += np.einsum("sa,sax->sx", turn, axes[free])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        if np.abs(turn).max() < DEFAULT.turned:
            break
    return normal


def _weighed(chord: np.ndarray) -> np.ndarray:
    """Chords (p, 3) over their squared length, that of the shortest as 1."""
    length = np.linalg.norm(chord, axis=1)
    found = np.divide(
        chord, length[:, None] ** 2, out=np.zeros_like(chord), where=length[:, None] > 0
    )
    return found * length.min(initial=np.inf, where=length > 0)


def _along(vector: np.ndarray, axes: np.ndarray, node: np.ndarray) -> sp.spmatrix:
    """(p, 2 s) CSR: components of vectors (p, 3) along the axes (s, 2, 3) of their nodes (p,)."""
    p = len(node)
    return sp.csr_matrix(
        (
            np.einsum("px,pax->pa", vector, axes[node]).ravel(),
            np.column_stack([2 * node, 2 * node + 1]).ravel(),
            np.arange(0, 2 * p + 1, 2),
        ),
        shape=(p, 2 * len(axes)),
    )
