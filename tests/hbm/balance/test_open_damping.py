"""Damping ratios of modes that leave contacts open, against responses too small to slip."""

from dataclasses import replace

import numpy as np
import pytest

from tipdamp import DryFriction2T, forced_response, linear_response
from tipdamp.hbm.balance.open_damping import open_modes
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.example import two_blades

ZETA = 0.01


def test_the_linear_response_with_a_pair_open_at_rest():
    """Its resonance is as high as that of the curve with the ratios that follow, and not with those
    that were asked for."""
    model, pairs = two_blades()
    preload = pairs.preload.copy()
    preload[0] = -1e3  # never closes
    pairs = replace(pairs, preload=preload)
    closed = pairs.select(preload > 0)
    tip = model.displacement_row("blade1", 1, [0, 1, 0])
    given = {"outputs": {"tip": tip}, "damping_ratio": ZETA}
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=ZETA)
    own = open_modes(problem).own
    hz = np.linspace(600.0, 1400.0, 4001)
    tops = [
        np.abs(linear_response(model, closed, tip, hz, ratio, {"tip": tip})).max()
        for ratio in (own, ZETA)
    ]
    curve = forced_response(
        model, pairs, DryFriction2T(), 1e-3 * tip, (600, 1400), harmonics=1, **given
    )
    assert not curve.share_slip.any()
    top = np.abs(curve.harmonics[:, 0, 1]).max() / 1e-3
    assert tops[0] == pytest.approx(top, rel=0.02)
    assert abs(tops[1] / top - 1) > 0.1


def test_nothing_where_all_are_closed():
    model, pairs = two_blades()
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=ZETA)
    assert open_modes(problem) is None
