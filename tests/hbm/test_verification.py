"""Rigid friction, lift-off and two forcing harmonics; the tables of A, C and D are subjects of
tests/validation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.hbm.cases import den_hartog, load, solve, unilateral
from tipdamp.hbm.response import follow_band

C1, C2 = load("C1"), load("C2")


@pytest.mark.slow
@pytest.mark.parametrize("known", load("B1")["results"], ids=lambda known: f"{known['Omega']:g}")
def test_approach_to_rigid_friction(known):
    """B1 by exact integration, and its distance from rigid friction, which the harmonics follow as
    far as they reach.

    What 61 harmonics leave at kt/k = 10 .. 1000 and at Om = 0.6, 0.8, 1.25, 1.5 is measured, and
    falls with the frequency: 3.7e-4 is the most.
    """
    soft = {"Jenkins_by_kt_over_k": dict(list(known["Jenkins_by_kt_over_k"].items())[:3])}
    rows, exponents = den_hartog(known | soft, 61)
    for (_, largest, expected), left in zip(rows, (1e-6, 4e-5, 4e-4), strict=True):
        assert largest == pytest.approx(expected, rel=left)
    exact = np.diff(np.log10([abs(expected / known["X_DenHartog"] - 1) for _, _, expected in rows]))
    assert np.allclose(exponents, exact, atol=0.04) and np.allclose(exact, -0.5, atol=0.07)


@pytest.mark.parametrize("case", [C1, C2], ids=["C1", "C2"])
def test_lift_off_in_closed_form(case):
    """Every solution of order 0 and 1 that the closed form lists is found from a guess beside
    it."""
    problem, force = unilateral(case["parameters"])
    for row in case["results"]:
        for known in row["HB01_all_solutions"]:
            X = force[0] / abs(force[0]) * known["X1"]
            best = np.inf
            for angle in np.linspace(0, -np.pi, 13):
                guess = np.array([known["X0"], X * np.cos(angle), X * np.sin(angle)])
                try:
                    q, _, _ = solve(problem, force, row["Omega"], 1, guess=guess)
                except AssertionError:
                    continue
                best = min(best, abs(abs(q[0, 1]) - known["X1"]) + abs(q[0, 0] - known["X0"]))
            assert best < 1e-9 * known["X1"]


def test_two_forcing_harmonics_against_runge_kutta():
    """C1 forced by harmonics 1 and 2 out of phase, lifting off; the integrator knows the equation
    of motion alone."""
    p = C1["parameters"]
    problem, _ = unilateral(p)
    w, first, second = 0.5, 6 * p["F"], 3 * p["F"] * np.exp(0.7j)

    def rate(t, y):
        f = first * np.cos(w * t) + (second * np.exp(2j * w * t)).real
        spring = max(p["N0"] + p["kn"] * y[0], 0.0) - max(p["N0"], 0.0)
        return y[1], (f - p["c"] * y[1] - p["k"] * y[0] - spring) / p["m"]

    period = 2 * np.pi / w
    # the transient has died to exp(-0.02 * 66 periods) = 6e-8
    t = period * (66 + np.arange(256) / 256)
    y = solve_ivp(rate, (0, t[-1]), [0.0, 0.0], t_eval=t, method="RK45", rtol=1e-9, atol=1e-11)
    expected = np.fft.rfft(y.y[0])[:4] / 256 * np.array([1, 2, 2, 2])
    curve = follow_band(
        problem,
        {1: np.array([first]), 2: np.array([second])},
        (0.5 / np.pi * w, 1 / np.pi * w),
        harmonics=30,
        outputs={"x": np.ones(1)},
    )
    assert np.abs(curve.harmonics[0, 0, :4] - expected).max() < 1e-6 * np.abs(expected).max()
    assert curve.share_open[0, 0] > 0.3 and abs(expected[2]) > 0.05 * abs(expected[1])
