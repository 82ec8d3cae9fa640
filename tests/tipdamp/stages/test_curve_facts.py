"""Facts of a curve as a study keeps them."""

from dataclasses import replace

import numpy as np

from tipdamp import CubicSpring, Problem
from tipdamp.stages.curve_facts import peak_of


def test_of_two_places_that_move_alike_the_solved_one_has_the_peak():
    """Of a patch one place with the largest amplitude is solved; which of two it is, where they
    move as one, is a matter of rounding, and no doubt of the peak."""
    duffing = Problem(M=[[1.0]], C=[[0.1]], K=[[1.0]]).add(CubicSpring(1e-6), 0).force(0, 0.2)
    places = {"one": [1.0], "two": [1.0]}
    curve = duffing.follow_band((0.08, 0.35), outputs=places, harmonics=1)
    marks = curve.peak_points.copy()
    marks[:, 1] |= marks[:, 0]
    marks[:, 0] = False
    peak = peak_of(replace(curve, peak_points=marks), np.ones(2, dtype=bool))
    assert peak.peak_m is not None and peak.unsolved == ""
