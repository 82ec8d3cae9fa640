"""Cantilever on eight contacts: fixed-frequency table and complete curves (tests/reference/hbm/frictional-beam.md)."""

import numpy as np
import pytest

from hbm import fourier
from hbm.response import follow_band
from tests.hbm.cases import beam, solve

TABLE = {("B8", 20, 930.6): {1: 9.14515e-5, 3: 9.14730e-5, 7: 9.14525e-5, 15: 9.14524e-5, "time": 9.14529e-5},
         ("C8", 40, 932.1): {1: 1.59843e-4, 3: 1.57963e-4, 7: 1.57987e-4, 15: 1.57987e-4, "time": 1.57986e-4}}


@pytest.mark.parametrize("case", TABLE, ids=lambda c: c[0])
def test_fixed_frequency(case):
    name, level, hz = case
    problem, force, outputs = beam(name)
    for H, expected in TABLE[case].items():
        H = 15 if H == "time" else H
        q, _, _ = solve(problem, level * force, 2 * np.pi * hz, H)
        assert fourier.half_peak_to_peak(outputs["tip"] @ q) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("case", TABLE, ids=lambda c: c[0])
def test_answer_does_not_depend_on_the_samples(case):
    name, level, hz = case
    problem, force, _ = beam(name)
    for H in (1, 3, 7):
        coarse, fine = (solve(problem, level * force, 2 * np.pi * hz, H, samples=n)[0] for n in (64, 1024))
        assert np.abs(coarse - fine).max() < 1e-10 * np.abs(fine).max()


@pytest.mark.slow
@pytest.mark.parametrize("name,levels", [("B8", (1, 20, 80)), ("C8", (1, 40, 200))])
@pytest.mark.parametrize("H", [1, 3, 7])
def test_every_curve_is_complete_with_the_same_peak_both_ways(name, levels, H):
    problem, force, outputs = beam(name)
    for level in levels:
        up, down = (follow_band(problem, level * force, band, harmonics=H, outputs=outputs)
                    for band in ((700, 1200), (1200, 700)))
        for curve in (up, down):
            assert curve.complete and curve.converged.all() and len(curve.frequency) <= 300
            assert curve.residual_calls <= 3 * len(curve.frequency)
        assert up.peak("tip")[1] == pytest.approx(down.peak("tip")[1], rel=1e-8)
        assert up.peak("tip")[0] == pytest.approx(down.peak("tip")[0], rel=1e-6)
