"""Planar blade-damper-blade oscillator: table and peaks of tests/reference/hbm/oscillator.md.

Free damper, no springs to ground, statics solved with the rest.
"""

import numpy as np
import pytest

from hbm.response import follow_band
from hbm.time.comparison import compare_point
from tests.hbm.cases import solve
from tests.hbm.oscillator import FORCE, Y2, oscillator

# f (Hz): H = 1, 3, 5, 9, time integration
TABLE = {150: [2.79185e-5] * 4 + [2.79164e-5], 155: [5.57187e-5] * 4 + [5.57125e-5],
         160: [1.98684e-4, 1.99790e-4, 2.00076e-4, 2.00064e-4, 1.99888e-4],
         162: [2.58829e-4, 2.21221e-4, 2.24989e-4, 2.25018e-4, 2.25009e-4],
         163: [2.41374e-4, 2.25083e-4, 2.27324e-4, 2.27274e-4, 2.27307e-4],
         165: [1.52150e-4] * 4 + [1.52172e-4], 170: [7.11574e-5] * 4 + [7.11621e-5],
         180: [4.01802e-5] * 4 + [4.01806e-5]}
PEAK = {1: (161.8, 2.5924e-4), 3: (163.1, 2.2519e-4), 5: (163.0, 2.2733e-4), 9: (163.0, 2.2728e-4)}
STUCK_HZ = [84.971, 161.981, 225.079, 256.630, 399.950, 555.087]


def test_stuck_frequencies():
    hz = oscillator().receptance().frequencies
    assert np.allclose(hz[::2], STUCK_HZ, rtol=1e-5)       # poles come in pairs


@pytest.mark.parametrize("H", PEAK)
def test_table_and_peak_in_both_directions(H):
    column = list(PEAK).index(H)
    for f, row in TABLE.items():
        q, _, _ = solve(oscillator(), FORCE, 2 * np.pi * f, H, start="zero_force")
        assert abs(q[3, 1]) == pytest.approx(row[column], rel=2e-4)
        if H == 9:
            assert abs(q[3, 1]) == pytest.approx(row[4], rel=1.5e-3)
    for band in ((150, 180), (180, 150)):
        curve = follow_band(oscillator(), FORCE, band, harmonics=H, outputs=Y2)
        hz, amplitude = curve.peak("y2", "harmonic")
        assert curve.complete and curve.origin == "unloaded" and curve.start == "zero_force"
        assert abs(hz - PEAK[H][0]) < 0.1 and amplitude == pytest.approx(PEAK[H][1], rel=5e-4)


def test_static_normal_loads():
    """Friction-free start, m = (0, 0): 31.388 and 79.436 N when the force vanishes."""
    curve = follow_band(oscillator(), 0 * FORCE, (100, 110), harmonics=1,
                        outputs={f"u{i}": row for i, row in enumerate(oscillator().B)})
    assert curve.complete and len(curve.frequency) == 2
    assert np.allclose(curve.harmonics[..., 1], 0)
    assert np.allclose(3e5 * curve.harmonics[0, [2, 5], 0].real, [31.388, 79.436], atol=1e-3)


def test_start_of_the_slider_is_part_of_the_problem():
    q, _, _ = solve(oscillator(), FORCE, 2 * np.pi * 160, 1, start="zero_slider")
    assert abs(q[3, 1]) == pytest.approx(1.88456e-4, rel=2e-4)


@pytest.mark.parametrize("seed", range(8))
def test_random_oscillators_are_complete_from_end_to_end(seed):
    """mu, stiffness and excitation at random, default settings (200 of them, and harder ones: tests/benchmarks)."""
    rng = np.random.default_rng(seed)
    mu, kn, kt = rng.uniform(0.1, 0.8), 10 ** rng.uniform(5, 6.5), 10 ** rng.uniform(5, 6.5)
    level, H = 10 ** rng.uniform(np.log10(0.05), np.log10(2)), int(rng.integers(1, 8))
    curve = follow_band(oscillator(mu, kn, kt), level * FORCE, (60, 300), harmonics=H, outputs=Y2)
    assert curve.complete, curve.ended


def test_a_point_of_the_curve_against_time_integration():
    q, point, balance = solve(oscillator(kn=1e6, kt=4e5), 0.6 * FORCE, 2 * np.pi * 160, 9, start="zero_force")
    c = compare_point(balance, point, [Y2["y2"]])
    assert c.agrees and c.difference < 5e-3
