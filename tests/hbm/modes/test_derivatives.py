"""Derivatives of peaks, points and stuck frequencies beside differences of those solved anew."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.hbm.small_rig import small_rig
from tipdamp import (
    DryFriction1T,
    DryFriction2T,
    InputError,
    Jenkins1D,
    ModelParameter,
    Problem,
    Unbalance,
    contact_problem,
    follow_band,
    follow_parameter,
    natural_frequencies,
    peak_derivatives,
    point_derivatives,
    solutions_at,
    stuck_frequency_derivatives,
)
from tipdamp.hbm import fourier
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.example import two_blades
from tipdamp.hbm.modes.derivatives import by_factor, by_setting

K = [[2.0, -1, 0], [-1, 2, -1], [0, -1, 1.3]]
BAND = (0.06, 0.14)
VARIED = [("mu", 0), ("kt", 0), ("kt", 1), ("kn", 1), ("preload", 0), ("damping", 0), ("level", 0)]


def by_ratio(damping, level):
    ratios = damping * np.array([0.02, 0.01, 0.015])
    return Problem(np.eye(3), K=K, damping_ratio=ratios).force(0, 0.1 * level)


def by_matrix(damping, level):
    return Problem(np.eye(3), 0.012 * damping * np.eye(3), K).force(0, 0.1 * level)


def turning(damping, level):
    """Gyroscopic forces, unbalance and structural damping at once."""
    G = 0.05 * np.array([[0, 1.0, 0], [-1, 0, 0.5], [0, -0.5, 0]])
    C = 0.006 * damping * np.eye(3) + G
    problem = Problem(np.eye(3), C, K, general=True, structural=0.006 * damping)
    return problem.force(0, Unbalance(0.15 * level))


def chain(kind=by_ratio, varied=(), factor=1.0):
    def of(setting, c, value):
        return value * (factor if varied == (setting, c) else 1.0)

    problem = kind(of("damping", 0, 1.0), of("level", 0, 1.0))
    problem = problem.add(
        Jenkins1D(),
        2,
        kt=of("kt", 0, 0.5),
        mu=of("mu", 0, 1.0),
        preload=of("preload", 0, 0.1),
    )
    return problem.add(
        DryFriction1T(),
        [1, 0],
        kt=of("kt", 1, 0.3),
        kn=of("kn", 1, 0.4),
        mu=of("mu", 1, 0.5),
        preload=of("preload", 1, 0.2),
    )


def peak(problem, kind="half_peak_to_peak"):
    curve = problem.follow_band(BAND, outputs={"tip": 2}, harmonics=5, truncation=False)
    found = peak_derivatives(curve, problem, "tip", kind)
    if kind == "half_peak_to_peak":
        hz, height = curve.peak("tip")
        assert found.amplitude == pytest.approx(height, rel=1e-9)
        assert found.frequency == pytest.approx(hz, rel=1e-5)  # flat there
    return found


@cache
def peak_of(kind):
    """Of the chain as it is."""
    return peak(chain(kind))


def difference(value_at, h=2e-3):
    """Derivative by a factor at 1, by differences of fourth order."""
    values = np.array([value_at(1 + s * h) for s in (-2, -1, 1, 2)])
    return np.array([1.0, -8.0, 8.0, -1.0]) @ values / (12 * h)


@pytest.mark.slow
@pytest.mark.parametrize("varied", VARIED)
@pytest.mark.parametrize("kind", [by_ratio, by_matrix, turning])
def test_a_peak_follows_a_setting_as_differences_say(kind, varied):
    setting, c = varied
    found = peak_of(kind)

    def value_at(factor):
        one = peak(chain(kind, varied, factor))
        return one.frequency, one.amplitude

    hz, height = difference(value_at)
    assert found.amplitude_by[setting][c] == pytest.approx(
        height, rel=1e-6, abs=1e-7 * found.amplitude
    )
    assert found.frequency_by[setting][c] == pytest.approx(hz, rel=1e-6, abs=1e-7 * found.frequency)


def heavier(problem, factor):
    """With a factor on the mass of the middle, which the other masses are coupled to."""
    more = np.array([[0.2, 0.1, 0], [0.1, 1.0, 0], [0, 0, 0]])
    return replace(problem, M=problem.M + (factor - 1) * more)


def stiffer(problem, factor):
    """With a spring at the tip that grows with the square of the factor."""
    return replace(problem, K=problem.K + 0.3 * (factor**2 - 1) * np.diag([0, 0, 1.0]))


OWN = [ModelParameter("mass", heavier), ModelParameter("spring", stiffer)]


def peak_by_own(kind, factor=1.0, parameters=()):
    problem = stiffer(heavier(chain(kind).contact_problem, factor), factor)
    force = np.array([0.1, 0, 0]) * (kind is not turning)
    given = dict(outputs={"tip": [0, 0, 1.0]}, harmonics=5, truncation=False)
    curve = follow_band(problem, force, BAND, **given)
    return peak_derivatives(curve, problem, "tip", parameters=parameters)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [by_ratio, by_matrix, turning])
def test_a_peak_follows_the_matrices_as_differences_say(kind):
    """Mass and spring at once; damping ratios follow the stuck modes."""
    found = peak_by_own(kind, parameters=OWN)
    hz = sum(found.frequency_by[one.name][0] for one in OWN)
    height = sum(found.amplitude_by[one.name][0] for one in OWN)
    beside = {s: peak_by_own(kind, 1 + 2e-3 * s) for s in (-2, -1, 1, 2)}
    assert hz == pytest.approx(difference(lambda s: near(beside, s).frequency), rel=1e-6)
    assert height == pytest.approx(difference(lambda s: near(beside, s).amplitude), rel=1e-6)


def near(beside, factor):
    """What is known at 1 + 2e-3 s, by s."""
    return beside[round((factor - 1) / 2e-3)]


def test_other_measures_of_the_peak():
    found = peak(chain(), "rms")
    value = difference(lambda s: peak(chain(varied=("mu", 0), factor=s), "rms").amplitude)
    assert found.amplitude_by["mu"][0] == pytest.approx(value, rel=1e-6)


def test_a_contact_that_sticks_at_the_peak_has_no_share_in_friction():
    found = peak(chain())
    assert abs(found.amplitude_by["mu"][1]) < 1e-9 < abs(found.amplitude_by["mu"][0])
    assert found.total("mu") == (
        found.frequency_by["mu"].sum(),
        found.amplitude_by["mu"].sum(),
    )


@pytest.mark.parametrize("names", [("kn", "kt"), ("mu",)])
@pytest.mark.parametrize("kind", [by_ratio, by_matrix])
def test_a_common_factor_is_the_sum_over_contacts(kind, names):
    """And the change of the residual of a problem made anew, by differences at a held motion."""
    problem = chain(kind).contact_problem
    balance = HarmonicBalance(problem, {1: np.array([0.5, 0, 0])}, 3)
    w = 2 * np.pi * 0.12
    here = solve_fixed(balance.evaluate, balance.linear(w), w, balance.weights).detail
    assert here.forces.shares[:, 1].max() > 0.1  # slips
    found = by_factor(balance, names)(here)
    each = [np.sum(list(by_setting(here, name)), axis=0) for name in names]
    np.testing.assert_allclose(found, sum(each), rtol=0, atol=1e-13 * np.abs(found).max())

    def residual(factor):
        contacts = problem.contacts
        changed = {name: factor * vars(contacts)[name] for name in names}
        anew = problem.with_contacts(replace(contacts, **changed))
        return balance.rebuilt(anew, balance.forces).evaluate(here.x, w).residual

    expected = (residual(1 + 1e-5) - residual(1 - 1e-5)) / 2e-5
    moved = -fourier.to_real(balance.shapes @ found).ravel()
    np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("forgotten", [False, True])
def test_by_friction_at_a_given_motion(forgotten):
    """Of contacts that slip and lift, beside central differences; of a point behind, too, whose
    matrices were dropped."""
    model, pairs, tip = small_rig(stations=3)
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.02)
    balance, w = HarmonicBalance(problem, {1: 200 * tip}, 3), 2 * np.pi * 312
    x = balance.linear(w)
    here = balance.evaluate(x, w)
    if forgotten:
        here.forget()
    found = by_factor(here.balance, ("mu",))(here)
    step, ends = 1e-6, []
    for factor in (1 + step, 1 - step):
        contacts = replace(problem.contacts, mu=factor * problem.contacts.mu)
        ends.append(here.balance.evaluate(x, w, contacts=contacts).modal)
    expected = (ends[0] - ends[1]) / (2 * step)
    assert len(here.forces.contacts) > 1
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_a_point_at_its_frequency():
    def at(varied=(), factor=1.0):
        problem = chain(varied=varied, factor=factor)
        curve = problem.follow_band(BAND, outputs={"tip": 2}, harmonics=5, truncation=False)
        return curve, problem

    curve, problem = at()
    found = point_derivatives(curve, problem, "tip", 0.1251, kind="harmonic")
    expected = difference(
        lambda s: np.abs(solutions_at(*at(("kt", 0), s), 0.1251)[0, 0, 1]), h=5e-4
    )
    assert found.amplitude_by["kt"][0] == pytest.approx(expected, rel=1e-6)
    assert not found.frequency_by["kt"].any()


def test_a_stuck_frequency():
    model, pairs = two_blades()
    problem, _ = contact_problem(model, pairs, DryFriction2T(), damping_ratio=0.01)
    found = stuck_frequency_derivatives(problem, 2)
    assert found.frequency == pytest.approx(natural_frequencies(model, pairs)[1], rel=1e-10)
    for name in ("kn", "kt"):

        def value_at(factor, name=name):
            stiffer = pairs.replace(**{name: vars(pairs)[name] * [factor, 1.0]})
            return natural_frequencies(model, stiffer)[1]

        expected = difference(value_at, 1e-3)
        assert found.frequency_by[name][0] == pytest.approx(expected, rel=1e-6, abs=1e-7)
    for name in ("mu", "preload", "damping", "level"):
        assert found.total(name)[0] == 0.0


@pytest.mark.parametrize("one", OWN, ids=lambda one: one.name)
def test_a_stuck_frequency_follows_the_matrices(one):
    problem = chain().contact_problem
    found = stuck_frequency_derivatives(problem, 1, parameters=OWN)

    def value_at(factor):
        return stuck_frequency_derivatives(one.of_value(problem, factor), 1).frequency

    assert found.total(one.name)[0] == pytest.approx(difference(value_at), rel=1e-7)


def over_the_level():
    given = {"outputs": {"tip": [0, 0, 1.0]}, "truncation": False}
    problem = chain().contact_problem
    return follow_parameter(problem, [0.1, 0, 0], 0.1, "level", (0.5, 1.0), **given), problem


def low_band():
    curve = chain().follow_band((0.06, 0.1), outputs={"tip": 2}, truncation=False)
    return curve, chain()


def by_own(name, of_value):
    parameters = [ModelParameter(name, of_value)]
    return stuck_frequency_derivatives(chain(), 1, parameters=parameters)


def far(problem, p):
    return replace(problem, K=p * np.eye(3))


def rougher(problem, p):
    return replace(problem, contacts=replace(problem.contacts, mu=p * problem.contacts.mu))


def smaller_motions(problem, p):
    """The relative motions are smaller on both sides of 1."""
    return replace(problem, B=(1 - abs(p - 1)) * problem.B)


BAD = {
    "runs over level": lambda: peak_derivatives(*over_the_level(), "tip"),
    "border of the band": lambda: peak_derivatives(*low_band(), "tip"),
    "output 'tap'": lambda: peak_derivatives(*low_band(), "tap"),
    "kind 'size' is unknown": lambda: peak_derivatives(*low_band(), "tip", "size"),
    "which = 5": lambda: point_derivatives(*low_band(), "tip", 0.08, 5),
    "mode = 9": lambda: stuck_frequency_derivatives(chain(), 9),
    "needs symmetric": lambda: stuck_frequency_derivatives(chain(turning), 1),
    "parameter 'mu': the name is taken": lambda: by_own("mu", lambda problem, p: problem),
    "parameter 'k': is not the problem of the curve at the value 1": lambda: by_own("k", far),
    "parameter 'k': changes contacts": lambda: by_own("k", rougher),
    "parameter 'B': changes contacts": lambda: by_own("B", smaller_motions),
    "parameters = 3: must be": lambda: stuck_frequency_derivatives(chain(), 1, parameters=[3]),
    "setting 'k'": lambda: stuck_frequency_derivatives(chain(), 1).total("k"),
}


@pytest.mark.parametrize("said", BAD)
def test_what_has_no_derivative_is_told_in_a_line(said):
    with pytest.raises(InputError, match=said) as told:
        BAD[said]()
    assert "\n" not in str(told.value)
