"""Nodes of two blocks that touch become pairs, wherever the interface looks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.boxes import block
from tipdamp.hbm.errors import InputError
from tipdamp.static_contact.surfaces.pairing import Side, matches, offsets, pair

TURNS = {"as it is": 0.0, "turned": 0.7}  # rad about y
SIDE = Side("top", "z0", "z1")
X, Y = np.array([0.0, 1e-3, 3e-3]), np.array([0.0, 2e-3, 3e-3, 5e-3])


def blocks(turn=0.0, shift=0.0):
    """(blade, damper): 1 mm thick, the blade above; the damper's nodes shifted by so many m along
    z, and in another order."""
    above, below = block(X, Y, [0.0, 1e-3]), block(X, Y, [-1e-3, 0.0])
    below = replace(below, position=below.position + [0, 0, shift])
    rotated = Rotation.from_rotvec([0, turn, 0]).as_matrix().T
    return tuple(replace(mesh, position=mesh.position @ rotated) for mesh in (above, below))


def paired(blade, damper, tolerance=1e-6):
    return pair(blade, damper, SIDE, axis=(0, 1, 0), pull=(1.0, 0, 0), tolerance=tolerance)


@pytest.mark.parametrize("name", TURNS)
def test_pairs_of_two_blocks(name):
    """Each node of the one with that at its place; normals into the blade; stations along the axis,
    rows against the pull; edge nodes face as the side does."""
    blade, damper = blocks(TURNS[name])
    pairs = paired(blade, damper)
    assert len(pairs) == len(X) * len(Y)
    at = blade.position[blade.index(pairs.blade_node)]
    assert np.array_equal(at, pairs.position)
    assert np.allclose(damper.position[damper.index(pairs.damper_node)], at, atol=1e-12)
    up = Rotation.from_rotvec([0, TURNS[name], 0]).apply([0, 0, 1.0])
    assert np.allclose(pairs.normal, up, atol=1e-12)
    assert np.allclose(pairs.frame @ pairs.frame.transpose(0, 2, 1), np.eye(3), atol=1e-12)
    along = at @ [0, 1.0, 0]
    assert [sorted(set(along[pairs.station == s].round(9))) for s in range(len(Y))] == [
        [y] for y in Y
    ]
    against = at @ [1.0, 0, 0]
    assert all(np.ptp(against[pairs.row == r]) < 1e-12 for r in range(len(X)))
    assert (np.diff([against[pairs.row == r].mean() for r in range(len(X))]) > 0).all()


def test_nodes_farther_apart_than_the_tolerance():
    """What would match them is named; the distance is that along the normal."""
    blade, damper = blocks(shift=-2e-5)
    assert not matches(blade, damper, SIDE, 1e-5) and matches(blade, damper, SIDE, 3e-5)
    with pytest.raises(
        InputError, match="24 without a partner within 1e-05 m .*tolerance = 2.2e-05"
    ):
        paired(blade, damper, 1e-5)
    pairs = paired(blade, damper, 3e-5)
    assert np.allclose(offsets(pairs, blade, damper), 2e-5, rtol=1e-6)
