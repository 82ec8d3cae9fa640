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
    share : (p,) m2 or m - tributary area or length of each pair: a third (half) of the cells at it."""

    side: str
    rows: np.ndarray
    cells: np.ndarray
    share: np.ndarray

    @property
    def is_area(self) -> bool:
        return self.cells.shape[1] == 3

    @property
    def unit(self) -> str:
        """Of `load`."""
        return "N/mm²" if self.is_area else "N/mm"

    def load(self, force) -> np.ndarray:
        """(p,) N/mm2 or N/mm from the preload of the table, (P,) N; open pairs carry nothing.

        Linear between the pairs, it integrates over the cells to the sum of the forces.
        """
        closed = np.maximum(np.asarray(force)[self.rows], 0.0)
        share = np.where(self.share > 0, self.share, np.nan)        # a pair in the place of another has none
        return closed / (share * (1e6 if self.is_area else 1e3))


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
        size = np.linalg.norm(place[cells[:, 1]] - place[cells[:, 0]], axis=1)
    else:
        cells = Delaunay(plane).simplices            # counter-clockwise in t1, t2: seen along -n, from outside
        normal = np.cross(place[cells[:, 1]] - place[cells[:, 0]], place[cells[:, 2]] - place[cells[:, 0]])
        size = np.linalg.norm(normal, axis=1) / 2
    share = np.zeros(len(rows))
    np.add.at(share, cells, (size / cells.shape[1])[:, None])
    return Patch(side, rows, cells, share)


def _direction(plane):
    return np.linalg.svd(plane, full_matrices=False)[2][0]
