"""Contact pressure from nodal preload: force over tributary area, or over length where a side is a single line."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

from hbm.contact import ContactTable

_FLAT = 1e-6      # width over length below which the pairs lie on one line


@dataclass(frozen=True)
class Patch:
    """One side of the damper between its pairs. rows : (p,) int - rows of the contact table
    cells : (c, 3) triangles of an area or (c, 2) pieces of a line - indices into `rows`
    tributary : (p,) m2 or m - area or length of each pair: the part of the cells that is nearest to it."""

    side: str
    rows: np.ndarray
    cells: np.ndarray
    tributary: np.ndarray

    @property
    def is_area(self) -> bool:
        """Whether the pairs span an area, not a line."""
        return self.cells.shape[1] == 3

    @property
    def unit(self) -> str:
        """Of `load`."""
        return "N/mm²" if self.is_area else "N/mm"

    def load(self, force: np.ndarray) -> np.ndarray:
        """(p,) N/mm2 or N/mm from the preload of the table, (P,) N; open pairs carry nothing."""
        closed = np.maximum(np.asarray(force)[self.rows], 0.0)
        tributary = np.where(self.tributary > 0, self.tributary, np.nan)    # a pair in the place of another has none
        return closed / (tributary * (1e6 if self.is_area else 1e3))


def patches(pairs: ContactTable) -> list[Patch]:
    """One for each side of which at least two pairs lie apart."""
    found = [_patch(pairs, side) for side in pairs.sides]
    return [patch for patch in found if patch is not None]


def _patch(pairs, side):
    rows = np.flatnonzero(pairs.side == side)
    place = pairs.position[rows]
    plane = (place - place.mean(axis=0)) @ pairs.frame[rows, :2].mean(axis=0).T      # along, across
    spread = np.linalg.svd(plane, compute_uv=False) if len(rows) > 1 else np.zeros(2)
    if not spread[0]:
        return None
    if spread[1] < _FLAT * spread[0] or len(rows) < 3:
        order = np.argsort(plane @ _direction(plane), kind="stable")
        cells = np.column_stack([order[:-1], order[1:]])
        part = np.linalg.norm(place[cells[:, 1]] - place[cells[:, 0]], axis=1)[:, None] / 2
    else:
        cells = Delaunay(plane).simplices            # counter-clockwise in t1, t2: seen along -n, from outside
        part = _nearest(place[cells])
    tributary = np.zeros(len(rows))
    np.add.at(tributary, cells, part)
    return Patch(side, rows, cells, tributary)


def _nearest(corner):
    """(c, 3) m2: areas of triangles, corners (c, 3, 3) m, that lie nearest to each corner, so that it does not matter
    along which diagonal a rectangle was cut; of obtuse ones half to the wide corner, a quarter to the others.
    [Meyer et al. 2003, Discrete differential-geometry operators for triangulated 2-manifolds, sec. 3.3]"""
    side = np.roll(corner, -1, axis=1) - np.roll(corner, 1, axis=1)       # opposite to each corner
    squared = np.einsum("cik,cik->ci", side, side)
    area = np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1)[:, None] / 2
    cosine = squared.sum(axis=1, keepdims=True) - 2 * squared             # b2 + c2 - a2: negative where obtuse
    obtuse = (cosine < 0).any(axis=1, keepdims=True)
    weighed = squared * cosine                                            # a2 cot A, times 4 area
    round_corner = (weighed.sum(axis=1, keepdims=True) - weighed) / (32 * np.where(area > 0, area, 1.0))
    return np.where(obtuse, np.where(cosine < 0, area / 2, area / 4), round_corner)


def _direction(plane):
    return np.linalg.svd(plane, full_matrices=False)[2][0]
