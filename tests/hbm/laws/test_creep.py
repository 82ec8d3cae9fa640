"""Coupled friction where sticking ends: a slider creeps towards its rest, ever more slowly."""

from dataclasses import replace

import numpy as np

from tests.hbm.conformance import random_case
from tipdamp.hbm.laws import IsotropicFriction
from tipdamp.hbm.testing import forces, full_derivative

LAW = IsotropicFriction()


def never_open(P=60):
    """Motions of two orders under which contacts stick at first and then slip, and these."""
    x, contacts, rng = random_case(LAW, P=P, H=2, seed=7)
    contacts = replace(contacts, preload=2 * contacts.kn * np.abs(x[:, 2]).sum(axis=1))
    x[:, :2] *= (contacts.mu * contacts.preload / contacts.kt)[:, None, None]
    return x, contacts


def test_no_jump_along_a_growing_motion():
    """Each interval of a path is halved where the force of its contact changes most."""
    x, contacts = never_open()

    def at(share):
        return forces(LAW, contacts, share[:, None, None] * x).g

    grid = np.linspace(0.02, 1.5, 150)
    along = np.array([at(np.full(len(x), share)) for share in grid])
    size = np.abs(along).max(axis=(0, 2, 3))
    most = np.abs(np.diff(along, axis=0)).max(axis=(2, 3)).argmax(axis=0)
    a, b = grid[most], grid[most + 1]
    for _ in range(40):
        middle = 0.5 * (a + b)
        low, half, high = at(a), at(middle), at(b)
        first = np.abs(half - low).max(axis=(1, 2)) > np.abs(high - half).max(axis=(1, 2))
        a, b = np.where(first, a, middle), np.where(first, middle, b)
    assert (b - a).max() < 1e-13
    assert (np.abs(at(b) - at(a)).max(axis=(1, 2)) <= 1e-5 * size).all()


def test_derivative_of_a_slider_that_has_crept():
    """Under motions at which some contacts creep for more periods than are followed."""
    x, contacts = never_open(200)
    along = (
        np.random.default_rng(1).normal(size=x.shape) * np.abs(x).max(axis=(1, 2))[:, None, None]
    )
    f = forces(LAW, contacts, x)
    slope = np.einsum("pijkl,pkl->pij", full_derivative(f, x), along)
    h = 1e-7
    there, back = (forces(LAW, contacts, x + s * along) for s in (h, -h))
    rests = f.active[:, 0] & (f.shares[:, 1] == 0)
    assert rests.sum() > 20
    error = np.abs((there.g - back.g) / (2 * h) - slope).max(axis=(1, 2))
    assert np.quantile(error[rests] / np.abs(slope).max(), 0.9) < 1e-7
