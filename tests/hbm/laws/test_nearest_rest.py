"""Coupled friction that comes to rest: where it does so is the nearest place to the start, whatever
the instant at which the cycle begins."""

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.hbm.laws.test_creep import LAW, never_open
from tipdamp import Contacts, IsotropicFriction, Problem, compare
from tipdamp.hbm import fourier
from tipdamp.hbm.balance import aft
from tipdamp.hbm.curve.cycles import contact_cycles
from tipdamp.hbm.testing import full_derivative


def forces(contacts, x, first=(0.0, 0.0)):
    """Of the motion x under sliders that start at `first`, m."""
    start = aft.slider_start(np.tile(first, (len(x), 1)), len(x), 2)._replace(nearest=True)
    return LAW.harmonics(contacts, x, start, aft.sample_grid(2, 64), 1.0)


def brought_to_rest():
    """(x, contacts, forces) of contacts that are dragged along and then stick."""
    x, contacts = never_open(200)
    x[:, :2, 0] *= 3
    f = forces(contacts, x)
    kept = np.flatnonzero(f.active[:, 0] & (f.shares[:, 0] == 1))
    assert len(kept) > 20
    x, contacts = np.ascontiguousarray(x[kept]), contacts.select(kept)
    return x, contacts, forces(contacts, x)


def test_the_place_is_the_nearest_one():
    """By minimising the way there under the limits at 2000 instants."""
    x, contacts, f = brought_to_rest()
    basis = fourier.basis(np.linspace(0, 2 * np.pi, 2000), 2)
    for p in range(12):
        u = basis @ x[p].T
        limit = contacts.mu[p] * (contacts.preload[p] + contacts.kn[p] * u[:, 2]) / contacts.kt[p]
        size = limit.max()
        within = {
            "type": "ineq",
            "fun": lambda w, u=u, limit=limit, size=size: (
                (limit**2 - ((u[:, :2] - size * w) ** 2).sum(axis=1)) / size**2
            ),
        }
        best = minimize(
            lambda w: w @ w, x[p, :2, 0] / size, constraints=within, options={"ftol": 1e-14}
        )
        place = -f.g[p, :2, 0] / contacts.kt[p]
        away = np.hypot(*place) / size
        assert away == pytest.approx(np.hypot(*best.x), rel=1e-6)
        assert place / size == pytest.approx(best.x, abs=1e-3)  # two limits at a blunt angle


def test_the_instant_of_the_start_does_not_matter():
    x, contacts, f = brought_to_rest()
    for turn in np.linspace(0.3, 6, 12):
        shifted = fourier.to_real(fourier.to_complex(x) * np.exp(1j * turn * np.arange(3)))
        again = forces(contacts, np.ascontiguousarray(shifted))
        assert np.abs(again.g[:, :2, 0] - f.g[:, :2, 0]).max() < 1e-9 * np.abs(f.g).max()
        assert (again.shares[:, 0] > 1 - 1e-5).all()  # by rounding a limit may slip at its instant


def test_the_derivative_follows_the_place():
    x, contacts, f = brought_to_rest()
    along = np.random.default_rng(1).normal(size=x.shape)
    along *= np.abs(x).max(axis=(1, 2))[:, None, None]
    slope = np.einsum("pijkl,pkl->pij", full_derivative(f, x), along)
    there, back = (forces(contacts, x + s * along).g for s in (1e-7, -1e-7))
    error = np.abs((there - back) / 2e-7 - slope).max(axis=(1, 2))
    assert np.quantile(error / np.abs(slope).max(), 0.95) < 1e-6


def test_no_jump_where_slip_begins():
    """Along 40 growing motions the force at the onset, which bisection finds, beside that a
    billionth before and after: no last digit decides, nor a limit that is missed by 1e-6."""
    rng = np.random.default_rng(1)
    contacts = Contacts([2.0], [10.0], [0.5], [1.5])
    jumps = []
    for i in range(40):
        x = rng.normal(size=(1, 3, 5)) / (1 + np.r_[0, 1, 1, 2, 2]) ** 3
        x[:, 2] *= 0.3
        x[:, :, 0] *= i % 2
        rests, slips = 0.0, 5.0
        for _ in range(60):
            middle = 0.5 * (rests + slips)
            if forces(contacts, middle * x).shares[0, 0] == 1:
                rests = middle
            else:
                slips = middle
        along = slips * (1 + np.r_[-1e-9, 10.0 ** np.arange(-12, -8)])
        g = np.array([forces(contacts, s * x).g[0] for s in along])
        jumps.append(np.abs(np.diff(g, axis=0)).max() / (0.5 * 1.5))
    assert np.mean(np.array(jumps) < 1e-3) >= 0.95, jumps


def test_points_where_slip_begins_are_solved():
    """At 0.4616 Hz none was found, and at 0.4613 Hz each number of orders had another mean."""
    problem = Problem(M=np.eye(3), C=0.02 * np.eye(3), K=np.diag([1.0, 0.74, 1.04]))
    problem = problem.add(IsotropicFriction(), [0, 1, 2], kn=2.217, kt=11.2, mu=0.5, preload=1.576)
    for i, force in enumerate([0.238 + 0.06j, -0.0228 + 0.23j, -0.0495 - 0.0761j]):
        problem = problem.force(i, force)
    for hz in (0.4613, 0.4616, 0.462):
        found = [problem.solve_at(hz, outputs={"x": 0}, harmonics=H) for H in (1, 3, 9)]
        assert all(one.converged for one in found)
        assert np.ptp([one.harmonics[0, 0].real for one in found]) < 1e-8
    assert problem.follow_band((0.4, 0.5), outputs={"x": 0}, harmonics=5).complete


def unloaded(turn):
    """A mass on a contact that a static load of three quarters of the limit reaches, its origin
    unloaded, under a rotating force that starts at an angle."""
    force = np.exp(1j * turn)
    return (
        Problem(
            M=np.eye(3),
            C=0.05 * np.eye(3),
            K=np.diag([1, 1.2, 0.2]),
            static=[2, 0, 2],
            preloaded=False,
        )
        .add(IsotropicFriction(), [0, 1, 2], kn=1, kt=0.5, mu=0.36)
        .force(0, force)
        .force(1, 0.4j * force)
    )


def solution(turn):
    return unloaded(turn).solve_at(0.25, outputs={"a": 0, "b": 1}, harmonics=5)


def test_the_mean_does_not_depend_on_the_phase_of_the_force():
    """It moved by 0.02 and 0.15 of the amplitude where the slider stayed as dragged."""
    means = [solution(turn).harmonics[:, 0].real for turn in np.linspace(0, 6, 13)]
    assert np.ptp(means, axis=0) == pytest.approx(0, abs=1e-9)


def test_steps_in_time_leave_the_slider_there():
    """Time integration from the orbit, and the loops of the contact."""
    problem = unloaded(0.0)
    curve = problem.follow_band((0.25, 0.26), outputs={"a": 0, "b": 1, "n": 2}, harmonics=5)
    assert compare(curve, problem.contact_problem, 0.25).difference < 1e-6
    loops = contact_cycles(curve, problem.contact_problem, 0, 64)
    mean = curve.harmonics[0, :, 0].real
    held = mean[:2] - ([2, 0] - [1, 1.2] * mean[:2]) / 0.5  # static load = springs + contact
    assert np.hypot(*held) > 1.0  # the slider was dragged there
    assert loops.sliders[:, 0] == pytest.approx(np.tile(held, (65, 1)), abs=1e-9)
