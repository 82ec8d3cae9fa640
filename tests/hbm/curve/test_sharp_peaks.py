"""Sharp peaks and folds: the Duffing oscillator at H = 1, whose peak is known in closed form."""

import numpy as np
import pytest

from tests.hbm.cases import duffing, duffing_peak
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.response import follow_band


def curve_of(problem, F, band, H=1):
    """Response from band[0] to band[1] rad/s."""
    return follow_band(
        problem,
        np.array([F]),
        np.array(band) / (2 * np.pi),
        harmonics=H,
        outputs={"x": np.ones(1)},
        truncation=False,
    )


def test_closed_form_itself():
    """m = k = cubic = 1, c = 0.03, F = 0.2: 2.657120165 at 2.508937161 rad/s, by hand."""
    assert duffing_peak(0.03, 0.2) == pytest.approx((2.508937161, 2.657120165), rel=1e-9)


@pytest.mark.parametrize(
    "band", [(0.5, 3.1), (3.1, 0.5), (0.4, 3.5), (3.5, 0.4), (0.5, 5.0), (5.0, 0.5), (2.9, 0.3)]
)
def test_sharp_peak_for_any_band_and_direction(band):
    problem = duffing(0.03)
    curve = curve_of(problem, 0.2, band)
    w, A = duffing_peak(0.03, 0.2)
    assert curve.complete
    assert curve.peak("x")[1] == pytest.approx(A, rel=1e-9)
    assert 2 * np.pi * curve.peak("x")[0] == pytest.approx(w, rel=1e-6)
    assert find_peaks(curve, problem, "x", "harmonic")[0, 1] == pytest.approx(A, rel=1e-9)


@pytest.mark.slow
def test_random_sharp_peaks():
    """16 random dampings, forces and springs, both directions, seeded."""
    rng = np.random.default_rng(1)
    for _ in range(16):
        c, F, cubic = 10 ** rng.uniform([-2.3, -1.5, -1.0], [-0.7, 0.3, 1.0])
        w, A = duffing_peak(c, F, cubic)
        band = np.array([0.3 * rng.uniform(0.8, 1.2), w * rng.uniform(1.15, 1.6)])
        for direction in (1, -1):
            curve = curve_of(duffing(c, cubic), F, band[::direction])
            assert curve.complete and curve.peak_points.any()
            assert curve.peak("x")[1] == pytest.approx(A, rel=1e-9), (c, F, cubic, direction)


@pytest.mark.parametrize("H", [1, 15])
@pytest.mark.parametrize("band", [(0.5, 3.1), (3.1, 0.5)])
def test_three_solutions_up_to_the_fold(H, band):
    """The upper fold lies at the largest frequency of the upper branch; just inside three
    solutions, outside one."""
    problem = duffing(0.03)
    curve = curve_of(problem, 0.2, band, H)
    inside, outside = curve.peak("x")[0], 3.0 / (2 * np.pi)
    for _ in range(36):  # to 1e-12
        middle = 0.5 * (inside + outside)
        inside, outside = (
            (middle, outside)
            if len(solutions_at(curve, problem, middle)) == 3
            else (inside, middle)
        )
    for share in (1e-2, 1e-3, 1e-4, 1e-6):
        assert len(solutions_at(curve, problem, inside * (1 - share))) == 3
        assert len(solutions_at(curve, problem, inside * (1 + share))) == 1
    # rad/s, where a bisection by solutions from all bands ends
    reference = {1: 2.509035309578, 15: 2.517290978755}
    assert 2 * np.pi * inside == pytest.approx(reference[H], rel=1e-9)
