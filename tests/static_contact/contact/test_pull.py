"""The pull on the load points of the damper, or at positions along its axis."""

import numpy as np
import pytest

from tipdamp.hbm.errors import InputError
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.contact.pull import pull_forces


def line_mesh():
    """Nodes on a line along y with four load points; cells do not matter here."""
    y = np.linspace(0, 0.06, 7)
    position = np.column_stack([np.zeros(7), y, np.full(7, 0.05)])
    return Mesh(
        np.arange(11, 18), position, {}, {"load_points": np.array([11, 13, 15, 17])}, source="line"
    )


@pytest.mark.parametrize(
    "options, place",
    [
        ({}, 0.03),
        ({"weights": (0.4, 0.3, 0.2, 0.1)}, 0.02),
        ({"positions": (0.25, 0.6)}, 0.0255),
        ({"positions": (0.1, 0.9), "weights": (0.75, 0.25)}, 0.018),
    ],
)
def test_resultant_and_place_of_the_pull(options, place):
    nodes, forces = pull_forces(line_mesh(), "load_points", (0, 1, 0), (0, 0, 1), **options)
    assert forces.sum(axis=0) == pytest.approx([0, 0, 1])
    assert forces[:, 2] @ line_mesh().position[nodes - 11, 1] == pytest.approx(place)


@pytest.mark.parametrize("options", [{"weights": (0.5, 0.5)}, {"weights": (0.4, 0.3, 0.2, 0.2)}])
def test_shares_must_match_and_add_up(options):
    with pytest.raises(InputError, match="numbers that add to 1 are needed"):
        pull_forces(line_mesh(), "load_points", (0, 1, 0), (0, 0, 1), **options)


def test_the_length_of_the_axis_does_not_count():
    options = {"positions": (0.25, 0.6), "weights": (0.75, 0.25)}
    nodes, forces = pull_forces(line_mesh(), "load_points", (0, 1, 0), (0, 0, 1), **options)
    others, same = pull_forces(line_mesh(), "load_points", (0, 40.0, 0), (0, 0, 1), **options)
    assert others.tolist() == nodes.tolist() and same == pytest.approx(forces)
