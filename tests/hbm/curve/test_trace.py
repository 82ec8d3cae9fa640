"""Branches of the harmonic balance: every point solves the equations, few calls, and ends in
words."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.hbm.cases import beam, rig
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.follow import follow
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.starts import first_point
from tipdamp.hbm.curve.trace import unrestrained
from tipdamp.hbm.hold.named_motion import NamedMotion
from tipdamp.hbm.laws import DryFriction2T, Jenkins1D
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band


@pytest.mark.parametrize("case,level,H", [("B8", 20, 7), ("C8", 40, 7), ("C8", 200, 3)])
def test_unevaluated_last_steps_solve_the_equations(case, level, H):
    """Every accepted point, its outputs and its forces, put back into the residual."""
    problem, force, outputs = beam(case)
    balance = HarmonicBalance(problem, {1: level * force}, H)
    begin = first_point(balance, 2 * np.pi * 700, Settings())
    branch = follow(balance.evaluate, begin, 2 * np.pi * 1200, balance.weights)
    linearised = 0
    for point in branch.points:
        again = balance.evaluate(point.x, point.parameter)
        size = np.linalg.norm(balance.weights * point.x)
        assert np.linalg.norm(again.residual) < 1e-9 * size
        assert np.abs(again.modal - point.detail.modal).max() < 1e-9 * np.abs(again.modal).max()
        assert (
            np.abs(again.forces.g - point.detail.forces.g).max()
            <= 1e-8 * np.abs(again.forces.g).max()
        )
        linearised += (
            point.detail.x is not point.x and np.linalg.norm(point.detail.residual) > 1e-10 * size
        )
    assert branch.complete and linearised > 0.5 * len(branch.points)


def test_residual_calls_and_points_of_the_rig():
    """The rig's 18 pairs at H = 5 and 20 N: the figures that are promised."""
    problem, force, outputs = rig()
    curve = follow_band(problem, 20 * force, (2300, 3300), harmonics=5, outputs=outputs)
    assert (
        curve.complete
        and curve.residual_calls <= 3 * len(curve.frequency)
        and len(curve.frequency) <= 300
    )


@pytest.mark.slow
@pytest.mark.parametrize("H", [1, 3])
def test_rolling_damper_is_named(H):
    """With the flat's roll stiffness the curve is complete; without it it ends in words: the damper
    lies along y."""
    problem, force, outputs = rig(roll=True)
    held = follow_band(problem, 40 * force, (2300, 3300), harmonics=H, outputs=outputs)
    assert held.complete and held.converged.all() and "rolls" not in held.ended
    problem, force, outputs = rig(roll=False)
    free = follow_band(problem, 40 * force, (2300, 3300), harmonics=H, outputs=outputs)
    assert not free.complete and len(free.frequency) < 300
    assert (
        "the damper rolls (body 'damper' rotates about (0.00, 1.00, 0.00) through (" in free.ended
    )
    assert "no periodic state exists there" in free.ended


@pytest.mark.parametrize("faced", [True, False])
def test_a_motion_that_normals_hold_while_they_are_closed_is_said(faced):
    """Beside the advice to hold it, which `held_motions` doubts of such a motion."""
    motion = np.array([0.0, 0.1, 1.0 if faced else 0.0])
    rolls = NamedMotion("body 'damper' rotates", "damper", True, True, "'about y'")
    problem = SimpleNamespace(law=DryFriction2T(), B=np.eye(3), describe=lambda _: rolls)
    last = SimpleNamespace(detail=SimpleNamespace(smallest_motion=lambda: (1e-9, motion[:, None])))
    said = unrestrained(last, problem)
    assert "the damper rolls" in said and "hold = { motion = 'about y', mean = true }" in said
    assert ("contact normals hold it only while enough of them are closed" in said) == faced


def test_a_mean_that_wanders_in_slip_costs_no_points():
    """Where a contact slips far its mean position is nearly indeterminate: with 'zero_force' it
    moves along the band, with 'zero_slider' it stays at zero, and the branch is no longer by it."""
    absorber = (
        Problem(M=np.eye(2), C=0.01 * np.eye(2), K=np.diag([1.0, 1.5]))
        .add(Jenkins1D(), (0, 1), kt=5.0, mu=0.1, preload=1.0)
        .force(0, 1.0)
    )
    wanders, stays = (
        absorber.follow_band((0.05, 0.4), harmonics=1, outputs={"x": (0, 1)}, start=start)
        for start in ("zero_force", "zero_slider")
    )
    slips_at = 0.1 / 5.0  # m, mu preload / kt
    assert np.ptp(wanders.harmonics[:, 0, 0].real) > slips_at
    assert np.abs(stays.harmonics[:, 0, 0]).max() < 1e-6 * slips_at
    assert wanders.complete and len(wanders.frequency) <= 1.1 * len(stays.frequency)
