"""Uncoupled Coulomb friction: event-driven cycles in closed form and in their extremes."""

import numpy as np
import pytest

from tests.hbm.conformance import random_case
from tipdamp.hbm import fourier, laws
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.uncoupled.breaks import AT, BACKWARD, FORWARD, PLACES, RATES
from tipdamp.hbm.laws.uncoupled.events import stick_ends
from tipdamp.hbm.testing import forces


def test_stuck_contact_is_a_spring():
    contacts = laws.Contacts([2.0], [3.0], [0.5], [10.0])
    f, state = laws.DryFriction2T().step(
        laws.Motion(np.array([[0.1, -0.2, 0.3]]), 0, 1), np.zeros((1, 5)), contacts
    )
    assert np.allclose(f, [[0.3, -0.6, 10.6]]) and (state[:, :2] == 0).all()
    x = np.zeros((1, 3, 3))
    x[0, :, 1] = 0.1, -0.2, 0.3
    for law in (laws.DryFriction2T(), laws.IsotropicFriction()):
        b = forces(law, contacts, x)
        assert not b.g.any() and not len(b.contacts) and b.shares.tolist() == [[1.0, 0.0, 0.0]]


def test_energy_of_a_jenkins_cycle_in_closed_form():
    """4 L (X - L/kt) per cycle, the area of the parallelogram."""
    kt, L, X = 2.0, 0.3, 1.0
    contacts = laws.Contacts([0.0], [kt], [1.0], [L])
    x = np.zeros((1, 1, 3))
    x[0, 0, 1] = X
    g = fourier.to_complex(forces(laws.Jenkins1D(), contacts, x).g)[0, 0, 1]
    assert np.pi * (g * X).imag == pytest.approx(4 * L * (X - L / kt), rel=1e-12)


def test_swapped_and_mirrored_tangents():
    """t1, t2 -> -t1, -t2 and t1 <-> t2 are symmetries of two uncoupled tangents."""
    law = laws.DryFriction2T()
    x, contacts, _ = random_case(law)
    g = forces(law, contacts, x).g
    assert np.allclose(forces(law, contacts, x[:, [1, 0, 2]]).g, g[:, [1, 0, 2]], atol=1e-13)
    sign = np.array([-1.0, -1, 1])[:, None]
    assert np.allclose(forces(law, contacts, sign * x).g, sign * g, atol=1e-13)


def test_lift_off_within_one_sample():
    """Open for 2 % of the cycle, between two of eight samples."""
    law, contacts = laws.UnilateralSpring(), laws.Contacts([1.0], [0.0], [0.0], [1.0])
    x = np.zeros((1, 1, 3))
    turn = 2 * np.pi * 4.5 / 8
    amplitude = 1 / np.cos(np.pi * 0.02)
    x[0, 0, 1:] = -amplitude * np.cos(turn), amplitude * np.sin(turn)
    assert forces(law, contacts, x, samples=8).shares[0, 2] == pytest.approx(0.02, rel=1e-10)


@pytest.mark.parametrize("shift", [0.1, 0.2, 0.3])
def test_pause_of_slip_within_one_sample(shift):
    """The rate of u falls below zero between two samples: the slider stops and starts again
    there."""
    law, contacts = laws.Jenkins1D(), laws.Contacts([0.0], [1.0], [1.0], [0.3])
    x = fourier.to_real(np.array([[[0, np.exp(1j * shift), 0, 1.02 / 3 * np.exp(3j * shift)]]]))
    coarse, fine = (forces(law, contacts, x, samples=n).g for n in (16, 4096))
    assert np.abs(coarse - fine).max() < 1e-14


def test_events_do_not_depend_on_samples():
    """4000 random cycles, among them pauses within a sample, and edges that leave the slider at
    re-contact."""
    rng = np.random.default_rng(0)
    P, H = 4000, 3
    x = rng.normal(size=(P, 3, 2 * H + 1)) / np.r_[1, np.repeat(np.arange(1, H + 1), 2)]
    contacts = laws.Contacts(np.ones(P), np.ones(P), rng.uniform(0.1, 1, P), rng.uniform(0, 1, P))
    coarse, fine = (forces(laws.DryFriction2T(), contacts, x, samples=n).g for n in (64, 1024))
    assert np.abs(coarse - fine).max() < 1e-13


@pytest.mark.parametrize("column", ["kn", "kt", "mu"])
def test_negative_settings_are_refused(column):
    values = dict(kn=[1.0], kt=[1.0], mu=[0.5], preload=[1.0]) | {column: [-1.0]}
    with pytest.raises(InputError, match=column):
        laws.Contacts(**values)


@pytest.mark.parametrize("law", [laws.DryFriction1T(), laws.DryFriction2T()])
def test_what_sticks_surely_is_a_bound_of_the_normal_force(law):
    """kn = 2, kt = 3, mu = 0.5, 10 N: it sticks while kt |u_t| <= mu (10 - kn u_n), and is closed
    while u_n < 5, however little it moves along."""
    contacts = laws.Contacts([2.0] * 5, [3.0] * 5, [0.5] * 5, [10.0] * 5)
    along, away = np.array([0.99, 1.01, 1e-6, 1e-6, 0.0]), np.array([2.0, 2.0, 4.9, 5.1, 5.1])
    amplitude = np.zeros((5, len(law.components)))
    amplitude[:, 0], amplitude[:, -1] = along, away
    found = law.sticks_surely(contacts, amplitude)
    assert found.tolist() == [True, False, True, False, False]


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("half_width", [0.1, 0.5])
def test_of_two_edges_that_reach_the_slider_the_earlier_one_counts(way, half_width):
    """u = +-sin t over 0.7 of a period, between two instants that are looked at: the slider at 0
    is taken along at arcsin of half the width of its interval, and only later by the other edge."""
    b = 1.4 * np.pi
    edges = np.array([[-half_width, 0, -way], [half_width, 0, -way]])
    marks = np.zeros((2, RATES + 2))
    marks[:, AT] = 0.0, b
    for s in range(2):
        marks[:, PLACES + s] = edges[s, 0] + way * np.sin(marks[:, AT])
        marks[:, RATES + s] = way * np.cos(marks[:, AT])
    when, state = stick_ends(marks, edges, 0, 0.0, 0.0, np.zeros(2))
    assert when == pytest.approx(np.arcsin(half_width), rel=1e-12)
    assert state == (FORWARD if way > 0 else BACKWARD)
