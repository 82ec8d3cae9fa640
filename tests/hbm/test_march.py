"""Time integration: exact where it must be, second order through transitions, equal to exact orbits."""

import numpy as np
import pytest

from hbm import fourier, laws, march
from tests.hbm.cases import coupled, jenkins, load, solve, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator


@pytest.mark.parametrize("law", [laws.Jenkins1D(), laws.DryFriction2T(), laws.UnilateralSpring()], ids=lambda w: w.name)
def test_kernel_is_the_plain_step(law):
    rng = np.random.default_rng(1)
    P, nd = 40, len(law.components)
    pairs = laws.PairSettings(*rng.uniform(0.1, 1, (3, P)), rng.uniform(-0.3, 1, P))
    u, slider = rng.normal(size=(P, nd)), rng.normal(size=(P, law.tangents))
    new, g = slider.copy(), np.zeros((P, nd))
    march.corridor_bracket(u, slider, new, g, law.tangents, law.has_normal, pairs.kt, pairs.kn, pairs.mu, pairs.preload)
    force, expected, _ = law.step(u, slider, pairs)
    f = g + law.stuck_stiffness(pairs) * u
    if law.has_normal:
        f[:, -1] += pairs.preload
    assert np.allclose(f, force, atol=1e-14) and np.allclose(new, expected, atol=1e-14)


def test_poles_give_the_receptance():
    for problem in (oscillator(), coupled(load("D1")["parameters"])[0]):
        R = problem.receptance()
        P, w = march.poles(R), 3.7
        G = (P.out / (1j * w - P.s)) @ P.into.T
        if R.poles is None:
            G = G / 2 + ((P.out.conj() / (1j * w - P.s.conj())) @ P.into.conj().T) / 2
        K = problem.stuck_stiffness - w**2 * problem.M + 1j * w * problem.C
        assert np.abs(G @ K - np.eye(len(K))).max() < 1e-9


@pytest.mark.parametrize("case,build,omega", [("A1", jenkins, 1.05), ("D1", coupled, 1.0), ("C1", unilateral, 1.15)])
def test_second_order_to_the_exact_orbit(case, build, omega):
    data = load(case)
    problem, force = build(data["parameters"])
    row = next(r for r in data.get("results", data.get("steady_state")) if r["Omega"] == omega)
    exact = np.atleast_1d(row["X1"])
    guess = None
    if case == "C1":        # the upper one of three solutions
        X = row["HB01_all_solutions"]
        guess = np.zeros(11)
        top = max(X, key=lambda s: s["X1"])
        guess[0], guess[2] = top["X0"], -top["X1"]
        for angle in np.linspace(0, 2 * np.pi, 24):
            guess[1:3] = top["X1"] * np.cos(angle), top["X1"] * np.sin(angle)
            try:
                q, point, balance = solve(problem, force, omega, 5, guess=guess)
            except AssertionError:
                continue
            if abs(abs(q[0, 1]) - exact[0]) < 1e-3:
                break
    else:
        q, point, balance = solve(problem, force, omega, 5)
    errors = []
    for steps in (128, 1024):
        m = march.March(balance, omega, steps)
        steady = m.shoot(m.on_orbit(point), np.eye(len(q)))
        assert steady.periodic
        errors.append(np.abs(np.abs(steady.harmonics[:, 1]) - exact).max() / exact.max())
    assert errors[1] < 3e-5 and errors[1] < errors[0] / 16      # 1/64 at second order


def test_balance_against_marching_from_its_orbit():
    """163 Hz, H = 9, and the published time integration (2.27307e-4 m)."""
    q, point, balance = solve(oscillator(), FORCE, 2 * np.pi * 163, 9, start="zero_force")
    steady, difference = march.compare(balance, point, [Y2["y2"]], steps=2000)
    assert steady.periodic and difference < 1.5e-3
    assert abs(steady.harmonics[0, 1]) == pytest.approx(2.27307e-4, rel=1e-4)
    g = fourier.to_complex(point.detail.bracket.g)[:, :2, 1:]
    u = fourier.to_complex(point.x.reshape(2, 3, -1))[:, :2, 1:]
    work = np.pi * np.sum(np.arange(1, 10) * (g * u.conj()).imag, axis=(1, 2))
    assert np.allclose(steady.work, work, rtol=1e-2)


def test_a_stuck_orbit_repeats_at_once():
    q, point, balance = solve(oscillator(), FORCE, 2 * np.pi * 150, 3, start="zero_force")
    steady, difference = march.compare(balance, point, [Y2["y2"]], steps=500)
    assert steady.periods == 1 and difference < 1e-10
