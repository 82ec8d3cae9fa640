"""Contact pressure from nodal preload: force over area, or over length where a side is a single
line.

A spring stands for a part of the area in the ratio of its stiffness: of equal ones that of a corner
node carries about as much as any other, and over the smaller tributary area it would look as if the
corners were loaded. Forces of hard pairs act on the tributary areas.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.ties import in_order

_FLAT = 1e-6  # width over length below which the pairs lie on one line


@dataclass(frozen=True)
class PressurePatch:
    """One side of the damper between its pairs. rows : (p,) int - rows of the contact table
    cells : (c, 3) triangles of an area or (c, 2) pieces of a line - indices into `rows`
    tributary : (p,) m2 or m - area or length of each pair: the part of the cells that is nearest to
    it
    loaded : (p,) m2 or m - that on which its force acts, of the same sum
    stations : the rows of the table that each of `rows` stands for, where that is not itself alone
    """

    side: str
    rows: np.ndarray
    cells: np.ndarray
    tributary: np.ndarray
    loaded: np.ndarray
    stations: tuple[np.ndarray, ...] = ()

    @property
    def is_area(self) -> bool:
        """Whether the pairs span an area, not a line."""
        return self.cells.shape[1] == 3

    @property
    def unit(self) -> str:
        """Of `load`."""
        return "N/mm²" if self.is_area else "N/mm"

    def carried(self, force: np.ndarray) -> np.ndarray:
        """(p,) N of the preload of the table, (P,) N; open pairs carry nothing."""
        closed = np.maximum(force, 0.0)
        if self.stations:
            return np.array([closed[rows].sum() for rows in self.stations])
        return closed[self.rows]

    def load(self, force: np.ndarray) -> np.ndarray:
        """(p,) N/mm2 or N/mm from the preload of the table, (P,) N; open pairs carry nothing."""
        closed = self.carried(force)
        # a pair in the place of another may have none
        loaded = np.where(self.loaded > 0, self.loaded, np.nan)
        pressure = closed / loaded
        carried = np.nansum(pressure * self.tributary)
        # the field over the side, of which each node stands for its tributary area, carries the
        # side force
        return (
            pressure
            * (closed.sum() / carried if carried > 0 else 1.0)
            / (1e6 if self.is_area else 1e3)
        )


def patches(pairs: ContactTable, hard: bool = False) -> list[PressurePatch]:
    """One for each side of which at least two pairs lie apart; hard - the preload is that of pairs
    without springs."""
    found = [_patch(pairs, side, hard) for side in pairs.sides]
    return [patch for patch in found if patch is not None]


def _patch(pairs: ContactTable, side: str, hard: bool) -> PressurePatch | None:
    rows = np.flatnonzero(pairs.side == side)
    place = pairs.position[rows]
    plane = (place - place.mean(axis=0)) @ pairs.frame[rows, :2].mean(axis=0).T  # along, across
    spread = np.linalg.svd(plane, compute_uv=False) if len(rows) > 1 else np.zeros(2)
    if not spread[0]:
        return None
    if spread[1] < _FLAT * spread[0] or len(rows) < 3:
        order = in_order(plane @ _direction(plane))
        cells = np.column_stack([order[:-1], order[1:]])
        part = np.linalg.norm(place[cells[:, 1]] - place[cells[:, 0]], axis=1)[:, None] / 2
    else:
        # counter-clockwise in t1, t2: seen along -n, from outside
        cells = Delaunay(plane).simplices
        part = _nearest(place[cells])
    if pairs.on_surface[rows].all():
        tributary = pairs.area[rows]
    else:
        tributary = np.zeros(len(rows))
        np.add.at(tributary, cells, part)
    return PressurePatch(side, rows, cells, tributary, _loaded(pairs.select(rows), tributary, hard))


def _loaded(mine: ContactTable, tributary: np.ndarray, hard: bool) -> np.ndarray:
    """(p,) m2 or m that the springs of the pairs stand for; without springs what is tributary."""
    kn = mine.kn * mine.weight
    by_springs = not hard and np.isfinite(kn).all() and kn.any()
    return tributary.sum() * kn / kn.sum() if by_springs else tributary


def _nearest(corner: np.ndarray) -> np.ndarray:
    """(c, 3) m2: areas of triangles, corners (c, 3, 3) m, that lie nearest to each corner, so that
    it does not matter along which diagonal a rectangle was cut; of obtuse ones half to the wide
    corner, a quarter to the others. [Meyer et al. 2003, Discrete differential-geometry operators
    for triangulated 2-manifolds, sec. 3.3]"""
    side = np.roll(corner, -1, axis=1) - np.roll(corner, 1, axis=1)  # opposite to each corner
    squared = np.einsum("cik,cik->ci", side, side)
    area = np.linalg.norm(np.cross(side[:, 0], side[:, 1]), axis=1)[:, None] / 2
    cosine = squared.sum(axis=1, keepdims=True) - 2 * squared  # b2 + c2 - a2: negative where obtuse
    obtuse = (cosine < 0).any(axis=1, keepdims=True)
    weighed = squared * cosine  # a2 cot A, times 4 area
    round_corner = (weighed.sum(axis=1, keepdims=True) - weighed) / (
        32 * np.where(area > 0, area, 1.0)
    )
    return np.where(obtuse, np.where(cosine < 0, area / 2, area / 4), round_corner)


def _direction(plane: np.ndarray) -> np.ndarray:
    return np.linalg.svd(plane, full_matrices=False)[2][0]
