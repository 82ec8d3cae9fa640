"""A contact that is closed for less than the time between two samples."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.conformance import random_case
from tipdamp import DryFriction2T, IsotropicFriction, Problem, UnilateralSpring
from tipdamp.hbm import fourier
from tipdamp.hbm.testing import forces

W, KN, MU = 1000.0, 1e5, 0.5
FORCE = 40.0  # N, along the normal
NORMAL = FORCE / abs(4e5 - 0.1 * W**2 + 20j * W)  # m, of the vibration without contact


@pytest.mark.parametrize("gap", [0.99, 0.999, 0.9999])
def test_friction_is_that_of_many_samples(gap):
    """Closed for 10, 3 and 1 % of the period, gap / NORMAL, where 16 samples see nothing: the same
    motion, force and work as with 4096."""
    problem = Problem(
        M=0.1 * np.eye(3), C=np.diag([2.0, 2.0, 20.0]), K=np.diag([1e5, 1.2e5, 4e5])
    ).add(IsotropicFriction(), [0, 1, 2], kn=KN, kt=1e5, mu=MU, preload=-KN * NORMAL * gap)
    problem = problem.force(0, 50.0).force(1, 20j).force(2, FORCE * np.exp(1j))
    found, many = (
        problem.solve_at(W / (2 * np.pi), outputs={"x": 0}, harmonics=3, samples=samples)
        for samples in (None, 4096)
    )
    assert found.converged and many.converged and found.dissipated[0] > 0
    assert found.dissipated == pytest.approx(many.dissipated, rel=1e-6)
    np.testing.assert_allclose(found.harmonics, many.harmonics, atol=1e-13)
    friction, normal = (abs(many.contact_force[0, at]) for at in (slice(0, 2), 2))
    np.testing.assert_allclose(
        abs(found.contact_force[0, :2]), friction, atol=1e-6 * friction.max()
    )
    assert 0 < friction.max() <= 2 * MU * normal.max()


@pytest.mark.parametrize("H", [1, 3, 7])
@pytest.mark.parametrize(
    "law", [IsotropicFriction(), DryFriction2T(), UnilateralSpring()], ids=lambda law: law.name
)
def test_forces_do_not_hang_on_samples(law, H):
    """Random motions whose crest closes the contact by a share of 1e-6 to 1e-1 of its way: with the
    default samples, and with 4096, to rounding."""
    x, contacts, rng = random_case(law, P=60, H=H)
    waves = (x[:, -1] @ fourier.basis(np.linspace(0, 2 * np.pi, 100_001), H).T).T
    closes = 10 ** rng.uniform(-6, -1, 60) * np.ptp(waves, axis=0)
    contacts = replace(contacts, preload=contacts.kn * (closes - waves.max(axis=0)))
    few, many = (forces(law, contacts, x, samples=samples) for samples in (None, 4096))
    assert np.abs(many.g).max(axis=(1, 2)).min() > 0
    np.testing.assert_array_equal(few.active, many.active)
    np.testing.assert_allclose(few.g, many.g, atol=1e-13)
    np.testing.assert_allclose(few.D, many.D, atol=1e-10)
