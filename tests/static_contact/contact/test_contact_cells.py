"""Points of a contact area: which of them are neighbours, and which at its rim."""

import numpy as np
import pytest

from tipdamp.static_contact.contact.contact_cells import SETTINGS, cells_in, surroundings


@pytest.mark.parametrize("seed", range(3))
def test_neighbours_of_a_grid_do_not_hang_on_rounding(seed):
    """A rectangle is cut along either of its diagonals: neighbours share an edge, and not a
    corner."""
    place = np.stack(np.meshgrid(np.arange(5) * 1.1, np.arange(4.0)), axis=-1).reshape(-1, 2)
    place = place * (1 + 1e-15 * np.random.default_rng(seed).normal(size=place.shape))
    rim, beside = surroundings(place, np.arange(20), SETTINGS)
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
    rim, beside = surroundings(place @ turn.T, np.arange(20), SETTINGS)
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
