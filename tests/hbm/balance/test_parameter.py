"""Branches over the level of the force and over settings of the pairs: all that holds for a band
holds for them."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm import test_extremes as extremes
from tests.hbm.cases import beam, load, solve, unilateral
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm.balance.contact_setting import ContactSetting
from tipdamp.hbm.balance.parameter import Damping, ForceParameter, Frequency, ModelParameter
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.comparison import compare
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.peaks import find_peaks
from tipdamp.hbm.curve.solutions import solutions_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import CubicSpring, DryFriction2T, UnilateralSpring
from tipdamp.hbm.problem import Problem
from tipdamp.hbm.response import follow_band, follow_parameter, solve_at

C1 = load("C1")
HZ = 1.15 / (2 * np.pi)
X = {"x": [1.0]}


PROBLEM, C1_FORCE = unilateral(C1["parameters"])


def c1(name, between, **more):
    return follow_parameter(PROBLEM, C1_FORCE, HZ, name, between, harmonics=1, outputs=X, **more)


@pytest.mark.parametrize(
    "name,between",
    [("level", (0.2, 3.0)), ("level", (3.0, 0.2)), ("preload", (0.1, 4.0)), ("kn", (0.3, 3.0))],
)
def test_folds_over_a_parameter(name, between):
    """At the factor 1 there are the three solutions that the verification table has at this
    frequency."""
    passed = []
    curve = c1(
        name,
        between,
        at=[1.0],
        contact=True,
        progress=lambda value, step, iterations: passed.append(value),
    )
    assert curve.complete and curve.parameter_name == name and (curve.frequency == HZ).all()
    axis = name if name == "level" else f"{name} factor"
    assert curve.over == axis == curve.plot().get_xlabel()
    assert f"{axis} {curve.parameter.min():g} to" in repr(curve)
    turns = np.count_nonzero(np.diff(np.sign(np.diff(curve.parameter))))
    known = next(r for r in C1["results"] if r["Omega"] == 1.15)["HB01_all_solutions"]
    found = np.sort(np.abs(solutions_at(curve, PROBLEM, 1.0)[:, 0, 1]))
    expected = np.sort([s["X1"] for s in known])
    if name == "preload":
        # the preload of this case is that of a gap: its branches do not all meet, but each is one
        # of the table
        assert all(np.abs(expected / amplitude - 1).min() < 1e-8 for amplitude in found) and len(
            found
        )
    else:
        assert turns >= 2 and np.allclose(found, expected, rtol=1e-8)
    assert curve.contact_force.shape == (len(curve.parameter), 1, 1, 2) and len(passed) > 10


@pytest.mark.parametrize("name,level,between", [("mu", 5, (1.0, 0.9)), ("level", 1, (5.0, 4.9))])
def test_branch_beyond_newton_from_stuck(name, level, between):
    """Five times the excitation at 160 Hz, H = 5: the other ways to a first point know the setting
    at its begin."""
    curve = follow_parameter(
        oscillator(), level * FORCE, 160, name, between, harmonics=5, outputs=Y2
    )
    band = follow_band(oscillator(), 5 * FORCE, (160, 180), harmonics=5, outputs=Y2)
    assert curve.complete
    alike = np.abs(solutions_at(band, oscillator(), 160)[:, 0, 1] / curve.harmonics[0, 0, 1] - 1)
    assert alike.min() < 1e-6


@pytest.mark.parametrize(
    "name,between",
    [("level", (0.3, 6.0)), ("mu", (1.5, 0.6)), ("kt", (3.0, 0.3)), ("kn", (3.0, 0.3))],
)
def test_parameter_branch_ends_at_the_scaled_model(name, between):
    """The last point against the first of a band of the model with that setting."""
    curve = follow_parameter(oscillator(), FORCE, 170, name, between, harmonics=3, outputs=Y2)
    assert curve.complete, curve.ended
    settings = {"mu": 0.5, "kn": 3e5, "kt": 3e5}
    other = oscillator(
        **(settings | ({name: between[1] * settings[name]} if name != "level" else {}))
    )
    level = between[1] if name == "level" else 1.0
    band = follow_band(other, level * FORCE, (170, 172), harmonics=3, outputs=Y2)
    assert (
        np.abs(solutions_at(band, other, 170)[:, 0, 1] / curve.harmonics[-1, 0, 1] - 1).min() < 1e-6
    )


def test_the_end_is_explained_in_the_parameter():
    curve = c1("level", (0.2, 3.0), settings=Settings(max_points=12))
    assert not curve.complete and "level = " in curve.ended and "Hz" not in curve.ended


def test_the_peak_over_a_parameter_is_solved():
    """C8 over the friction coefficient: the response is largest somewhere inside, and the top
    stands still there."""
    problem, force, outputs = beam("C8")
    curve = follow_parameter(
        problem, 40 * force, 932.1, "mu", (3.0, 0.05), harmonics=3, outputs=outputs
    )
    assert curve.complete
    for value, top in find_peaks(curve, problem, "tip"):
        beside = [
            follow_parameter(
                problem, 40 * force, 932.1, "mu", (v, 1.01 * v), harmonics=3, outputs=outputs
            ).amplitude()[0, 0]
            for v in (value * (1 - 1e-4), value * (1 + 1e-4))
        ]
        assert top >= max(beside) * (1 - 1e-9)


def scaled(problem, factor, name, contacts):
    """A problem with a setting of some contacts times a factor."""
    values = vars(problem.contacts)[name].copy()
    values[list(contacts)] *= factor
    return replace(problem, contacts=replace(problem.contacts, **{name: values}))


RATIO = replace(beam("C8")[0], C=None, damping_ratio=0.01)
LAWS_OWN = replace(unilateral(C1["parameters"])[0], law=CubicSpring(0.05))
KINDS = {  # parameter, problem, force, and the problem at a value
    "one contact": (
        ContactSetting("kt", (1,)),
        *beam("C8")[:2],
        lambda p, v: scaled(p, v, "kt", (1,)),
    ),
    "preload of some": (
        ContactSetting("preload", (2, 5)),
        *beam("C8")[:2],
        lambda p, v: scaled(p, v, "preload", (2, 5)),
    ),
    "gap of those open at rest": (
        ContactSetting("gap"),
        scaled(beam("C8")[0], -0.02, "preload", (2, 5)),
        beam("C8")[1],
        lambda p, v: scaled(p, v, "preload", (2, 5)),
    ),
    "pull": (
        ContactSetting("pull"),
        *beam("C8")[:2],
        lambda p, v: scaled(p, v, "preload", range(8)),
    ),
    "damping": (Damping(), *beam("C8")[:2], lambda problem, v: replace(problem, C=v * problem.C)),
    "damping ratio": (
        Damping(),
        RATIO,
        beam("C8")[1],
        lambda problem, v: replace(problem, damping_ratio=v * problem.damping_ratio),
    ),
    "stiffness": (
        ModelParameter("ground", lambda problem, v: replace(problem, K=v * problem.K)),
        *beam("C8")[:2],
        lambda problem, v: replace(problem, K=v * problem.K),
    ),
    "law": (
        ModelParameter("cubic", lambda problem, v: replace(problem, law=CubicSpring(0.05 * v))),
        LAWS_OWN,
        unilateral(C1["parameters"])[1],
        lambda problem, v: replace(problem, law=CubicSpring(0.05 * v)),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_any_parameter_against_solutions_at_its_values(kind):
    """Every point of the branch is the solution of the problem with that value, and so is one
    between them."""
    parameter, problem, force, at = KINDS[kind]
    hz, rows = (HZ, X) if kind == "law" else (932.1, {"tip": beam("C8")[2]["tip"]})
    level = 1.0 if kind == "law" else 40.0
    curve = follow_parameter(
        problem, level * force, hz, parameter, (1.0, 1.3), harmonics=3, outputs=rows
    )
    assert curve.complete and curve.parameter_name == parameter.name and len(curve.frequency) > 4
    beside = 0.5 * (curve.parameter[2] + curve.parameter[3])
    between = solutions_at(curve, problem, beside, parameter)
    for value, X_k in [
        *zip(curve.parameter[::3], curve.harmonics[::3], strict=True),
        (beside, between[0]),
    ]:
        alone = solve_at(at(problem, value), level * force, hz, harmonics=3, outputs=rows)
        assert alone.converged and np.abs(alone.harmonics - X_k).max() < 1e-7 * np.abs(X_k).max()
    assert (
        len(between) == 1
        and np.abs(np.diff(curve.amplitude()[[0, -1], 0])) > 1e-4 * curve.amplitude().max()
    )


def test_direction_of_the_force():
    """A force that turns from along the contact to across: every point is that of its own force,
    and so is the peak."""

    def at(angle):
        return {
            1: np.array([12 * np.cos(angle), 12 * np.sin(angle), 0, 0]),
            3: np.array([0, 0, 2j, 0]),
        }

    problem = extremes.problem(DryFriction2T(), 1.0)
    turning = ForceParameter("angle", at)
    given = dict(harmonics=3, outputs=extremes.X)
    curve = follow_parameter(problem, at(1.0), 72.0, turning, (0.3, 6.0), **given)
    assert (
        curve.complete
        and curve.share_slip.max() > 0.01
        and len(find_peaks(curve, problem, "x", parameter=turning))
    )
    for i in range(0, len(curve.parameter), 9):
        alone = solve_at(problem, at(curve.parameter[i]), 72.0, guess=curve.unknowns[i], **given)
        assert alone.converged and alone.harmonics == pytest.approx(
            curve.harmonics[i], rel=1e-8, abs=1e-14
        )
    assert compare(curve, problem, 2.0, parameter=turning).agrees
    for forcing in (0 * at(1.0)[1], at(1.0)[1]):
        with pytest.raises(
            InputError,
            match=r"parameter 'angle': its forcing has the orders \[1, 3\], the forcing of",
        ):
            follow_parameter(problem, forcing, 72.0, turning, (0.3, 6.0), **given)


def test_damping_by_a_matrix_that_couples_no_modes():
    """Points are held against the equation of motion with the damping that they have: all but the
    first were left out, as if out of balance."""
    problem, force, rows = beam("C8")
    proportional = replace(problem, C=1e-5 * problem.stuck_stiffness)
    given = dict(harmonics=1, outputs={"tip": rows["tip"]})
    curve = follow_parameter(proportional, 40 * force, 932.1, "damping", (1.0, 0.5), **given)
    assert curve.complete and curve.converged.all(), curve.ended
    half = replace(problem, C=0.5e-5 * problem.stuck_stiffness)
    alone = solve_at(half, 40 * force, 932.1, **given)
    assert curve.harmonics[-1] == pytest.approx(alone.harmonics, rel=1e-8, abs=1e-14)


@pytest.mark.parametrize("ends", [(100, 1e-6), (1e-3, 200)], ids=["to none", "beyond critical"])
def test_damping_through_critical_values(ends):
    """On the way poles meet, and at its end nothing damps."""
    problem = extremes.problem(DryFriction2T())
    curve = follow_parameter(
        problem, extremes.F, 72.0, "damping", ends, harmonics=3, outputs=extremes.X
    )
    assert curve.complete and len(curve.parameter) > 9
    for i in range(0, len(curve.parameter), 9):
        alone = solve_at(
            problem.with_damping(curve.parameter[i]),
            extremes.F,
            72.0,
            harmonics=3,
            outputs=extremes.X,
            guess=curve.unknowns[i],
        )
        assert alone.converged and alone.harmonics == pytest.approx(
            curve.harmonics[i], rel=1e-8, abs=1e-14
        )


def test_a_value_inside_that_has_no_solution_is_named():
    """At the ends of the branch all is well, between them a body has less than no mass."""
    light = ModelParameter(
        "mass", lambda problem, m: replace(problem, M=problem.M * abs(m - 0.5) - 0.1 * problem.M)
    )
    with pytest.raises(InputError, match=r"^mass = 0\.\S+: M has .* masses must not be negative"):
        follow_parameter(
            extremes.problem(DryFriction2T()),
            extremes.F,
            72.0,
            light,
            (0.2, 1.5),
            harmonics=3,
            outputs=extremes.X,
        )


def test_a_function_that_makes_no_problem():
    with pytest.raises(
        InputError, match=r"parameter 'K' at 0.5 = 0.5: must be a ContactProblem, made by replace"
    ):
        c1(ModelParameter("K", lambda problem, value: value), (0.5, 2.0))


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_by_a_parameter(kind):
    """Against differences of the residual, of fourth order and away from a value of 1."""
    parameter, problem, force, _ = KINDS[kind]
    balance = HarmonicBalance(problem, {1: 40 * force}, 3)
    w = 2 * np.pi * (HZ if kind == "law" else 932.1)
    x = 1.5 * balance.linear(w)
    residuals = [parameter.evaluate(balance, x, w, 1.1 + k * 1e-3).residual for k in (-2, -1, 1, 2)]
    slope = (residuals[0] - 8 * residuals[1] + 8 * residuals[2] - residuals[3]) / 12e-3
    found = parameter.evaluate(balance, x, w, 1.1)
    assert (
        np.abs(found.by_parameter - slope).max() < 1e-5 * np.abs(slope).max()
        and np.abs(slope).max() > 0
    )
    moved = found.displacement() + (found.balance.receptance.shapes @ found.modal_rate) * 1e-3
    again = parameter.evaluate(balance, x, w, 1.101).displacement()
    assert np.abs(moved - again).max() < 1e-2 * np.abs(again - found.displacement()).max()


def test_a_parameter_of_its_own_is_asked_for():
    """A file does not hold the function: without it the curve cannot be solved anywhere."""
    parameter, problem, force, _ = KINDS["stiffness"]
    curve = follow_parameter(
        problem, force, 932.1, parameter, (1.0, 1.01), harmonics=1, outputs={"x": force}
    )
    with pytest.raises(InputError, match="runs over ground: give the `parameter`"):
        solutions_at(curve, problem, 1.005)


@pytest.mark.parametrize(
    "parameter,message",
    [
        (Frequency(), "use follow_band"),
        (ContactSetting("kt", (1,)), "contacts = .*from 0 to 0"),
        (ContactSetting("kt", (-1,)), "contacts = .*from 0 to 0"),
        (ContactSetting("gap", 0), "parameter 'gap of contacts 0': no contact is open at rest"),
    ],
)
def test_a_parameter_that_does_not_fit(parameter, message):
    with pytest.raises(InputError, match=message):
        c1(parameter, (0.5, 2.0))


@pytest.mark.parametrize(
    "changes,message",
    [
        (dict(parameter="levels"), "parameter = 'levels': .*level"),
        (dict(parameter=["mu"]), r"parameter = '\['mu'\]'.*valid: level"),
        (dict(between=(1.0, 1.0)), "between = .*different"),
        (dict(between=(0.0, 1.0)), "between = .*positive"),
        (dict(between=3), "between = 3"),
        (dict(hz=-1.0), "hz = -1"),
        (dict(hz=(1, 2)), r"hz = \(1, 2\)"),
        (dict(at=[7.0]), r"at = 7: lies outside between = \(0.5, 2\)"),
    ],
)
def test_errors_name_their_argument(changes, message):
    problem, force = unilateral(C1["parameters"])
    given = dict(hz=HZ, parameter="level", between=(0.5, 2.0)) | changes
    with pytest.raises(InputError, match=message):
        follow_parameter(problem, force, harmonics=1, outputs=X, **given)


@pytest.mark.parametrize(
    "name,between",
    [
        ("level", (1.0, 40.0)),
        ("preload", (3.0, 1.0)),
        ("mu", (3.0, 1.0)),
        ("kn", (0.3, 1.0)),
        ("kt", (3.0, 1.0)),
    ],
)
def test_branches_end_at_the_frequency_curve(name, between):
    """C8 at 932.1 Hz, H = 3: the branch ends at the state of 40 N with the preload and mu of the
    model."""
    problem, force, outputs = beam("C8")
    expected = np.abs(outputs["tip"] @ solve(problem, 40 * force, 2 * np.pi * 932.1, 3)[0][:, 1])
    curve = follow_parameter(
        problem,
        force if name == "level" else 40 * force,
        932.1,
        name,
        between,
        harmonics=3,
        outputs=outputs,
    )
    assert curve.complete and curve.parameter[-1] == pytest.approx(between[1])
    assert abs(curve.harmonics[-1, 0, 1]) == pytest.approx(expected, rel=1e-6)
    assert (curve.frequency == 932.1).all() and curve.parameter_name == name


@pytest.mark.parametrize("name", ["kn", "kt"])
def test_stiffness_branch_ends_at_the_stiffer_model(name):
    """From 1 to 2: the end is the solution of the model whose springs are twice as stiff."""
    problem, force, outputs = beam("C8")
    curve = follow_parameter(
        problem, 40 * force, 932.1, name, (1.0, 2.0), harmonics=3, outputs=outputs
    )
    other = replace(
        problem, contacts=replace(problem.contacts, **{name: 2 * getattr(problem.contacts, name)})
    )
    expected = outputs["tip"] @ solve(other, 40 * force, 2 * np.pi * 932.1, 3)[0]
    assert (
        curve.complete
        and np.abs(curve.harmonics[-1, 0] - expected).max() < 1e-8 * np.abs(expected).max()
    )


def test_unknown_parameter():
    problem, force, outputs = beam("B8")
    with pytest.raises(InputError, match="level"):
        follow_parameter(problem, force, 900.0, "levels", (1, 2), outputs=outputs)


def stopped(kn=1.0):
    """Two masses, the second with a stop behind a gap of 0.3 m that the first level reaches."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    masses = Problem(np.eye(2), 0.05 * np.eye(2), K).force(0, 0.2)
    return masses.add(UnilateralSpring(), 1, kn=kn, preload=-0.3 * kn)


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_a_gap_stays_where_the_stiffness_varies(factor):
    """The preload of an open contact is -kn gap; the other way it would close by the factor."""
    given = dict(outputs={"x": [0, 1.0]}, harmonics=5)
    force, hz = np.array([0.2, 0.0]), 0.17
    branch = follow_parameter(stopped(), force, hz, "kn", (1.0, factor), **given)
    there = solve_at(stopped(factor), force, hz, guess=branch.unknowns[-1], **given)
    assert branch.complete and 0 < branch.share_open[-1, 0] < 1
    assert np.allclose(branch.unknowns[-1], there.unknowns, rtol=0, atol=1e-8)


def test_derivative_by_the_stiffness_of_a_stop():
    problem = stopped().contact_problem
    balance = HarmonicBalance(problem, {1: np.array([0.2, 0.0])}, 5)
    w = 2 * np.pi * 0.17
    found = solve_at(problem, np.array([0.2, 0.0]), 0.17, outputs={"x": [0, 1.0]}, harmonics=5)
    kn, h = ContactSetting("kn"), 1e-6
    rate = kn.evaluate(balance, found.unknowns, w, 1.0).by_parameter
    after, before = (kn.evaluate(balance, found.unknowns, w, 1 + s).residual for s in (h, -h))
    assert np.abs(rate).max() > 1e-3
    assert np.allclose(rate, (after - before) / (2 * h), rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["mu", "kt", "preload"])
def test_a_setting_without_a_value_is_refused(name):
    """Of a spring there is no friction to follow: all places would be the same."""
    duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0)
    with pytest.raises(InputError, match=f"parameter '{name}': is 0 at these contacts"):
        follow_parameter(duffing, np.array([0.1]), 0.2, name, (1.0, 2.0), outputs=X, harmonics=1)


def test_a_problem_is_taken_as_it_is():
    """And its ContactProblem gives the same."""
    given = dict(outputs={"x": [0, 1.0]}, harmonics=3)
    of_both = [
        follow_parameter(one, np.array([0.2, 0.0]), 0.17, "level", (0.5, 1.0), **given)
        for one in (stopped(), stopped().contact_problem)
    ]
    assert np.array_equal(of_both[0].unknowns, of_both[1].unknowns)
