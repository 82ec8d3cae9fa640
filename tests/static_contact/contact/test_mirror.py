"""Planes of symmetry of a contact and its preload, and how far the preload is from symmetric."""

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tipdamp.static_contact.contact.mirror import mirrors_of


def grid(n=12, m=7, step=1e-3):
    """n x m points on one side, about the origin, and their areas."""
    x, y = (step * (np.arange(k) - (k - 1) / 2) for k in (n, m))
    place = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    place = np.column_stack([place, np.zeros(n * m)])
    area = np.full(n * m, step**2)
    return contact_table(np.tile(np.eye(3), (n * m, 1, 1)), position=place, area=area), area


@pytest.mark.parametrize("level", [1e-3, 1e6])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.02])
def test_noise_is_the_share_of_the_load_that_is_elsewhere_in_the_image(share, level):
    """More on one end than on the other by twice the share; along the other axis nothing is."""
    pairs, area = grid()
    load = level * area * (1 + share * np.sign(pairs.position[:, 0]))
    across, along = mirrors_of(pairs, area, load, (1, 0, 0), (0, 0, 1))
    assert [np.abs(m.normal).argmax() for m in (across, along)] == [0, 1]
    assert across.noise == pytest.approx(2 * share, rel=1e-6, abs=1e-12)
    assert along.noise == pytest.approx(0, abs=1e-12) and across.pairwise and along.pairwise


@pytest.mark.parametrize("shift", [(0, 0, 0), (0.3, -0.2, 0.05)])
def test_a_mirror_stands_where_the_contact_is(shift):
    """Images of points are points, wherever the contact lies."""
    pairs, area = grid()
    pairs = pairs.replace(position=pairs.position + shift)
    for mirror, place in zip(
        mirrors_of(pairs, area, area, (1, 0, 0), (0, 0, 1)), shift[:2], strict=True
    ):
        assert mirror.offset * mirror.normal.sum() == pytest.approx(place, abs=1e-12)
        apart = np.linalg.norm(mirror.image[:, None] - pairs.position, axis=2).min(axis=1)
        assert apart.max() < 1e-9


def test_a_part_without_image_has_no_mirror():
    """A third of one half cut away across: the plane across the axis has no image of it, the plane
    along it has."""
    pairs, area = grid()
    mine = pairs.position[:, 0] < 2e-3
    mine |= np.abs(pairs.position[:, 1]) < 1.1e-3
    pairs, area = pairs.select(mine), area[mine]
    (found,) = mirrors_of(pairs, area, area, (1, 0, 0), (0, 0, 1))
    assert np.abs(found.normal).argmax() == 1


def test_what_would_close_an_open_row_is_no_noise():
    """One row of a round side carries, and the mesh puts half of it 1 um beside: the rows beside it
    are open by a hundred times what presses, and count as nothing."""
    pairs, area = grid(m=3)
    middle = np.abs(pairs.position[:, 1]) < 1e-9
    load = area * np.where(middle, 1.0, -400.0)
    place = pairs.position.copy()
    place[middle & (place[:, 0] > 0), 1] += 1e-6
    found = mirrors_of(pairs.replace(position=place), area, load, (1, 0, 0), (0, 0, 1))
    assert len(found) == 2 and max(mirror.noise for mirror in found) < 5e-3
