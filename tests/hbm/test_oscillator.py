"""Planar blade-damper-blade oscillator; its tables and peaks are a subject of tests/validation.

Free damper, no springs to ground, statics solved with the rest.
"""

import numpy as np
import pytest

from tests.hbm.cases import solve
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm.comparison import compare_point
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.response import follow_band

STUCK_HZ = [84.971, 161.981, 225.079, 256.630, 399.950, 555.087]


def test_stuck_frequencies():
    hz = oscillator().receptance().frequencies
    assert np.allclose(hz[::2], STUCK_HZ, rtol=1e-5)  # poles come in pairs


def test_static_normal_loads():
    """Friction-free start, m = (0, 0): 31.388 and 79.436 N when the force vanishes."""
    curve = follow_band(
        oscillator(),
        0 * FORCE,
        (100, 110),
        harmonics=1,
        start="zero_force",
        outputs={f"u{i}": row for i, row in enumerate(oscillator().B)},
    )
    assert curve.complete and len(curve.frequency) == 2
    assert curve.origin == "unloaded" and curve.start == "zero_force"
    assert np.allclose(curve.harmonics[..., 1], 0)
    assert np.allclose(3e5 * curve.harmonics[0, [2, 5], 0].real, [31.388, 79.436], atol=1e-3)


def test_static_normal_loads_from_the_unloaded_place():
    """By default the friction springs are at rest before the load: the statics of the springs
    alone, as none slips."""
    problem, law = oscillator(mu=5.0), DryFriction2T()
    curve = follow_band(
        problem,
        0 * FORCE,
        (100, 110),
        harmonics=1,
        outputs={f"u{i}": row for i, row in enumerate(problem.B)},
    )
    springs = np.diag(law.stuck_stiffness(problem.contacts).ravel())
    stuck = problem.B @ np.linalg.solve(
        problem.K + problem.B.T @ springs @ problem.B, problem.static
    )
    assert curve.start == "zero_slider" and (curve.share_stick == 1).all()
    assert np.allclose(curve.harmonics[0, :, 0].real, stuck, rtol=1e-9, atol=1e-15)


def test_slider_start_is_part_of_the_problem():
    q, _, _ = solve(oscillator(), FORCE, 2 * np.pi * 160, 1, start="zero_slider")
    assert abs(q[3, 1]) == pytest.approx(1.88456e-4, rel=2e-4)


@pytest.mark.parametrize("seed", range(8))
def test_random_oscillators_are_complete_from_end_to_end(seed):
    """mu, stiffness and excitation at random, default settings (200 of them, and harder ones:
    tests/benchmarks)."""
    rng = np.random.default_rng(seed)
    mu = rng.uniform(0.1, 0.8)
    kn = 10 ** rng.uniform(5, 6.5)
    kt = 10 ** rng.uniform(5, 6.5)
    level, H = 10 ** rng.uniform(np.log10(0.05), np.log10(2)), int(rng.integers(1, 8))
    curve = follow_band(oscillator(mu, kn, kt), level * FORCE, (60, 300), harmonics=H, outputs=Y2)
    assert curve.complete, curve.ended


def test_a_point_of_the_curve_against_time_integration():
    q, point, balance = solve(
        oscillator(kn=1e6, kt=4e5), 0.6 * FORCE, 2 * np.pi * 160, 9, start="zero_force"
    )
    c = compare_point(balance, point, [Y2["y2"]])
    assert c.agrees and c.difference < 5e-3
