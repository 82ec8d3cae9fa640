"""Preloads, bands and forces far from the ordinary: the right answer, or a message where there is
none."""

from dataclasses import replace

import numpy as np
import pytest

from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import (
    Contacts,
    DryFriction1T,
    DryFriction2T,
    IsotropicFriction,
    Jenkins1D,
    UnilateralSpring,
)
from tipdamp.hbm.response import follow_band, follow_parameter, solve_at

X = {"x": np.array([1.0, 0, 0, 0])}
F = np.array([10.0, 0, 0, 0])
ROWS = {"t1": [1.0, 0, -1, 0], "t2": [0, 1.0, 0, -1], "n": [1.0, 0, 1, 1]}


def problem(law, preload=10.0, kt=1e6, kn=1e5):
    """Four dofs of 1, 1, 0.2 and 0.2 kg, resonances around 31, 71, 100 and 174 Hz without
    contact."""
    k = 4e5
    K = np.array([[2 * k, -k, 0, 0], [-k, 2 * k, 0, 0], [0, 0, 0.1 * k, 0], [0, 0, 0, 0.1 * k]])
    B = np.array([ROWS[c] for c in law.components])
    return ContactProblem(
        np.diag([1, 1, 0.2, 0.2]), 1e-5 * K, K, B, law, Contacts([kn], [kt], [1], [preload])
    )


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
    stuck = [
        follow_band(problem(law, preload), F, (60, 130), harmonics=3, outputs=X)
        for preload in (1e7, 1e300)
    ]
    assert all(curve.complete and curve.share_stick.min() == 1 for curve in stuck)
    assert stuck[0].peak("x") == pytest.approx(stuck[1].peak("x"), rel=1e-12)


def test_contact_force_over_the_preload():
    """The force is that of the settings at each point: its mean normal part follows the preload."""
    curve = follow_parameter(
        problem(DryFriction1T(), 50.0),
        F,
        80.0,
        "preload",
        (0.5, 4.0),
        harmonics=3,
        outputs=X,
        contact=True,
    )
    assert curve.complete
    stays_closed = curve.share_open[:, 0] == 0
    assert stays_closed.any()
    mean = (
        curve.contact_force[stays_closed, 0, 1, 0].real
        - 1e5 * curve.contact_motion[stays_closed, 0, 1, 0].real
    )
    assert mean == pytest.approx(50.0 * curve.parameter[stays_closed], rel=1e-9)


@pytest.mark.parametrize(
    "band", [(50, 1e4), (50, 1e8), (1e8, 50), (0.01, 160), (160, 0.01), (1e-4, 1e6)], ids=str
)
def test_bands_far_wider_than_the_resonances(band):
    """The peak is that of an ordinary band, and no motion is said to drift."""
    usual = follow_band(problem(Jenkins1D()), F, (50, 160), harmonics=3, outputs=X)
    curve = follow_band(problem(Jenkins1D()), F, band, harmonics=3, outputs=X)
    assert curve.complete and curve.reached_end and 0.1 < np.nanmax(curve.share_slip) < 1
    assert curve.peak("x")[1] == pytest.approx(usual.peak("x")[1], rel=1e-9)
    assert curve.frequency[[0, -1]] == pytest.approx(band)


@pytest.mark.parametrize("size", [1e-119, 1e-100, 1e-20, 1e-3])
def test_tiny_forces(size):
    """The contact sticks: the linear response, in proportion."""
    one, tiny = (
        follow_band(problem(Jenkins1D(), 1e3), f * F, (60, 130), harmonics=3, outputs=X)
        for f in (1.0, size)
    )
    assert tiny.complete and tiny.share_stick.min() == 1 == one.share_stick.min()
    assert np.array(tiny.peak("x")) == pytest.approx(
        np.array(one.peak("x")) * [1, size], rel=1e-6, abs=0
    )


@pytest.mark.parametrize("size", [1e-300, 1e-130, 1e150, 1e300])
def test_forces_that_no_arithmetic_carries(size):
    with pytest.raises(
        InputError, match=r"largest entry is \S+ N, must be between 1e-120 and 1e\+100 N"
    ):
        follow_band(problem(Jenkins1D()), size * F, (60, 130), outputs=X)


def test_huge_forces():
    """The contact slides: the response without it, but for its limit."""
    curve = follow_band(problem(Jenkins1D()), 1e99 * F, (60, 130), harmonics=3, outputs=X)
    assert curve.complete
    assert curve.harmonics[:, 0, 1] / 1e99 == pytest.approx(free(F, curve.frequency), rel=2e-8)


@pytest.mark.parametrize("band", [(20, 160), (160, 20), (20, 1e6)], ids=str)
@pytest.mark.parametrize("law", [Jenkins1D(), IsotropicFriction()], ids=lambda law: law.name)
def test_a_force_that_does_not_reach_the_contact(law, band):
    """The body beside: its own resonance, solved to the last digit, while nothing moves at the
    contact."""
    p, rows = problem(law), {"x": X["x"], "beside": np.eye(5)[4]}
    M, C, K = (np.pad(A, (0, 1)) for A in (p.M, p.C, p.K))
    M[4, 4], C[4, 4], K[4, 4] = 0.5, 0.4, 2e5
    beside = ContactProblem(M, C, K, np.pad(p.B, ((0, 0), (0, 1))), law, p.contacts)
    rows["x"] = np.pad(rows["x"], (0, 1))
    curve = follow_band(beside, 3.0 * np.eye(5)[4], band, harmonics=3, outputs=rows, at=[90.0])
    w = 2 * np.pi * curve.frequency
    assert curve.complete and curve.frequency[[0, -1]] == pytest.approx(band)
    assert curve.harmonics[:, 1, 1] == pytest.approx(3.0 / (2e5 - 0.5 * w**2 + 0.4j * w), rel=1e-9)
    assert np.abs(curve.harmonics[:, 0]).max() < 1e-15 * curve.peak("beside")[1]
    top = np.sqrt(2e5 / 0.5 - 0.5 * 0.8**2)  # of |X|: w^2 = w0^2 (1 - 2 zeta^2)
    assert curve.peak("beside")[1] == pytest.approx(3.0 / (0.4 * np.sqrt(4e5 - 0.4**2)), rel=1e-9)
    assert (
        2 * np.pi * curve.peak("beside")[0] == pytest.approx(top, rel=1e-4)
        and curve.peak_points[:, 1].any()
    )
    assert len(find_peaks(curve, beside, "beside")) == 1 and 90.0 in curve.frequency
    assert solutions_at(curve, beside, 91.0)[0, 1, 1] == pytest.approx(
        3.0 / (2e5 - 0.5 * (182 * np.pi) ** 2 + 0.4j * 182 * np.pi), rel=1e-9
    )
    assert solve_at(beside, 3.0 * np.eye(5)[4], 91.0, outputs=rows).converged


def test_no_force_at_all():
    """The static state at both ends of the band, and where it was asked for."""
    curve = follow_band(problem(Jenkins1D()), 0 * F, (60, 130), outputs=X, at=[70.0, 100.0])
    assert curve.complete and curve.frequency == pytest.approx([60, 70, 100, 130])
    assert not curve.harmonics.any() and "static state" in curve.ended
    over = follow_parameter(
        problem(Jenkins1D()), 0 * F, 80.0, "level", (1.0, 3.0), outputs=X, at=[2.0]
    )
    assert over.complete and over.parameter == pytest.approx([1, 2, 3])


@pytest.mark.parametrize("band", [(90, 90 * (1 + 1e-15)), (1e-300, 100), (100, 1e300)], ids=str)
def test_bands_that_no_arithmetic_carries(band):
    with pytest.raises(
        InputError,
        match=r"band = .* Hz: both must lie between 1e-120 and 1e\+100 and differ by 1e-12",
    ):
        follow_band(problem(Jenkins1D()), F, band, outputs=X)
    with pytest.raises(InputError, match=r"between = .*: both must lie between 1e-120 and 1e\+100"):
        follow_parameter(problem(Jenkins1D()), F, 80.0, "preload", band, outputs=X)


def test_narrow_band():
    """Both ends, and what a solution at one frequency gives there."""
    curve = follow_band(problem(Jenkins1D()), F, (90, 90 * (1 + 1e-11)), harmonics=3, outputs=X)
    alone = solve_at(problem(Jenkins1D()), F, 90, harmonics=3, outputs=X)
    assert curve.complete and curve.harmonics[-1] == pytest.approx(
        alone.harmonics, rel=1e-7, abs=1e-15
    )


@pytest.mark.parametrize(
    "name,value", [("kn", 1e300), ("kt", 5e-324), ("kt", 1e300), ("mu", 1e300)]
)
def test_settings_that_no_arithmetic_carries(name, value):
    settings = {"kn": [1e5], "kt": [1e6], "mu": [1.0], "preload": [10.0]} | {name: [value]}
    with pytest.raises(
        InputError, match=rf"contact 0: {name} = \S+, must be zero, or between 1e-120 and 1e\+100"
    ):
        Contacts(**settings)


def test_tangents_far_stiffer_than_the_bodies():
    """Both tangents vibrate at all but one high frequency, whose modes rounding mixes: the rigid
    limit all the same."""
    softer, stiff = (
        follow_band(problem(DryFriction2T(), kt=kt), F, (50, 160), harmonics=3, outputs=X)
        for kt in (1e8, 1e9)
    )
    assert stiff.complete and stiff.converged.all() and 0.1 < stiff.share_slip.max() < 1
    assert stiff.peak("x") == pytest.approx(softer.peak("x"), rel=2e-2)


def test_huge_friction():
    """A contact that lifts off but never slips: what is found is right, what is not is said."""
    p = problem(DryFriction2T())
    p = replace(p, contacts=Contacts(p.contacts.kn, p.contacts.kt, [1e90], p.contacts.preload))
    curve = follow_band(p, F, (60, 130), harmonics=3, outputs=X)
    assert np.nanmax(curve.share_slip) < 1e-3 and np.nanmax(curve.force_residual) < 1e-8
    assert curve.complete or "stopped at" in curve.ended
