"""Points of a contact area: which of them are neighbours, and which at its rim."""

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tipdamp.static_contact.contact.contact_cells import cells_in, fade_of, surroundings


@pytest.mark.parametrize("seed", range(3))
def test_neighbours_of_a_grid_do_not_hang_on_rounding(seed):
    """A rectangle is cut along either of its diagonals: neighbours share an edge, and not a
    corner."""
    place = np.stack(np.meshgrid(np.arange(5) * 1.1, np.arange(4.0)), axis=-1).reshape(-1, 2)
    place = place * (1 + 1e-15 * np.random.default_rng(seed).normal(size=place.shape))
    rim, beside = surroundings(place, np.arange(20))
    assert (
        rim.sum() == 14
        and beside[0] == {1, 5}
        and beside[6] == {1, 5, 7, 11}
        and beside[12] == {7, 11, 13, 17}
    )


@pytest.mark.parametrize("angle", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("bow", [0.0, 1e-3])
def test_neighbours_do_not_hang_on_axes_or_on_a_bowed_rim(angle, bow):
    """A rim that is not quite straight: the flat triangles that close it make no neighbours."""
    place = np.stack(np.meshgrid(np.arange(5) * 1.1, np.arange(4.0)), axis=-1).reshape(-1, 2)
    place[1:4, 1] += bow
    place[16:19, 1] -= bow
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    rim, beside = surroundings(place @ turn.T, np.arange(20))
    assert rim.sum() == 14 and beside[0] == {1, 5} and beside[12] == {7, 11, 13, 17}


def test_cells_hold_what_lies_within_their_size():
    """Together points of one cell are no farther apart than its diagonal, and without a size each
    stands alone."""
    place = np.random.default_rng(0).uniform(-1, 1, (60, 2)) * [3.0, 1.0]
    cell = cells_in(place, 0.5)
    assert 1 < len(np.unique(cell)) < 60
    for c in np.unique(cell):
        assert (np.ptp(place[cell == c], axis=0) <= 0.5).all()
    assert len(np.unique(cells_in(place, None))) == 60


@pytest.mark.parametrize(
    "order, leave", [("least_loaded", [3, 1, 2, 4]), ("from_middle", [2, 1, 3, 4])]
)
def test_contacts_leave_one_after_the_other(order, leave):
    """Five on a line, the first open: it takes up no area, and of the four others each begins to
    leave where the one before is gone."""
    area, load = np.array([9.0, 1, 2, 3, 4]), np.array([-5.0, 2, 6, 3, 40])
    pairs = contact_table(
        np.tile(np.eye(3), (5, 1, 1)), position=np.outer([0, 1.1, 2, 3.2, 4], [1, 0, 0])
    )
    fade = fade_of(pairs, area, load, (1, 0, 0), order=order)
    left = 1 - np.cumsum(area[leave]) / area[1:].sum()
    assert fade.gone[leave] == pytest.approx(left, abs=1e-15)
    assert fade.begins[leave] == pytest.approx(np.r_[1.0, left[:-1]])
    if order == "least_loaded":
        assert fade.begins[0] == fade.gone[0] == 1.0
