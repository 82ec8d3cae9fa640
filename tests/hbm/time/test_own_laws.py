"""Laws of a user's own in time integration: tables written by hand, and laws that depend on the
rate."""

from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tipdamp.hbm.balance.residual import ContactProblem, HarmonicBalance
from tipdamp.hbm.comparison import compare_point, integrator_of
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts, Jenkins1D
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.piecewise import PiecewiseLinear
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.sampled import SampledIntegrator
from tipdamp.hbm.time.settings import IntegrationSettings

ONE = np.ones((1, 1))
W, FORCE = 0.8, 1.0


def oscillator(law, contacts=1):
    """1 kg on 1 N/m with damping, and so many contacts to the ground."""
    none = np.zeros(contacts)
    problem = ContactProblem(
        ONE, 0.05 * ONE, ONE, np.ones((contacts, 1)), law, Contacts(none, none, none, none)
    )
    return HarmonicBalance(problem, {1: np.array([FORCE])}, 5)


def by_scipy(integrator, periods, rate):
    """Motion after so many periods from the steady stuck motion; rate(t, q, v, state) -> (force,
    state rate)."""
    q, v = integrator.stuck.known(np.zeros(1))[:2, 0, 0]

    def slope(t, y):
        force, state_rate = rate(t, y[0], y[1], y[2:])
        return [y[1], FORCE * np.cos(W * t) - 0.05 * y[1] - y[0] - force, *state_rate]

    states = len(rate(0.0, q, v, np.zeros(9))[1])
    found = solve_ivp(
        slope, (0, periods * 2 * np.pi / W), [q, v, *np.zeros(states)], rtol=1e-11, atol=1e-12
    )
    return found.y[0, -1]


def end_of(integrator, periods):
    """Motion at the end of so many periods from rest."""
    z = integrator.periods(integrator.at_rest(), periods).state.z
    return integrator.stuck.known(np.zeros(1))[0, 0, 0] + (integrator.stuck.system.out @ z)[0]


@dataclass(frozen=True)
class Stop(ContactLaw):
    """A spring k behind a gap."""

    k: float = 4.0
    gap: float = 0.7
    components: ClassVar[tuple] = ("n",)

    def step(self, motion, state, contacts):
        return np.where(
            motion.u.real > self.gap, self.k * (motion.u - self.gap), 0 * motion.u
        ), state

    def piecewise_linear(self, contacts):
        P, ones = len(contacts), np.ones(len(contacts))
        none, free = np.zeros((P, 2, 1, 0)), np.zeros(P)
        return PiecewiseLinear(
            initial=np.zeros(P, int),
            stiffness=np.stack([free, self.k * ones], axis=1)[:, :, None, None],
            by_memory=none,
            offset=np.stack([free, -self.k * self.gap * ones], axis=1)[:, :, None],
            follows=np.zeros((2, 0), bool),
            follow_u=np.zeros((P, 2, 0, 1)),
            follow_0=np.zeros((P, 2, 0)),
            state=np.array([0, 1]),
            next_state=np.array([1, 0]),
            of_rate=np.zeros(2, bool),
            entry=np.zeros(2, bool),
            guard_u=np.stack([ones, -ones], axis=1)[:, :, None],
            guard_memory=np.zeros((P, 2, 0)),
            guard_0=np.stack([-self.gap * ones, self.gap * ones], axis=1),
            watched=np.ones((P, 2), bool),
        )


def test_stop_behind_a_gap():
    """Both integrators against Runge-Kutta in five periods; the event-driven one to the accuracy of
    its steps."""
    balance = oscillator(Stop())
    exact = integrator_of(balance, W, IntegrationSettings(tolerance=1e-9))
    assert isinstance(exact, ExactIntegrator)
    expected = by_scipy(exact, 5, lambda t, q, v, s: (4 * max(q - 0.7, 0.0), []))
    assert end_of(exact, 5) == pytest.approx(expected, abs=1e-8)
    assert end_of(SampledIntegrator(balance, W), 5) == pytest.approx(expected, abs=1e-5)
    assert exact.periods(exact.at_rest(), 5).events >= 8


K, LIMIT = (0.6, 0.9), (0.15, 0.5)


@dataclass(frozen=True)
class Iwan(ContactLaw):
    """Two Jenkins elements side by side in one contact."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2
    sliders: ClassVar[int] = 2

    def stuck_stiffness(self, contacts):
        return np.full((len(contacts), 1), sum(K))

    def initial_state(self, u, start, contacts):
        return np.repeat(u, 2, axis=1) if start.from_position else start.positions + 0 * u

    def step(self, motion, state, contacts):
        trial = K * (motion.u - state)
        force = np.where(np.abs(trial.real) > LIMIT, np.sign(trial.real) * LIMIT, trial)
        return force.sum(axis=1, keepdims=True), motion.u - force / K

    def piecewise_linear(self, contacts):
        states, P = list(product((0, 1, -1), repeat=2)), len(contacts)
        guards = []  # state, next state, of rate, by u, by each slider, constant
        for s, d, sign in product(range(9), (0, 1), (1, -1)):
            other = list(states[s])
            other[d] = 0 if states[s][d] else sign
            following, slider = states.index(tuple(other)), np.eye(2)[d]
            if states[s][d] == 0:
                guards.append((s, following, False, sign, -sign * slider, -LIMIT[d] / K[d]))
            elif states[s][d] == sign:
                guards.append((s, following, True, -sign, 0 * slider, 0.0))
        state, following, of_rate, by_u, by_slider, constant = map(
            np.array, zip(*guards, strict=True)
        )
        G, signs = len(guards), np.array(states)
        every = np.ones((P, 1, 1))
        return PiecewiseLinear(
            np.zeros(P, int),
            every[..., None] * np.full((9, 1, 1), sum(K)),
            -every[..., None] * np.full((9, 1, 2), K),
            np.zeros((P, 9, 1)),
            signs != 0,
            np.ones((P, 9, 2, 1)),
            -every * signs * np.divide(LIMIT, K),
            state,
            following,
            of_rate,
            np.zeros(G, bool),
            every * by_u[:, None],
            every * by_slider,
            every[..., 0] * constant,
            np.ones((P, G), bool),
        )


@pytest.mark.slow
def test_iwan_is_two_jenkins_elements():
    """Written by hand with two sliders in one contact; two contacts with a law of the house; and by
    samples."""
    one = ExactIntegrator(oscillator(Iwan()), W)
    contacts = Contacts([0.0, 0.0], K, [1.0, 1.0], LIMIT)
    problem = ContactProblem(ONE, 0.05 * ONE, ONE, np.ones((2, 1)), Jenkins1D(), contacts)
    two = ExactIntegrator(HarmonicBalance(problem, {1: np.array([FORCE])}, 5), W)
    a, b = (integrator.periods(integrator.at_rest(), 6) for integrator in (one, two))
    # the first slider starts at its limit: slip for the law by hand, a stick that ends at once for
    # the other
    assert 30 < a.events <= b.events <= a.events + 1
    assert a.state.memory.ravel() == pytest.approx(b.state.memory.ravel(), abs=1e-8)
    assert a.dissipated.sum() == pytest.approx(b.dissipated.sum(), rel=1e-7)
    assert a.force[0] == pytest.approx(b.force.sum(axis=0), abs=1e-7)
    assert end_of(SampledIntegrator(oscillator(Iwan()), W), 6) == pytest.approx(
        end_of(one, 6), abs=2e-5
    )


@dataclass(frozen=True)
class Damper(ContactLaw):
    """f = c v + c3 v^3 + k u^3."""

    components: ClassVar[tuple] = ("t1",)

    def step(self, motion, state, contacts):
        return 0.3 * motion.v + 0.2 * motion.v**3 + 0.5 * motion.u**3, state


def test_nonlinear_damper_to_fourth_order():
    balance, errors = oscillator(Damper()), []
    for samples in (64, 256):
        integrator = integrator_of(balance, W, IntegrationSettings(samples=samples))
        expected = by_scipy(
            integrator, 3, lambda t, q, v, s: (0.3 * v + 0.2 * v**3 + 0.5 * q**3, [])
        )
        errors.append(abs(end_of(integrator, 3) - expected))
    assert integrator.method == "sampled" and errors[1] < 1e-7 and errors[1] < errors[0] / 100


@dataclass(frozen=True)
class Hysteresis(ContactLaw):
    """Bouc-Wen with n = 1 [Wen 1976]: f = 0.7 z, z' = v - 1.5 |v| z - 0.5 v |z|; state: z and the
    motion before."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    def initial_state(self, u, start, contacts):
        return np.concatenate([0 * u, u], axis=1)

    def step(self, motion, state, contacts):
        z, way = state[:, :1], motion.u - state[:, 1:]
        a = 1.5 * np.where(way.real < 0, -way, way) + 0.5 * np.where(z.real < 0, -way, way)
        part = 1 - a / 2 + a**2 / 6 - a**3 / 24  # (1 - exp(-a))/a of a short step
        z = z * (1 - a * part) + way * part
        return 0.7 * z, np.concatenate([z, motion.u], axis=1)


@pytest.mark.slow
def test_bouc_wen_to_second_order():
    balance, errors = oscillator(Hysteresis()), []
    for samples in (256, 1024):
        integrator = integrator_of(balance, W, IntegrationSettings(samples=samples))
        expected = by_scipy(
            integrator,
            3,
            lambda t, q, v, s: (0.7 * s[0], [v - 1.5 * abs(v) * s[0] - 0.5 * v * abs(s[0])]),
        )
        errors.append(abs(end_of(integrator, 3) - expected))
    assert errors[1] < 1e-5 and errors[1] < errors[0] / 8


@dataclass(frozen=True)
class Maxwell(ContactLaw):
    """A spring k = 0.8 in series with a damper c = 0.5; state: place of the damper."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 1

    def step(self, motion, state, contacts):
        decay = np.exp(-0.8 / 0.5 * motion.dt)
        stretch = (motion.u - motion.v * motion.dt - state) * decay + motion.v * (
            1 - decay
        ) * 0.5 / 0.8
        return 0.8 * stretch, motion.u - stretch


@pytest.mark.slow
def test_velocity_and_step_length_reach_the_law():
    """The steady state of a Maxwell element has a closed form."""
    integrator = integrator_of(oscillator(Maxwell()), W, IntegrationSettings(samples=256))
    state = integrator.periods(integrator.at_rest(), 20).state
    cycle = integrator.periods(state)
    stiffness = 0.8 * 0.5j * W / (0.8 + 0.5j * W)
    expected = FORCE / (1 - W**2 + 0.05j * W + stiffness)
    assert integrator.change(state, cycle) < 1e-8
    assert integrator.stuck.harmonics(ONE, cycle.force)[0, 1] == pytest.approx(expected, rel=3e-4)
    assert cycle.dissipated == pytest.approx(np.pi * stiffness.imag * abs(expected) ** 2, rel=3e-4)


def test_balance_of_a_rate_dependent_law():
    balance = oscillator(Maxwell())
    point = solve_fixed(balance.evaluate, balance.linear(W), W, balance.weights)
    found = compare_point(balance, point, ONE, IntegrationSettings(samples=256))
    assert found.agrees and found.difference < 1e-3
    assert found.said.endswith(
        "; integrated with 256 steps per period, as law Maxwell is not piecewise linear"
    )


def test_a_law_without_table_is_refused():
    with pytest.raises(InputError, match="law Damper is not piecewise linear"):
        ExactIntegrator(oscillator(Damper()), W)
