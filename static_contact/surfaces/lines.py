"""Points of surfaces that touch along a line, as a round pin on a flank: moved onto what they stand
for.

The functions of the corners read a motion at the centre of what a corner has of the faces around
it, and it has more on one side of itself than on the other where these differ: at the ends of a
side of triangles, at its rims, where faces differ in size. On surfaces that part from each other
such a point would have the gap of a place beside its corner. Where the contact line runs through
the corner that point would stay open, and what is pressed there be lost to its neighbours: faces
are a hundred times wider than the strip that touches [Johnson 1985, Contact Mechanics, eq. 4.43].
So the motion is read at the corner, in the directions in which the surfaces part; in the others,
along the line, where it was.

On each face, w' = w + D (I - T) P M^-1 psi with T = D^-1 W M, the places that w = W psi reads at,
and P, which leaves of a linear function of the place what varies in the direction of the curvature.
w' has the integrals of w and its sum on the face. A point takes of each of its faces as little of
the change as brings it to its corner (least squares): none where they are alike all around.

Where no corner lies on the line, nothing is read there: `beside_line` says by how much.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from tipdamp.static_contact.surfaces.normals import tangents, unit
from tipdamp.static_contact.surfaces.settings import DEFAULT


class FaceCorners(NamedTuple):
    """f faces of one kind with w corners, on what is covered of them.

    mass (f, w, w) m2 - M; weights (f, w, w) - W; turned : (f, w, 3) m2 - int psi (n + n') dA of the
    smooth normals of both bodies; read : (f, w, 3) m3 - int psi x dA; place, normal : (f, w, 3) m
    and unit normals
    """

    mass: np.ndarray
    weights: np.ndarray
    turned: np.ndarray
    read: np.ndarray
    place: np.ndarray
    normal: np.ndarray


def changes(faces: FaceCorners) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(f, w, w): D (I - T) P M^-1; (f, w, 3) m3: by how much it moves where each corner is read,
    times its area; (f, w, 3) m3: by how much that should move. 0 on faces that are covered too
    little to tell, and where nothing parts."""
    w = faces.mass.shape[1]
    good = np.linalg.cond(faces.mass) < DEFAULT.conditioned
    M = np.where(good[:, None, None], faces.mass, np.eye(w))
    inverse, own = np.linalg.inv(M), faces.mass.sum(axis=2)
    ways, share, P = _parting(faces.place, inverse @ faces.turned, good)
    T = faces.weights @ M / own[:, :, None]
    change = own[:, :, None] * ((np.eye(w) - T) @ P) @ inverse
    size = np.abs(change).max(axis=(1, 2))
    limit = DEFAULT.steep / np.maximum(size, DEFAULT.steep)
    change *= limit[:, None, None]
    return change, change @ faces.read, _off(faces, own, ways, limit[:, None] * share)


def _parting(
    place: np.ndarray, turned: np.ndarray, good: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The two directions in which the surfaces part on each face, (f, 2, 3); how much of the way to
    the corner is taken in each, (f, 2) 0..1; P (f, w, w). turned (f, w, 3) - n + n' at the
    corners."""
    axes = tangents(unit(np.cross(place[:, 1] - place[:, 0], place[:, -1] - place[:, 0])))
    at = np.einsum("fwx,fax->fwa", place - place.mean(axis=1)[:, None], axes)
    slopes = np.linalg.pinv(np.concatenate([np.ones_like(at[:, :, :1]), at], axis=2))[:, 1:]
    bend = slopes @ np.einsum("fwx,fax->fwa", turned, axes)
    curvature, main = np.linalg.eigh((bend + np.swapaxes(bend, 1, 2)) / 2)
    along, slope = at @ main, np.swapaxes(main, 1, 2) @ slopes
    turn = np.abs(curvature) * np.ptp(along, axis=1)
    share = np.clip(turn / DEFAULT.parting - 1, 0, 1) * good[:, None]
    P = np.einsum("fwe,fe,fev->fwv", along, share, slope)
    return np.einsum("fae,fax->fex", main, axes), share, P


def _off(faces: FaceCorners, own: np.ndarray, ways: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(f, w, 3) m3: shares (f, 2) of the way from where each corner is read to the corner, in the
    directions ways (f, 2, 3) and along the surface."""
    normal = faces.normal[:, :, None]
    parting = ways[:, None] - (ways[:, None] * normal).sum(axis=3)[..., None] * normal
    parting /= np.maximum(np.linalg.norm(parting, axis=3), 1e-300)[..., None]
    away = own[:, :, None] * faces.place - faces.weights @ faces.read
    return np.einsum("fwx,fwex,fe,fwey->fwy", away, parting, share, parting)


def least_changes(
    gather: sp.csr_matrix, normal: np.ndarray, moves: np.ndarray, off: np.ndarray
) -> np.ndarray:
    """(n,): the share that each of n corners of faces takes of its change, the least by which the
    points move as far as they are off. gather (points, n) - sums them up; normal (n, 3); moves,
    off (n, 3) m3 - of `changes`."""
    axes = tangents(normal)
    flat, wanted = (np.einsum("nax,nx->na", axes, one) for one in (moves, off))
    wanted = gather @ wanted
    normed = (gather @ np.einsum("na,nb->nab", flat, flat).reshape(-1, 4)).reshape(-1, 2, 2)
    size = np.trace(normed, axis1=1, axis2=2)[:, None, None]
    normed += (DEFAULT.ridge * size + (size == 0)) * np.eye(2)
    by = np.linalg.solve(normed, wanted[:, :, None])[:, :, 0]
    return np.einsum("na,na->n", flat, gather.T @ by)


class BesideLine(NamedTuple):
    """How far a point lies from the line of contact: m across it, and degrees between the
    normals."""

    distance: float
    angle: float


def beside_line(place: np.ndarray, normal: np.ndarray, turned: np.ndarray) -> BesideLine | None:
    """The nearest of n points (n, 3) m of two surfaces that part to both sides of a line, with
    normals (n, 3) of the one and sums of those of both, which are 0 on the line; None where they do
    not part so."""
    way = np.linalg.svd(turned - turned.mean(axis=0), full_matrices=False)[2][0]
    turn = turned @ way
    if not turn.min() < 0 < turn.max():
        return None
    before = np.where(turn < 0, turn, -np.inf).argmax()
    behind = np.where(turn < 0, np.inf, turn).argmin()
    if turn[behind] - turn[before] < DEFAULT.parting:
        return None
    share = turn[before] / (turn[before] - turn[behind])
    there = normal[before] + share * (normal[behind] - normal[before])
    nearest = before if share < 0.5 else behind
    cosine = normal[nearest] @ there / np.linalg.norm(there)
    return BesideLine(
        min(share, 1 - share) * abs(float((place[behind] - place[before]) @ way)),
        float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))),
    )
