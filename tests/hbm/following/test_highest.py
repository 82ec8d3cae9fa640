"""The highest of several branches of peaks: taken up where it is higher, by name."""

import numpy as np
import pytest

from tests.hbm.following.test_follow import absorber
from tipdamp.hbm.balance.parameter import as_parameter
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.following.follow import follow_peak
from tipdamp.hbm.laws import CubicSpring, DryFriction2T, Jenkins1D
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band


def friction_system():
    """Six coordinates, a contact of three components, one of one and a cubic spring."""
    B = np.random.default_rng(5).normal(size=(6, 6))
    K = 2e4 * (np.eye(6) * 2.2 + 0.3 * (B + B.T) / 2)
    K[4, 4] = K[5, 5] = 1.8e4
    body = Problem(np.diag([1, 1.2, 0.8, 1, 0.5, 0.5]), 1.5 * np.eye(6), K)
    rubbing = body.add(
        DryFriction2T(), [(0, 3), (1, 4), (2, 5)], kn=3e4, kt=2e4, mu=0.3, preload=50.0
    ).add(Jenkins1D(), [0, 0, 0, 1.0, -0.5, 0], kt=6e3, mu=0.6, preload=10.0)
    return rubbing.add(CubicSpring(3e7), 1).contact_problem


def of_the_curve(problem, force, parameter, value, given, names):
    """(Hz, m) of the highest peak of a whole curve."""
    there, forces = as_parameter(parameter).rebuild(problem, {1: force}, value)
    options = dict(outputs=given["outputs"], harmonics=given["harmonics"], truncation=False)
    curve = follow_band(there, forces, given["band"], **options)
    tops = [find_peaks(curve, there, name)[0] for name in names]
    return max(tops, key=lambda top: top[1])


def check_places(peaks, problem, force, given, names, places):
    for i in np.unique(np.linspace(0, len(peaks.parameter) - 1, places).astype(int)):
        value = peaks.parameter[i]
        hz, height = of_the_curve(problem, force, peaks.parameter_name, value, given, names)
        assert peaks.height[i] == pytest.approx(height, rel=1e-6)
        assert peaks.frequency[i] == pytest.approx(hz, rel=1e-5)


@pytest.mark.slow
def test_no_silent_jump_and_the_highest_at_the_end():
    """A kink ends the first branch; at the last value a peak five times as high stands, which joins
    the curve on the way."""
    problem, force = friction_system(), 8 * np.array([1, 0, 0.3, 0, 0, 0])
    given = dict(outputs={"a": np.eye(6)[0]}, band=(15, 45), harmonics=3)
    peaks = follow_peak(problem, force, "preload", (0.7, 0.2), at=[0.65, 0.5, 0.3], **given)
    assert peaks.complete and {0.65, 0.5, 0.3} <= set(peaks.parameter)
    assert peaks.ended.count("was taken up") == peaks.jumps.sum() == 2
    assert "stands on a branch apart from the curve" in peaks.ended
    steps = np.abs(np.diff(peaks.frequency)) / peaks.frequency[1:]
    assert steps[~peaks.jumps[1:]].max() < 0.005 < steps[peaks.jumps[1:]].max()
    check_places(peaks, problem, force, given, ["a"], 6)


@pytest.mark.slow
def test_two_peaks_change_places():
    """Where the absorber slides two peaks stand on the curve: the other one is taken up where both
    are as high."""
    problem, force = absorber(), np.array([1.0, 0.0])
    given = dict(outputs={"x": [1.0, 0.0]}, band=(0.1, 0.25), harmonics=1)
    peaks = follow_peak(problem, force, "level", (1.0, 0.01), **given)
    assert peaks.complete
    check_places(peaks, problem, force, given, ["x"], 8)


def test_the_largest_of_a_patch():
    """Of two outputs the larger one; where the other becomes larger both are as high."""
    problem, force = absorber(), np.array([1.0, 0.0])
    given = dict(outputs={"x": [1.0, 0.0], "y": [0.0, 0.4]}, band=(0.1, 0.25), harmonics=1)
    peaks = follow_peak(problem, force, "level", (0.01, 0.3), output=["x", "y"], **given)
    assert peaks.complete and set(peaks.peak_of) == {"x", "y"}
    (at,) = np.flatnonzero(peaks.peak_of[1:] != peaks.peak_of[:-1])
    assert peaks.parameter[at] == peaks.parameter[at + 1]
    assert peaks.height[at] == pytest.approx(peaks.height[at + 1], rel=1e-8)
    assert "becomes higher than" in peaks.ended
    check_places(peaks, problem, force, given, ["x", "y"], 5)
