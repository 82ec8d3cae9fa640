"""Curves from a guess, and subharmonic ones, against closed forms."""

import numpy as np
import pytest

from tests.hbm.search.test_branches import HZ, STOPPED, a_period_later, orbit, state, stopped
from tests.hbm.search.test_curves_beside import ABSORBER
from tipdamp import (
    CubicSpring,
    ForceParameter,
    InputError,
    Problem,
    UnilateralSpring,
    branch_from,
    curves_beside,
    follow_parameter,
    named_points,
    solutions_at,
    time_history,
)
from tipdamp.hbm.search.beside import Search


def third(A, cubic=1.0, damping=0.0):
    """x = A cos(w t / 3) is exact without damping: cos^3 = (3 cos + cos 3)/4 [Stoker, Nonlinear
    Vibrations, 1950, ch. IV]. (problem, w, its unknowns for H orders)."""
    force, w = 0.25 * cubic * A**3, 3 * np.sqrt(1 + 0.75 * cubic * A**2)
    problem = Problem([[1.0]], [[damping]], [[1.0]]).add(CubicSpring(cubic), 0).force(0, force)

    def unknowns(H):
        x = np.zeros(2 * H + 1)
        x[1] = A
        return x

    return problem, w, unknowns


def test_a_motion_of_three_periods_in_closed_form():
    duffing, w, unknowns = third(2.0)
    found = duffing.solve_at(
        w * HZ, outputs={"x": 0}, harmonics=5, periods=3, guess=1.01 * unknowns(5)
    )
    assert found.converged and found.force_orders == (3,)
    assert abs(found.harmonics[0, 1]) == pytest.approx(2.0, rel=1e-9)
    assert np.abs(np.delete(found.harmonics[0], 1)).max() < 1e-9


@pytest.mark.parametrize("guess", [None, np.array([0.0, 1e-3, 0.0])])
def test_a_solution_that_repeats_earlier_than_it_was_asked_for_is_said(guess, recwarn):
    """The ordinary motion, from no guess or one of a third that dies out; not for one period, and
    not where it does last three."""
    duffing, w, unknowns = third(2.0)
    found = duffing.solve_at(8 * HZ, outputs={"x": 0}, harmonics=5, periods=3, guess=guess)
    (said,) = (str(one.message) for one in recwarn)
    assert found.converged and "repeats after 1 of 3 periods of the excitation" in said
    recwarn.clear()
    duffing.solve_at(8 * HZ, outputs={"x": 0}, harmonics=5)
    duffing.solve_at(w * HZ, outputs={"x": 0}, harmonics=5, periods=3, guess=unknowns(5))
    assert not recwarn.list


def test_a_curve_of_three_periods_runs_through_it(tmp_path):
    duffing, w, unknowns = third(2.0)
    curve = duffing.follow_band(
        (0.9 * w * HZ, 1.1 * w * HZ),
        outputs={"x": 0},
        harmonics=9,
        periods=3,
        guess=(w * HZ, unknowns(1)),
        at=[w * HZ],
    )
    assert curve.periods == 3 and curve.complete
    assert curve.frequency.min() == pytest.approx(0.9 * w * HZ)
    assert curve.frequency.max() == pytest.approx(1.1 * w * HZ)
    amplitudes = np.abs(solutions_at(curve, duffing.contact_problem, w * HZ)[:, 0, 1])
    assert np.abs(amplitudes / 2 - 1).min() < 1e-9
    t, x = time_history(curve, duffing.contact_problem, "x", w * HZ)
    assert 256 * (t[1] - t[0]) == pytest.approx(3 * 2 * np.pi / w)
    assert type(curve).load(curve.save(tmp_path / "curve.npz")) == curve


def test_it_folds_with_damping_and_an_integration_stays_there():
    """With damping the curve closes. Between its folds there is a motion that an integration keeps,
    and one that it leaves."""
    duffing, w, unknowns = third(2.0, damping=0.05)
    given = {"outputs": {"x": 0}, "harmonics": 9, "periods": 3}
    curve = duffing.follow_band((3.05 * HZ, 7 * HZ), guess=(w * HZ, unknowns(1)), **given)
    assert curve.complete and "closed" in curve.ended
    named = named_points(curve, duffing.contact_problem, stability=False)
    assert [point.kind for point in named] == ["fold", "fold"]

    def system(t, y, w):
        return [y[1], 2.0 * np.cos(w * t) - 0.05 * y[1] - y[0] - y[0] ** 3]

    w, found = 4.0, []
    for X in solutions_at(curve, duffing.contact_problem, w * HZ):
        begin = state(X, w / 3)
        y, multipliers = orbit(system, begin, w, 3)
        assert np.abs(y - begin).max() < 1e-3 * np.abs(y).max()
        found.append(np.abs(multipliers).max())
        assert np.abs(a_period_later(system, y, w) - y).max() > 0.1
    assert min(found) < 1 < max(found)


def test_a_detached_curve_from_a_point_of_it():
    """The same as the one that a search finds, from any of its points, both ways."""
    band, rows = (0.6 * HZ, 1.6 * HZ), {"x": 0}
    curve = ABSORBER.follow_band(band, outputs=rows, harmonics=3)
    (known,) = curves_beside(
        curve, ABSORBER.contact_problem, Search(frequencies=3, starts=0)
    ).curves
    i = len(known.frequency) // 3
    guess = known.frequency[i], known.unknowns[i]
    for ends in (band, band[::-1]):
        again = ABSORBER.follow_band(ends, outputs=rows, harmonics=3, guess=guess)
        assert again.complete and "closed" in again.ended
        assert again.frequency[0] == again.frequency[-1] == again.frequency.min()
        assert again.peak("x")[1] == pytest.approx(known.peak("x")[1], rel=1e-7)
        assert again.truncation.shape == (len(again.frequency), 1)
    more = ABSORBER.follow_band(band, outputs=rows, harmonics=5, guess=guess)
    assert "closed" in more.ended and more.H == 5
    at_begin = ABSORBER.follow_band(
        (known.frequency[i], 0.25), outputs=rows, harmonics=3, guess=known.unknowns[i]
    )
    assert at_begin.frequency[0] == known.frequency[i]
    assert np.allclose(at_begin.unknowns[0], known.unknowns[i], rtol=1e-6)


def test_a_subharmonic_curve_over_the_level():
    """From a point of the curve that a period doubling leads to."""
    problem = STOPPED.contact_problem
    given = {"outputs": {"x": 0}, "harmonics": 12}
    curve = STOPPED.follow_band((2 * HZ, 3.2 * HZ), **given)
    doubling = [p for p in named_points(curve, problem) if p.kind == "period doubling"]
    (twice,) = branch_from(curve, problem, doubling[0])
    i = len(twice.frequency) // 2
    over = follow_parameter(
        problem,
        dict(STOPPED.forces),
        twice.frequency[i],
        "level",
        (0.9, 1.1),
        outputs={"x": [1.0]},
        harmonics=24,
        periods=2,
        guess=(1.0, twice.unknowns[i]),
    )
    assert over.complete and over.periods == 2 and over.frequency[0] == twice.frequency[i]
    found = solutions_at(over, problem, 1.0)[:, 0]
    assert np.abs(found - twice.harmonics[i, 0]).max(axis=1).min() < 1e-6
    w = twice.frequency[i] / HZ
    y, _ = orbit(stopped, state(twice.harmonics[i], w / 2), w, 2)
    assert np.abs(a_period_later(stopped, y, w) - y).max() > 1e-3 * np.abs(y).max()


GAPPED = Problem([[1.0]], [[0.1]], [[1.0]]).force(0, 1.0)
GAPPED = GAPPED.add(UnilateralSpring(), 0, kn=50.0, preload=-15.0)  # a stop 0.3 m away


@pytest.fixture(scope="module")
def gapped():
    """(where its period doubles, Hz, the last at a grazing; two motions of two periods, the second
    not far from the grazing)."""
    given = {"outputs": {"x": 0}, "harmonics": 10, "stability": "all"}
    curve = GAPPED.follow_band((1.9 * HZ, 2.3 * HZ), **given)
    doubled = [p for p in curve.named_points if p.kind == "period doubling"]
    (twice,) = branch_from(curve, GAPPED.contact_problem, doubled[0])
    places = len(twice.frequency) // 2, len(twice.frequency) - 6
    guesses = [(twice.frequency[i], twice.unknowns[i]) for i in places]
    return [p.frequency for p in doubled], guesses


@pytest.mark.parametrize("inside", [True, False])
def test_a_subharmonic_curve_ends_at_its_parent(gapped, inside):
    """Both ways, where the period doubles and at the grazing; and from where the band begins."""
    doubled, guesses = gapped
    guess = guesses[0] if inside else guesses[1]
    begin, end = (1.9 * HZ, 3.7 * HZ) if inside else (guess[0], 1.9 * HZ)
    given = {"outputs": {"x": 0}, "harmonics": 20, "periods": 2, "guess": guess}
    curve = GAPPED.follow_band((begin, end), **given)
    assert curve.complete and "from which it branches off" in curve.ended
    assert "stopped" not in curve.ended
    own = np.abs(curve.harmonics[:, 0, 1::2]).max(axis=1)
    whole = np.abs(curve.harmonics[:, 0, 1:]).max(axis=1)
    ends = [0, -1] if inside else [-1]
    assert (own[ends] <= 1e-6 * whole[ends]).all() and (own[1:-1] > 1e-6 * whole[1:-1]).all()
    assert (np.abs(curve.frequency[ends][:, None] / doubled - 1).min(axis=1) < 1e-3).all()


def test_a_force_parameter_counts_orders_of_the_excitation():
    turned = ForceParameter("size", lambda value: {1: np.array([value])}).over(2)
    _, forces = turned.rebuild(STOPPED.contact_problem, {2: np.ones(1)}, 3.0)
    assert forces[2].tolist() == [3.0]


def test_guesses_and_periods_that_cannot_be():
    duffing, w, unknowns = third(2.0)
    given = {"outputs": {"x": 0}, "harmonics": 5, "periods": 3}
    band = 0.9 * w * HZ, 1.1 * w * HZ

    def refused(match, **options):
        with pytest.raises(InputError, match=match):
            duffing.follow_band(band, **{**given, **options})

    refused("guess: has 13 unknowns, must have", guess=np.ones(13))
    refused("guess: has 4 unknowns", guess=np.ones(4))
    refused("finite", guess=np.full(11, np.nan))
    refused("guess: is one at 0.5, must be between", guess=(0.5, unknowns(5)))
    refused("guess", guess="near")
    refused("leads from it to no solution", guess=(w * HZ, 1e8 * np.ones(11)))
    refused("periods = 0: must be a whole number", periods=0)
    refused("stands at 7: at least that many", periods=7)
    with pytest.warns(UserWarning, match="of its motion away: it may be another one"):
        duffing.follow_band(band, guess=(w * HZ, 3 * unknowns(5)), **given)
    with pytest.warns(UserWarning, match="repeats after 1 of 3 periods"):
        linear = duffing.solve_at(8 * HZ, outputs={"x": 0}, harmonics=1).unknowns
        seen = np.zeros(11)
        seen[[5, 6]] = linear[[1, 2]]
        duffing.follow_band((8 * HZ, 9 * HZ), guess=seen, **given)


def test_a_mean_a_hundred_times_the_vibration_does_not_hide_a_wrong_one(recwarn):
    """On a spring that is nearly linear, below its resonance: the mean 100 and 1/(1 - 1/4) are the
    solution."""
    pressed = Problem([[1.0]], [[0.02]], [[1.0]], static=[100.0]).add(CubicSpring(1e-9), 0)
    pressed = pressed.force(0, 1.0)
    given = {"outputs": {"x": 0}, "harmonics": 1}
    band = 0.4 * HZ, 0.6 * HZ
    near = pressed.follow_band(band, guess=(0.5 * HZ, np.array([90.0, 4 / 3, 0])), **given)
    assert near.complete and not recwarn.list
    assert near.harmonics[0, 0, 0] == pytest.approx(100, rel=1e-3)
    with pytest.warns(UserWarning, match=r"8\d% of its motion away: it may be another one"):
        pressed.follow_band(band, guess=(0.5 * HZ, np.array([100.0, 0, 0])), **given)
