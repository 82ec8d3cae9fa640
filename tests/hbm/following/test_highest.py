"""The highest of several branches of peaks: taken up where it is higher, by name."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.hbm.following.test_follow import FORCE, TIP, absorber, oscillator
from tipdamp.hbm.balance.equation import as_parameter
from tipdamp.hbm.balance.parameter import ModelParameter
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.trace import NO_PERIOD
from tipdamp.hbm.following import highest, taken_up
from tipdamp.hbm.following.follow import follow_peak
from tipdamp.hbm.following.run import Run
from tipdamp.hbm.following.taken_up import Path
from tipdamp.hbm.laws import CubicSpring, DryFriction1T, DryFriction2T, Jenkins1D, UnilateralSpring
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


@pytest.mark.parametrize("upper", [0.3, 0.35, 0.4])
def test_a_smooth_peak_leaves_the_band_once(upper):
    """Duffing's oscillator of one harmonic: c = 0.1, the peak at w has the amplitude a and the
    force c a sqrt(w^2 + c^2/4)."""
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0)
    given = dict(outputs={"x": [1.0]}, band=(0.05, upper), harmonics=1)
    peaks = follow_peak(duffing, np.array([1.0]), "level", (0.05, 5.0), **given)
    w2 = (2 * np.pi * upper) ** 2
    a = np.sqrt((w2 - 1 + 0.1**2 / 2) / 0.75)
    assert peaks.parameter[-1] == pytest.approx(0.1 * a * np.sqrt(w2 + 0.1**2 / 4), rel=1e-5)
    assert upper * (1 - 1e-6) < peaks.frequency[-1] <= upper
    assert not peaks.complete and not peaks.jumps.any()
    assert peaks.ended == f"at level = {peaks.parameter[-1]:.6g} the peak leaves the band"


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


def test_one_of_several_outputs_is_followed_as_if_alone():
    problem, force = absorber(), np.array([1.0, 0.0])
    rows = {"y": [0.0, 0.4], "x": [1.0, 0.0]}
    given = dict(band=(0.1, 0.25), harmonics=1)
    alone = follow_peak(problem, force, "level", (1.0, 0.01), outputs={"x": rows["x"]}, **given)
    peaks = follow_peak(problem, force, "level", (1.0, 0.01), output="x", outputs=rows, **given)
    assert set(peaks.peak_of) == {"x"} and peaks.ended == alone.ended
    for name in ("parameter", "height", "frequency"):
        assert np.allclose(getattr(peaks, name), getattr(alone, name), rtol=1e-9, atol=0)


def system_with_a_stop():
    """Three coordinates, a stop with a gap and a rubbing contact: the peak of the lower resonance
    stands at kinks of the curve."""
    M = np.diag([1.74, 1.88, 0.886])
    C = [[0.093, -0.018, 0], [-0.018, 0.111, -0.008], [0, -0.008, 0.079]]
    K = [[3.37, -0.66, 0], [-0.66, 4.03, -0.284], [0, -0.284, 2.86]]
    one = Problem(M, C, K).add(UnilateralSpring(), 1, kn=1.606, preload=-0.388)
    contact = dict(kn=1.26, kt=1.729, mu=0.322, preload=1.381)
    return one.add(DryFriction1T(), [(0, 2), 2], **contact).contact_problem


WITH_A_STOP = dict(outputs={"o": [0, 0, 1.0]}, band=(0.18, 0.32), harmonics=2)
PUSH = np.array([0.0775, -0.1278, -0.0319])


@pytest.mark.slow
def test_the_way_back_goes_on_beyond_a_kink():
    """The other peak is the higher one from level 1.54 on; its way back from the last value meets a
    kink at 1.69, from which on a kink stands at the peak itself."""
    problem = system_with_a_stop()
    peaks = follow_peak(problem, PUSH, "level", (1.5, 1.72), at=[1.53], **WITH_A_STOP)
    assert peaks.complete and peaks.jumps.sum() == 1
    assert peaks.parameter[peaks.jumps][0] == pytest.approx(1.5416, abs=2e-4)
    kinks = peaks.parameter[peaks.fitted]
    assert len(kinks) > 9 and kinks[0] == pytest.approx(1.69, abs=0.01)
    assert (peaks.fitted == (peaks.parameter >= kinks[0])).all()
    assert "the curve has a kink at its peak, places are fitted" in peaks.ended
    check_places(peaks, problem, PUSH, WITH_A_STOP, ["o"], 5)


@pytest.mark.slow
def test_a_way_back_that_is_lost_is_told(monkeypatch):
    monkeypatch.setattr(taken_up, "MOST_TAKEN_UP", 1)
    monkeypatch.setattr(taken_up, "_past", lambda *given: None)
    peaks = follow_peak(system_with_a_stop(), PUSH, "level", (1.5, 1.72), **WITH_A_STOP)
    assert not peaks.complete
    assert "between level = 1.5 and level = 1.69" in peaks.ended
    assert "another peak may be the highest" in peaks.ended


def test_where_a_kink_stands_at_the_peak_places_are_fitted(monkeypatch):
    """Where the equation has no solution: maxima of short pieces of the curve, and it says so."""
    monkeypatch.setattr(taken_up, "run_from", lambda *given: None)
    monkeypatch.setattr(taken_up, "begin_at", lambda case, top, p: (None, None))
    monkeypatch.setattr(taken_up, "FITTED", 0.2)
    problem, given = oscillator(), dict(outputs=TIP, band=(600, 1200), harmonics=1)
    peaks = follow_peak(problem, FORCE, "level", (1.0, 3.0), **given)
    assert peaks.complete and peaks.fitted.all() and np.isnan(peaks.curvature).all()
    assert np.allclose(peaks.parameter, np.linspace(1.0, 3.0, 6))
    assert "level = 1 to level = 3 the curve has a kink at its peak, places are" in peaks.ended
    check_places(peaks, problem, FORCE, given, ["tip"], 6)


@pytest.mark.parametrize("parameter", ["kn", "kt"])
def test_over_a_stiffness_ratios_damp_as_at_the_first_value(parameter):
    """Of whole curves too: else the one at the last value has another peak than the followed."""
    K = np.array([[1.5e6, -5e5], [-5e5, 1e6]])
    blades = Problem(np.diag([0.05, 0.04]), K=K, damping_ratio=[0.01, 0.04])
    problem = blades.add(DryFriction1T(), [0, 1], kn=2e5, kt=5e5, mu=0.5, preload=40.0)
    problem, force = problem.contact_problem, np.array([5.0, 0.0])
    given = dict(outputs={"x": [1.0, 0.0]}, band=(500, 1100), harmonics=1)
    peaks = follow_peak(problem, force, parameter, (1.0, 1.3), **given)
    assert peaks.complete and peaks.ended == "reached the last value"
    mass = np.diag([0.05, 0.04])
    w2, shapes = eigh(K + np.diag([5e5, 2e5]), mass)
    C = mass @ shapes @ np.diag(2 * np.array([0.01, 0.04]) * np.sqrt(w2)) @ shapes.T @ mass
    with_matrix = replace(problem, C=C, damping_ratio=None)
    check_places(peaks, with_matrix, force, given, ["x"], 3)


def test_a_peak_that_leaves_the_band_ends_there_or_gives_way():
    def springs(problem, k):
        return replace(problem, K=np.diag([1e6 * (2 - k), 1.3e6]))

    blades = Problem(0.05 * np.eye(2), 4 * np.eye(2), np.diag([1e6, 1.3e6]))
    problem = blades.add(Jenkins1D(), (0, 1), kt=1e3, mu=0.5, preload=0.4).contact_problem
    parameter = ModelParameter("k", springs)
    given = dict(outputs={"t": [1.0, 0.0]}, band=(690, 790), harmonics=1)
    alone = follow_peak(problem, np.array([5.0, 0.0]), parameter, (1.0, 1.3), **given)
    assert not alone.complete and alone.ended.endswith("the peak leaves the band")
    assert alone.frequency[-1] == pytest.approx(690, rel=1e-5)
    given = dict(outputs={"t": [1.0, 1.0]}, band=(690, 1000), harmonics=1)
    both = follow_peak(problem, np.array([5.0, 2.0]), parameter, (1.0, 1.3), **given)
    assert both.complete and "the peak leaves the band; another peak was taken" in both.ended
    hz = of_the_curve(problem, np.array([5.0, 2.0]), parameter, 1.3, given, ["t"])[0]
    assert both.frequency[-1] == pytest.approx(hz, rel=1e-6) and hz > 800


@pytest.mark.parametrize("wrong", ["K", "M"])
def test_a_parameter_that_ends_the_problem_keeps_what_was_followed(wrong):
    def scaled(problem, k):
        return replace(problem, **{wrong: getattr(problem, wrong) * (2 - k)})

    blade = Problem(M=[[0.05]], K=[[1e6]], C=[[4.0]])
    problem = blade.add(Jenkins1D(), 0, kt=1e3, mu=0.5, preload=0.4).contact_problem
    given = dict(outputs={"t": [1.0]}, band=(1, 20000), harmonics=1)
    peaks = follow_peak(problem, np.array([5.0]), ModelParameter("k", scaled), (1.0, 2.5), **given)
    assert not peaks.complete and len(peaks) > 5 and 1.5 < peaks.parameter[-1] < 2.001
    assert "k = 2" in peaks.ended and wrong in peaks.ended


@pytest.mark.parametrize("beyond", [True, False])
def test_a_drift_that_ends_run_and_curve_is_said_once(beyond):
    """However rounding writes it; another end of the curve leaves the words of the run whole."""
    drift = "; nothing restrains a mean motion (slides along ({}, 1.00, 0.00)): " + NO_PERIOD
    found = SimpleNamespace(parameter=2.0, detail=SimpleNamespace(found=None))
    run = Run(None, [found], 0, 1, "stopped at level = 2" + drift.format("0.00"))
    path = Path(SimpleNamespace(parameter=SimpleNamespace(scale=1.0)), (1.0, 3.0))
    path.runs = [replace(run, drift=drift.format("0.00"))]
    ended = f"stopped at 700 Hz{drift.format('-0.00') if beyond else '; too many points'}"
    path.case.named = "level = {:g}".format
    path.case.heights = lambda found: np.ones(1)
    path.case.highest_at = lambda value: (None, f"the curve has no peak, it {ended}")
    assert highest._other(path)[0] is None
    assert path.runs[0].why.count(NO_PERIOD) == 1
    assert path.runs[0].why.endswith("stopped at level = 2") == beyond
