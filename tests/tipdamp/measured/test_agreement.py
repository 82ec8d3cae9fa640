"""Share of a computed curve within a measured band."""

import numpy as np
import pytest

from tests.tipdamp.measured.oscillator import grid, receptance
from tipdamp.measured.agreement import drawn, share_inside, values_at


def test_drawn_curve_passes_its_points_and_follows_the_resonance():
    coarse = grid(step=30.0)
    hz, x = drawn(coarse, np.abs(receptance(coarse)))
    np.testing.assert_allclose(
        np.interp(coarse, hz[:-1], x[:-1]), np.abs(receptance(coarse)), rtol=1e-12
    )
    good = np.isfinite(hz)
    assert np.abs(x[good] - np.abs(receptance(hz[good]))).max() < 0.01 * np.nanmax(x)


def test_share_inside_the_band():
    hz, dense = grid(), grid(2400, 3200, 1.0)
    x = np.abs(receptance(hz))
    assert share_inside(hz, 0.95 * x, 1.05 * x, dense, np.abs(receptance(dense))) == 1.0
    assert share_inside(hz, 1.05 * x, 1.1 * x, dense, np.abs(receptance(dense))) == 0.0
    half = dense[dense <= 2800]  # the part that it does not cover does not count
    assert share_inside(hz, 0.95 * x, 1.05 * x, half, np.abs(receptance(half))) == 1.0
    shifted = share_inside(
        hz, 0.95 * x, 1.05 * x, dense, np.abs(receptance(dense, natural_hz=2830))
    )
    assert 0.0 < shifted < 0.5
    assert np.isnan(
        share_inside(np.array([10.0, 20.0]), x[:2], x[:2], dense, np.abs(receptance(dense)))
    )


def test_a_fold_has_several_values_and_any_of_them_counts():
    path_hz, path = np.array([1.0, 2.0, 1.5, 3.0]), np.array([1.0, 2.0, 3.0, 4.0])
    (at,) = values_at(np.array([1.75]), path_hz, path)
    np.testing.assert_allclose(at, [1.75, 2.5, 3.0 + 1 / 6])


def test_a_gap_is_not_bridged():
    path_hz = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    path = np.array([1.0, 2.0, np.nan, 4.0, 5.0])
    assert [len(v) for v in values_at(np.array([1.53, 2.5, 3.5, 4.53]), *drawn(path_hz, path))] == [
        1,
        0,
        0,
        1,
    ]
    assert share_inside(np.array([2.5]), np.zeros(1), np.ones(1), path_hz, path) == pytest.approx(
        np.nan, nan_ok=True
    )
