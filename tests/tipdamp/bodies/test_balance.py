"""The damper in a V of two flanks, and what holds it along its axis."""

import numpy as np
import pytest

from tests.contact_tables import contact_table, frames
from tipdamp.bodies.balance import Balance, DamperHold, side_sums
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.rigid_motion import parse_motion
from tipdamp.study.hold import HoldChoice

FLANKS = np.array([[-1.0, 0, 1], [1, 0, 1]]) / np.sqrt(2)
FREE = DamperHold("damper", ())


def wedge(preload=(0.0, 0.0), **columns):
    """A pair on each flank, whose normals are 45 degrees off the pull along z."""
    return contact_table(frames(FLANKS), side=["left", "right"], preload=preload, **columns)


def held(*motions):
    return DamperHold("damper", [HoldChoice(motion=one) for one in motions])


def test_sides_balance_the_load():
    """N = F / (2 cos 45 deg) each; half of it on one flank leaves a quarter of the load along z and
    as much along x."""
    balance, force = Balance(np.array([0.0, 0, 100]), FREE), 100 / np.sqrt(2)
    assert balance.equilibrium(wedge()) == pytest.approx({"left": force, "right": force})
    assert balance.error(wedge([force, force])) == pytest.approx(0.0, abs=1e-15)
    assert balance.error(wedge([force, force / 2])) == pytest.approx(np.sqrt(2) / 4)


def test_open_pairs_carry_nothing():
    assert side_sums(wedge([3.0, -2.0])) == {"left": 3.0, "right": 0.0}


def test_other_normals_share_the_load_otherwise():
    """The right flank upright: the left one carries all along z and presses against it."""
    found = Balance(np.array([0.0, 0, 100]), FREE).of_sides(
        wedge(), {"right": np.array([1.0, 0, 0])}
    )
    assert found == pytest.approx({"left": 100 * np.sqrt(2), "right": 100.0})


def test_a_hold_takes_what_lies_along_it():
    """A load along the axis: refused, or taken by the hold; friction may hold it too."""
    load, force = np.array([0.0, 30, 100]), 100 / np.sqrt(2)
    with pytest.raises(InputError, match=r"residual of 30 N along \[0.0, 1.0, 0.0\]"):
        Balance(load, FREE).of_sides(wedge())
    assert Balance(load, held("y")).of_sides(wedge()) == pytest.approx(
        {"left": force, "right": force}
    )
    pairs = wedge([force, force], mu=0.2)
    assert Balance(load, FREE).by_friction(pairs) == pytest.approx((30.0, 0.2 * 2 * force))
    assert Balance(load, held("y")).by_friction(pairs)[0] == pytest.approx(0.0, abs=1e-12)


def test_directions_are_those_that_no_normal_faces():
    """A rotation has none, and the pull is faced by both flanks."""
    assert held("z", "about y", "y").directions(wedge()).tolist() == [[0.0, 1.0, 0.0]]
    assert held("z", "about y").ways == pytest.approx(
        np.array([parse_motion(one)[2] for one in ("z", "about y")])
    )
    assert FREE.directions(wedge()).shape == (0, 3)
