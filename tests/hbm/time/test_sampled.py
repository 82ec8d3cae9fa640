"""Sampled integration of laws known by their step: coupled friction, cubic spring, laws of a user's
own."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from tests.hbm.cases import jenkins, load, solve
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.laws import ContactLaw, Contacts, CubicSpring, IsotropicFriction
from tipdamp.hbm.time import shooting
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.sampled import SampledIntegrator
from tipdamp.hbm.time.settings import IntegrationSettings

ONE = np.ones((1, 1))


@dataclass(frozen=True)
class OwnSlider(ContactLaw):
    """A user's own law: Jenkins' element, written anew."""

    components: ClassVar[tuple] = ("t1",)
    sliders: ClassVar[int] = 1
    states: ClassVar[int] = 1

    def stuck_stiffness(self, pairs):
        return pairs.kt[:, None]

    def initial_state(self, u, start, pairs):
        return start.positions + 0 * u

    def step(self, motion, state, pairs):
        u = motion.u
        limit, kt = (pairs.mu * pairs.preload)[:, None], pairs.kt[:, None]
        trial = kt * (u - state)
        slips = np.abs(trial.real) > limit.real
        force = np.where(slips, np.sign(trial.real) * limit, trial)
        return force, u - force / kt


def duffing(omega, H=25):
    p = load("I1")["parameters"]
    pairs = Contacts([0.0], [0.0], [0.0], [0.0])
    problem = ContactProblem(
        p["m"] * ONE, p["c"] * ONE, p["k"] * ONE, ONE, CubicSpring(p["k3"]), pairs
    )
    return solve(problem, np.array([p["F"]]), omega, H)


def test_cubic_spring_to_fourth_order():
    """0.9 rad/s; at H = 25 the balance is converged to 1e-11."""
    q, point, balance = duffing(0.9)
    errors = []
    for steps in (64, 256):
        integrator = SampledIntegrator(
            balance, 0.9, IntegrationSettings(samples=steps, repeats=1e-11)
        )
        steady = shooting.shoot(integrator, integrator.on_orbit(point), [[1.0]])
        assert steady.periodic
        errors.append(abs(abs(steady.harmonics[0, 1]) / abs(q[0, 1]) - 1))
    assert errors[1] < 1e-8 and errors[1] < errors[0] / 100  # 1/256


def test_own_law_is_the_built_in_one():
    """A1 at 1.05 with a Jenkins element of a user's own, against the exact orbit and event-driven
    integration."""
    built, force = jenkins(load("A1")["parameters"])
    problem = ContactProblem(built.M, built.C, built.K, built.B, OwnSlider(), built.contacts)
    q, point, balance = solve(problem, force, 1.05, 5, samples=256)
    integrator = SampledIntegrator(balance, 1.05, IntegrationSettings(samples=256))
    own = shooting.shoot(integrator, integrator.on_orbit(point), [[1.0]])
    exact = next(r["X1"] for r in load("A1")["steady_state"] if r["Omega"] == 1.05)
    assert own.periodic and abs(own.harmonics[0, 1]) == pytest.approx(exact, rel=5e-4)
    integrator = ExactIntegrator(solve(built, force, 1.05, 9)[2], 1.05)
    exact_steady = shooting.shoot(integrator, integrator.at_rest(), [[1.0]])
    assert own.dissipated == pytest.approx(exact_steady.dissipated, rel=3e-3)


@pytest.mark.parametrize("law", [CubicSpring(0.6), OwnSlider(), IsotropicFriction()])
@pytest.mark.parametrize("newton", [8, 1])
def test_steps_together_are_those_one_by_one(law, newton):
    """Hard springs, and sliders that slip; after one step of Newton's method nothing has converged,
    and steps that do not are taken one by one."""
    nd = len(law.components)
    contacts = Contacts([3.0], [2.0], [0.5], [0.4])
    one = np.eye(nd)
    problem = ContactProblem(one, 0.05 * one, one, one, law, contacts)
    balance = HarmonicBalance(problem, {1: np.array([1.0, 1.0j, 0.3])[:nd]}, 3)

    def two_periods(together):
        integrator = SampledIntegrator(
            balance,
            0.9,
            IntegrationSettings(samples=100, together=together, newton_together=newton),
        )
        return integrator.periods(integrator.at_rest(), 2)

    found, expected = two_periods(64), two_periods(1)
    size = np.abs(expected.force).max()
    assert np.abs(expected.force[0, 1:]).max() > 0.05 * size  # more than the stuck springs
    assert np.abs(found.force - expected.force).max() < 1e-11 * size
    assert found.state.z == pytest.approx(expected.state.z, abs=1e-11 * np.abs(found.state.z).max())
    assert found.state.memory == pytest.approx(expected.state.memory, abs=1e-11)
    assert found.dissipated == pytest.approx(expected.dissipated, abs=1e-10 * size)


class Maxwell(OwnSlider):
    """A spring behind a dashpot, which relaxes in a second: linear in motion and memory."""

    def step(self, motion, state, pairs):
        share = motion.dt / (1.0 + motion.dt)
        relaxed = state + share * (motion.u - state)
        return pairs.kt[:, None] * (motion.u - relaxed), relaxed


def test_one_step_of_newton_solves_all_samples_of_a_linear_law():
    """The second one, about the path of the first, finds it unchanged."""
    contacts = Contacts([0.0], [2.0], [1.0], [1.0])
    problem = ContactProblem(ONE, 0.05 * ONE, ONE, ONE, Maxwell(), contacts)
    balance = HarmonicBalance(problem, {1: np.array([1.0])}, 3)

    def integrator(together):
        settings = IntegrationSettings(samples=64, together=together, newton_together=2)
        return SampledIntegrator(balance, 0.9, settings)

    solved = integrator(64)._steps(1, 64, integrator(64).at_rest())
    assert solved is not None
    alone = integrator(1).periods(integrator(1).at_rest())
    assert solved[0].memory == pytest.approx(alone.state.memory, rel=1e-9)
    assert solved[0].z == pytest.approx(alone.state.z, rel=1e-9)


def test_one_step_of_newton_solves_a_sample_of_a_linear_law():
    """With the derivative of what acts beside the spring of the contact at rest."""
    contacts = Contacts([0.0], [2.0], [1.0], [1.0])
    problem = ContactProblem(ONE, 0.05 * ONE, ONE, ONE, Maxwell(), contacts)
    balance = HarmonicBalance(problem, {1: np.array([1.0])}, 3)
    once, often = (
        SampledIntegrator(
            balance, 0.9, IntegrationSettings(samples=64, together=1, newton_steps=steps)
        )
        for steps in (2, 20)
    )
    found, expected = (one.periods(one.at_rest()).state for one in (once, often))
    assert found.memory == pytest.approx(expected.memory, rel=1e-11)
    assert found.z == pytest.approx(expected.z, rel=1e-11)


@pytest.mark.slow
def test_coupled_friction_under_a_rotating_force():
    """The exact radius at 1.1 rad/s, to second order in the steps."""
    row = next(r for r in load("E1")["rotating_force_oscillator"] if r["Omega"] == 1.1)
    B = np.vstack([np.eye(2), np.zeros((1, 2))])
    pairs = Contacts([0.0], [row["kt"]], [1.0], [row["L"]])
    problem = ContactProblem(*[row[k] * np.eye(2) for k in "mck"], B, IsotropicFriction(), pairs)
    X = -1j * row["R_exact"][0] * np.array([1, -1j])
    guess = np.zeros((3, 3))
    guess[:2, 1], guess[:2, 2] = X.real, X.imag
    q, point, balance = solve(
        problem, row["F"] * np.array([1, -1j]), row["Omega"], 1, samples=256, guess=guess.ravel()
    )
    errors = []
    for steps in (32, 128):
        integrator = SampledIntegrator(
            balance, row["Omega"], IntegrationSettings(samples=steps, repeats=1e-7)
        )
        steady = shooting.shoot(integrator, integrator.on_orbit(point), np.eye(2))
        assert steady.periodic
        errors.append(
            np.abs(np.abs(steady.harmonics[:, 1]) - row["R_exact"][0]).max() / row["R_exact"][0]
        )
    assert errors[1] < 1e-3 and errors[1] < errors[0] / 8 + 1e-9
