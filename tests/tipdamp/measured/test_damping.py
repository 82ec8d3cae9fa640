"""Damping identified on an oscillator whose damping is known."""

import numpy as np
import pytest

from tests.tipdamp.measured.oscillator import PEAK_HZ, ZETA, grid, receptance
from tipdamp.hbm.errors import InputError
from tipdamp.measured.damping import circle_fit, half_power, highest_peak


@pytest.mark.parametrize("zeta", [0.005, 0.022, 0.05])
def test_half_power_of_an_oscillator(zeta):
    """Exact half-power points of the receptance: (f/f0)^2 = 1 - 2 zeta^2 -+ 2 zeta sqrt(1 -
    zeta^2)."""
    hz = grid(step=0.5)
    found = half_power(hz, np.abs(receptance(hz, zeta)))
    low, high = (
        PEAK_HZ * np.sqrt(1 - 2 * zeta**2 + s * 2 * zeta * np.sqrt(1 - zeta**2)) for s in (-1, 1)
    )
    peak = PEAK_HZ * np.sqrt(1 - 2 * zeta**2)
    np.testing.assert_allclose(
        [found.low_hz, found.high_hz, found.peak_hz], [low, high, peak], rtol=2e-6
    )
    assert found.zeta == pytest.approx((high - low) / (2 * peak), rel=1e-4)
    assert found.zeta == pytest.approx(zeta, rel=2 * zeta**2 + 1e-4)


@pytest.mark.parametrize("zeta", [0.005, 0.022, 0.05])
def test_circle_fit_of_an_oscillator(zeta):
    hz = grid(step=1.0)
    assert circle_fit(hz, receptance(hz, zeta)) == pytest.approx(zeta, rel=1e-6)


def test_circle_fit_beside_another_mode():
    """A mode an octave above adds nearly a constant to the mobility, and does not change the
    damping."""
    hz = grid()
    both = receptance(hz) + receptance(hz, natural_hz=2 * PEAK_HZ)
    assert circle_fit(hz, both) == pytest.approx(ZETA, rel=2e-3)


def test_peak_between_two_samples():
    hz = grid(step=7.0)
    peak = PEAK_HZ * np.sqrt(1 - 2 * ZETA**2)
    assert highest_peak(hz, np.abs(receptance(hz)))[0] == pytest.approx(peak, abs=0.05)


@pytest.mark.parametrize(
    ("hz", "why"),
    [
        (grid(2850), "lies at the end of the record, 2850 Hz"),
        (grid(2780, 3100), "no half-power point below the peak"),
        (grid(2500, 2820), "no half-power point above the peak"),
    ],
)
def test_a_cut_peak_has_no_damping(hz, why):
    for method, values in ((half_power, np.abs(receptance(hz))), (circle_fit, receptance(hz))):
        with pytest.raises(InputError, match=why):
            method(hz, values)


def test_a_clipped_peak_has_no_damping():
    hz, top = grid(), 0.9 * np.abs(receptance(PEAK_HZ))
    with pytest.raises(InputError, match="clipped"):
        half_power(hz, np.minimum(np.abs(receptance(hz)), top))


def test_dense_samples_of_a_peak_are_not_clipped():
    """As a computed curve has, where its peak was refined."""
    peak = PEAK_HZ * np.sqrt(1 - 2 * ZETA**2)
    hz = np.unique(np.r_[grid(), peak + 1e-4 * np.arange(-2, 3)])
    assert half_power(hz, np.abs(receptance(hz))).zeta == pytest.approx(ZETA, rel=5e-3)


def test_circle_fit_needs_phase_and_points():
    hz = grid(step=40.0)
    with pytest.raises(InputError, match="needs the phase"):
        circle_fit(hz, np.abs(receptance(hz)))
    with pytest.raises(InputError, match="points within the half-power bandwidth"):
        circle_fit(hz, receptance(hz))


def test_noisy_uneven_samples_give_a_peak_near_the_highest():
    """The parabola through three of them may point anywhere; a refusal is an InputError."""
    rng = np.random.default_rng(1)
    for _ in range(500):
        hz = np.unique(np.r_[np.linspace(2500, 3100, 11), rng.uniform(2780, 2820, 3)])
        x = np.abs(receptance(hz)) * (1 + 0.02 * rng.standard_normal(len(hz)))
        try:
            found = half_power(hz, x)
        except InputError:
            continue
        assert x.max() <= found.peak <= 1.06 * x.max() and abs(found.peak_hz - hz[x.argmax()]) < 200
