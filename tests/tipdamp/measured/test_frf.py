"""Quantities and repeats of measured curves."""

import numpy as np
import pytest

from tests.tipdamp.measured.oscillator import grid, receptance
from tipdamp.hbm.errors import InputError
from tipdamp.measured.frf import Frf, average
from tipdamp.measured.frf import receptance as to_receptance


@pytest.mark.parametrize(
    ("quantity", "power"), [("receptance", 0), ("mobility", 1), ("accelerance", 2)]
)
def test_quantities_by_differentiation(quantity, power):
    hz = grid()
    x = receptance(hz)
    motion = x * (2j * np.pi * hz) ** power
    np.testing.assert_allclose(to_receptance(quantity, hz, motion), x, rtol=1e-13)
    np.testing.assert_allclose(to_receptance(quantity, hz, np.abs(motion)), np.abs(x), rtol=1e-13)


def test_mean_and_band_of_repeats():
    hz, x = grid(), np.abs(receptance(grid()))
    curve = average(
        [Frf(hz, factor * x, 1.0, f"run {k}") for k, factor in enumerate((0.9, 1.0, 1.1))]
    )
    np.testing.assert_allclose(curve.mean, x)
    np.testing.assert_allclose(curve.deviation, 0.1 * x)  # sample deviation of 0.9, 1.0, 1.1
    for scatter, half in ((0.05, 0.2), (0.3, 0.3)):
        np.testing.assert_allclose(curve.band(scatter), [(1 - half) * x, (1 + half) * x])


def test_repeats_on_other_frequencies():
    coarse, fine = grid(2550, 3000, 10.0), grid(step=1.0)
    curve = average([Frf(hz, np.abs(receptance(hz)), 1.0, "run") for hz in (coarse, fine)])
    np.testing.assert_array_equal(curve.hz, coarse)
    np.testing.assert_allclose(curve.mean, np.abs(receptance(coarse)), rtol=1e-12)
    with pytest.raises(InputError, match="no frequencies in common"):
        average(
            [
                Frf(hz, np.abs(receptance(hz)), 1.0, "run")
                for hz in (grid(2500, 2600), grid(2700, 2800))
            ]
        )
