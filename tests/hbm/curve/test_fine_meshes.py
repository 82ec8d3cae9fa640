"""Points whose residual is rounding of the stiffness of small elements are kept; it is said how far
that moves them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from tests.hbm.fine_beams import clamped, in_modes, rigid_motions, two_free
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.equilibrium import _limit, doubt, force_residuals, settle
from tipdamp.hbm.curve.starts import first_point
from tipdamp.hbm.laws import Contacts, CubicSpring, Jenkins1D
from tipdamp.hbm.response import follow_band

LAWS = {
    "friction": (Jenkins1D(), Contacts([0], [2e3], [1], [1])),
    "cubic": (CubicSpring(6e9), Contacts([0], [0], [0], [0])),
}


def at_the_tip(law, n=160, unit=1.0):
    """(problem of a clamped beam with a law at its tip, row of the tip)"""
    K, M, tip = clamped(n, unit)
    law, contacts = LAWS[law]
    return ContactProblem(M, None, K, tip[None], law, contacts, damping_ratio=0.005), tip


@pytest.mark.slow
@pytest.mark.parametrize("law, unit", [("friction", 1.0), ("friction", 1e-3), ("cubic", 1e3)])
def test_a_clamped_beam_of_many_elements(law, unit):
    """318 dofs: all points are kept, and the peak is that in modal coordinates, which have no such
    rounding."""
    problem, tip = at_the_tip(law, unit=unit)
    given = dict(harmonics=5, truncation=False)
    curve = follow_band(problem, 0.3 * tip, (15, 45), outputs={"tip": tip}, **given)
    even, shapes = in_modes(problem, tip)
    row = shapes.T @ tip
    other = follow_band(even, 0.3 * row, (15, 45), outputs={"tip": row}, **given)
    assert curve.complete and curve.converged.all() and "left out" not in curve.ended
    assert "the vibration is known to" in curve.ended and "the forces balance" not in other.ended
    np.testing.assert_allclose(curve.peak("tip"), other.peak("tip"), rtol=1e-6)


@pytest.mark.parametrize("n", [60, 160, 400])
def test_the_doubt_is_the_distance_to_the_solution(n):
    """Of a beam on a stuck contact, a linear system solved to the last digit by refinement in
    extended precision."""
    K, M, tip = clamped(n)
    w, kt, force = 2 * np.pi * 23.0, 2e3, 0.3
    contacts = Contacts([0], [kt], [1], [1e6])
    problem = ContactProblem(M, 0.2 * M, K, tip[None], Jenkins1D(), contacts)
    balance = HarmonicBalance(problem, {1: force * tip}, 1)
    point = first_point(balance, w, Settings())
    found = np.array([point.detail.outputs(row[None])[0, 1] for row in np.eye(len(K))])

    long, omega = np.longdouble, np.longdouble(w)
    heavy = M.astype(long)
    A = K.astype(long) + kt * np.outer(tip, tip) - omega**2 * heavy + 0.2j * omega * heavy
    solve = splu(csc_matrix(A.astype(complex))).solve
    exact = np.zeros(len(K), np.clongdouble)
    for _ in range(30):
        correction = solve((force * tip - A @ exact).astype(complex))
        exact += correction
    size = abs(exact[::2]).max()
    off = abs(found - exact)[::2].max()
    assert abs(correction).max() < 0.1 * off
    assert doubt(Equation(balance, Frequency()), point) == pytest.approx(off / size, rel=0.5)


def test_rounding_hides_no_wrong_point():
    """At a motion of the contact that is off by 1e-5 the forces are far more out of balance than
    rounding is."""
    problem, tip = at_the_tip("cubic")
    w = 2 * np.pi * 23.0
    balance = HarmonicBalance(problem, {1: 0.3 * tip}, 1)
    equation = Equation(balance, Frequency())
    point = first_point(balance, w, Settings())
    wrong = replace(point, x=(1 + 1e-5) * point.x, detail=balance.evaluate((1 + 1e-5) * point.x, w))
    residuals, _ = force_residuals(equation, [point, wrong])
    assert 5e-9 < residuals[0] < _limit(equation, point) < residuals[1]
    assert not settle(equation, [point], [w])[2][0]


@pytest.mark.slow
@pytest.mark.parametrize("n, unit", [(39, 1.0), (81, 1.0), (81, 1e3), (121, 1e-3)])
def test_two_free_beams_of_many_elements(n, unit):
    """Solved, whatever the unit of their slopes; the centre of mass moves as F/(m w^2)."""
    problem = two_free(n, unit)
    force = 10.0 * np.eye(4 * n)[2 * (n // 2)]
    centre = problem.M @ np.tile([1.0, 0.0], 2 * n)
    mass = centre @ np.tile([1.0, 0.0], 2 * n)
    curve = follow_band(
        problem,
        force,
        (50, 100),
        harmonics=3,
        outputs={"centre": centre / mass, "point": force / 10},
        truncation=False,
    )
    assert curve.complete and curve.converged.all()
    np.testing.assert_allclose(
        curve.harmonics[:, 0, 1], -10 / (mass * (2 * np.pi * curve.frequency) ** 2), rtol=1e-6
    )
    even, shapes = in_modes(problem, force, rigid_motions(n, unit))
    given = dict(harmonics=3, outputs={"point": shapes.T @ force / 10}, truncation=False)
    other = follow_band(even, shapes.T @ force, (50, 100), **given)
    np.testing.assert_allclose(curve.at_least("point"), other.at_least("point"), rtol=1e-6)


@pytest.mark.slow
def test_beams_of_very_many_elements_on_three_springs():
    """Rounding of terms 1e12 times the forces hides what is left of them: in extended precision it
    is seen, and the points are those of the same beams in their modes."""
    problem = two_free(200, middle=True)
    force = 20.0 * np.eye(800)[200]
    given = dict(harmonics=5, truncation=False)
    curve = follow_band(problem, force, (50, 200), outputs={"point": force / 20}, **given)
    assert curve.complete and curve.converged.all() and "left out" not in curve.ended
    even, shapes = in_modes(problem, force, rigid_motions(200))
    row = shapes.T @ force
    other = follow_band(even, row, (50, 200), outputs={"point": row / 20}, **given)
    np.testing.assert_allclose(curve.peak("point"), other.peak("point"), rtol=1e-5)
