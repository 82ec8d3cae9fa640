"""Cells of a contact side, and the order in which they leave the contact as its kept part shrinks.

A cell is a contact point with its own area, or all points in an interval along the axis and one
across it. The closed part of a side shrinks from its edge inwards: of the cells there the one of
the least pressure goes first, and what lay behind it is at the edge then. So it shrinks where the
preload fades, and has no holes.
"""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import Delaunay

from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.ties import SAME, in_order
from tipdamp.static_contact.contact.mirror import Mirror, mirrored_cells

Order = Literal["from_edge", "least_loaded", "from_middle"]


@dataclass(frozen=True)
class CellSettings:
    """Of cells and their neighbours."""

    # of the usual distance of neighbours: longer edges of a triangle bridge a hole
    reach: float = 3.0
    # of its length: a triangle at the rim that is lower spans points of one row
    straight: float = 0.1
    # of the largest pressure: nearer ones are noise of a mesh, and the outer one goes first
    alike: float = 1e-2
    # sine: four places that near to one circle have two diagonals, of which none counts
    round: float = 1e-3
    flat: float = 1e-6  # width over length below which the points lie on one line


SETTINGS = CellSettings()


@dataclass(frozen=True)
class Fade:
    """Of each contact (P,): the share of the closed area of its side that is kept when it begins to
    leave, and when it is gone. Contacts of a cell have these in common; those open at rest leave at
    once."""

    begins: np.ndarray
    gone: np.ndarray

    def factors(self, share: float) -> np.ndarray:
        """(P,) 0..1: what is left of each contact where that share of the closed area is kept."""
        width = self.begins - self.gone
        return np.where(
            width > 0,
            np.clip((share - self.gone) / np.where(width > 0, width, 1.0), 0, 1),
            share >= self.begins - SAME,
        )

    @property
    def shares(self) -> np.ndarray:
        """(n,) descending: all at which a contact begins to leave."""
        return np.unique(np.round(self.begins / SAME))[::-1] * SAME

    def whole(self) -> "Fade":
        """With cells that leave whole as soon as they begin to."""
        return Fade(self.begins, self.begins)


def fade_of(
    pairs: ContactTable,
    area: np.ndarray,
    load: np.ndarray,
    axis: ArrayLike,
    order: Order = "from_edge",
    size: float | None = None,
    mirrors: Sequence[Mirror] = (),
) -> Fade:
    """How the contacts of a table leave as its closed part shrinks, on every side in the same
    proportion.

    area : (P,) m2, or m where a side is a line; load : (P,) N, static, closed where positive; size
    : m of cells, None: every contact for itself; order : "from_edge", "least_loaded" by the
    pressure wherever it is, "from_middle" of the axis outwards; mirrors - what is mirrored leaves
    together
    """
    begins, gone = np.ones(len(pairs)), np.ones(len(pairs))
    along = pairs.position @ (np.asarray(axis, dtype=float) / np.linalg.norm(axis))
    closed = pairs.carrying & (load > 0)
    cells = mirrored_cells(pairs, _all_cells(pairs, size), mirrors)
    for sides in _exchanged(pairs.sides, mirrors):
        mine = np.flatnonzero(np.isin(pairs.side, sides) & pairs.carrying)
        if not closed[mine].any():
            continue
        cell = np.unique(cells[mine], return_inverse=True)[1].ravel()
        own, force = (
            np.bincount(cell, np.where(closed[mine], one[mine], 0.0)) for one in (area, load)
        )
        if order == "from_middle":
            leaves = _from_middle(along[mine], cell)
        else:
            pressure = np.where(own > 0, force / np.where(own > 0, own, 1.0), -np.inf)
            leaves = _by_pressure(pressure, order, pairs.select(mine), cell)
        before, after = _shares(own, leaves)
        begins[mine], gone[mine] = before[cell], after[cell]
    return Fade(begins, gone)


def _shares(own: np.ndarray, leaves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(c,) shares of the area that are there before each cell leaves, and after; own (c,) areas,
    leaves (c,) cells in their order."""
    left = 1 - np.r_[0.0, np.cumsum(own[leaves])] / own.sum()
    place = np.argsort(leaves)
    return left[place], np.maximum(left[place + 1], 0.0)


def _from_middle(along: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """Numbers of the cells, the middle of the axis first; along (p,) m."""
    middle = (along.min() + along.max()) / 2
    away = np.bincount(cell, np.abs(along - middle)) / np.bincount(cell)
    return in_order(away)


def _by_pressure(
    pressure: np.ndarray, order: str, pairs: ContactTable, cell: np.ndarray
) -> np.ndarray:
    """Numbers of the cells, the least loaded first: wherever they are, or from the edge."""
    rank = np.round(pressure / pressure.max() / SETTINGS.alike + SAME)
    if order == "least_loaded":
        return np.argsort(rank, kind="stable")
    return peeled(rank, *_all_surroundings(pairs, cell))


def _exchanged(sides: Sequence[str], mirrors: Sequence[Mirror]) -> Iterator[list[str]]:
    """Lists of the sides that mirrors map onto each other."""
    left = list(sides)
    while left:
        found = {left[0], *(mirror.onto.get(left[0], left[0]) for mirror in mirrors)}
        yield sorted(found)
        left = [side for side in left if side not in found]


def _all_cells(pairs: ContactTable, size: float | None) -> np.ndarray:
    """(P,) number of the cell of each contact that carries, over all sides; -1 of the others."""
    cells, count = np.full(len(pairs), -1), 0
    for side in pairs.sides:
        mine = np.flatnonzero((pairs.side == side) & pairs.carrying)
        if len(mine):
            cells[mine] = count + cells_in(plane_of(pairs.select(mine)), size)
            count = int(cells[mine].max()) + 1
    return cells


def _all_surroundings(pairs: ContactTable, cell: np.ndarray) -> tuple[np.ndarray, list[set[int]]]:
    """`surroundings` of cells (p,) that may have contacts on several sides."""
    count = int(cell.max()) + 1
    rim, beside = np.zeros(count, dtype=bool), [set[int]() for _ in range(count)]
    for side in pairs.sides:
        mine = pairs.side == side
        names, own = np.unique(cell[mine], return_inverse=True)
        at_rim, near = surroundings(plane_of(pairs.select(mine)), own.ravel())
        rim[names[at_rim]] = True
        for name, others in zip(names.tolist(), near, strict=True):
            beside[name] |= set(names[list(others)].tolist())
    return rim, beside


def plane_of(pairs: ContactTable) -> np.ndarray:
    """(p, 2) m: places of the contacts of one side along t1 and t2, from the middle."""
    return (pairs.position - pairs.position.mean(axis=0)) @ pairs.frame[:, :2].mean(axis=0).T


def cells_in(plane: np.ndarray, size: float | None) -> np.ndarray:
    """(p,) number of the cell of each place (p, 2); squares of about that size in m that fill the
    side, or each place its own."""
    if size is None:
        return np.arange(len(plane))
    low, extent = plane.min(axis=0), np.ptp(plane, axis=0)
    count = np.maximum(np.rint(extent / size + SAME), 1)
    place = (plane - low) / np.where(extent > 0, extent, 1.0) * count
    square = np.minimum(np.floor(place + SAME), count - 1).astype(int)
    return np.unique(square, axis=0, return_inverse=True)[1].ravel()


def surroundings(plane: np.ndarray, cell: np.ndarray) -> tuple[np.ndarray, list[set[int]]]:
    """(cells (c,) bool at the rim of the side, neighbours of each cell); all are at the rim where
    the places (p, 2) lie on a line."""
    count = int(cell.max()) + 1
    rim, beside = np.ones(count, dtype=bool), [set[int]() for _ in range(count)]
    spread = (
        np.linalg.svd(plane - plane.mean(axis=0), compute_uv=False)
        if len(plane) > 3
        else np.zeros(2)
    )
    if spread[-1] <= SETTINGS.flat * spread[0]:
        return rim, beside
    lines, outer = _rim_of(plane, Delaunay(plane).simplices)
    rim[cell[lines]] = False
    rim[cell[outer]] = True
    for a, b in cell[lines].tolist():
        if a != b:
            beside[a].add(b)
            beside[b].add(a)
    return rim, beside


def _rim_of(plane: np.ndarray, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(lines (l, 2), those of them at the rim (m, 2)) of triangles (t, 3), without those at the rim
    that span a bay or a row of points which is not quite straight."""
    length = np.linalg.norm(plane[corner] - plane[np.roll(corner, -1, axis=1)], axis=2)
    usual = np.median(length)
    a, b = (plane[corner[:, k]] - plane[corner[:, 0]] for k in (1, 2))
    height = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[:, None] / length
    spans = (length > SETTINGS.reach * usual) | (height < SETTINGS.straight * length)
    while True:
        lines = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=2), axis=2)
        found, place, times = np.unique(
            lines.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True
        )
        place = place.reshape(-1, 3)
        bad = ((times == 1)[place] & spans).any(axis=1)
        if not bad.any() or bad.all():
            return found[~_either_way(plane, corner, place)], found[times == 1]
        corner, spans = corner[~bad], spans[~bad]


def _either_way(plane: np.ndarray, corner: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(l,) bool: lines between two triangles (t, 3) that could as well be cut along the other
    diagonal, as rectangles can; line (t, 3) - number of the line from each corner to the next."""
    start, end, apex = (plane[np.roll(corner, -k, axis=1)] for k in range(3))
    a, b = start - apex, end - apex
    turn = np.einsum("tki,tki->tk", a, b) + 1j * np.abs(
        a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    )
    both, times = np.ones(line.max() + 1, dtype=complex), np.bincount(line.ravel())
    np.multiply.at(both, line, turn / np.abs(turn))
    # opposite angles of a circle add up to pi
    return (times == 2) & (np.abs(both.imag) < SETTINGS.round)


def peeled(rank: np.ndarray, rim: np.ndarray, beside: list[set[int]]) -> np.ndarray:
    """(c,) cells in the order in which they leave: of those at the edge the one of the smallest
    rank (c,), of equal ones the one that is there for longest; what lay behind it is at the edge
    then. -inf: open, there from the start."""
    seen, leaves = rim | np.isneginf(rank), list[int]()
    edge = [(rank[c], k, c) for k, c in enumerate(map(int, np.flatnonzero(seen)))]
    heapq.heapify(edge)
    count = len(edge)
    while edge:
        leaves.append(heapq.heappop(edge)[2])
        for other in sorted(beside[leaves[-1]]):
            if not seen[other]:
                seen[other] = True
                heapq.heappush(edge, (rank[other], count, other))
                count += 1
    return np.array(leaves)
