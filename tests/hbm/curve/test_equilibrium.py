"""Every stored point solves the plain equation of motion, or says why not; contacts stiffer than
double precision."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.hbm.cases import beam, duffing, jenkins, load, solve, unilateral, with_damping_matrix
from tests.hbm.oscillator import FORCE, oscillator
from tests.hbm.small_rig import small_rig
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency, ModelParameter
from tipdamp.hbm.balance.problem import ContactProblem, contact_problem
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.equilibrium import force_residuals
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import Contacts, DryFriction2T, Jenkins1D
from tipdamp.hbm.response import follow_band, follow_parameter, solve_at
from tipdamp.hbm.testing import forces, total_force

LIMIT = 1e-8
F = np.array([10.0, 0, 0, 0])


def four_dofs(kt, c=1e-5, limit=10.0):
    """Two masses of 1 kg on springs of 4e5 N/m, a light one held softly and rubbing on the first,
    and one beside."""
    k = 4e5
    K = np.array([[2 * k, -k, 0, 0], [-k, 2 * k, 0, 0], [0, 0, 0.1 * k, 0], [0, 0, 0, 0.1 * k]])
    return ContactProblem(
        np.diag([1, 1, 0.2, 0.2]),
        c * K,
        K,
        np.array([[1.0, 0, -1, 0]]),
        Jenkins1D(),
        Contacts([0], [kt], [1], [limit]),
    )


def every_dof(problem):
    return {f"q{i}": row for i, row in enumerate(np.eye(len(problem.K)))}


def largest_residual(curve, problem, force):
    """Of the plain equation at every point, over the force or the contact's, of the vibration over
    what vibrates: from the harmonics of every dof alone."""
    worst, contacts, law = 0.0, problem.contacts, problem.law
    for w, q in zip(
        2 * np.pi * curve.frequency[curve.converged], curve.harmonics[curve.converged], strict=True
    ):
        u = np.ascontiguousarray(
            fourier.to_real(problem.B @ q).reshape(len(contacts), len(law.components), -1)
        )
        f = total_force(law, contacts, u, forces(law, contacts, u, w, curve.start, curve.samples))
        f[:, :, 0] -= problem.rest_force(contacts)
        contact = problem.B.T @ fourier.to_complex(f.reshape(-1, u.shape[2]))
        k = w * np.arange(q.shape[1])
        applied = np.zeros(q.shape, complex)
        applied[:, 1] = force
        if problem.static is not None:
            applied[:, 0] = problem.static
        r = problem.K @ q - k**2 * (problem.M @ q) + 1j * k * (problem.C @ q) + contact - applied
        unit = 1 / np.sqrt(np.abs(np.diag(problem.K)) + w**2 * np.diag(problem.M))[:, None]
        (mean, rest), *scales = (
            [np.linalg.norm(unit * a[:, part]) for part in (slice(1), slice(1, None))]
            for a in (r, applied, contact)
        )
        of_mean, of_rest = np.max(scales, axis=0)
        worst = max(worst, np.hypot(mean / np.hypot(of_mean, of_rest), rest / of_rest))
    return worst


def test_uneven_elements_are_rounding_and_no_residual():
    """Beam elements of very different length: K q is known to 4e-9 of the forces, whatever solves
    it."""
    from tests.benchmarks import contact_beam

    problem, force, outputs = contact_beam.plane(32)
    given = dict(harmonics=3, truncation=False)
    curve = follow_band(problem, 20 * force, (700, 1200), outputs=outputs, **given)
    even, push, rows = contact_beam.in_modes((problem, force, outputs))
    other = follow_band(even, 20 * push, (700, 1200), outputs=rows, **given)
    assert curve.complete and curve.converged.all() and other.complete
    np.testing.assert_allclose(curve.peak("tip"), other.peak("tip"), rtol=1e-7)


CASES = {
    "stiff 1e8": (four_dofs(1e8), F, (50, 160), 5),
    "stiff 1e10": (four_dofs(1e10), F, (50, 160), 5),
    "stiff 1e11": (four_dofs(1e11), F, (160, 50), 5),
    "I1": (duffing(0.03), np.array([0.2]), (0.08, 0.5), 5),
    "C1": (*unilateral(load("C1")["parameters"]), (0.1, 0.3), 7),
    "C8": (beam("C8")[0], 40 * beam("C8")[1], (700, 1200), 5),
    "oscillator": (oscillator(0.4, 2e6, 5e7), FORCE, (150, 300), 5),
}


@pytest.mark.parametrize("case", CASES)
def test_every_stored_point_is_in_equilibrium(case):
    problem, force, band, H = CASES[case]
    given = dict(harmonics=H, outputs=every_dof(problem), truncation=False)
    curve = follow_band(problem, force, band, **given)
    assert curve.complete
    assert largest_residual(curve, problem, force) <= LIMIT
    assert curve.force_residual.max() == pytest.approx(
        largest_residual(curve, problem, force), rel=0.3, abs=1e-11
    )


def under_static_load(static):
    """(Duffing oscillator, rad/s and amplitude per newton of its small vibrations) under a static
    load."""
    x = brentq(lambda x: x + x**3 - static, 0, static)
    w = np.sqrt(1 + 3 * x**2)
    return replace(duffing(0.03), static=np.array([static]), preloaded=False), w, 1 / (0.03 * w)


@pytest.mark.parametrize("static, force", [(1e4, 1e-4), (1e6, 1e-2)])
def test_a_static_load_does_not_hide_the_vibration(static, force):
    """Found to 1e-6; off by a hundredth it is not in equilibrium, 1.7e-6 of what the contact
    carries at resonance."""
    problem, w, amplitude = under_static_load(static)
    q, point, balance = solve(problem, np.array([force]), w, 3, start="zero_force")
    assert abs(q[0, 1]) == pytest.approx(force * amplitude, rel=1e-6)
    x = point.x * np.r_[1.0, np.full(6, 1.01)]
    wrong = replace(point, x=x, detail=balance.evaluate(x, w))
    residuals, _ = force_residuals(Equation(balance, Frequency()), [point, wrong])
    assert residuals[0] <= 1e-7 and residuals[1] > 1e-6


def test_a_single_solution_says_what_rounding_leaves():
    """1e-12 of the static load: 2e-4 of the vibration at most, by Newton steps that do not come
    nearer; 1e-8: 1e-8."""
    problem, w, amplitude = under_static_load(1e6)
    with pytest.warns(
        UserWarning, match="balance to .* of their scale only, by the rounding of static forces"
    ):
        found = solve_at(
            problem, np.array([1e-6]), w / (2 * np.pi), outputs={"x": [1.0]}, harmonics=3
        )
    assert found.converged and abs(found.harmonics[0, 1]) == pytest.approx(
        1e-6 * amplitude, rel=1e-3
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = solve_at(
            problem, np.array([1e-2]), w / (2 * np.pi), outputs={"x": [1.0]}, harmonics=3
        )
    assert abs(found.harmonics[0, 1]) == pytest.approx(1e-2 * amplitude, rel=1e-7)


def test_a_force_beyond_rounding_ends():
    """1e-15 of the static load: there is nothing to find. The search ends, or where it ends by the
    luck of rounding (which differs from machine to machine), what it took for points is left
    out."""
    problem, w, _ = under_static_load(1e6)
    curve = follow_band(
        problem,
        np.array([1e-9]),
        (0.8 * w / 6.28, w / 6.28),
        harmonics=3,
        outputs={"x": [1.0]},
        settings=Settings(max_first_calls=300),
    )
    assert not curve.converged.any()
    searched = "no solution found" in curve.ended and curve.residual_calls < 310
    assert (
        searched
        or f"{len(curve.converged)} points left out, as the forces do not balance" in curve.ended
    )


@pytest.mark.parametrize("kt", [1e13, 1e16, 1e20, 1e30])
def test_stiffness_beyond_double_precision_is_refused(kt):
    """1e16 N/m times the rounding of a motion, 2e-16 of it, is no longer small; the limit that is
    named is."""
    said = r"contact 0: a stiffness of \S+ N/m along t1 is more than double .* at most"
    with pytest.raises(InputError, match=said) as caught:
        follow_band(four_dofs(kt), F, (50, 160), outputs=every_dof(four_dofs(1.0)))
    with pytest.raises(InputError, match="at most"):
        solve_at(four_dofs(kt), F, 50.0, outputs=every_dof(four_dofs(1.0)))
    most = float(str(caught.value).split("at most ")[1].split()[0])
    curve = follow_band(four_dofs(most), F, (50, 160), outputs=every_dof(four_dofs(1.0)))
    assert curve.complete and largest_residual(curve, four_dofs(most), F) <= LIMIT


def test_a_stiff_contact_that_nothing_moves_is_not_refused():
    """Force and contact on separate bodies: the response is linear, however stiff the contact."""
    q4 = solve_at(four_dofs(1e16), F[::-1], 50.0, outputs=every_dof(four_dofs(1.0))).harmonics[3, 1]
    w = 100 * np.pi
    assert q4 == pytest.approx(10 / (4e4 - 0.2 * w**2 + 1j * w * 0.4), rel=1e-12)


def test_points_that_do_not_balance_are_left_out():
    """Hardly damped, the resonance moves thousands of times as far as the statics: too far for so
    stiff a contact."""
    problem = four_dofs(1e11, c=1e-6, limit=1e-3)
    curve = follow_band(problem, F, (99, 101.5), outputs=every_dof(problem))
    assert not curve.complete and not curve.converged.all()
    assert "left out, as the forces do not balance to 5e-09 of their scale" in curve.ended
    assert "more than double precision can carry" in curve.ended
    assert (
        np.isnan(curve.harmonics[~curve.converged]).all()
        and np.isnan(curve.unknowns[~curve.converged]).all()
    )
    assert largest_residual(curve, problem, F) <= LIMIT


@pytest.mark.parametrize("parameter", ["level", "kt", "mu", "damping", "spring"])
def test_residual_over_other_parameters(parameter):
    problem = oscillator(0.4, 2e6, 5e6)
    if parameter == "spring":
        parameter = ModelParameter("spring", lambda p, s: oscillator(0.4, 2e6, 5e6 * s))
    curve = follow_parameter(
        problem, FORCE, 180.0, parameter, (0.8, 1.2), outputs=every_dof(problem)
    )
    assert curve.complete and curve.force_residual.max() <= LIMIT


def test_damping_ratios_and_the_same_damping_as_a_matrix():
    """The residual knows the damping of either kind."""
    model, pairs, tip = small_rig(stations=3)
    ratios, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=[0.01, 0.02, 0.03])
    matrix = with_damping_matrix(ratios, dashpot=0.0)
    one, other = (solve_at(p, 150 * tip, 1250.0, outputs={"tip": tip}) for p in (ratios, matrix))
    assert one.share_slip.max() > 0.1
    assert max(one.force_residual, other.force_residual) <= LIMIT
    assert one.harmonics == pytest.approx(other.harmonics, rel=1e-8)


@pytest.mark.parametrize("H", [5, 9])
def test_rounding_of_the_motion_of_a_stiff_contact(H):
    """At its resonance a contact of kt/k = 1e6 is let through: points whose residual of 5.4e-9 is
    rounding are kept."""
    problem, force = jenkins(dict(m=1.0, k=1.0, c=0.005, kt=1e6, slip_limit_muN=1.0, F=1.4))
    curve = follow_band(problem, force, (0.157, 0.161), harmonics=H, outputs={"x": [1.0]})
    assert curve.complete and curve.force_residual.max() < LIMIT
