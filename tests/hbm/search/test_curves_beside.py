"""Detached curves and further solutions, against closed forms and counted solutions."""

import numpy as np
import pytest

from tipdamp import (
    CubicSpring,
    InputError,
    Jenkins1D,
    OwnForce,
    Problem,
    Search,
    curves_beside,
    solutions_at,
)
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Level
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.closed import follow_both_ways
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.search.beside import Beside, _Mixtures
from tipdamp.hbm.search.levels import _held, _strange, over_levels

HZ = 1 / (2 * np.pi)  # of 1 rad/s
M, C = np.diag([1.0, 0.05]), np.array([[0.01, -0.005], [-0.005, 0.005]])
K = np.array([[1.015, -0.015], [-0.015, 0.015]])
CUBIC, FORCE = 0.2 / 3, 0.0311
ABSORBER = Problem(M, C, K).add(CubicSpring(CUBIC), (0, 1)).force(0, FORCE)
ONE_HARMONIC = {"outputs": {"x": 0}, "harmonics": 1, "samples": 16}


def amplitudes_in_closed_form(w):
    """|x1| of every solution of the absorber with one harmonic: the square of the stretch is a root
    of a cubic."""
    G = np.linalg.inv(K - w**2 * M + 1j * w * C)
    across = np.array([1.0, -1.0])
    g, r, k = across @ G @ across, FORCE * (across @ G)[0], 0.75 * CUBIC
    roots = np.roots([abs(k * g) ** 2, 2 * k * g.real, 1, -(abs(r) ** 2)])
    squares = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
    stretch = r / (1 + k * g * squares)
    return np.sort(np.abs((FORCE * G[:, :1] - G @ across[:, None] * k * squares * stretch)[0]))


def test_detached_resonance_of_an_absorber():
    """Twenty times the peak of the curve that is followed from the end of the band."""
    curve = ABSORBER.follow_band((0.6 * HZ, 1.6 * HZ), **ONE_HARMONIC)
    beside = curves_beside(curve, ABSORBER.contact_problem, Search(frequencies=5, starts=4))
    (detached,) = beside.curves
    assert beside.curve.searched.endswith(
        "5 of 5 values, over the level of the force and from 36 starts: 1 further curve found"
    )
    w = np.linspace(0.7, 1.0, 3001)
    closed_form = [amplitudes_in_closed_form(one) for one in w]
    three = w[[len(found) == 3 for found in closed_form]]
    # the points beside its folds
    assert detached.frequency.min() / HZ == pytest.approx(three.min(), abs=1e-3)
    assert detached.frequency.max() / HZ == pytest.approx(three.max(), abs=1e-3)
    highest = max(found[-1] for found in closed_form)
    assert detached.peak("x")[1] == pytest.approx(highest, rel=1e-3)  # 1e-4 rad/s between two w
    assert highest > 18 * curve.peak("x")[1]
    for one, x in zip(detached.frequency, detached.harmonics[:, 0, 1], strict=True):
        there = amplitudes_in_closed_form(one / HZ)
        assert np.abs(there / abs(x) - 1).min() < 1e-6
    assert detached.frequency[0] == detached.frequency[-1] == detached.frequency.min()
    assert "closed" in detached.ended and detached.complete


def test_more_harmonics_of_the_absorber():
    curve = ABSORBER.follow_band((0.6 * HZ, 1.6 * HZ), outputs={"x": 0}, harmonics=5)
    (detached,) = curves_beside(
        curve, ABSORBER.contact_problem, Search(frequencies=3, starts=4)
    ).curves
    # by a level path of others, at 0.93 rad/s: 0.811 and 0.0909 here, 0.1798 on the curve
    of_both = [
        np.abs(solutions_at(one, ABSORBER.contact_problem, 0.93 * HZ)[:, 0, 1])
        for one in (detached, curve)
    ]
    assert sorted(of_both[0]) == pytest.approx([0.0909, 0.811], rel=1e-3)
    assert of_both[1] == pytest.approx([0.1798], rel=1e-3)
    assert detached.force_residual.max() < 5e-9 and detached.energy_error.max() < 1e-8


def driven(factor):
    """The absorber under another force."""
    return Problem(M, C, K).add(CubicSpring(CUBIC), (0, 1)).force(0, factor * FORCE)


def of_orders(H):
    return {**ONE_HARMONIC, "band": (0.6 * HZ, 1.6 * HZ), "harmonics": H, "samples": 16}


def stretches_in_closed_form(w, level):
    """|x1 - x2| of the solutions with one harmonic, under so many times the force."""
    G = np.linalg.inv(K - w**2 * M + 1j * w * C)
    across = np.array([1.0, -1.0])
    g, r, k = across @ G @ across, level * FORCE * (across @ G)[0], 0.75 * CUBIC
    roots = np.roots([abs(k * g) ** 2, 2 * k * g.real, 1, -(abs(r) ** 2)])
    return np.sort(np.sqrt(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real))


RING = 3 * np.eye(4) - np.roll(np.eye(4), 1, axis=0) - np.roll(np.eye(4), -1, axis=0)


def ring():
    problem = Problem(np.eye(4), 0.1 * np.eye(4), RING)
    for i in range(4):
        problem = problem.add(CubicSpring(1.0), i).force(i, 2.0)
    return HarmonicBalance(problem.contact_problem, dict(problem.forces), 3)


def test_all_solutions_of_a_ring():
    """Four equal oscillators: eleven solutions at 2 rad/s, closed under the symmetry of the
    ring."""
    balance, w = ring(), 2.0
    first = solve_fixed(balance.evaluate, balance.linear(w), w, balance.weights)
    beside = Beside(balance, w, [first.x], Search(), DEFAULT)
    found = [*beside.known, *beside.over_level(), *beside.from_starts()]
    assert len(beside.symmetries) == 15  # eight of a square, each with and without half a period
    assert len(found) == len(beside.known) == 11
    for x in found:
        residual = balance.evaluate(x, w).residual
        assert np.linalg.norm(residual) <= 1e-9 * np.linalg.norm(x)
        turned = np.roll(x.reshape(4, -1), 1, axis=0).ravel()
        assert sum(beside.same(turned, one) for one in found) == 1


@pytest.mark.slow
@pytest.mark.parametrize("w, count", [(2.0, 11), (2.5, 39)])
def test_solutions_of_a_ring_by_a_search_of_its_curve(w, count):
    """With the default search, at one frequency, and with the word that more may exist."""
    problem = Problem(np.eye(4), 0.1 * np.eye(4), RING)
    for i in range(4):
        problem = problem.add(CubicSpring(1.0), i).force(i, 2.0)
    band = (w - 0.02) * HZ, (w + 0.02) * HZ
    curve = problem.follow_band(band, outputs={"x": 0}, harmonics=3)
    beside = curves_beside(curve, problem.contact_problem, Search(frequencies=1, curves=2))
    assert beside.solutions[0] >= count and (w > 2 or beside.solutions[0] == count)
    assert "more may exist" in beside.curve.searched


def test_no_mixture_is_tried_twice_nor_its_images():
    balance, w = ring(), 2.0
    first = solve_fixed(balance.evaluate, balance.linear(w), w, balance.weights)
    beside = Beside(balance, w, [first.x], Search(), DEFAULT)
    list(beside.over_level())
    assert len(beside.known) == 3  # equal motions of three sizes: 81 mixtures, 21 up to symmetry
    mixed, random = _Mixtures(beside), np.random.default_rng(0)
    every = []
    while (one := mixed.near(random)) is not None:
        every.append(one)
    for i, one in enumerate(every):
        images = [image(one) for image in beside.symmetries] + [one]
        assert not any(np.array_equal(a, b) for a in images for b in every[:i])
    assert 12 <= len(every) <= 18


def test_means_of_sliders_are_one_solution():
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    for problem, one in ((damped, True), (ABSORBER.contact_problem, False)):
        balance = HarmonicBalance(problem, {1: np.ones(len(problem.K))}, 1)
        x = np.zeros(3)
        x[1] = 1.0
        moved = x + [10.0, 0.0, 0.0]
        beside = Beside(balance, 1.0, [x, moved], Search(), DEFAULT)
        assert beside.same(x, moved) == one


@pytest.mark.parametrize("harmonics", [(1, 1, 1), (3, 1, 1)])
def test_one_branch_over_the_level_serves_the_curves_of_several(harmonics):
    """At 0.93 rad/s, where the closed form has three solutions at each level; the branch comes back
    over its fold; also where the curves have other numbers of harmonics."""
    w, levels = 0.93, (0.5, 0.9, 1.0)
    curves = [driven(f).follow_band(**of_orders(H)) for f, H in zip(levels, harmonics, strict=True)]
    found = over_levels(curves, ABSORBER.contact_problem, w * HZ, 10.0, 1000)
    for one, level, curve in zip(found, levels, curves, strict=True):
        (further,), (held,) = one.further, _held(curve, w * HZ)
        closed_form = stretches_in_closed_form(w, level)
        assert len(closed_form) == 3
        # the curve's point is one between two of its own
        tolerances = zip((further, held), (0.05 if curve.H > 1 else 1e-6, 0.02), strict=True)
        for x, tolerance in tolerances:
            stretch = float(np.hypot(*x[1:3]))
            assert np.abs(closed_form / stretch - 1).min() < tolerance
        assert curve.H > 1 or np.hypot(*further[1:3]) > 1.5 * np.hypot(*held[1:3])
    assert found[0].reach == pytest.approx(2 * found[2].reach, rel=1e-12)
    assert found[0].calls < 200


def test_means_of_sliders_are_no_further_solution():
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    for problem, count in ((damped, 0), (ABSORBER.contact_problem, 1)):
        balance = HarmonicBalance(problem, {1: np.ones(len(problem.K))}, 1)
        x = np.array([0.0, 1.0, 0.0])
        branch = Branch([Point(level * x, level, True, 1) for level in (0.5, 1.5)])
        assert len(_strange(branch, 1.0, balance, [x + [1e3, 0.0, 0.0]], 1)) == count


def test_a_branch_over_the_level_keeps_its_limit():
    curves = [driven(1.0).follow_band(**of_orders(1))]
    problem, hz = ABSORBER.contact_problem, 1.3 * HZ
    (short,), (long,) = (over_levels(curves, problem, hz, 10.0, calls) for calls in (8, 1000))
    assert short.calls <= 9 < long.calls <= 1000
    assert short.reach < long.reach == pytest.approx(10.0)
    words = [
        curves_beside(curves[0], problem, Search(effort=0.0, least_calls=0), crossed=[one])
        for one in (short, long)
    ]
    assert f"up to {short.reach:.3g} times" in words[0].curve.searched
    assert all("at 1 of 12 values" in one.curve.searched for one in words)
    assert f"stopped after {long.calls} evaluations" in words[1].curve.searched


def test_a_study_finds_the_detached_resonance():
    """As a study does: with 0.3 of the evaluations of the curve."""
    curve = ABSORBER.follow_band((0.6 * HZ, 1.6 * HZ), outputs={"x": 0}, harmonics=5)
    search = Search(effort=0.3, least_calls=0)
    beside = curves_beside(curve, ABSORBER.contact_problem, search)
    (detached,) = beside.curves
    assert detached.frequency.min() / HZ < 0.725 and detached.frequency.max() / HZ > 0.968
    assert "more may exist" in beside.curve.searched
    # H = 5: less than the closed form of H = 1
    highest = max(amplitudes_in_closed_form(one)[-1] for one in np.linspace(0.9, 1.0, 500))
    assert 0.9 * highest < np.abs(detached.harmonics[:, 0, 1]).max() < highest


@pytest.mark.parametrize("F", [0.0215, 0.017])
def test_a_narrow_detached_resonance_at_the_peak_of_its_curve(F):
    """Damped by .06 v - .1 v3 + .045 v5: F = A (.06 - .075 A2 + .028125 A4) at 1 rad/s, and the
    peak of the curve lies there. The closed curve is 0.02 rad/s wide and above."""
    roots = np.roots([0.045 * 5 / 8, 0, -0.1 * 3 / 4, 0, 0.06, -F])
    lowest, _, highest = np.sort(roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real)
    damping = OwnForce(lambda u, v: 0.06 * v - 0.1 * v**3 + 0.045 * v**5, 1)
    damped = Problem([[1.0]], [[0.0]], [[1.0]]).add(damping, 0).force(0, F)
    curve = damped.follow_band(omega=(0.6, 1.5), outputs={"x": 0}, harmonics=3, truncation=False)
    assert curve.peak("x")[1] == pytest.approx(lowest, rel=1e-3)
    (found,) = curves_beside(curve, damped.contact_problem, Search(starts=0)).curves
    assert found.peak("x")[1] == pytest.approx(highest, rel=2e-3)  # at 1 rad/s beside the peak
    assert np.ptp(found.frequency) < 0.02 * HZ


def test_a_branch_is_followed_across_others():
    """The level path of equal motions meets those of unequal ones: it goes on to its folds and
    back."""
    balance, w = ring(), 2.5
    evaluate = Equation(balance, Level(), w * HZ).evaluate
    first = solve_fixed(evaluate, balance.linear(w), 1.0, balance.weights)
    branch = follow_both_ways(evaluate, first, (0.05, 10.0), balance.weights, DEFAULT, 300)
    assert branch.end == "through" and branch.points[-1].parameter == pytest.approx(10.0)
    for point in branch.points:
        u = point.x.reshape(4, -1)
        assert np.abs(u - u[0]).max() < 1e-6 * np.abs(u).max()
    turns = np.diff(np.sign(np.diff([point.parameter for point in branch.points])))
    assert np.count_nonzero(turns) == 2


def test_a_curve_that_leaves_the_band_at_both_ends_of_its_part():
    """A hardening resonance whose fold lies above the band: the two other solutions belong to one
    curve, or to one each where it folds outside."""
    duffing = Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
    curve = duffing.follow_band((0.4 * HZ, 2.0 * HZ), **ONE_HARMONIC)
    beside = curves_beside(curve, duffing.contact_problem, Search(frequencies=4, starts=8))
    assert max(beside.solutions) == 3
    for one in beside.curves:
        a, w = np.abs(one.harmonics[:, 0, 1]), one.frequency / HZ
        assert ((1 - w**2 + 0.75 * a**2) ** 2 + (0.02 * w) ** 2) * a**2 == pytest.approx(
            0.04, rel=1e-6
        )
        assert "leaves the band at both ends" in one.ended


def test_nothing_beside_a_friction_oscillator_and_limits_that_are_told():
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    curve = damped.follow_band((600, 1000), outputs={"tip": 0}, harmonics=3)
    nothing = curves_beside(curve, damped.contact_problem, Search(frequencies=3, starts=5))
    assert nothing.curves == () and nothing.solutions == (1, 1, 1)
    words = nothing.curve.searched
    assert words.endswith(
        "3 of 3 values, over the level of the force and from 15 starts: no further curve found"
    )
    assert curve.searched == "not looked for further curves"
    few = Search(effort=0.0, least_calls=50)
    stopped = curves_beside(curve, damped.contact_problem, few)
    assert (
        "stopped after 50 evaluations" in stopped.curve.searched
        and "more may exist" in stopped.curve.searched
    )
    assert len(stopped.places) < 12
    late = curves_beside(curve, damped.contact_problem, Search(seconds=1e-9))
    assert "stopped after 1e-09 s, more may exist" in late.curve.searched


def test_curves_that_cannot_be_searched_beside():
    curve = ABSORBER.follow_band((0.6 * HZ, 0.9 * HZ), **ONE_HARMONIC)
    other = Problem(M, C, 2 * K).add(CubicSpring(CUBIC), (0, 1)).contact_problem
    with pytest.raises(InputError, match="the problem is not that of the curve"):
        curves_beside(curve, other)
