"""Stations and rows of contact points: intervals along the damper axis, and the order across them."""

import numpy as np

from static_contact.surfaces.settings import DEFAULT, SurfaceSettings


def stations_and_rows(places: list[np.ndarray], sizes: list[float], axis: np.ndarray,
                      up: np.ndarray, settings: SurfaceSettings = DEFAULT) -> list[tuple[np.ndarray, np.ndarray]]:
    """(station, row) of the points of each side, (n, 3) m, whose faces are `sizes` m in size.

    Where the points of all sides lie on common lines across the axis, as on hexahedra, each line is a station; else
    stations are intervals as wide as the faces. A row counts the points of a station along `up`, from 0.
    """
    along = np.concatenate(places) @ axis
    size = max(sizes)
    label, spread = _lines(along, settings.line * size)
    if spread > settings.line * size:
        count = max(1, round(float(np.ptp(along)) / size))
        label = np.minimum((along - along.min()) / max(float(np.ptp(along)), 1e-300) * count, count - 1).astype(int)
    found = []
    for place, station in zip(places, np.split(label, np.cumsum([len(p) for p in places])[:-1]), strict=True):
        station = np.unique(station, return_inverse=True)[1]
        order = np.lexsort((place @ up, station))
        first = np.searchsorted(station[order], np.arange(station.max() + 1))
        row = np.empty(len(place), dtype=np.int64)
        row[order] = np.arange(len(place)) - first[station[order]]
        found.append((station, row))
    return found


def _lines(values, step):
    """Values that are no more than a step apart form a line: the line of each, and the widest line."""
    order = np.argsort(values)
    label = np.empty(len(values), dtype=np.int64)
    label[order] = np.cumsum(np.diff(values[order], prepend=values[order[0]]) > step)
    width = max(float(np.ptp(values[label == k])) for k in range(label.max() + 1))
    return label, width
