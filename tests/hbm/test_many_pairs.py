"""A free bar along the axis under a stretching blade: many pairs that slip and lift off, mirrored
about the middle.

Mirrored pairs change state at once. When the last two that hold the bar along its axis begin to
slide in each cycle, no force depends on where it stands on average: the periodic state exists, by
symmetry, but its mean position is free."""

from dataclasses import replace

import numpy as np
import pytest

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.comparison import left_orbit
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.solutions import points_at
from tipdamp.hbm.laws import Contacts, DryFriction2T
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.time.settings import IntegrationSettings

N = 16  # pairs
BAND = (80, 180)  # Hz, around the blade's 100 Hz alone and its resonance with the bar stuck to it
CHAIN = {"t1": 1e6, "t2": 1e5, "n": 1e5}  # N/m between neighbouring nodes of the bar


def bar(half=False, skew=0.0):
    """(problem, share) of the blade's mode, which stretches the surface, turns it and lifts it; or
    half of the bar.

    The halves move against each other along the axis and across it, so that the middle of each
    spring between them stands still, and alike along the normal.
    """
    law = DryFriction2T()
    x = np.linspace(-1, 1, N)[N // 2 if half else 0 :]
    n, share = len(x), 0.5 if half else 1.0
    shape = {"t1": x, "t2": 0.2 * x, "n": 0.3 + 0.06 * x**2}
    M = np.diag(np.r_[share, np.full(3 * n, 0.002)])
    K = np.zeros((1 + 3 * n,) * 2)
    B = np.zeros((3 * n, 1 + 3 * n))
    K[0, 0] = share * (2 * np.pi * 100.0) ** 2
    for d, name in enumerate(law.components):
        dof = 1 + 3 * np.arange(n) + d
        for a, b in zip(dof[:-1], dof[1:], strict=True):
            K[np.ix_([a, b], [a, b])] += CHAIN[name] * np.array([[1, -1], [-1, 1]])
        if half and name != "n":
            K[dof[0], dof[0]] += 2 * CHAIN[name]
        B[dof - 1, dof] = 1.0
        B[dof - 1, 0] = -shape[name]
    pairs = Contacts(np.full(n, 3e4), np.full(n, 2e4), np.full(n, 0.4), 1 + 0.3 * x**2 + skew * x)
    return ContactProblem(M, None, K, B, law, pairs, damping_ratio=0.01), share


def curve_of_bar(level, half=False, skew=0.0, **more):
    """Response of the bar at a force of the whole bar."""
    problem, share = bar(half, skew)
    tip = np.eye(len(problem.K))[0]
    given = dict(harmonics=3, outputs={"tip": tip}, truncation=False)
    return follow_band(problem, share * level * tip, BAND, **given, **more)


@pytest.mark.slow
@pytest.mark.parametrize("level", [20.0, 40.0])  # every pair slides; and every pair lifts off too
def test_free_bar_is_twice_its_half(level):
    whole, half = curve_of_bar(level), curve_of_bar(level, half=True)
    assert whole.complete and half.complete, (whole.ended, half.ended)
    assert (whole.share_slip + whole.share_open).max(axis=0).min() > 0
    assert (whole.share_open.max(axis=0) > 0).all() == (level == 40.0)
    assert whole.residual_calls < 4 * len(whole.frequency)
    assert whole.peak("tip") == pytest.approx(half.peak("tip"), rel=1e-6)


def test_an_orbit_beside_it_is_the_same_orbit():
    """Every pair slides, and where the bar stands on average is open: moved along by a thousandth,
    it did not leave."""
    curve = curve_of_bar(20.0)
    sliding = curve.frequency[(curve.share_slip + curve.share_open).min(axis=1) > 0]
    balance, points = points_at(curve, bar()[0], sliding.mean())
    moved = points[0].x.reshape(balance.n_components, -1).copy()
    moved[::3, 0] += 1e-3 * np.abs(moved[:, 1:]).max()
    assert not left_orbit(
        balance, points[0], fourier.to_complex(moved), 1e-3, IntegrationSettings()
    )


def test_rigid_body_drift_is_reported():
    """Pressed more at one end, it is driven along its axis once every pair slides, and nothing
    brings it back."""
    curve = curve_of_bar(40.0, skew=0.05)
    assert not curve.complete and curve.ended.count("rigid-body drift") == 1
    assert "nothing restrains a mean motion" in curve.ended and "stiffness" in curve.ended
    assert curve.residual_calls < 1000


def test_work_is_bounded():
    """The same with an allowance that it cannot keep: it ends with the reason and what to do, and
    keeps its points."""
    settings = replace(DEFAULT, max_calls=50, calls_per_point=1)
    curve = curve_of_bar(40.0, settings=settings)
    assert not curve.complete and "more evaluations of the residual than allowed" in curve.ended
    assert "max_calls" in curve.ended
    points = len(curve.frequency)
    # and the peaks'
    assert 10 < points and curve.converged.all() and curve.residual_calls <= 50 + points + 40
