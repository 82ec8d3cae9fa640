"""What can slip or lift off, counted before a curve is followed: beside what does on the curve, and
its memory."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks import hundreds
from tests.hbm.small_rig import small_rig
from tipdamp.hbm.balance.activity import activity, opening
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.interface import SETTINGS as INTERFACE
from tipdamp.hbm.interface import Excitation, reduce_interface
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.memory import curve_bytes
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import follow_band

MODEL, PAIRS, TIP = small_rig(stations=6)
BAND = (300, 330)


def problem_of(pairs, **more):
    return contact_problem(MODEL, pairs, DryFriction2T(), damping_ratio=0.02, **more)[0]


def counted(problem, level, force=TIP, band=BAND):
    return activity(problem, level * force, band, "zero_slider")


@pytest.mark.parametrize("level", [1e-3, 20.0, 60.0, 200.0])
def test_no_fewer_than_on_the_curve(level):
    """Pairs that slip or lift at once on the curve are among those counted; none where none
    moves."""
    problem = problem_of(PAIRS)
    curve = follow_band(problem, level * TIP, BAND, harmonics=3, outputs={"tip": TIP})
    moving = int(((curve.share_slip + curve.share_open) > 0).sum(axis=1).max())
    found = counted(problem, level)
    assert moving <= found.contacts <= 12 and found.components <= 3 * found.contacts
    assert found.contacts == 0 if level < 1 else moving > 0 or level < 60


def test_more_preload_and_friction_move_fewer():
    """All at once: what a motion moves depends on its ratio to the preload alone; the unit of force
    does not count."""
    first = [counted(problem_of(PAIRS), level) for level in (5.0, 50.0, 500.0)]
    larger = problem_of(PAIRS.replace(preload=10 * PAIRS.preload))
    assert [counted(larger, 10 * level) for level in (5.0, 50.0, 500.0)] == first
    assert first[0].components < first[1].components < first[2].components


def test_open_pairs_are_counted():
    """Open at rest: all three components differ from the springs."""
    preload = np.where(np.arange(12) < 4, -1e3, 1e6)
    assert counted(problem_of(PAIRS.replace(preload=preload)), 1.0) == (4, 12)


def test_many_dofs_count_as_few(monkeypatch):
    """Where not all modes are made, those of the band are."""
    every = counted(problem_of(PAIRS), 60.0)
    monkeypatch.setattr(
        "tipdamp.hbm.balance.problem.DEFAULT", replace(DEFAULT, few_modes_of_ratio=0)
    )
    problem = problem_of(PAIRS)
    assert problem.reducible and counted(problem, 60.0) == every


@pytest.mark.slow
def test_memory_of_an_interface_reduction_whose_pairs_all_slip(monkeypatch):
    """120 pairs, all sliding, 8 of them followed: the curve takes what is counted for all pairs."""
    monkeypatch.setattr(hundreds, "SLIP", 30)
    arrays, pairs, push = hundreds.face_to_face(120)
    model = ReducedModel.from_matrices(**arrays)
    law = DryFriction2T()
    force = 100 * push
    settings = Excitation([force], hundreds.FACES_BAND, 3)
    found = reduce_interface(model, pairs, law, settings, settings=replace(INTERFACE, followed=8))
    problem = contact_problem(found.model, pairs, law, damping_ratio=0.01)[0]
    act = activity(problem, force @ found.basis, hundreds.FACES_BAND, "zero_slider")
    options = dict(outputs={"push": push @ found.basis}, harmonics=3)
    # loads and compiles
    follow_band(problem, 1e-3 * force @ found.basis, hundreds.FACES_BAND, **options)
    tracemalloc.start()
    curve = follow_band(problem, force @ found.basis, hundreds.FACES_BAND, **options)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert ((curve.share_slip + curve.share_open) > 0).sum(axis=1).max() == act.contacts == 120
    assert 0.5 < curve_bytes(act.components / 3, 120, 3, 3) / peak < 2
    assert curve_bytes(8, 120, 3, 3) < 0.6 * peak


def test_contacts_that_lift_off_are_counted_apart():
    """Sliders that nothing limits leave lifting off alone; open at rest counts as none."""
    free = PAIRS.replace(mu=np.full(12, 1e9))
    for preload in (PAIRS.preload, np.where(np.arange(12) < 4, -1e3, PAIRS.preload)):
        problem = problem_of(free.replace(preload=preload))
        still, much = (opening(problem, level * TIP, BAND, "zero_slider") for level in (1e-3, 1e6))
        assert (still, much) == (0, int((preload > 0).sum()))
        assert counted(problem, 1e6).contacts == 12
