"""Tributary areas and pressure of the contact pairs."""

import numpy as np
import pytest

from tests.tipdamp.curved_pairs import curved_pairs
from tipdamp.pressure import patches


def test_tributary_areas_are_cells_of_the_grid():
    """Half the distance to each neighbour, along the chords of the arc: a quarter of a rectangle at a corner."""
    pairs = curved_pairs(rows=4, stations=7)
    arc = next(p for p in patches(pairs) if p.is_area)
    grid = np.lexsort((pairs.row[arc.rows], pairs.station[arc.rows]))
    place = pairs.position[arc.rows][grid].reshape(7, 4, 3)
    across, along = (np.linalg.norm(np.diff(place, axis=axis), axis=2) for axis in (1, 0))
    cell = np.outer(half_to_neighbours(along[:, 0]), half_to_neighbours(across[0]))
    assert arc.tributary[grid] == pytest.approx(cell.ravel(), rel=1e-9)


def half_to_neighbours(steps):
    return np.convolve(steps, [0.5, 0.5])


def test_patch_is_the_grid_of_pairs():
    pairs = curved_pairs(rows=4, stations=7)
    arc = next(p for p in patches(pairs) if p.is_area)
    assert len(arc.cells) == 2 * 3 * 6
    place = pairs.position[arc.rows][arc.cells]
    normal = np.cross(place[:, 1] - place[:, 0], place[:, 2] - place[:, 0])
    assert (np.einsum("ij,ij->i", normal, pairs.normal[arc.rows[arc.cells[:, 0]]]) > 0).all()
    station, row = pairs.station[arc.rows][arc.cells], pairs.row[arc.rows][arc.cells]
    assert np.ptp(station, axis=1).max() == 1 and np.ptp(row, axis=1).max() == 1


def test_load_times_area_is_the_side_force():
    pairs = curved_pairs()
    for patch in patches(pairs):
        load = patch.load(pairs.preload)
        factor = 1e6 if patch.is_area else 1e3
        assert (load * patch.tributary).sum() * factor == pytest.approx(np.maximum(pairs.preload[patch.rows], 0).sum())
        assert (load >= 0).all() and (load[pairs.preload[patch.rows] <= 0] == 0).all()
