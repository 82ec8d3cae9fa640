"""Mirror planes of a contact: where its places and its preload map are symmetric within the noise
of the meshes.

What is kept of a symmetric contact must be symmetric, too: else the kept part carries a moment that
the damper does not have. A mesh generator breaks the symmetry by percents; here its noise is
measured, and mirrored parts are found."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import QhullError, cKDTree

from tipdamp.hbm.contact import ContactTable


@dataclass(frozen=True)
class MirrorSettings:
    """When a contact counts as symmetric."""

    # of the forces: meshes of one body differ by 1 to 2 %, a pull 1 % off the middle by 6
    map: float = 0.05
    # neighbours: those of a point in all directions, of cells three times as long as wide
    around: int = 6
    # of the distance of the last of them: a point whose image lies further off has no partner
    reach: float = 1.0
    # of the distance of the first: nearer to its partner a point is its mirror image
    alike: float = 0.25


SETTINGS = MirrorSettings()


@dataclass(frozen=True)
class Mirror:
    """normal : (3,) unit, offset : m - of the plane normal . x = offset
    image : (P, 3) m of the contacts; onto {side: side}; noise - of the map, sum of the differences
    over the sum of the forces; pairwise - whether each contact is the image of one other, or of
    itself."""

    normal: np.ndarray
    offset: float
    image: np.ndarray
    onto: dict[str, str]
    noise: float
    pairwise: bool


def mirrors_of(
    pairs: ContactTable, area: np.ndarray, load: np.ndarray, axis: ArrayLike, pull: ArrayLike
) -> list[Mirror]:
    """The planes about which the closed contact is symmetric: across the axis, and along the axis
    and the pull.

    area : (P,) m2, or m of a line; load : (P,) N, static, closed where positive; axis, pull (3,).
    The second plane exchanges the sides; it counts only where the contacts of both are images of
    each other one by one.
    """
    along = np.asarray(axis, dtype=float)
    across = np.cross(along, np.asarray(pull, dtype=float))
    rows = np.flatnonzero(pairs.carrying & (area > 0))
    found = []
    for normal in (along, across):
        size = np.linalg.norm(normal)
        if size > 0 and len(rows) and (one := _mirror(pairs, rows, (area, load), normal / size)):
            if normal is along or one.pairwise:
                found.append(one)
    return found


def _mirror(
    pairs: ContactTable, rows: np.ndarray, fields: tuple[np.ndarray, np.ndarray], normal: np.ndarray
) -> Mirror | None:
    """The plane through the middle of the contact, None where it is not symmetric about it."""
    area, load = fields
    offset = float(area[rows] @ (pairs.position[rows] @ normal) / area[rows].sum())
    image = pairs.position - 2 * np.outer(pairs.position @ normal - offset, normal)
    onto, pairwise = {}, True
    of_side = {side: rows[pairs.side[rows] == side] for side in pairs.sides}
    of_side = {side: mine for side, mine in of_side.items() if len(mine)}
    facing = {side: pairs.normal[mine].mean(axis=0) for side, mine in of_side.items()}
    for side, mine in of_side.items():
        turned = facing[side] - 2 * (facing[side] @ normal) * normal
        # itself first
        places = {other: pairs.position[of_side[other]] for other in (side, *of_side)}
        far, partner, onto[side] = _nearest_side(places, facing, image[mine], turned)
        theirs = of_side[onto[side]]
        near, around = _spacing(pairs.position[theirs])
        if far.max() > SETTINGS.reach * around:
            return None
        pairwise &= bool(far.max() < SETTINGS.alike * near) and len(mine) == len(theirs) == len(
            np.unique(partner)
        )
    unlike = _unlike(
        pairs, [(mine, of_side[onto[s]]) for s, mine in of_side.items()], fields, image
    )
    noise = unlike / (np.maximum(load[rows], 0).sum() or np.inf)
    if noise > SETTINGS.map or any(onto[onto[side]] != side for side in onto):
        return None
    return Mirror(normal, offset, image, onto, noise, pairwise)


def _unlike(
    pairs: ContactTable,
    sides: Iterable[tuple[np.ndarray, np.ndarray]],
    fields: tuple[np.ndarray, np.ndarray],
    image: np.ndarray,
) -> float:
    """N: by which the map of contacts differs from that at their images, on pairs of sides that are
    images of each other."""
    area, load = fields
    # of what is open it would be the force that would close it, as steep as the gap is stiff
    pressure = np.maximum(load, 0) / np.where(area > 0, area, 1.0)
    total = 0.0
    for mine, theirs in sides:
        there = _pressure_at(pairs.select(theirs), pressure[theirs], image[mine])
        total += float(area[mine] @ np.abs(pressure[mine] - there))
    return total


def _nearest_side(
    places: dict[str, np.ndarray],
    facing: dict[str, np.ndarray],
    image: np.ndarray,
    turned: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, str]:
    """(distances, nearest places, side) of the side that comes nearest to an image (p, 3) which
    faces as `turned`."""
    found = ((*cKDTree(at).query(image), other) for other, at in places.items())
    return min(found, key=lambda one: one[0].mean() * (1 + np.linalg.norm(facing[one[2]] - turned)))


def _spacing(places: np.ndarray) -> tuple[float, float]:
    """m: usual distance of a place (p, 3) from the nearest other one, and from the last of those
    around it."""
    far = (
        cKDTree(places)
        .query(places, min(SETTINGS.around + 1, len(places)))[0]
        .reshape(len(places), -1)
    )
    usual = np.median(far[:, 1:], axis=0) if far.shape[1] > 1 else np.full(1, np.inf)
    return usual[0], usual[-1]


def _pressure_at(pairs: ContactTable, pressure: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(m,) pressure (p,) of one side at places (m, 3) on it, linear between its contacts."""
    middle, t = pairs.position.mean(axis=0), pairs.frame[:, :2].mean(axis=0)
    known, wanted = (pairs.position - middle) @ t.T, (places - middle) @ t.T
    nearest = pressure[cKDTree(pairs.position).query(places)[1]]
    try:
        between = LinearNDInterpolator(known, pressure)(wanted)
    except QhullError:  # a line of contacts
        order = np.argsort(known[:, 0])
        between = np.interp(wanted[:, 0], known[order, 0], pressure[order])
    return np.where(np.isnan(between), nearest, between)


def mirrored_cells(pairs: ContactTable, cell: np.ndarray, mirrors: Iterable[Mirror]) -> np.ndarray:
    """(P,) cells with all that are images of each other as one; cell (P,) int, of one side each,
    -1: none.

    Where contacts are no images of each other one by one, a cell belongs to the one that its image
    lies nearest to."""
    used = np.flatnonzero(cell >= 0)
    count, links = int(cell.max(initial=-1)) + 1, [np.empty((0, 2), dtype=int)]
    middle = _middles(pairs.position[used], cell[used], count)
    for mirror in mirrors:
        image = _middles(mirror.image[used], cell[used], count)
        for name, other in mirror.onto.items():
            mine, theirs = (np.unique(cell[used[pairs.side[used] == s]]) for s in (name, other))
            if len(mine) and len(theirs):
                nearest = cKDTree(middle[theirs]).query(image[mine])[1]
                links.append(np.column_stack([mine, theirs[nearest]]))
    a, b = np.concatenate(links).T
    graph = sp.coo_matrix((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    label = sp.csgraph.connected_components(graph, directed=False)[1]
    return np.where(cell >= 0, label[cell], -1)


def _middles(place: np.ndarray, cell: np.ndarray, count: int) -> np.ndarray:
    """(count, 3) m: mean of the places (p, 3) of each cell (p,), 0 of one that has none."""
    size = np.maximum(np.bincount(cell, minlength=count), 1)[:, None]
    return np.column_stack([np.bincount(cell, place[:, k], count) for k in range(3)]) / size
