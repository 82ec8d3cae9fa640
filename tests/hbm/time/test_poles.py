"""Which modes of the stuck system may follow without mass."""

import numpy as np
import pytest

from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.laws import UnilateralSpring
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.time.poles import poles, split

MASS, OWN, CONTACT = 0.5, 3.0, 97.0  # kg; N/m: of the spring to ground, and of the contact


def receptance():
    """Of two masses that do not know of each other, the second on a spring and a stiff contact."""
    K = np.diag([1.0, OWN])
    light = Problem(np.diag([1.0, MASS]), 1e-3 * K, K)
    light = light.add(UnilateralSpring(), 1, kn=CONTACT, preload=1.0).force(0, 1.0)
    balance = HarmonicBalance(light.contact_problem, {1: np.eye(2)[0]}, 1)
    return balance.receptance, np.array([[0.0, 1.0]]), balance.springs.ravel()


def test_a_motion_that_the_contact_lets_go():
    """Of one mode in closed form: sqrt(OWN (OWN + CONTACT) / CONTACT / MASS), to first order in
    its inertia; the motion itself has sqrt(OWN / MASS) rad/s."""
    linear, B, springs = receptance()
    stuck = np.sqrt((OWN + CONTACT) / MASS)
    assert np.abs(poles(linear).s).max() == pytest.approx(stuck, rel=1e-3)
    exact = np.sqrt(OWN * (OWN + CONTACT) / CONTACT / MASS)
    assert poles(linear, 0.9 * stuck).let_go(B, springs) == pytest.approx(exact, rel=1e-3)
    assert poles(linear).let_go(B, springs) == np.inf


@pytest.mark.parametrize("reached, kept", [(2.4, 1), (2.6, 2)])
def test_what_is_slow_once_the_contact_lets_go_keeps_its_mass(reached, kept):
    """At 14 rad/s while the contact sticks, and 2.49 rad/s without it."""
    linear, B, springs = receptance()
    assert len(split(linear, B, springs, 5.0, 0.02, reached).s) == kept


C_OF = {
    "below critical": [[0.3, 0.0], [0.0, 0.2]],
    "beyond critical": [[40.0, 0.0], [0.0, 0.2]],
    "critical": [[2.0 * np.sqrt(1.0 + CONTACT), 0.0], [0.0, 0.2]],
    "beyond critical, coupled": [[40.0, -1.0], [-1.0, 0.5]],
}


@pytest.mark.parametrize("name", C_OF)
def test_the_poles_are_those_of_the_receptance(name):
    """Of the whole system in its poles, and with those that are fast without mass at low
    frequencies."""
    K = np.diag([1.0, OWN])
    masses = Problem(np.diag([1.0, MASS]), C_OF[name], K)
    stopped = masses.add(UnilateralSpring(), 0, kn=CONTACT, preload=1.0).force(0, 1.0)
    linear = HarmonicBalance(stopped.contact_problem, {1: np.eye(2)[0]}, 1).receptance
    found = poles(linear)
    for w in (0.0, 0.7, 3.0, 12.0):
        factors = linear.factors(w)[0][:, 0]
        wanted = (linear.shapes * factors) @ linear.into.T
        here = (found.out / (1j * w - found.s)) @ found.into.T
        beside = (found.out.conj() / (1j * w - found.s.conj())) @ found.into.conj().T
        assert np.abs((here + beside) / 2 - wanted).max() < 1e-8 * np.abs(wanted).max()
    real = found.s.imag == 0
    assert real.any() == (name != "below critical")
    assert not found.out[:, real].imag.any() and not found.into[:, real].imag.any()
