"""Bands that begin under a fold, where the branch first leads out of the band."""

import numpy as np
import pytest

from tests.hbm.cases import load, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve import starts
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.response import follow_band

C1 = load("C1")


def test_c1_from_below_its_fold():
    """The band begins at 1.15, where the verification table has three solutions: all are on the
    curve."""
    problem, force = unilateral(C1["parameters"])
    begin = 1.15 / (2 * np.pi)
    curve = follow_band(
        problem, force, (begin, 1.5 / (2 * np.pi)), harmonics=1, outputs={"x": [1.0]}
    )
    assert (
        curve.complete
        and curve.frequency.min() >= begin * (1 - 1e-12)
        and "followed outside" in curve.ended
    )
    known = next(r for r in C1["results"] if r["Omega"] == 1.15)["HB01_all_solutions"]
    found = np.sort(np.abs(solutions_at(curve, problem, begin)[:, 0, 1]))
    assert np.allclose(found, np.sort([s["X1"] for s in known]), rtol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("begin,H", [(155, 5), (155, 9), (160, 5)])
def test_the_oscillator_from_below_its_fold(begin, H):
    """Five times the excitation: Newton from the stuck state fails at 160 Hz, and from 155 Hz the
    branch leads out.

    The end is held against a curve that begins there.
    """
    curve = follow_band(oscillator(), 5 * FORCE, (begin, 180), harmonics=H, outputs=Y2)
    assert curve.complete and curve.frequency.min() >= begin * (1 - 1e-12)
    whole = follow_band(oscillator(), 5 * FORCE, (180, 170), harmonics=H, outputs=Y2)
    assert np.allclose(
        curve.harmonics[-1],
        whole.harmonics[0],
        rtol=1e-6,
        atol=1e-9 * np.abs(whole.harmonics[0]).max(),
    )


def test_first_point_from_outside_the_band():
    balance = HarmonicBalance(oscillator(), {1: 5 * FORCE}, 5, "zero_force")
    w, settings = 2 * np.pi * 170, Settings()
    point = starts._from_frequency(balance, 0.95 * w, w, settings)
    assert point.converged and point.parameter == w and point.iterations > 20
    assert np.linalg.norm(balance.evaluate(point.x, w).residual) < 1e-9 * np.linalg.norm(point.x)


def test_integration_ends_where_its_periods_take_too_many_steps():
    """It leads to where Newton converges, and to none where the steps of a period are used up
    before it ends."""
    balance = HarmonicBalance(oscillator(), {1: 5 * FORCE}, 5, "zero_force")
    w = 2 * np.pi * 170
    x, _ = starts._integrate(balance, w, Settings())
    assert solve_fixed(balance.evaluate, x, w, balance.weights).converged
    assert starts._integrate(balance, w, Settings(start_steps=0))[0] is None
