"""Preloads, bands and forces far from the ordinary: the right answer, or a message where there is none."""

import numpy as np
import pytest

from hbm.laws import Contacts, DryFriction1T, DryFriction2T, IsotropicFriction, Jenkins1D, UnilateralSpring
from hbm.problem import ContactProblem
from hbm.response import follow_band, follow_parameter

X = {"x": np.array([1.0, 0, 0, 0])}
F = np.array([10.0, 0, 0, 0])
ROWS = {"t1": [1.0, 0, -1, 0], "t2": [0, 1.0, 0, -1], "n": [1.0, 0, 1, 1]}


def problem(law, preload=10.0, kt=1e6, kn=1e5):
    """Four dofs of 1, 1, 0.2 and 0.2 kg, resonances around 31, 71, 100 and 174 Hz without contact."""
    k = 4e5
    K = np.array([[2 * k, -k, 0, 0], [-k, 2 * k, 0, 0], [0, 0, 0.1 * k, 0], [0, 0, 0, 0.1 * k]])
    B = np.array([ROWS[c] for c in law.components])
    return ContactProblem(np.diag([1, 1, 0.2, 0.2]), 1e-5 * K, K, B, law, Contacts([kn], [kt], [1], [preload]))


def free(force, hz, dof=0):
    """(n,) response of a dof without contact."""
    p = problem(Jenkins1D())
    w = 2 * np.pi * np.atleast_1d(hz)
    return np.array([np.linalg.solve(p.K - v**2 * p.M + 1j * v * p.C, force)[dof] for v in w])


LAWS = [Jenkins1D(), DryFriction1T(), DryFriction2T(), IsotropicFriction(), UnilateralSpring()]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
@pytest.mark.parametrize("preload", [-1e4, -1e12, -1e300])
def test_a_contact_that_never_closes(law, preload):
    """However wide it is open: the response without it."""
    curve = follow_band(problem(law, preload), F, (60, 130), harmonics=3, outputs=X)
    assert curve.complete and curve.share_open.min() == 1
    assert curve.harmonics[:, 0, 1] == pytest.approx(free(F, curve.frequency), rel=2e-8)
    assert np.abs(curve.harmonics[:, 0, [0, 2, 3]]).max() < 1e-12 * curve.peak("x")[1]


@pytest.mark.parametrize("law", LAWS[:4], ids=lambda law: law.name)
def test_a_contact_that_never_moves(law):
    """However large its preload: the stuck response."""
    stuck = [follow_band(problem(law, preload), F, (60, 130), harmonics=3, outputs=X) for preload in (1e7, 1e300)]
    assert all(curve.complete and curve.share_stick.min() == 1 for curve in stuck)
    assert stuck[0].peak("x") == pytest.approx(stuck[1].peak("x"), rel=1e-12)


def test_contact_force_over_the_preload():
    """The force is that of the settings at each point: its mean normal part follows the preload."""
    curve = follow_parameter(problem(DryFriction1T(), 50.0), F, 80.0, "preload", (0.5, 4.0), harmonics=3, outputs=X,
                             contact=True)
    assert curve.complete
    stays_closed = curve.share_open[:, 0] == 0
    assert stays_closed.any()
    mean = curve.contact_force[stays_closed, 0, 1, 0].real - 1e5 * curve.contact_motion[stays_closed, 0, 1, 0].real
    assert mean == pytest.approx(50.0 * curve.parameter[stays_closed], rel=1e-9)
