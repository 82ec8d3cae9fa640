"""Amplitudes of series: the same bits wherever they lie in memory, slopes to rounding."""

import numpy as np
import pytest

from tipdamp.hbm.amplitude import KINDS, amplitude, amplitude_along
from tipdamp.hbm.fourier import half_peak_to_peak, half_peak_to_peak_along

RNG = np.random.default_rng(1)


def placed(X, filler):
    """X in fresh memory, with other blocks made and dropped around it."""
    blocks = [np.empty(n) for n in filler]
    del blocks[::2]
    return X.copy()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("H", [1, 2, 3])
def test_same_bits_wherever_it_lies(kind, H):
    for _ in range(40):
        X, dX = RNG.normal(size=(2, 1, H + 1)) + 1j * RNG.normal(size=(2, 1, H + 1))
        found = set()
        for _ in range(30):
            filler = RNG.integers(1, 12, size=RNG.integers(1, 40))
            one, change = placed(X, filler), placed(dX, filler)
            value, slope = amplitude_along(one, change, kind, [1])
            found.add((float(amplitude(one, kind, [1])[0]), float(value[0]), float(slope[0])))
        assert len(found) == 1


def test_slope_to_rounding():
    """Against extremal instants bisected from their rate."""
    k = np.arange(1, 6)
    for _ in range(50):
        X = np.r_[0, (RNG.normal(size=5) + 1j * RNG.normal(size=5)) * 0.3 ** (k - 1)]
        dX = np.r_[0, RNG.normal(size=5) + 1j * RNG.normal(size=5)]

        def rate(t, X=X):
            return -(X[1:] * np.exp(1j * k * t)).imag @ k

        tau = np.linspace(0, 2 * np.pi, 20001)
        values = (X[1:] @ np.exp(1j * np.outer(k, tau))).real
        slope = []
        for i, sign in ((values.argmax(), 1), (values.argmin(), -1)):
            low, high = tau[i] - 1e-3, tau[i] + 1e-3
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if sign * rate(middle) > 0 else (low, middle)
            slope.append((dX[1:] @ np.exp(1j * k * low)).real)
        value, found = half_peak_to_peak_along(X, dX)
        assert value == half_peak_to_peak(X)
        assert found == pytest.approx(0.5 * (slope[0] - slope[1]), rel=1e-12, abs=1e-13)


def test_no_number_stays_no_number():
    X = np.array([[0, 1, 0.1], [0, np.nan, 0]], dtype=complex)
    for kind in KINDS:
        good, bad = amplitude(X, kind, [1])
        assert np.isfinite(good) and np.isnan(bad)
