"""Contacts that stay open are taken out of Newton's system: the same steps as with them in it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.test_many_pairs import bar
from tipdamp.hbm import fourier
from tipdamp.hbm.balance import condensation
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.truncation import TruncationEstimate

W, H = 2 * np.pi * 110.0, 3


def apart(few, monkeypatch):
    """`few_open` of the settings."""
    monkeypatch.setattr(condensation, "DEFAULT", replace(condensation.DEFAULT, few_open=few))


def linearised(open_pairs=range(4, 10), level=6.0):
    """The bar with pairs that are open at rest, half way between stuck and at rest: the others slip
    and lift."""
    problem, _ = bar()
    preload = problem.contacts.preload.copy()
    preload[list(open_pairs)] = -50.0
    held = problem.K + 1e3 * np.eye(len(problem.K))  # without contacts the bar would be free
    contacts = replace(problem.contacts, preload=preload)
    problem = replace(problem, K=held, contacts=contacts)
    balance = HarmonicBalance(problem, {1: level * np.eye(len(problem.K))[0]}, H)
    return balance.evaluate(0.5 * balance.linear(W), W)


@pytest.fixture(params=[range(4, 10), range(16)], ids=["some", "all"])
def both(request, monkeypatch):
    """The same point with the open contacts in the system, and with them taken out."""
    made = []
    for few in (1000, 1):
        apart(few, monkeypatch)
        here = linearised(request.param)
        made.append((here, here._condensed()))
    (_, whole), (_, less) = made
    assert whole.open is None
    assert len(less.open.rows) == 3 * len(request.param)
    assert len(less.acting.rows) == len(whole.acting.rows) - len(less.open.rows)
    return [here for here, _ in made]


def test_steps_and_determinants_are_the_same(both):
    (whole, less), rng = both, np.random.default_rng(3)
    row = rng.normal(size=len(whole.x))
    for corner in (0.7, -0.7):
        for residual in (None, 1e-5 * rng.normal(size=len(row))):
            expected = whole.solve(row, corner, 0.3, residual)
            found = less.solve(row, corner, 0.3, residual)
            assert found[1] == pytest.approx(expected[1], rel=1e-9)
            assert np.abs(found[0] - expected[0]).max() < 1e-9 * np.abs(expected[0]).max()
        assert less.direction(row, corner)[2] == whole.direction(row, corner)[2]


def test_step_solves_the_linearised_equations(both):
    """By differences of the residual, with no formula of the system."""
    _, less = both
    row = np.ones(len(less.x))
    dx, dp = less.solve(row, 0.5, 0.0)
    step = 1e-7
    moved = less.balance.evaluate(less.x + step * dx, less.w + step * dp)
    change = (moved.residual - less.residual) / step
    assert np.abs(change + less.residual).max() < 1e-5 * np.abs(less.residual).max()


def test_softest_motion_is_the_same(both):
    """Where all are out, nothing is left of Newton's matrix."""
    whole, less = both
    if not len(less._condensed().acting.rows):
        assert less.smallest_motion() == (1.0, None)
        return
    (_, expected), (_, found) = whole.smallest_motion(), less.smallest_motion()
    assert np.isfinite(found).all() and found.shape == expected.shape


def test_estimated_errors_are_the_same(both):
    found = []
    for few, here in zip((1000, 1), both, strict=True):
        with pytest.MonkeyPatch.context() as patch:
            apart(few, patch)
            balance = here.balance
            rows = np.eye(len(balance.problem.K))[:3]
            estimate = TruncationEstimate(Equation(balance, Frequency(), W), rows)
            point = Point(here.x, W, True, 1, here, (0 * here.x, 1.0), 1.0)
            change, motion = estimate.change(here, point)
            found.append((fourier.rms(change), motion))
    (expected, motion), (rms, moved) = found
    assert rms == pytest.approx(expected, rel=1e-8)
    assert np.abs(moved - motion).max() < 1e-8 * np.abs(motion).max()
