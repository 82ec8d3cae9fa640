"""Curves and solutions as arrays alone: read-only, pickled, compared, saved and loaded."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.cases import jenkins, load
from tests.hbm.small_rig import small_rig
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import CubicSpring, DryFriction2T
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band, solve_at
from tipdamp.hbm.result import ForcedResponse

PROBLEM, FORCE = jenkins(load("A1")["parameters"])


@pytest.fixture(scope="module")
def curve():
    return follow_band(PROBLEM, FORCE, (0.1, 0.2), harmonics=3, outputs={"x": [1.0]}, contact=True)


def test_arrays_are_read_only(curve):
    """Neither the curve nor the array that a field was made from reaches the other."""
    with pytest.raises(ValueError, match="read-only"):
        curve.harmonics[:] *= 2
    mine = np.array(curve.harmonics)
    other = replace(curve, harmonics=mine)
    mine[:] = 0
    assert other == curve


@pytest.mark.parametrize("way", ["pickle", "file"])
def test_copies_are_equal(curve, way, tmp_path):
    loaded = ForcedResponse.load(curve.save(tmp_path / "c.npz"))
    again = pickle.loads(pickle.dumps(curve)) if way == "pickle" else loaded
    assert (
        again == curve
        and not again.harmonics.flags.writeable
        and again.peak("x") == curve.peak("x")
    )
    assert np.array_equal(solutions_at(again, PROBLEM, 0.157), solutions_at(curve, PROBLEM, 0.157))
    assert np.array_equal(find_peaks(again, PROBLEM, "x"), find_peaks(curve, PROBLEM, "x"))


def test_differences_are_named(curve):
    """Failed points are equal to themselves; the time that it took does not count."""
    X = np.array(curve.harmonics)
    X[2] = np.nan
    failed = replace(curve, harmonics=X)
    assert (
        failed == replace(failed, seconds=1e3)
        and failed != curve
        and curve != replace(curve, ended="")
        and curve != "curve"
    )


def test_curve_without_unknowns(curve):
    """A measured curve has amplitudes and peaks, but nothing can be solved on it."""
    fields = ("unknowns", "carrying", "forces", "contact_force")
    measured = replace(curve, **{name: getattr(curve, name)[:0] for name in fields})
    assert measured.contact_motion.size == 0 and measured.peak("x")[1] > 0
    with pytest.raises(InputError, match="holds no unknowns: it was measured"):
        solutions_at(measured, PROBLEM, 0.15)


def test_one_solution_in_one_call(curve):
    """At one frequency, from the stuck response and from a given start; what does not fit is
    refused."""
    hz = curve.frequency[curve.dissipated[:, 0].argmax()]
    X = solutions_at(curve, PROBLEM, hz)[0]
    found = solve_at(PROBLEM, FORCE, hz, harmonics=3, outputs={"x": [1.0]})
    again = solve_at(PROBLEM, FORCE, hz, harmonics=3, outputs={"x": [1.0]}, guess=found.unknowns)
    for one in (found, again):
        assert one.converged and np.abs(one.harmonics - X).max() < 1e-8 * np.abs(X).max()
    assert (
        again.iterations == 1 < found.iterations
        and found.share_slip[0] > 0
        and found.dissipated[0] > 0
    )
    assert np.allclose(found.contact_motion[0], found.harmonics) and found.amplitude()[0] > 0
    for guess, match in (
        ([0, 1], "guess: has 2 unknowns, must have .* at most 3: 7"),
        (np.full(7, np.nan), "guess: 7 of 7 unknowns are not finite"),
        ((0.4,), "guess: is a tuple of 1, must be"),
        ((0.9 * hz, found.unknowns), f"guess: is one at {0.9 * hz:g}, must be {hz:g}$"),
    ):
        with pytest.raises(InputError, match=match):
            solve_at(PROBLEM, FORCE, hz, harmonics=3, outputs={"x": [1.0]}, guess=guess)


def test_a_solution_is_a_value():
    """As a curve is: read-only, equal to its copies even where it is NaN, told from a solution
    beside it."""
    solved = solve_at(PROBLEM, FORCE, 0.15, harmonics=1, outputs={"x": [1.0]})
    nothing = np.full(solved.harmonics.shape, np.nan)
    lost = replace(solved, harmonics=nothing, converged=False)
    with pytest.raises(ValueError, match="read-only"):
        solved.harmonics[:] *= 2
    for one in (solved, lost):
        again = pickle.loads(pickle.dumps(one))
        assert again == one and not again.unknowns.flags.writeable
    assert solved != lost and solved != replace(solved, frequency=0.16) and solved != "solution"


def test_a_problem_is_pickled_with_its_curve():
    """What a process pool needs: the problem goes out, the curve comes back."""
    model, pairs, tip = small_rig(stations=2)
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.02)
    again = pickle.loads(pickle.dumps(problem))
    first, second = (
        solve_at(p, 8 * tip, 1300.0, harmonics=1, outputs={"tip": tip}) for p in (problem, again)
    )
    assert np.array_equal(first.harmonics, second.harmonics)


def test_motion_of_the_contacts(curve):
    """One Jenkins element at the only dof: its motion is that of the dof."""
    assert np.allclose(curve.contact_motion[:, 0], curve.harmonics, rtol=1e-12)
    assert curve.contact_force.shape == curve.contact_motion.shape


def test_a_point_knows_what_its_curve_knows_of_it():
    """Of a Duffing oscillator the points between the two folds are unstable [multiplier above 1];
    a single solution has no stability."""
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.5)
    curve = duffing.follow_band((0.1, 0.4), outputs={"x": 0}, harmonics=5, stability="all")
    upper, lower = (k.frequency for k in curve.named_points if k.kind == "fold")
    turned = int(np.flatnonzero(np.diff(curve.frequency) < 0)[2])  # well behind the first fold
    point = curve[turned]
    assert lower < point.frequency < upper
    assert point.unstable and not point.stable and abs(point.multipliers[0]) > 1
    assert curve[0].stable and not curve[0].unstable
    np.testing.assert_array_equal(point.truncation, curve.truncation[turned])
    alone = duffing.solve_at(curve[0].frequency, outputs={"x": 0}, harmonics=5)
    assert not (alone.stable or alone.unstable or alone.multipliers.size)
