"""Stability of periodic orbits by the largest Floquet multiplier of the period map."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.hbm.cases import jenkins, load, rig, solve
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.comparison import compare_point, integrator_of
from tipdamp.hbm.laws import Contacts, CubicSpring, IsotropicFriction, Jenkins1D
from tipdamp.hbm.time import period_map
from tipdamp.hbm.time.settings import IntegrationSettings

ONE = np.ones((1, 1))


def duffing(branch, H):
    """(q, point, balance) of a solution of I1 at 1.4 rad/s, and its reference."""
    p = load("I1")["parameters"]
    w = 1.4
    known = next(row for row in load("I1")["results"] if row["Omega"] == 1.4)["branches"][branch]
    X = p["F"] / (
        p["k"] + 0.75 * p["k3"] * known["HB1_amplitude"] ** 2 - p["m"] * w**2 + 1j * w * p["c"]
    )
    guess = fourier.to_real(np.r_[0, X, np.zeros(H - 1)])
    problem = ContactProblem(
        p["m"] * ONE,
        p["c"] * ONE,
        p["k"] * ONE,
        ONE,
        CubicSpring(p["k3"]),
        Contacts([0.0], [0.0], [0.0], [0.0]),
    )
    return *solve(problem, np.array([p["F"]]), w, H, guess=guess), known


def variational(q, w):
    """Largest modulus of the multipliers of I1 along the motion from q, by Runge-Kutta of order
    8."""
    p = load("I1")["parameters"]

    def rate(t, y):
        tangent = np.array(
            [[0, 1], [-(p["k"] + 3 * p["k3"] * y[0] ** 2) / p["m"], -p["c"] / p["m"]]]
        )
        pull = (p["F"] * np.cos(w * t) - p["c"] * y[1] - p["k"] * y[0] - p["k3"] * y[0] ** 3) / p[
            "m"
        ]
        return np.r_[y[1], pull, (tangent @ y[2:].reshape(2, 2)).ravel()]

    orders = np.arange(q.shape[1])
    begin = np.r_[q[0].sum().real, (1j * w * orders * q[0]).sum().real, 1, 0, 0, 1]
    end = solve_ivp(rate, (0, 2 * np.pi / w), begin, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return np.abs(np.linalg.eigvals(end[2:].reshape(2, 2))).max()


@pytest.mark.slow
@pytest.mark.parametrize("H", [5, 15])
@pytest.mark.parametrize("branch,stable", [(0, True), (1, False), (2, True)])
def test_stability_of_three_duffing_solutions(branch, stable, H):
    """The middle one is unstable, also where its first period repeats at once."""
    q, point, balance, known = duffing(branch, H)
    expected = np.hypot(*np.transpose(known["floquet_multipliers"])).max()
    found = compare_point(balance, point, ONE, IntegrationSettings(samples=256))
    assert found.agrees and found.stable == stable == known["stable"]
    assert found.multiplier == pytest.approx(expected, rel=1e-5)
    assert variational(q, 1.4) == pytest.approx(expected, rel=1e-4)
    assert ("but it is unstable" in found.said, "which is stable" in found.said) == (
        not stable,
        stable,
    )


@pytest.mark.slow
def test_multiplier_after_the_orbit_was_left():
    """Integration alone goes from the middle solution to another one; the multiplier is that of the
    middle one."""
    _, point, balance, known = duffing(1, 3)
    found = compare_point(balance, point, ONE, IntegrationSettings(samples=128, patience=400))
    assert (
        found.left and found.stable is False and found.multiplier == pytest.approx(1.5568, rel=1e-3)
    )
    assert (
        "left for another orbit" in found.said
        and "the orbit of the solution is unstable" in found.said
    )


@pytest.mark.parametrize("law,rows", [(Jenkins1D(), 1), (IsotropicFriction(), 3)])
def test_multiplier_of_a_damped_oscillator(law, rows):
    """exp(-zeta w0 T) where the slider sticks; its own multiplier of 1 is not counted. By events
    and by samples."""
    m = 2.0
    c = 0.3
    k = 5.0
    kt = 1.0
    w = 1.1
    problem = ContactProblem(
        m * ONE, c * ONE, k * ONE, np.eye(rows, 1), law, Contacts([0.0], [kt], [1.0], [1e3])
    )
    _, point, balance = solve(problem, np.array([1.0]), w, 3)
    found = compare_point(balance, point, ONE, IntegrationSettings(samples=64))
    assert found.stable and found.multiplier == pytest.approx(
        np.exp(-c / (2 * m) * 2 * np.pi / w), rel=1e-8
    )


@pytest.mark.parametrize("omega", [0.9, 1.05])
def test_slip_is_stable(omega):
    """A1: friction dissipates more where the motion is larger; a slider that moves is counted."""
    problem, force = jenkins(load("A1")["parameters"])
    _, point, balance = solve(problem, force, omega, 9)
    found = compare_point(balance, point, ONE)
    free = np.exp(-problem.C[0, 0] / (2 * problem.M[0, 0]) * 2 * np.pi / omega)
    assert found.stable and found.multiplier < free


def test_leading_multiplier_of_a_chain():
    """60 masses on a contact that sticks: exp(-zeta w1 T) of the lowest mode, by Arnoldi as by
    columns."""
    n, w, zeta = 60, 0.5, 0.02
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    problem = ContactProblem(
        np.eye(n),
        None,
        K,
        np.eye(1, n),
        Jenkins1D(),
        Contacts([0.0], [1.0], [1.0], [1e3]),
        damping_ratio=zeta,
    )
    _, point, balance = solve(problem, np.eye(1, n, n // 2)[0], w, 3)
    lowest = np.sqrt(np.linalg.eigvalsh(problem.stuck_stiffness)[0])
    expected, periods = np.exp(-zeta * lowest * 2 * np.pi / w), []
    for columns in (0, 200):
        integrator = integrator_of(balance, w, IntegrationSettings(max_columns=columns))
        found, used = period_map.largest_multiplier(integrator, integrator.on_orbit(point))
        assert found == pytest.approx(expected, rel=1e-4)
        periods.append(used)
    assert periods[1] == 2 * (2 * n + 1)


@pytest.mark.slow
def test_rig_is_stable():
    """12 N near the peak, 292 unknowns: the same by differences ten times smaller and larger, to
    1e-3."""
    problem, force, outputs = rig()
    rows = [next(iter(outputs.values()))]
    _, point, balance = solve(problem, 12 * force, 2 * np.pi * 2782.6, 5)
    found = compare_point(balance, point, rows)
    assert (
        found.agrees and found.stable and "which is stable (Floquet multiplier 0.92" in found.said
    )
    for disturbance in (1e-4, 1e-6):
        integrator = integrator_of(
            balance, point.parameter, replace(IntegrationSettings(), disturbance=disturbance)
        )
        other, used = period_map.largest_multiplier(integrator, found.steady.state)
        assert other == pytest.approx(found.multiplier, rel=1e-3) and used < 200
