"""Checks of contact pairs that only their geometry decides."""

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tipdamp.checks.pairs import jamming, one_row_warnings, slides
from tipdamp.hbm.contact import ContactTable


def test_a_closed_part_of_one_row_is_said():
    """Of contact points with several rows; not of pairs of nodes, nor where two rows are closed."""
    row = np.tile(np.arange(3), 8)
    table = contact_table(
        np.tile(np.eye(3), (24, 1, 1)),
        side=np.repeat(["left", "right"], 12),
        row=row,
        station=np.repeat(np.arange(8), 3),
        area=1e-6,
    )
    one = table.replace(preload=np.where((row == 1) | (table.side == "right"), 1.0, -1.0))
    (said,) = one_row_warnings(one)
    assert "side 'left': the closed part is one row" in said and "by = 'area'" in said
    (said,) = one_row_warnings(table.replace(preload=np.where(row == 1, 1.0, -1.0)))
    assert said.startswith("side 'left' and 'right': ")  # once
    assert not list(one_row_warnings(one, meets=True))  # as it asks for
    assert not list(one_row_warnings(one.replace(area=np.zeros(24))))
    assert not list(one_row_warnings(table.replace(preload=np.where(row < 2, 1.0, -1.0))))


def test_how_far_contact_points_slide():
    """Half of the range along t1, against the half-width or the distance of neighbours; what a pair
    moves along its normal is no slide."""
    table = contact_table(
        np.tile(np.eye(3), (4, 1, 1)),
        side=["left", "left", "left", "right"],
        position=[[0, 0, 0], [2e-3, 0, 0], [4e-3, 0, 0], [0, 1, 0]],
    )
    turn = np.linspace(0, 2 * np.pi, 9)
    motion = np.zeros((9, 4, 3))
    motion[:, 1, 0] = 1e-3 + 3e-3 * np.cos(turn)
    motion[:, :, 2] = 5e-3 * np.cos(turn)[:, None]
    motion[:, 3, 1] = 40e-6 * np.cos(turn)
    found = {
        one.side: one
        for one in slides(table, motion, ("t1", "t2", "n"), {"left": None, "right": 33e-6})
    }
    assert found["left"].share == pytest.approx(1.5) and "2e+03 um" in found["left"].said
    assert found["right"].share == pytest.approx(40 / 33) and "half-width" in found["right"].said
    assert [one.side for one in slides(table, motion, ("t1", "t2", "n"), {})] == ["left"]


@pytest.mark.parametrize(
    ("mu", "degrees", "jams"),
    [(0.3, 16, True), (0.3, 17, False), (0.6, 30.9, True), (0.6, 31, False), (0.0, 1, False)],
)
def test_a_wedge_jams_below_its_friction_angle(mu, degrees, jams):
    """atan(0.3) = 16.70 degrees, atan(0.6) = 30.96 degrees; angle between the face and the pull."""
    t = np.radians(degrees)
    normal, other = np.array([np.cos(t), 0, np.sin(t)]), np.array([-1.0, 0, 0.0])
    t1, count = np.array([0.0, 1, 0]), 2
    frame = np.array([[t1, np.cross(n, t1), n] for n in (normal, other / np.linalg.norm(other))])
    steep = ContactTable(
        np.array(["wedge", "flat"]),
        np.arange(2),
        np.zeros(2, int),
        ["blades"] * count,
        np.arange(2),
        ["damper"] * count,
        np.arange(2),
        np.eye(2, 3),
        frame,
        np.zeros(2),
        np.ones(2),
        np.ones(2),
        np.array([mu, 0.0]),
        np.ones(2),
        np.ones(2),
    )
    said = jamming(steep, np.array([0.0, 0, 1]))
    assert [text.split("'")[1] for text in said] == ["wedge"] * jams
