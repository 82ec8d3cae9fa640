"""Steps of the monodromy matrix against the dense systems that they stand for."""

from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm

from tipdamp import CubicSpring, IsotropicFriction, Jenkins1D, Problem
from tipdamp.hbm.stability import kernels

rng = np.random.default_rng(3)
CONTACTS, ND = 5, 3
NC = CONTACTS * ND - 2


@pytest.fixture
def place():
    """Of 5 contacts with three components, two of which do not act."""
    found = np.full((CONTACTS, ND), -1)
    found.ravel()[rng.permutation(CONTACTS * ND)[:NC]] = np.arange(NC)
    return found


def tangents(place, of):
    """(a, nd, nd), of some contacts."""
    gamma = np.zeros((CONTACTS, ND, ND))
    for p in of:
        acts = place[p] >= 0
        gamma[p] = rng.normal(size=(ND, ND)) * np.outer(acts, acts)
    return gamma


def whole(place, gamma):
    """(nc, nc), the same of the components that act."""
    dense = np.zeros((NC, NC))
    for p, i, j in zip(*np.nonzero(gamma), strict=True):
        dense[place[p, i], place[p, j]] = gamma[p, i, j]
    return dense


def test_tangents_change_contact_by_contact(place):
    """As if all had been there from the begin, after several events."""
    out, root = rng.normal(size=(NC, 4)), rng.normal(size=(NC, NC))
    static = 0.1 * root @ root.T
    seen, flexibility, before = out, static, np.zeros((CONTACTS, ND, ND))
    for of in ([0, 1, 2, 3, 4], [2], [], [0, 3]):
        gamma = before.copy()
        gamma[of] = tangents(place, of)[of]
        seen, flexibility = kernels.at(place, seen, flexibility, gamma - before)
        system = np.eye(NC) + static @ whole(place, gamma)
        assert seen == pytest.approx(np.linalg.solve(system, out), rel=1e-9, abs=1e-10)
        assert flexibility == pytest.approx(np.linalg.solve(system, static), rel=1e-9, abs=1e-10)
        before = gamma


@pytest.mark.parametrize("modes", [2, NC])
def test_a_step_with_fewer_modes_or_fewer_components(place, modes):
    """u + seen weight into (gamma u + force) = free, either way."""
    gamma = tangents(place, range(CONTACTS))
    into, seen = rng.normal(size=(2 * modes, NC)), 0.1 * rng.normal(size=(NC, 2 * modes))
    weight = rng.normal(size=modes) + 1j * rng.normal(size=modes)
    force, free = rng.normal(size=(2, NC, 7))
    closed = kernels.closing(place, into, weight, seen, gamma)
    u = kernels.stepped(place, into, weight, seen, gamma, force, free, closed)
    real, imaginary = np.split(into @ (whole(place, gamma) @ u + force), 2)
    z = weight[:, None] * (real + 1j * imaginary)
    assert u == pytest.approx(free - seen @ np.vstack([z.real, z.imag]), abs=1e-9)


@pytest.mark.parametrize("refreshed", [2, 10**6])
def test_a_period_in_one_route_or_another(place, monkeypatch, refreshed):
    """The period map of random tangents, whether they are taken afresh now and then or never, is
    that of the dense system of each interval."""
    n, K = 3, 9
    poles = kernels.Poles(
        -0.1 * rng.random(n) + 1j * (1 + rng.random(n)),
        rng.normal(size=(NC, 2 * n)),
        0.1 * rng.normal(size=(2 * n, NC)),
        np.zeros((NC, NC)),
    )
    monkeypatch.setattr(kernels, "AFRESH", refreshed)
    gamma = np.repeat([tangents(place, [k % 3, 4]) for k in range(K)], 2, axis=0)
    gamma = gamma.reshape(K, 2, CONTACTS, ND, ND).swapaxes(0, 1).copy()
    length = np.full(K, 0.02)
    nothing = np.zeros((K, CONTACTS, ND))
    segments = kernels.Segments(
        place,
        length,
        gamma,
        np.zeros_like(gamma),
        nothing,
        nothing.astype(bool),
        np.zeros((K, CONTACTS, ND, ND)),
        kernels.Carried(
            np.empty(0, dtype=int),
            np.zeros((2, K, 0, ND, ND)),
            np.zeros((2, K, 0, ND, ND)),
            np.zeros((K, 0, ND, ND)),
            np.zeros((4, K, 0, ND, ND)),
        ),
    )
    found = kernels.monodromy.py_func(poles, segments, np.empty(0, dtype=int))
    exact, s = np.eye(2 * n), np.diag(poles.s)
    system = np.block([[s.real, -s.imag], [s.imag, s.real]])
    for k in range(K):
        exact = (
            expm(length[k] * (system - poles.into @ whole(place, gamma[0, k]) @ poles.out)) @ exact
        )
    assert found == pytest.approx(exact, rel=1e-5, abs=1e-5)
    assert not np.allclose(exact, np.eye(2 * n), atol=1e-2)


def test_a_force_of_few_rows():
    flexibility, force = rng.normal(size=(NC, NC)), rng.normal(size=(NC, 4))
    force[2:9] = 0
    for one in (force, np.zeros_like(force), rng.normal(size=force.shape)):
        assert kernels.yielded(flexibility, one) == pytest.approx(flexibility @ one, abs=1e-12)


def test_the_period_map_is_compiled_once_for_all_laws():
    """A law that lays its tangents out otherwise would wait for a minute."""
    contact = {"kt": 1.0, "kn": 1.0, "mu": 0.5, "preload": 0.4}
    laws = (
        (CubicSpring(1.0), 0, {}),
        (Jenkins1D(), 0, {"kt": 1.0, "mu": 0.5, "preload": 0.2}),
        (IsotropicFriction(), [0, 1, 2], contact),
    )
    for (law, where, settings), more in product(laws, (False, True)):
        problem = Problem(np.eye(6), 0.05 * np.eye(6), np.eye(6)).force(0, 0.4).force(3, 0.4)
        problem = problem.add(law, where, **settings)
        if more:  # several contacts are laid out otherwise than one
            problem = problem.add(law, 3 + np.array(where), **settings)
        curve = problem.follow_band((0.18, 0.22), outputs={"x": 0}, harmonics=3, stability="all")
        assert np.isfinite(curve.multipliers).any()
    assert len(kernels.monodromy.signatures) == 1
