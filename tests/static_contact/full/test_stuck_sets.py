"""Stuck modes of several sets of pairs in one space, against a factor for each."""

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

from tests.contact_tables import contact_table
from tests.static_contact.tuning.test_reduction_error import rod
from tipdamp.hbm.contact import relative_motion
from tipdamp.static_contact.bodies.sparse_bodies import AssembledBodies
from tipdamp.static_contact.full import stuck_modes
from tipdamp.static_contact.full.common_space import CommonSettings, lowest_of_sets
from tipdamp.static_contact.full.stuck_modes import StuckSet, full_stuck_hz, full_stuck_sets
from tipdamp.static_contact.tuning.roll_springs import RollSpring

BODIES = [rod("one", 350, 2e7, 2e-3), rod("two", 240, 3e7, 1e-3)]
PAIRS = contact_table(
    np.tile(np.eye(3)[[1, 2, 0]], (4, 1, 1)),
    blade_body="one",
    blade_node=[20, 60, 131, 300],
    damper_body="two",
    damper_node=[15, 50, 90, 200],
    kn=2e6,
)
SPRING = [RollSpring(3.0, 0, 2, 1e-3)]
SETS = [
    (PAIRS, []),
    (PAIRS.replace(weight=np.array([1, 0, 0.3, 0])), SPRING),
    (PAIRS.replace(weight=np.array([0, 0, 1.0, 1])), [RollSpring(8.0, 0, 2, 1e-3)]),
    (PAIRS, []),
]


def told(motion, bound=1 + 1e-4, count=5):
    """Hz of each set by a factor of its own, and what a reduction would say of it."""
    hz = [full_stuck_hz(BODIES, table, count, springs) for table, springs in SETS]
    rows = relative_motion(AssembledBodies(BODIES), PAIRS).shape[0]
    made = np.random.default_rng(5).standard_normal((rows, count)) * motion
    return hz, [
        StuckSet(table, springs, bound * one, made)
        for (table, springs), one in zip(SETS, hz, strict=True)
    ]


@pytest.fixture
def factors(monkeypatch):
    """How many times a set had a factor of its own."""
    made = []

    class Counted(stuck_modes.Factor):
        def modes(self, *args, **options):
            made.append(1)
            return super().modes(*args, **options)

    monkeypatch.setattr(stuck_modes, "Factor", Counted)
    return made


@pytest.mark.parametrize("motion", [0.0, 1.0])
@pytest.mark.parametrize("bound, alone", [(1 + 1e-4, 0), (0.9, 4)])
def test_sets_share_a_space(factors, motion, bound, alone):
    """Pairs that go, that keep a part, and springs that come, whatever the reduction says of their
    motion; also where its frequencies are no bounds."""
    hz, sets = told(motion, bound)
    factors.clear()
    found = full_stuck_sets(BODIES, sets)
    assert len(factors) == alone
    for one, expected in zip(found, hz, strict=True):
        assert one == pytest.approx(expected, rel=1e-9)


def test_a_missed_mode_is_found(factors, monkeypatch):
    """The frequencies from the second on in place of the lowest lie above those of a reduction."""
    hz, sets = told(1.0)
    factors.clear()
    missing = [2 * np.pi * np.append(one[1:], 1.01 * one[-1]) for one in hz]
    monkeypatch.setattr(stuck_modes, "lowest_of_sets", lambda *_: missing)
    for one, expected in zip(full_stuck_sets(BODIES, sets), hz, strict=True):
        assert one == pytest.approx(expected, rel=1e-9)
    assert len(factors) == 4


def test_too_little_in_common(factors):
    hz, sets = told(1.0, count=40)
    factors.clear()
    for one, expected in zip(full_stuck_sets(BODIES, sets), hz, strict=True):
        assert one == pytest.approx(expected, rel=1e-9)
    assert len(factors) == 4


def test_a_space_without_room_is_given_up():
    n = 400
    K = sp.diags([np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], [-1, 0, 1]).tocsr()
    R, M = sp.csr_matrix(np.eye(n)[[10, 200]]), sp.identity(n, format="csr")
    k, motion = np.array([[5.0, 0.0], [0.0, 7.0]]), [np.ones((2, 3))] * 2
    assert lowest_of_sets(K, M, R, k, motion, CommonSettings(most=24)) is None
    for one, omega in zip(k, lowest_of_sets(K, M, R, k, motion), strict=True):
        dense = sl.eigvalsh((K + R.T @ np.diag(one) @ R), subset_by_index=(0, 2))
        assert omega**2 == pytest.approx(dense, rel=1e-9)
