"""Tributary areas and pressure of the contact pairs."""

from pathlib import Path

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tests.tipdamp.curved_pairs import curved_pairs
from tipdamp.fields.pressure import patches
from tipdamp.readers.dispatch import read_mesh


def test_tributary_areas_are_cells_of_the_grid():
    """Half the distance to each neighbour, along the chords of the arc: a quarter of a rectangle at
    a corner."""
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


PLATFORM_WEDGE = Path(__file__).parents[2] / "reference" / "platform-wedge" / "coarse_damper.msh"


@pytest.fixture
def flat():
    """The right flat of the platform wedge, 51 nodes, with equal springs."""
    mesh = read_mesh(PLATFORM_WEDGE, 1e-3)
    node = mesh.groups["wd_R"]
    place = mesh.position[mesh.index(node)]
    n = np.linalg.svd(place - place.mean(axis=0))[2][2]
    t1 = np.array([0.0, 1, 0])
    return contact_table(
        np.tile(np.stack([t1, np.cross(n, t1), n]), (len(node), 1, 1)), position=place, kn=2e6
    )


def test_equal_springs_do_not_load_the_corners(flat):
    """An even penetration is an even pressure; over tributary areas of 1.39 and 2.78 mm2 the
    corners would look twice as loaded as the middle of an edge (1.174 and 1.033 N: 0.843 and 0.371
    N/mm2)."""
    (patch,) = patches(flat)
    corner = patch.tributary.argmin()
    edge = np.abs(patch.tributary - 2 * patch.tributary.min()).argmin()
    assert (1e6 * patch.tributary[[corner, edge]]) == pytest.approx([1.39, 2.78], abs=0.01)
    assert patch.load(np.full(51, 0.9)) == pytest.approx(0.9 * 51 / (1e6 * patch.tributary.sum()))
    force = np.full(51, 1.0)
    force[[corner, edge]] = 1.174, 1.033
    load = patch.load(force)
    assert load[corner] / load[edge] == pytest.approx(1.174 / 1.033)
    assert (load * patch.tributary).sum() * 1e6 == pytest.approx(force.sum())
    (hard,) = patches(flat, hard=True)
    assert hard.load(force)[[corner, edge]] == pytest.approx([0.843, 0.371], abs=0.002)


def test_springs_by_tributary_area_are_drawn_over_it(flat):
    (patch,) = patches(flat)
    by_area = flat.replace(kn=2e12 * patch.tributary)
    (again,) = patches(by_area)
    assert again.loaded == pytest.approx(again.tributary)
    assert again.load(5e5 * patch.tributary) == pytest.approx(0.5)


def test_load_times_area_is_the_side_force():
    pairs = curved_pairs()
    for patch in patches(pairs):
        load = patch.load(pairs.preload)
        factor = 1e6 if patch.is_area else 1e3
        assert (load * patch.tributary).sum() * factor == pytest.approx(
            np.maximum(pairs.preload[patch.rows], 0).sum()
        )
        assert (load >= 0).all() and (load[pairs.preload[patch.rows] <= 0] == 0).all()
