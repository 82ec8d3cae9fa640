"""Shapes of modes with one frequency, turned by a motion: the same for every mixture that a solver
may return."""

import numpy as np
import pytest

from tipdamp.hbm.ties import turned

HZ = np.array([1.0, 1 + 1e-12, 1 + 2e-12, 2.0, 3.0, 3 + 1e-11])


def mixed(shapes, seed):
    """Any mixture of the first three and of the last two, and any sign."""
    random, found = np.random.default_rng(seed), shapes.copy()
    for own in (slice(0, 3), slice(3, 4), slice(4, 6)):
        found[:, own] = (
            shapes[:, own] @ np.linalg.qr(random.normal(size=(own.stop - own.start,) * 2))[0]
        )
    return found


@pytest.mark.parametrize("seed", range(4))
def test_every_mixture_gives_the_same(seed):
    random = np.random.default_rng(10)
    shapes, row = np.linalg.qr(random.normal(size=(8, 6)))[0], random.normal(size=8)
    one, two = turned(HZ, shapes, row), turned(HZ, mixed(shapes, seed), row)
    assert two.T @ two == pytest.approx(np.eye(6), abs=1e-14)
    for k in (0, 3, 4):  # the first of each set is its share of the row
        assert two[:, k] == pytest.approx(one[:, k], abs=1e-14)
    assert row @ two == pytest.approx(
        [
            np.linalg.norm(row @ shapes[:, :3]),
            0,
            0,
            abs(row @ shapes[:, 3]),
            np.linalg.norm(row @ shapes[:, 4:]),
            0,
        ],
        abs=1e-14,
    )


def test_modes_that_do_not_move_stay():
    shapes = np.eye(6)
    assert (turned(HZ, shapes, np.zeros(6)) == shapes).all()
    assert turned(HZ[:0], shapes[:, :0], np.zeros(6)).shape == (6, 0)
