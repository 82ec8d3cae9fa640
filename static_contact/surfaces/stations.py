"""Stations and rows of contact points: intervals along the damper axis and across it."""

import numpy as np

from tipdamp.hbm.ties import SAME, in_order
from tipdamp.static_contact.surfaces.settings import DEFAULT


def stations_and_rows(
    places: list[np.ndarray], sizes: list[float], axis: np.ndarray, up: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """(station, row) of the points of each side, (n, 3) m, whose faces are `sizes` m in size.

    Where the points of all sides lie on common lines across the axis, as on hexahedra, each line is
    a station; else stations are intervals as wide as the faces. Rows are the lines of a side along
    the axis, or else intervals no higher than the faces, from the one around its lower edge (row 0)
    to that around its upper one, the same in all stations. Of several points in an interval of a
    station all but the lowest move up.
    """
    along = np.concatenate(places) @ axis
    size = max(sizes)
    label, spread = _lines(along, DEFAULT.line * size)
    if spread > DEFAULT.line * size:
        count = max(1, round(float(np.ptp(along)) / size + SAME))
        place = (along - along.min()) / max(float(np.ptp(along)), 1e-300) * count
        label = np.minimum(place + SAME, count - 1).astype(int)
    found = []
    labels = np.split(label, np.cumsum([len(place) for place in places])[:-1])
    for place, own, station in zip(places, sizes, labels, strict=True):
        station = np.unique(station, return_inverse=True)[1]
        found.append((station, _rows(_height(place, axis, up), station, own)))
    return found


def _rows(height: np.ndarray, station: np.ndarray, size: float) -> np.ndarray:
    """(n,) rows of the points of a side with the heights (n,) m, whose faces are `size` m."""
    interval, spread = _lines(height, DEFAULT.line * size)
    if spread > DEFAULT.line * size:
        low, whole = height.min(), float(np.ptp(height))
        steps = np.ceil(whole / size - SAME)
        interval = np.rint((height - low) / whole * steps + SAME).astype(int)
    row = np.empty(len(height), dtype=np.int64)
    for k in np.unique(station):
        mine = np.flatnonzero(station == k)
        mine, rank = mine[in_order(height[mine])], np.arange(len(mine))
        row[mine] = np.maximum.accumulate(interval[mine] - rank) + rank
    return row


def _height(place: np.ndarray, axis: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(n,) m across the axis along the side, which is flat or an arc, from below."""
    beside = place - place.mean(axis=0)
    beside = beside - np.outer(beside @ axis, axis)
    across = np.linalg.svd(beside, full_matrices=False)[2][0]
    return beside @ (across if across @ up >= 0 else -across)


def _lines(values: np.ndarray, step: float) -> tuple[np.ndarray, float]:
    """Values that are no more than a step apart form a line: the line of each, and the widest
    line."""
    order = np.argsort(values)
    label = np.empty(len(values), dtype=np.int64)
    label[order] = np.cumsum(np.diff(values[order], prepend=values[order[0]]) > step)
    width = max(float(np.ptp(values[label == k])) for k in range(label.max() + 1))
    return label, width
