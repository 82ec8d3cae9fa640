"""Points whose residual is rounding of the stiffness of small elements are kept; it is said how far
that moves them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.fine_beams import clamped, in_modes, two_free
from tipdamp.hbm.balance.parameter import Equation, Frequency
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
    curve = follow_band(problem, 0.3 * tip, (15, 45), harmonics=5, outputs={"tip": tip})
    even, shapes = in_modes(problem, tip)
    other = follow_band(
        even, 0.3 * shapes.T @ tip, (15, 45), harmonics=5, outputs={"tip": shapes.T @ tip}
    )
    assert curve.complete and curve.converged.all() and "left out" not in curve.ended
    assert "the vibration is known to" in curve.ended and "the forces balance" not in other.ended
    np.testing.assert_allclose(curve.peak("tip"), other.peak("tip"), rtol=1e-6)


def test_the_doubt_is_what_rounding_of_the_matrix_makes():
    """Entries of K that are off by a rounding, element by element, move the resonance by as much as
    is said."""
    problem, tip = at_the_tip("friction", 60)
    w, rng = 2 * np.pi * 23.0, np.random.default_rng(1)

    def solved(problem):
        balance = HarmonicBalance(problem, {1: 0.3 * tip}, 1)
        point = first_point(balance, w, Settings())
        return point, balance, point.detail.outputs(tip[None])[0, 1]

    point, balance, here = solved(problem)
    said = doubt(Equation(balance, Frequency()), point)
    moved = []
    for _ in range(5):
        off = 1 + np.finfo(float).eps * rng.uniform(-1, 1, problem.K.shape)
        K = problem.K * np.triu(off) + np.triu(problem.K * off, 1).T
        moved.append(
            abs(
                solved(
                    ContactProblem(
                        problem.M,
                        None,
                        K,
                        problem.B,
                        problem.law,
                        problem.contacts,
                        damping_ratio=0.005,
                    )
                )[2]
                / here
                - 1
            )
        )
    assert max(moved) < said < 1e3 * max(moved)


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
    )
    assert curve.complete and curve.converged.all()
    np.testing.assert_allclose(
        curve.harmonics[:, 0, 1], -10 / (mass * (2 * np.pi * curve.frequency) ** 2), rtol=1e-6
    )
    even, shapes = in_modes(problem, force, rigid=4)
    other = follow_band(
        even, shapes.T @ force, (50, 100), harmonics=3, outputs={"point": shapes.T @ force / 10}
    )
    np.testing.assert_allclose(curve.at_least("point"), other.at_least("point"), rtol=1e-6)
