"""What springs leave loose, and what a load could do along a free motion, by closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from tipdamp.static_contact.bodies.free_motions import FreeMotions
from tipdamp.static_contact.bodies.loose_motions import _unfelt


@pytest.mark.parametrize("count", [1, 2, 3])
def test_what_no_spring_feels(count):
    """All of it, of motions whose sizes are decades apart, as those of turns and shifts are."""
    random = np.random.default_rng(count)
    motions = random.standard_normal((12, 5)) * np.geomspace(1e-3, 10, 5)
    springs = random.standard_normal((count, 12)) * np.geomspace(1, 1e4, count)[:, None]
    left = _unfelt(springs, motions)
    assert left.shape == (5, 5 - count) and np.linalg.matrix_rank(left) == 5 - count
    moved = motions @ left
    felt = np.abs(springs @ moved) / np.outer(
        np.linalg.norm(springs, axis=1), np.linalg.norm(moved, axis=0)
    )
    assert felt.max() < 1e-12


def test_what_a_load_could_do_is_that_of_the_motion_there_and_back():
    """20 N on two nodes, along a slide that moves every node by 2 and a roll about one of them."""
    rigid = np.zeros((6, 6))
    rigid[:, :3] = np.tile(np.eye(3), (2, 1))
    rigid[3:, 5] = [0, 0.5, 0]  # the second node half a metre along x: a turn about z moves it
    one = np.zeros((6, 2))
    one[0, 0], one[5, 1] = 2.0, 1.0
    motions = FreeMotions(
        rigid,
        one,
        [("slide along x", "N"), ("roll about z", "N m")],
        np.array(["d"] * 6),
        np.zeros(2),
    )
    load = np.array([-10.0, 0, 0, 0, 0, 10.0])
    assert motions.reach(load) == pytest.approx([40.0, 10.0])
    assert replace(motions, coefficients=-one).reach(load) == pytest.approx([40.0, 10.0])
