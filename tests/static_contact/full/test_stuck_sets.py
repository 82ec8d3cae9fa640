"""Stuck modes of several sets of pairs on one factor of the full model, against a factor for
each."""

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tests.static_contact.tuning.test_reduction_error import rod
from tipdamp.static_contact.full.stuck_modes import (
    StuckModeSettings,
    StuckSet,
    full_stuck_hz,
    full_stuck_sets,
)
from tipdamp.static_contact.tuning.roll_springs import RollSpring


@pytest.mark.parametrize("off_the_bounds, few", [(False, 600), (True, 600), (False, 5)])
def test_sets_share_a_factor(off_the_bounds, few):
    """Pairs that go, that keep a part, and springs that come; also where the reduction's
    frequencies are no bounds, and where two sets differ by too much for one factor."""
    bodies = [rod("one", 350, 2e7, 2e-3), rod("two", 240, 3e7, 1e-3)]
    pairs = contact_table(
        np.tile(np.eye(3)[[1, 2, 0]], (4, 1, 1)),
        blade_body="one",
        blade_node=[20, 60, 131, 300],
        damper_body="two",
        damper_node=[15, 50, 90, 200],
        kn=2e6,
    )
    spring = [RollSpring(3.0, 0, 2, 1e-3)]
    sets = [
        (pairs, []),
        (pairs.replace(weight=np.array([1, 0, 0.3, 0])), spring),
        (pairs.replace(weight=np.array([0, 0, 1.0, 1])), [RollSpring(8.0, 0, 2, 1e-3)]),
        (pairs, []),
    ]
    told = [full_stuck_hz(bodies, table, 5, springs) for table, springs in sets]
    factor = 0.9 if off_the_bounds else 1.0 + 1e-4
    found = full_stuck_sets(
        bodies,
        [
            StuckSet(table, springs, factor * hz)
            for (table, springs), hz in zip(sets, told, strict=True)
        ],
        StuckModeSettings(few=few),
    )
    for one, hz in zip(found, told, strict=True):
        assert one == pytest.approx(hz, rel=1e-9)
