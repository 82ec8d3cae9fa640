"""Laws that depend on the rate: velocity and length of a step reach them, and the frequency enters
the derivatives."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from tests.hbm.conformance import own_law
from tests.hbm.laws.test_contract import Viscous
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.laws import ContactLaw, Contacts
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.testing import check_law, forces, full_derivative

ONE, ONE2 = np.eye(1), np.eye(2)


@dataclass(frozen=True)
class Maxwell(ContactLaw):
    """Spring k (N/m) and dashpot c (N s/m) in series, by the trapezoidal rule; state: force and
    velocity before."""

    components: ClassVar[tuple] = ("t1",)
    states: ClassVar[int] = 2

    k: float
    c: float

    def step(self, motion, state, contacts):
        v, lag = motion.v[:, 0], 0.5 * motion.dt * self.k
        f = (state[:, 0] * (1 - lag / self.c) + lag * (v + state[:, 1])) / (1 + lag / self.c)
        return f[:, None], np.stack([f, v], axis=1)


def impedance(law, w):
    """Complex force by motion, N/m."""
    return 1j * w * law.c if isinstance(law, Viscous) else 1 / (1 / law.k + 1 / (1j * w * law.c))


@pytest.mark.parametrize("law", [Viscous(0.3), Maxwell(2.0, 0.8)], ids=lambda law: law.name)
def test_contract(law):
    check_law(law)


@pytest.mark.slow
@pytest.mark.parametrize("law", [Viscous(0.3), Maxwell(2.0, 0.8)], ids=lambda law: law.name)
def test_resonance_in_closed_form(law):
    problem = ContactProblem(ONE, 0.05 * ONE, ONE, ONE, law, Contacts([0.0], [0.0], [0.0], [0.0]))
    curve = follow_band(
        problem,
        np.ones(1),
        (0.05, 0.4),
        harmonics=1,
        outputs={"x": [1.0]},
        samples=512,
        truncation=False,
    )
    w = 2 * np.pi * curve.frequency
    expected = 1 / (1 - w**2 + 0.05j * w + np.array([impedance(law, one) for one in w]))
    assert curve.complete and np.allclose(curve.harmonics[:, 0, 1], expected, rtol=1e-4)
    assert np.allclose(curve.share_slip, 1.0)  # without sliders: it slips where it dissipates


@pytest.mark.parametrize(
    "law",
    [Viscous(0.3), Maxwell(2.0, 0.8), own_law("bouc_wen").BoucWen(0.1, 0.4, 0.8, 0.2)],
    ids=lambda law: law.name,
)
def test_derivative_of_residual_by_frequency(law):
    problem = ContactProblem(ONE, 0.05 * ONE, ONE, ONE, law, Contacts([0.0], [1.0], [0.0], [0.0]))
    balance, w, h = HarmonicBalance(problem, {1: np.ones(1)}, 3), 0.9, 1e-6
    x = np.random.default_rng(0).normal(size=7)
    ends = [balance.evaluate(x, w + s).residual for s in (h, -h)]
    slope = (ends[0] - ends[1]) / (2 * h)
    assert np.abs(balance.evaluate(x, w).by_parameter - slope).max() < 1e-7 * np.abs(slope).max()


class SliderBesideASpring(ContactLaw):
    """A tangent that creeps, and a normal that its stuck spring holds whole."""

    components: ClassVar[tuple] = ("t1", "n")
    states: ClassVar[int] = 2

    def stuck_stiffness(self, contacts):
        return np.stack([contacts.kt, contacts.kn], axis=1)

    def step(self, motion, state, contacts):
        move = motion.u[:, 0] - state[:, 1]
        s = np.where(move.real > 0, 1.0, -1.0)
        friction = s + (state[:, 0] - s) * np.exp(-contacts.kt * s * move)
        force = np.stack([friction, contacts.kn * motion.u[:, 1]], axis=1)
        return force, np.stack([friction, motion.u[:, 0]], axis=1)


def test_a_component_that_is_not_active_has_no_derivative():
    """Beside one that is: rounding of what the stuck spring takes over is left out."""
    contacts = Contacts(kn=[1.3, 0.7], kt=[1.1, 0.9], mu=[0.5, 0.5], preload=[1.0, 1.0])
    x = np.random.default_rng(0).normal(size=(2, 2, 7))
    found = forces(SliderBesideASpring(), contacts, x)
    assert found.active.tolist() == [[True, False]] * 2
    assert not full_derivative(found, x)[~found.active].any()


def test_a_tangent_at_rest_leaves_newton_to_the_one_that_creeps():
    """Of two tangents that creep by themselves: what a period leaves where it was stays there, and
    the other repeats in as few periods as alone."""
    periods = []

    class Counted(own_law("creeping_contact").CreepingContact):
        def tangents(self, motion, state, contacts):
            periods.append(1)
            return super().tangents(motion, state, contacts)

    law = Counted(0.1)
    contacts = Contacts(kn=[1.0, 1.0], kt=[1.0, 0.8], mu=[0.5, 0.5], preload=[1.0, 1.0])
    x = 0.03 * np.random.default_rng(0).normal(size=(2, 2, 7))
    x[:, 1] = 0.0
    found = forces(law, contacts, x)
    assert len(periods) == 3
    forces_at = [forces(law, contacts, x + h * (x != 0)).g for h in (1e-6, -1e-6)]
    expected = (forces_at[0] - forces_at[1]) / 2e-6
    derivative = np.einsum("pdmek,pek->pdm", full_derivative(found, x), 1.0 * (x != 0))
    assert np.abs(derivative - expected).max() < 1e-8 * np.abs(expected).max()
    alone = x.copy()
    alone[:, 1] = 0.03  # a motion about another mean: the same friction of the first
    assert np.allclose(forces(law, contacts, alone).g[:, 0], found.g[:, 0], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("ratio", 10.0 ** -np.arange(5, 12))
def test_a_tangent_that_hardly_moves_is_no_noise(ratio):
    """Its mean force is at most kt times its motion, as where friction is none at t = 0: not what
    a state that creeps for a million periods makes of the rounding of the limit force, 0.5 N."""
    law = own_law("creeping_contact").CreepingContact(0.0)
    contacts = Contacts(kn=[1.0], kt=[1.0], mu=[0.5], preload=[1.0])
    x = np.zeros((1, 2, 7))
    x[:, 0, 1] = 1.0
    for phase in np.linspace(0.1, 6.0, 15):
        x[:, 1, 1:3] = ratio * np.array([np.cos(phase), np.sin(phase)])
        assert abs(forces(law, contacts, x).g[0, 1, 0]) < 1.1 * ratio


@pytest.mark.parametrize("w", [0.6, 1.2])
def test_a_right_law_is_taken_where_a_tangent_hardly_moves(w):
    """Differences of what is small beside the limit force are rounding over a short step."""
    law = own_law("creeping_contact").CreepingContact(0.0)
    plate = Problem(ONE2, 0.05 * ONE2, np.diag([1.0, 1.3])).force(0, 1.0)
    plate = plate.add(law, [0, 1], kt=1.0, mu=0.5, preload=1.0)
    for size in 10.0 ** -np.arange(5, 13):
        found = plate.force(1, size).solve_at(omega=w, outputs={"a": 0}, harmonics=3)
        assert found.converged
