"""Branches through branch points and period doublings, against symmetry, and integrations that are
written here."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tipdamp import (
    CubicSpring,
    InputError,
    Problem,
    UnilateralSpring,
    branch_from,
    follow_parameter,
    named_points,
    solutions_at,
)

HZ = 1 / (2 * np.pi)  # of 1 rad/s
SYMMETRIC = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 2.0)
# closed at rest with 0.2 N, 50 times as stiff as the spring beside it
STOP = {"kn": 50.0, "preload": 0.2}
STOPPED = Problem([[1.0]], [[0.1]], [[1.0]]).add(UnilateralSpring(), 0, **STOP).force(0, 1.0)
PAIR_M, PAIR_C = np.diag([1.0, 0.2]), np.array([[0.1, -0.02], [-0.02, 0.02]])
PAIR_K = np.array([[1.2, -0.2], [-0.2, 0.2]])
GAP = {"kn": 10.0, "preload": -2.0}  # open by 0.2 m at rest
PAIR = Problem(PAIR_M, PAIR_C, PAIR_K).add(UnilateralSpring(), (1, 0), **GAP).force(0, 0.1)


def stopped(t, y, w):
    """(x', v') of STOPPED."""
    force = max(0.0, STOP["preload"] + STOP["kn"] * y[0]) - STOP["preload"]
    return [y[1], np.cos(w * t) - 0.1 * y[1] - y[0] - force]


def pair(t, y, w):
    """(x', v') of PAIR."""
    x, v = y[:2], y[2:]
    force = max(0.0, GAP["preload"] + GAP["kn"] * (x[1] - x[0])) * np.array([-1.0, 1.0])
    push = np.array([0.1 * np.cos(w * t), 0.0])
    return [*v, *((push - PAIR_C @ v - PAIR_K @ x - force) / PAIR_M.diagonal())]


def a_period_later(system, y, w, periods=1):
    T = 2 * np.pi / w * periods
    given = {"rtol": 1e-10, "atol": 1e-12, "max_step": T / (200 * periods), "method": "DOP853"}
    found = solve_ivp(system, (0, T), y, args=(w,), **given)
    return found.y[:, -1]


def orbit(system, y, w, periods=1):
    """(state at t = 0 of the periodic motion near y, its multipliers): Newton on the map."""
    for _ in range(8):
        after = a_period_later(system, y, w, periods)
        step = 1e-5 * max(np.abs(y))
        columns = [a_period_later(system, y + d, w, periods) for d in step * np.eye(len(y))]
        A = (np.array(columns).T - after[:, None]) / step
        change = np.linalg.solve(A - np.eye(len(y)), y - after)
        y = y + change
        if np.abs(change).max() < 1e-8 * np.abs(y).max():
            break
    return y, np.linalg.eigvals(A)


def state(X, w):
    """At t = 0, from complex harmonics (m, H+1)."""
    return np.r_[X.real.sum(axis=1), -(w * np.arange(X.shape[1]) * X.imag).sum(axis=1)]


def of_kind(found, kind):
    return [point for point in found if point.kind == kind]


def test_a_broken_symmetry_both_ways():
    """A mean builds up, either way: half a period later and with the other sign."""
    curve = SYMMETRIC.follow_band((0.12, 0.16), outputs={"x": 0}, harmonics=7)
    problem = SYMMETRIC.contact_problem
    first, second = of_kind(named_points(curve, problem), "symmetry breaking")
    up, down = branch_from(curve, problem, first)
    X, Y = up.harmonics[:, 0], down.harmonics[:, 0]
    assert len(X) == len(Y)
    image = Y * -((-1.0) ** np.arange(8))
    assert np.abs(X - image).max() < 1e-6 * np.abs(X).max()
    assert np.abs(X[:, 0]).max() > 0.1 and np.ptp(np.sign(X[5:-2, 0].real)) == 0
    for one in (up, down):
        assert one.complete and "from which it branches off" in one.ended
        assert one.frequency[0] == first.frequency
        # the multipliers are those of more orders than the curve has
        assert one.frequency[-1] == pytest.approx(second.frequency, rel=1e-3)
        assert np.abs(one.harmonics[[0, -1], 0, 0]).max() < 1e-6
        assert one.force_residual.max() < 5e-9 and one.periods == 1
        assert one.relative_truncation.max() < 1e-2  # with estimate and multipliers as any curve
        assert (one.stable | one.unstable)[1:-1].all()
        assert one.named_points == named_points(one, problem)
    back, _ = branch_from(curve, problem, second)
    there = 0.5 * (first.frequency + second.frequency)
    means = (solutions_at(one, problem, there)[:, 0, 0].real for one in (up, down, back))
    a, b, c = (float(mean.item()) for mean in means)
    assert a == pytest.approx(-b, rel=1e-6) and abs(c) == pytest.approx(abs(a), rel=1e-6)


def test_two_equal_oscillators_move_unequally():
    """Over the level; the two branches are images under their exchange."""
    two = two_alike()
    problem, rows = two.contact_problem, {"a": [1, 0], "b": [0, 1]}
    given = {"outputs": rows, "harmonics": 3}
    curve = follow_parameter(problem, dict(two.forces), 2 * HZ, "level", (0.05, 3), **given)
    first, second = of_kind(named_points(curve, problem), "symmetry breaking")
    one, other = branch_from(curve, problem, first)
    X, Y = one.harmonics, other.harmonics
    assert np.abs(X - Y[:, ::-1]).max() < 1e-6 * np.abs(X).max()
    assert np.abs(X[:, 0] - X[:, 1]).max() > 0.1
    assert one.parameter[0] == first.parameter
    assert one.parameter[-1] == pytest.approx(second.parameter, rel=1e-3)


def two_alike():
    two = Problem(np.eye(2), 0.1 * np.eye(2), [[2, -1], [-1, 2]])
    for i in (0, 1):
        two = two.add(CubicSpring(1.0), i).force(i, 2.0)
    return two


@pytest.mark.parametrize("w", [2.0, 2.5])
def test_a_curve_runs_across_the_branches_that_leave_it(w):
    """Equal motions stay equal, past the levels at which unequal ones branch off."""
    two = two_alike()
    given = {"outputs": {"a": [1, 0], "b": [0, 1]}, "harmonics": 3, "truncation": False}
    forces = dict(two.forces)
    curve = follow_parameter(two.contact_problem, forces, w * HZ, "level", (0.05, 3), **given)
    assert curve.complete and not len(curve.restarts) and curve.residual_calls < 1000
    X = curve.harmonics
    assert np.abs(X[:, 0] - X[:, 1]).max() < 1e-8 * np.abs(X).max()


def test_four_equal_oscillators_have_branches_in_pairs():
    """Two multipliers at once: motions equal across and along a diagonal, each in both ways."""
    from tests.hbm.search.test_curves_beside import ring

    balance = ring()
    problem, rows = balance.problem, dict(zip("abcd", np.eye(4), strict=True))
    curve = follow_parameter(
        problem, balance.forces, 2.5 * HZ, "level", (2.2, 2.6), outputs=rows, harmonics=3
    )
    found = of_kind(named_points(curve, problem), "symmetry breaking")
    double = min(found, key=lambda point: abs(point.parameter - 2.502))
    branches = branch_from(curve, problem, double)
    patterns = set()
    for one in branches:
        a = np.abs(one.harmonics[len(one.parameter) // 2, :, 1])
        patterns.add(tuple((a > a.mean()).tolist()))
    assert len(patterns) == len(branches) >= 4


def test_the_period_doubles_at_a_stiff_stop_and_halves_again():
    curve = STOPPED.follow_band((1.1 * HZ, 3 * HZ), outputs={"x": 0}, harmonics=15)
    problem = STOPPED.contact_problem
    first, second = of_kind(named_points(curve, problem), "period doubling")
    (twice,) = branch_from(curve, problem, first)
    assert twice.periods == 2 and twice.H == 30 and twice.force_orders.tolist() == [2]
    assert twice.frequency[0] == first.frequency
    assert twice.complete and twice.force_residual.max() < 5e-9


@pytest.mark.slow
def test_multipliers_far_outside_the_circle_and_the_motions_that_take_over():
    """Multipliers down to -5; where the period doubles is confirmed by disturbed periods of an
    integration, and the motion of twice the period is where such an integration stays."""
    given = {"outputs": {"x": 0}, "harmonics": 25, "stability": "all"}
    curve = STOPPED.follow_band((0.7 * HZ, 4 * HZ), **given)
    problem = STOPPED.contact_problem
    assert np.nanmin(curve.multipliers.real) < -5
    found = of_kind(named_points(curve, problem), "period doubling")
    assert len(found) >= 4
    for point in found:
        assert abs(point.multiplier.imag) < 1e-3
        leading = []
        for i in (point.index, point.index + 1):
            w = curve.frequency[i] / HZ
            _, multipliers = orbit(stopped, state(curve.harmonics[i], w), w)
            leading.append(multipliers[np.argmax(np.abs(multipliers))])
        least, most = sorted(leading, key=abs)
        assert abs(least) < 1 and most.imag == 0 and most.real < -1
    confirmed = 0
    for point in found:
        (twice,) = branch_from(curve, problem, point)
        for i in (4, 6):  # further on some lose their stability, too, and no integration stays
            w, X = twice.frequency[i] / HZ, twice.harmonics[i]
            begin = state(X, w / 2)
            y, multipliers = orbit(stopped, begin, w, 2)
            assert np.abs(y - begin).max() < 0.02 * np.abs(y).max()
            assert np.abs(a_period_later(stopped, y, w) - y).max() > 1e-3 * np.abs(y).max()
            confirmed += np.abs(multipliers).max() < 1
    assert confirmed >= 4  # stable ones: an integration stays there


@pytest.mark.slow
def test_a_second_frequency_at_a_stop():
    """A pair of multipliers passes the unit circle and comes back: Neimark-Sacker."""
    curve = PAIR.follow_band((1.2 * HZ, 1.32 * HZ), outputs={"x": 0, "y": 1}, harmonics=25)
    problem = PAIR.contact_problem
    found = [point for point in named_points(curve, problem) if np.isfinite(point.multiplier)]
    found = [point for point in found if point.kind != "fold"]
    assert [point.kind for point in found] == ["Neimark-Sacker"] * 2
    for point, inwards in zip(found, (1, -1), strict=True):
        for share, grows in ((1 + 2e-3 * inwards, True), (1 - 2e-3 * inwards, False)):
            w = share * point.frequency / HZ
            (X,) = solutions_at(curve, problem, w * HZ)
            _, multipliers = orbit(pair, state(X, w), w)
            leading = multipliers[np.argmax(np.abs(multipliers))]
            assert (abs(leading) > 1) == grows
            assert abs(abs(leading.imag) - abs(point.multiplier.imag)) < 0.1
    with pytest.raises(InputError, match="is a Neimark-Sacker, from which no other branch"):
        branch_from(curve, problem, found[0])


@pytest.mark.slow
def test_a_point_that_was_edited():
    """One that is not where its index says, or is none of the curve."""
    curve = SYMMETRIC.follow_band((0.12, 0.16), outputs={"x": 0}, harmonics=3)
    problem = SYMMETRIC.contact_problem
    point = of_kind(named_points(curve, problem), "symmetry breaking")[0]
    for index in (-1, 999):
        with pytest.raises(InputError, match=f"after point {index}"):
            branch_from(curve, problem, replace(point, index=index))
    with pytest.raises(InputError, match="the curve does not have the point"):
        branch_from(curve, problem, replace(point, index=2))
    with pytest.raises(InputError, match="the curve does not have the point"):
        branch_from(curve, problem, replace(point, parameter=1.1 * point.parameter))


def test_a_fold_leads_to_no_other_branch():
    duffing = Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.02)
    curve = duffing.follow_band((0.14, 0.24), outputs={"x": 0}, harmonics=1, samples=16)
    fold = named_points(curve, duffing.contact_problem, stability=False)[0]
    with pytest.raises(InputError, match="is a fold, from which no other branch"):
        branch_from(curve, duffing.contact_problem, fold)


def test_a_symmetry_breaks_where_the_half_period_says(tmp_path):
    """Strongly forced: the half-period map, turned round, of scipy's integration has there a
    multiplier of -1, and the motions that branch off come back."""
    duffing = Problem([[1.0]], [[0.2]], [[1.0]]).add(CubicSpring(0.5), 0).force(0, 6.0)
    given = {"outputs": {"x": 0}, "harmonics": 15, "stability": "all"}
    curve = duffing.follow_band((0.8 * HZ, 1.4 * HZ), **given)
    broken = of_kind(curve.named_points, "symmetry breaking")
    assert len(broken) == 2

    def system(t, y, w):
        A = np.array([[0, 1], [-1 - 1.5 * y[0] ** 2, -0.2]])
        a = 6 * np.cos(w * t) - 0.2 * y[1] - y[0] - 0.5 * y[0] ** 3
        return np.r_[y[1], a, (A @ y[2:].reshape(2, 2)).ravel()]

    for point in broken:
        w = point.frequency / HZ
        found = duffing.solve_at(
            hz=point.frequency, guess=curve.unknowns[point.index], outputs={"x": 0}, harmonics=15
        )
        y = np.r_[state(found.harmonics, w), np.eye(2).ravel()]
        tight = {"rtol": 1e-11, "atol": 1e-12, "method": "DOP853"}
        half = solve_ivp(system, (0, np.pi / w), y, args=(w,), **tight).y[:, -1]
        assert half[:2] == pytest.approx(-y[:2], abs=1e-4)
        assert np.linalg.det(half[2:].reshape(2, 2) - np.eye(2)) == pytest.approx(0, abs=1e-4)
        assert point.within < 1e-6
        for branch in branch_from(curve, duffing.contact_problem, point):
            assert "from which it branches off" in branch.ended
            assert sorted(branch.frequency[[0, -1]]) == pytest.approx(
                [point.frequency for point in broken], rel=1e-6
            )
            assert not of_kind(branch.named_points, "fold")


def test_two_stops_that_face_each_other_are_alike():
    """Half a period later and with their places changed the motion is the same, until it is lost;
    the branch comes back where the symmetry does."""
    stop = {"kn": 15.0, "preload": -4.5}
    stops = Problem([[1.0]], [[0.1]], [[1.0]]).force(0, 1.5)
    for side in (1.0, -1.0):
        stops = stops.add(UnilateralSpring(), [side], **stop)
    curve = stops.follow_band(
        (0.79 * HZ, 1.6 * HZ), outputs={"x": 0}, harmonics=25, stability="all"
    )
    broken = of_kind(curve.named_points, "symmetry breaking")
    assert len(broken) == 2 and not of_kind(curve.named_points, "branch point")
    for branch in branch_from(curve, stops.contact_problem, broken[1]):
        ends = sorted(branch.frequency[[0, -1]])
        assert ends == pytest.approx(sorted(point.frequency for point in broken), rel=1e-5)
        assert np.abs(branch.harmonics[len(branch) // 2, 0, 0]) > 0.01


def test_a_branch_has_no_folds_but_its_own():
    """At its ends, on the curve that it leaves, it has tangents of both; and every named point is
    where it runs."""
    stopped = Problem([[1.0]], [[0.05]], [[1.0]]).add(UnilateralSpring(), 0, kn=5.0).force(0, 1.0)
    curve = stopped.follow_band((1.2 * HZ, 5 * HZ), outputs={"x": 0}, harmonics=25, stability="all")
    doublings = of_kind(curve.named_points, "period doubling")
    assert len(doublings) == 2
    for point in doublings:
        (branch,) = branch_from(curve, stopped.contact_problem, point)
        low, high = sorted(branch.frequency[[0, -1]])
        assert not of_kind(branch.named_points, "fold")
        assert all(low < named.frequency < high for named in branch.named_points)


def test_a_peak_at_the_root_of_a_branch():
    """Two masses and a stop: the branch is highest beside the point that it leaves."""
    M, C = np.diag([1.0, 0.6]), 0.04 * np.array([[2, -1], [-1, 1.5]])
    pair = Problem(M, C, np.array([[2, -1], [-1, 1.6]]))
    pair = pair.add(UnilateralSpring(), 1, kn=16.0, preload=-3.2).force(0, 0.8)
    curve = pair.follow_band(
        (1.05 * HZ, 1.12 * HZ), outputs={"x": 0, "y": 1}, harmonics=25, stability="all"
    )
    [point] = of_kind(curve.named_points, "period doubling")
    (branch,) = branch_from(curve, pair.contact_problem, point)
    assert branch.periods == 2 and len(branch) > 5


def test_a_range_between_two_points_is_not_stepped_over():
    """Where a stop is left, multipliers leave the unit circle and come back before the next point:
    doublings at 2.0373 and 2.0823 rad/s (both to 1e-4 by an integration with shooting)."""
    stops = Problem([[1.0]], [[0.05]], [[1.0]]).force(0, 1.0).force(0, 0.2j, harmonic=2)
    stops = stops.add(UnilateralSpring(), 0, kn=30.0, preload=-9.0)
    stops = stops.add(UnilateralSpring(), [-1.0], kn=8.0, preload=-4.0)
    curve = stops.follow_band((1.9 * HZ, 4 * HZ), outputs={"x": 0}, harmonics=45, stability="all")
    doublings = [p.frequency / HZ for p in of_kind(curve.named_points, "period doubling")]
    assert doublings == pytest.approx([2.0373, 2.0823], abs=1e-4)
    # beside a fold the parting of a stop is where it was with other steps (1.9684814 by shooting)
    parted = [p.frequency / HZ for p in of_kind(curve.named_points, "separation")]
    assert parted == pytest.approx([1.9684814, 2.0823163], abs=2e-6)
