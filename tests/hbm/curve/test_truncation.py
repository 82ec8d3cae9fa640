"""The estimated error of the points of a curve, beside solutions with many more orders."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.cases import beam, coupled, jenkins, load, rig, unilateral
from tests.hbm.conformance import own_law
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp import (
    CubicSpring,
    DryFriction1T,
    IsotropicFriction,
    Jenkins1D,
    Problem,
    UnilateralSpring,
    follow_band,
)
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.curve.truncation import TruncationEstimate
from tipdamp.hbm.result import DOUBTFUL

FRICTION = {"kn": 2.0, "kt": 2.0, "mu": 0.4, "preload": 0.5}
CASES = {
    "cubic": (CubicSpring(0.3), 0, {}),
    "Jenkins": (Jenkins1D(), 0, {"kt": 2.0, "mu": 0.4, "preload": 0.5}),
    "one tangent": (DryFriction1T(), [0, 2], FRICTION),
    "two tangents": (IsotropicFriction(), [0, 1, 2], FRICTION),
    "unilateral": (UnilateralSpring(), 2, {"kn": 4.0, "preload": 0.1}),
}
BAND = (0.08, 0.5)
OUTPUTS = {"x": 0, "y": 1, "z": 2}


def chain(law, where, settings, seed=0):
    """Three dofs with a law, under forces of three phases."""
    A = np.random.default_rng(seed).normal(size=(3, 3))
    K = np.diag(np.linspace(1, 6, 3)) + 0.1 * (A + A.T)
    problem = Problem(M=np.eye(3), C=0.02 * K, K=K).add(law, where, **settings)
    return problem.force(0).force(1, 0.6j).force(2, 0.3)


def true_errors(problem, curve, at, orders, samples=None):
    """Largest over the outputs, of the largest vibration, as root mean square."""
    found = []
    for i in at:
        hz = curve.frequency[i]
        exact = problem.solve_at(
            hz,
            outputs=OUTPUTS,
            harmonics=orders,
            guess=_padded(curve, i, orders),
            samples=samples,
        )
        assert exact.converged
        change = exact.harmonics.copy()
        change[:, : curve.H + 1] -= curve.harmonics[i]
        size = [np.linalg.norm(part[:, 1:], axis=1).max() for part in (change, exact.harmonics)]
        found.append(size[0] / size[1])
    return np.array(found)


def references():
    """(problem, force, band, outputs) of cases of the verification table, an oscillator and a
    beam."""
    unit = {"x": [1.0]}
    stick, stick_force = jenkins(load("A1")["parameters"])
    stop, stop_force = unilateral(load("C1")["parameters"])
    rub, rub_force = coupled(load("D1")["parameters"])
    blade, blade_force, outputs = beam("C8")
    return {
        "A1": (stick, stick_force, (0.05, 0.4), unit),
        "C1": (stop, stop_force, (0.05, 0.35), unit),
        "D1": (rub, rub_force, (0.08, 0.4), {"x": np.eye(len(rub.K))[0]}),
        "oscillator": (oscillator(), FORCE, (60.0, 300.0), Y2),
        "C8": (blade, 200 * blade_force, (700.0, 1200.0), outputs),
    }


@pytest.mark.parametrize("H", [3, 5])
@pytest.mark.parametrize("name", ["A1", "C1", "D1", "oscillator", "C8"])
def test_beside_references_with_many_orders(name, H):
    """All points with an error above 1e-5 within a factor 5; 294 of 294 with those of the rig."""
    problem, force, band, outputs = references()[name]
    curve = follow_band(problem, force, band, harmonics=H, outputs=outputs)
    many, w = HarmonicBalance(problem, {1: np.asarray(force)}, 31), 2 * np.pi * curve.frequency
    true, found = [], []
    for i in np.linspace(0, len(w) - 1, 12).astype(int):
        guess = np.zeros((many.n_components, many.nh))
        guess[:, : 2 * H + 1] = curve.unknowns[i].reshape(many.n_components, -1)
        point = solve_fixed(many.evaluate, guess.ravel(), w[i], many.weights, Settings())
        change = point.detail.outputs(curve.output_rows)
        change[:, : H + 1] -= curve.harmonics[i]
        error = np.linalg.norm(change[:, 1:], axis=1).max()
        true.append(error / np.linalg.norm(curve.harmonics[i, :, 1:], axis=1).max())
        found.append(curve.relative_truncation[i])
    seen = np.array(true) > 1e-5
    ratio = np.array(found)[seen] / np.array(true)[seen]
    assert seen.sum() >= 4 and ((ratio > 0.2) & (ratio < 5)).all()


@pytest.mark.parametrize("H", [3, 5])
@pytest.mark.parametrize("case", CASES)
def test_beside_the_true_error(case, H):
    problem = chain(*CASES[case])
    curve = problem.follow_band(BAND, outputs=OUTPUTS, harmonics=H)
    estimate = curve.relative_truncation
    at = np.linspace(0, len(curve.frequency) - 1, 25).astype(int)
    true = true_errors(problem, curve, at, 30)
    seen = (true > 1e-5) & (estimate[at] < DOUBTFUL)
    ratio = estimate[at][seen] / true[seen]
    assert seen.sum() >= 6
    assert np.mean((ratio > 0.2) & (ratio < 5)) >= 0.9 and ratio.min() > 0.2
    assert 0.7 < np.median(ratio) < 1.4


@pytest.mark.parametrize("H", [3, 5])
@pytest.mark.parametrize("case", CASES)
def test_change_of_each_harmonic(case, H):
    """Not its size alone: as complex harmonics, those of the curve and those above; the tangent
    along the branch or none gives the same."""
    problem = chain(*CASES[case])
    curve = problem.follow_band(BAND, outputs=OUTPUTS, harmonics=H)
    equation, points = restored(curve, problem.contact_problem)
    estimate = TruncationEstimate(equation, curve.output_rows)
    off, lost = [], 0
    for i in np.flatnonzero(curve.relative_truncation > 1e-5)[::5]:
        exact = problem.solve_at(
            curve.frequency[i], outputs=OUTPUTS, harmonics=30, guess=_padded(curve, i, 30)
        )
        if not exact.converged:  # beside a fold of H there may be nothing with more orders
            lost += 1
            continue
        true = exact.harmonics[:, : 2 * H + 2].copy()
        true[:, : H + 1] -= curve.harmonics[i]
        here = equation.evaluate(points[i].x, points[i].parameter)
        found, _ = estimate.change(here, points[i])
        tx, tp, _ = here.direction(np.ones_like(here.x), 1.0)
        along, _ = estimate.change(here, replace(points[i], tangent=(tx, tp)))
        assert np.linalg.norm(along - found) <= 1e-6 * np.linalg.norm(found)
        parts = slice(1, H + 1), slice(H + 1, None)
        off.append(
            [np.linalg.norm((found - true)[:, k]) / np.linalg.norm(true[:, k]) for k in parts]
        )
    low, high = np.median(off, axis=0)
    assert len(off) >= 5 and low < 0.2 and high < 0.1
    assert lost <= 0.05 * len(off)


def _padded(curve, i, orders):
    few, many = 2 * curve.H + 1, 2 * orders + 1
    guess = np.zeros((len(curve.unknowns[i]) // few, many))
    guess[:, :few] = curve.unknowns[i].reshape(-1, few)
    return guess.ravel()


def test_of_one_order():
    """Nothing above order 1 is known of the curve, and the third order is seen all the same."""
    problem = chain(*CASES["cubic"])
    curve = problem.follow_band(BAND, outputs=OUTPUTS, harmonics=1)
    estimate = curve.relative_truncation
    at = np.linspace(0, len(curve.frequency) - 1, 12).astype(int)
    ratio = estimate[at] / true_errors(problem, curve, at, 20)
    assert np.mean((ratio > 0.2) & (ratio < 5)) >= 0.9


def test_a_contact_that_sticks_has_no_error():
    problem = chain(Jenkins1D(), 0, {"kt": 2.0, "mu": 0.4, "preload": 1e6})
    curve = problem.follow_band(BAND, outputs=OUTPUTS, harmonics=3)
    estimate = curve.relative_truncation
    assert not estimate.any()
    assert curve.truncation.shape == (len(curve.frequency), 3)


def test_samples_of_a_sampled_law_are_in_it():
    """With many orders and few samples what is missing are the samples."""
    problem = chain(own_law("dahl").Dahl(), 0, {"kt": 2.0, "mu": 0.4, "preload": 0.5})
    curve = problem.follow_band((0.15, 0.2), outputs=OUTPUTS, harmonics=9, samples=40)
    estimate = curve.relative_truncation
    at = np.linspace(0, len(curve.frequency) - 1, 5).astype(int)
    true = true_errors(problem, curve, at, 19, samples=1024)
    ratio = estimate[at] / true
    assert (true > 1e-5).all() and ((ratio > 0.2) & (ratio < 5)).all()


def test_rig():
    """At 2780 Hz under 20 N with 5 orders it is 3.8e-3, by solutions with many orders."""
    problem, force, outputs = rig()
    curve = follow_band(problem, 20 * force, (2770.0, 2790.0), harmonics=5, outputs=outputs)
    estimate = curve.relative_truncation
    assert estimate[np.argmin(np.abs(curve.frequency - 2780))] == pytest.approx(3.8e-3, rel=0.5)
    assert (estimate < DOUBTFUL).all()
