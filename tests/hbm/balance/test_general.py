"""Matrices that are not symmetric, and structural damping, beside direct solutions and closed
forms."""

import numpy as np
import pytest

from tipdamp import (
    CubicSpring,
    Damping,
    InputError,
    Jenkins1D,
    Problem,
    UnilateralSpring,
    backbone,
    compare,
    follow_parameter,
)
from tipdamp.hbm.balance.receptance import general_receptance

TURN = np.array([[0.0, 1], [-1, 0]])


def random_matrices(r, seed=0):
    rng = np.random.default_rng(seed)
    A, B, C = rng.normal(size=(3, r, r))
    M, K = A @ A.T / r + np.eye(r), 50 * (B @ B.T / r + np.eye(r))
    return M, 0.1 * (C @ C.T / r) + 2 * (C - C.T), K + 3 * (A - A.T)


def direct(M, C, K, w, D=0.0):
    return np.linalg.inv(K + 1j * w * C - w**2 * M + 1j * np.sign(w) * D)


@pytest.mark.parametrize("structural", [False, True])
def test_receptance_is_the_inverse_of_the_dynamic_stiffness(structural):
    """And its derivative by the frequency, that of an inverse."""
    M, C, K = random_matrices(7)
    D = 0.03 * (K + K.T) / 2 if structural else None
    found = general_receptance(M, C, K, D)
    for w in (0.0, 0.7, 9.0, 300.0):
        q, rate = ((found.shapes * d[:, 0]) @ found.into.T for d in found.factors(w))
        expected = direct(M, C, K, w, D if structural else 0.0)
        assert q == pytest.approx(expected, rel=0, abs=1e-11 * np.abs(expected).max())
        if w:  # where structural damping sets in
            expected = -expected @ (1j * C - 2 * w * M) @ expected
            assert rate == pytest.approx(expected, rel=0, abs=1e-11 * np.abs(expected).max())


def test_gyroscopic_response_is_the_direct_solution_while_contacts_stick():
    """A rotor of one disk: forward and backward whirl are apart by the gyroscopic matrix."""
    K, C = 1e6 * np.eye(2), 5.0 * np.eye(2) + 300.0 * TURN
    rotor = Problem(np.eye(2), C, K, general=True).force(0, 3.0).force(1, -3.0j)
    stuck = rotor.add(Jenkins1D(), 0, kt=4e5, mu=1.0, preload=1e9)
    curve = stuck.follow_band((100, 250), outputs={"x": 0, "y": 1}, harmonics=1)
    assert curve.complete and len(curve.frequency) > 3
    for hz, X in zip(curve.frequency, curve.harmonics[:, :, 1], strict=True):
        G = direct(np.eye(2), C, K + np.diag([4e5, 0]), 2 * np.pi * hz)
        assert X == pytest.approx(G @ [3.0, -3.0j], rel=1e-9)


def test_circulatory_forces_do_work_and_the_energy_balance_knows():
    """A cubic spring on a rotor with internal damping (circulatory stiffness): input is what
    damping and circulation take."""
    K, C = np.eye(2) + 0.02 * TURN, 0.1 * np.eye(2) + 0.3 * TURN
    rotor = Problem(np.eye(2), C, K, general=True).force(0, 0.2).add(CubicSpring(0.5), 1)
    curve = rotor.follow_band((0.1, 0.25), outputs={"x": 0}, harmonics=5, stability="peaks")
    assert curve.complete
    assert np.nanmax(curve.energy_error) < 1e-8
    assert np.nanmax(curve.force_residual) < 1e-8


def two_disks():
    """Two disks on a shaft, lateral motions x1, x2, y1, y2, with gyroscopic moments."""
    shaft = np.array([[3.0, -1], [-1, 2.5]])
    K = np.kron(np.eye(2), shaft) * 1e5
    M = np.diag([1.0, 0.8, 1.0, 0.8])
    G = np.kron(TURN, np.diag([60.0, 90.0]))
    return M, 2e-4 * K + G, K


def rubbing_rotor():
    """(curve, problem) of two disks of which the second rubs against a stop."""
    M, C, K = two_disks()
    rotor = Problem(M, C, K, general=True).force(1, 100.0).force(3, -100.0j)
    rub = rotor.add(UnilateralSpring(), 1, kn=5e4, preload=-10.0)
    given = dict(outputs={"x": 1, "y": 3}, harmonics=25, stability="peaks")
    return rub.follow_band((40, 110), **given), rub.contact_problem


@pytest.mark.slow
def test_rub_of_a_rotor_beside_time_integration():
    """The curve and integration from its orbit, on both sides of the peak and far from it."""
    curve, problem = rubbing_rotor()
    assert curve.complete and curve.share_open.min() < 0.99
    hz, _ = curve.peak("x")
    for away in (-2.0, 2.0, 10.0):
        found = compare(curve, problem, hz + away, which=0)
        assert found.agrees and found.stable
        assert found.difference < 1e-4
    multipliers = curve.multipliers[np.isfinite(curve.multipliers[:, 0])]
    assert np.abs(multipliers).max() < 1


def test_structural_damping_beside_its_closed_form():
    """One dof with K (1 + i eta) and a stuck contact: X = F / (k (1 + i eta) + kt - m w^2)."""
    problem = Problem([[0.05]], K=[[1e6]], structural=0.02).force(0, 5.0)
    stuck = problem.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=1e6)
    curve = stuck.follow_band((600, 1000), outputs={"x": 0}, harmonics=3)
    w = 2 * np.pi * curve.frequency
    closed = 5.0 / (1e6 * (1 + 0.02j) + 5e5 - 0.05 * w**2)
    assert curve.harmonics[:, 0, 1] == pytest.approx(closed, rel=1e-9)


def test_structural_damping_takes_the_same_share_at_every_order():
    """Duffing with a loss factor: at order k the equation of motion has i eta K, at rest none."""
    problem = Problem([[1.0]], K=[[1.0]], structural=0.05).force(0, 0.1).force(0, 0.05, harmonic=2)
    duffing = problem.add(CubicSpring(0.3), 0)
    found = duffing.solve_at(0.11, outputs={"x": 0}, harmonics=7)
    k, w = np.arange(8), 2 * np.pi * 0.11
    F = np.zeros(8)
    F[1], F[2] = 0.1, 0.05
    stiff = 1 + 0.05j * (k > 0) - (k * w) ** 2
    left = stiff * found.harmonics[0] + found.contact_force[0, 0] - F
    assert np.abs(left).max() < 1e-9 * 0.1
    curve = duffing.follow_band((0.1, 0.3), outputs={"x": 0}, harmonics=7, stability="all")
    assert np.isnan(curve.multipliers).all() and np.nanmax(curve.energy_error) < 1e-8
    assert np.isfinite(curve.truncation).all()
    with pytest.raises(InputError, match="no motion in time"):
        compare(curve, duffing.contact_problem, 0.11)


def test_a_factor_on_the_damping_leaves_gyroscopic_forces():
    K, C = np.eye(2), 0.1 * np.eye(2) + 0.3 * TURN
    rotor = Problem(np.eye(2), C, K, general=True).force(0, 0.02).add(CubicSpring(1e-12), 1)
    given = {"outputs": {"x": [1.0, 0.0]}, "harmonics": 1, "truncation": False}
    problem = rotor.contact_problem
    curve = follow_parameter(problem, [0.02, 0.0], 0.14, Damping(), (1.0, 0.3), **given)
    G = direct(np.eye(2), 0.03 * np.eye(2) + 0.3 * TURN, K, 2 * np.pi * 0.14)
    assert curve.harmonics[-1, 0, 1] == pytest.approx(0.02 * G[0, 0], rel=1e-8)


@pytest.mark.parametrize(
    "given", [{"general": True, "C": [[0.1]]}, {"structural": 0.1}, {"varies": True}]
)
def test_a_backbone_refuses_what_has_no_real_modes(given):
    varies = given.pop("varies", False)
    problem = Problem([[1.0]], K=[[1.0]], **(given or {"C": [[0.1]]})).add(CubicSpring(1.0), 0)
    if varies:
        problem = problem.of_speed(K=lambda speed: [[1 + speed**2]])
    with pytest.raises(InputError, match="backbone: needs symmetric matrices"):
        backbone(problem.contact_problem, 1, (0.1, 1.0), outputs={"x": [1.0]})


BAD = {
    "K is not symmetric.*general = True": {"K": [[1.0, 0.1], [0, 1]]},
    "C is not symmetric.*general = True": {"C": [[0.1, 0.1], [0, 0.1]]},
    "M is not symmetric": {"M": [[1.0, 0.1], [0, 1]], "general": True},
    "damping_ratio beside general": {"C": None, "damping_ratio": 0.01, "general": True},
    "damping_ratio beside structural": {"C": None, "damping_ratio": 0.01, "structural": 0.1},
    "C is missing": {"C": None, "general": True},
    "must not be negative": {"structural": -0.1},
    "loss factor": {"structural": [0.1, 0.2]},
    r"K\[0, 0\] is nan": {"K": [[np.nan, 0], [0, 1.0]], "general": True},
    "without mass": {"M": [[1.0, 0], [0, 0]], "general": True},
    "unrestrained": {"K": [[0.0, 1.0], [-1.0, 0.0]], "general": True},
}


@pytest.mark.parametrize("said", BAD)
def test_bad_matrices_are_told_in_a_line(said):
    given = {"M": np.eye(2), "C": 0.1 * np.eye(2), "K": np.eye(2)} | BAD[said]
    problem = Problem(**given).force(0, 1.0).add(CubicSpring(1.0), 0)
    with pytest.raises(InputError, match=said) as told:
        problem.solve_at(0.1, outputs={"x": 0})
    assert "\n" not in str(told.value)
