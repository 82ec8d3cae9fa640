"""Named points against closed forms and an integration of its own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from tests.hbm.cases import duffing, load, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tests.hbm.search.test_curves_beside import ABSORBER, HZ
from tests.hbm.stability.test_multipliers import largest_multiplier, solved
from tipdamp import (
    CubicSpring,
    DryFriction2T,
    ForcedResponse,
    InputError,
    Jenkins1D,
    Problem,
    UnilateralSpring,
    branch_from,
    follow_band,
    follow_parameter,
    forced_response,
    named_points,
)
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.time.exact import ExactIntegrator


def kinds(found):
    return [point.kind for point in found]


def test_folds_of_duffing_with_one_harmonic():
    """(1 - w^2 + 3/4 a^2)^2 + (c w)^2 = (F / a)^2 gives w(a); a fold is its extremum."""
    c, F = 0.02, 0.02
    duffing = Problem([[1.0]], [[c]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, F)
    curve = duffing.follow_band((0.9 * HZ, 1.5 * HZ), outputs={"x": 0}, harmonics=1, samples=64)
    found = named_points(curve, duffing.contact_problem, stability=False)

    def w(a, sign):
        b = 1 + 0.75 * a**2  # w^4 - (2 b - c^2) w^2 + b^2 - (F / a)^2 = 0
        p = b - 0.5 * c**2
        return np.sqrt(p + sign * np.sqrt(max(p**2 - b**2 + (F / a) ** 2, 0.0)))

    within = {"bounds": (0.1, 0.5), "method": "bounded", "options": {"xatol": 1e-9}}
    lower = minimize_scalar(lambda a: w(a, 1), **within).fun
    within["bounds"] = (0.7, 0.8164)
    upper = -minimize_scalar(lambda a: -w(a, 1), **within).fun
    assert kinds(found) == ["fold", "fold"]
    assert [point.frequency / HZ for point in found] == pytest.approx([upper, lower], rel=1e-6)


@pytest.mark.slow
def test_a_multiplier_is_one_at_every_fold():
    """Also where it is 1 to rounding, as that of a motion that nothing holds."""
    given = load("I1")["parameters"]
    problem, force = duffing(given["c"], given["k3"]), np.array([given["F"]])
    band = (0.8 * HZ, 2 * HZ)
    curve = follow_band(problem, force, band, outputs={"x": [1.0]}, harmonics=7, stability="all")
    assert kinds(curve.named_points) == ["fold", "fold"]
    for point in curve.named_points:
        assert point.multiplier == pytest.approx(1, abs=1e-3)


@pytest.mark.slow
def test_multipliers_that_jump_are_no_branch_point():
    """At a contact that begins to slip: from a pair of modulus 1.05 to 0.98."""
    given = {"outputs": Y2, "harmonics": 7, "stability": "all"}
    curve = follow_band(oscillator(), 3 * FORCE, (245.0, 255.0), **given)
    found = kinds(curve.named_points)
    assert "branch point" not in found and "grazing" in found


def test_slip_begins_at_the_limit():
    """kt a = mu N: a = 40 um."""
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    found = named_points(curve, problem)
    assert kinds(found) == ["onset of slip"] * 2 and [point.contact for point in found] == [0, 0]
    for point in found:
        assert point.amplitudes == pytest.approx([4e-5], rel=1e-5)
        assert point.within < 1e-6 * point.parameter
        ends = curve.frequency[point.index : point.index + 2]
        assert ends.min() <= point.frequency <= ends.max()


def test_a_gap_opens_and_the_period_doubles():
    """C1 lifts off where kn a = N0; at 1.2 N multipliers pass -1 twice, and an integration that is
    disturbed finds the motion unstable between the two alone."""
    given = load("C1")["parameters"]
    problem, force = unilateral(given)
    curve = follow_band(problem, force, (0.05, 0.35), harmonics=7, outputs={"x": [1.0]})
    found = named_points(curve, problem)
    assert kinds(found) == ["lift-off", "fold", "fold", "lift-off"]
    for point in (found[0], found[-1]):
        assert point.amplitudes == pytest.approx([given["N0"] / given["kn"]], rel=1e-5)
    problem, force = unilateral(given | {"F": 1.2})
    curve = follow_band(problem, force, (0.115, 0.125), harmonics=15, outputs={"x": [1.0]})
    found = named_points(curve, problem)
    assert kinds(found) == ["period doubling"] * 2
    assert [point.multiplier for point in found] == pytest.approx([-1, -1], abs=1e-4)
    for point, inwards in zip(found, (1, -1), strict=True):
        near = curve.unknowns[point.index]
        for share, grows in ((1 + 1e-3 * inwards, True), (1 - 1e-3 * inwards, False)):
            w = 2 * np.pi * point.frequency * share
            there = solved(problem, force, w, 15, near)
            integrator = ExactIntegrator(there.detail.balance, w)
            modulus, _ = largest_multiplier(integrator, integrator.on_orbit(there))
            assert (modulus > 1) == grows


def test_second_frequencies_of_an_absorber():
    """Between the two Neimark-Sacker points the leading multipliers are a pair outside the unit
    circle."""
    problem = ABSORBER.contact_problem
    given = {"outputs": {"x": 0}, "harmonics": 5, "stability": "all"}
    curve = ABSORBER.follow_band((0.6 * HZ, 1.6 * HZ), **given)
    found = named_points(curve, problem)
    first, second = (point for point in found if point.kind == "Neimark-Sacker")
    assert abs(first.multiplier) == pytest.approx(1, abs=1e-4) and first.multiplier.imag > 0.1
    pairs = np.where(curve.multipliers.imag > 0.01, np.abs(curve.multipliers), 0.0).max(axis=1)
    assert (pairs[first.index + 1 : second.index + 1] > 1).all()
    assert pairs[[first.index, second.index + 1]].max() < 1


def test_unequal_motions_branch_off_equal_ones():
    """Of a ring of equal oscillators, over the level: where a real multiplier passes 1 and the
    branch does not fold."""
    stiffness = 3 * np.eye(4) - np.roll(np.eye(4), 1, axis=0) - np.roll(np.eye(4), -1, axis=0)
    ring = Problem(np.eye(4), 0.1 * np.eye(4), stiffness)
    for i in range(4):
        ring = ring.add(CubicSpring(1.0), i).force(i, 2.0)
    rows = {"x": np.eye(4)[0]}
    curve = follow_parameter(
        ring.contact_problem, dict(ring.forces), 2.5 * HZ, "level", (0.05, 3), outputs=rows
    )
    found = named_points(curve, ring.contact_problem)
    branches = [point for point in found if point.kind == "symmetry breaking"]
    assert set(kinds(found)) == {"symmetry breaking", "fold"} and len(branches) >= 3
    for point in branches:
        assert point.multiplier == pytest.approx(1, abs=1e-4)


def test_a_curve_keeps_its_named_points(tmp_path):
    """Those of the function, with the contact among all pairs, and in the file."""
    model, pairs = two_blades()
    pairs = pairs.select(np.array([0, 0, 1])).replace(weight=np.array([0.0, 1.0, 1.0]))
    tip = model.displacement_row("blade1", 1, [0, 1, 0])
    given = {"damping_ratio": 0.01, "outputs": {"tip": tip}, "harmonics": 1, "stability": "all"}
    curve = forced_response(model, pairs, DryFriction2T(), 100 * tip, (600, 690), **given)
    slips = [one.contact for one in curve.named_points if one.kind == "onset of slip"]
    assert set(slips) == set(curve.slipping_pairs.tolist()) == {1, 2}
    assert ForcedResponse.load(curve.save(tmp_path / "curve.npz")) == curve
    assert replace(curve, named_points=curve.named_points[1:]) != curve
    duffing = Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.02)
    curve = duffing.follow_band((0.14, 0.24), outputs={"x": 0}, stability="all")
    assert curve.named_points == named_points(curve, duffing.contact_problem)
    assert ForcedResponse.load(curve.save(tmp_path / "folds.npz")).named_points[0].multiplier


def test_another_problem_is_refused():
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    curve = damped.follow_band((600, 1000), outputs={"tip": 0}, harmonics=1)
    other = blade.add(Jenkins1D(), 0, kt=6e5, mu=0.5, preload=40.0)
    with pytest.raises(InputError, match="the problem is not that of the curve"):
        named_points(curve, other.contact_problem)


STOP = (
    Problem(np.diag([1.0, 0.3]), [[0.06, -0.02], [-0.02, 0.04]], [[1.3, -0.3], [-0.3, 0.7]])
    .add(UnilateralSpring(), 1, kn=20.0, preload=-8.0)
    .force(0, 0.25)
)


def named_of_stop(harmonics, band):
    curve = STOP.follow_band(
        omega=band, outputs={"x0": 0, "x1": 1}, harmonics=harmonics, stability="all"
    )
    return [(one.kind, 2 * np.pi * one.frequency) for one in curve.named_points]


def test_two_bifurcations_between_two_points_of_the_curve():
    """Of a gap of 0.4: an own integration with events, its monodromy by differences, has a pair of
    multipliers leave the circle between 1.338 and 1.341 rad/s, and the one below -1, which left it
    at 1.243, come back at 1.3437; one step of the curve holds both."""
    found = named_of_stop(15, (1.0, 1.42))
    assert [kind for kind, _ in found] == ["period doubling", "Neimark-Sacker", "period doubling"]
    assert [w for _, w in found] == pytest.approx([1.2433, 1.338, 1.3437], abs=1e-3)


def test_a_pair_outside_the_circle_that_becomes_two_real_ones_is_no_grazing():
    """The same integration: at 1.1245 rad/s nothing begins to touch, 1.098 +- 0.03i goes over into
    1.12 and 1.08."""
    found = named_of_stop(31, (0.7, 1.3))
    assert "grazing" not in [kind for kind, _ in found]
    assert ("Neimark-Sacker", pytest.approx(1.1217, abs=1e-3)) in found


@pytest.mark.slow
def test_a_fold_is_beside_its_points():
    """Of a motion that is symmetric but for a hair the curve turns sharply from one arm of a
    pitchfork onto the other: what is found as a fold between may lie anywhere."""
    bent = Problem([[1.0]], [[0.1]], [[1.0]], preloaded=False, static=[1e-8])
    driven = bent.add(CubicSpring(1.0), 0).force(0, 2.0)
    curve = driven.follow_band(
        omega=(0.7, 1.0), outputs={"x": 0}, harmonics=15, stability="all", truncation=False
    )
    folds = [one for one in curve.named_points if one.kind == "fold"]
    assert len(folds) > 2
    for one in folds:
        beside = curve.frequency[max(one.index - 1, 0) : one.index + 3]
        assert np.abs(beside - one.frequency).min() < 0.02 * one.frequency


def test_a_branch_that_goes_over_into_another_one_does_not_drift():
    """Of order 1/2, from its middle to where it leaves the response: no friction, no drift."""
    stop = Problem([[1.0]], [[0.05]], [[1.0]]).force(0, 1.0)
    stop = stop.add(UnilateralSpring(), 0, kn=50.0, preload=-10.0)
    band, outputs = (0.8, 6.0), {"x": 0}
    curve = stop.follow_band(omega=band, outputs=outputs, harmonics=25, stability="all")
    first = next(one for one in curve.named_points if one.kind == "period doubling")
    (branch,) = branch_from(curve, stop.contact_problem, first)
    i = len(branch) // 2
    guess = branch.frequency[i], branch.unknowns[i]
    again = stop.follow_band(
        omega=band, guess=guess, outputs=outputs, harmonics=branch.H, periods=2
    )
    assert "drift" not in again.ended and "where it leaves another one" in again.ended
