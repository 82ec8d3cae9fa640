"""The condensed Newton system against the full Jacobian by differences, for every kind of damping and parameter."""

import numpy as np
import pytest

from hbm.laws import DryFriction2T
from hbm.residual import HarmonicBalance
from hbm.response import contact_problem
from tests.hbm.cases import coupled, load
from tests.hbm.small_rig import small_rig


def pencil_case():
    problem, force = coupled(load("D1")["parameters"])
    return HarmonicBalance(problem, {1: force}, 3), 1.1, 0.3


def modal_case():
    model, pairs, tip = small_rig(stations=7)         # 102 dofs: the high modes go through the series
    problem, _ = contact_problem(model, pairs.select(np.arange(0, 14, 6)), DryFriction2T(), damping_ratio=0.02)
    return HarmonicBalance(problem, {1: 40 * tip}, 2), 2 * np.pi * 1300.0, 8e-6


@pytest.mark.parametrize("by", ["w", "level", "preload", "mu"])
@pytest.mark.parametrize("case", [pencil_case, modal_case])
def test_bordered_solve_and_determinant(case, by):
    balance, w, size = case()
    rng = np.random.default_rng(0)
    x = balance.linear(w) + size * rng.normal(size=balance.n_components * balance.nh) / balance.nh
    n = len(x)
    e = balance.evaluate(x, w, by=by)
    assert len(e.bracket.pair) > 0
    h = 1e-6 * size
    J = np.array([(balance.evaluate(x + h * v, w).residual - balance.evaluate(x - h * v, w).residual) / (2 * h)
                  for v in np.eye(n)]).T
    d = 1e-6 * (w if by == "w" else 1.0)
    ends = [balance.evaluate(x, **({"w": w + s} if by == "w" else
                                   {"w": w, "by": by, "level" if by == "level" else "factor": 1 + s})).residual
            for s in (d, -d)]
    slope = (ends[0] - ends[1]) / (2 * d)
    assert np.abs(e.by_parameter - slope).max() < 1e-5 * np.abs(slope).max()
    row, corner = rng.normal(size=n) / size, 0.7 / (w if by == "w" else 1.0)
    full = np.block([[J, slope[:, None]], [row[None], np.array([[corner]])]])
    dx, dp = e.solve(row, corner, 0.3)
    expected = np.linalg.solve(full, np.r_[-e.residual, 0.3])
    assert np.abs(dx - expected[:n]).max() < 1e-4 * np.abs(expected[:n]).max()
    assert dp == pytest.approx(expected[n], rel=1e-4)
    assert e.direction(row, corner)[2] == np.linalg.slogdet(full)[0]
