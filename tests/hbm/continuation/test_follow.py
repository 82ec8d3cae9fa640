"""The continuation by itself, on equations that have nothing to do with vibration."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.continuation.equations import Dense, s_curve, start_at
from tipdamp.hbm.continuation.branch import COMPLETE, ENDS, Branch, BranchTracer
from tipdamp.hbm.continuation.corrector import between, correct
from tipdamp.hbm.continuation.follow import follow
from tipdamp.hbm.continuation.point import Metric, Plane
from tipdamp.hbm.continuation.settings import DEFAULT, Settings


def test_folds_are_followed():
    branch = follow(s_curve, start_at(s_curve, -2.5, -8.0), 8.0, np.ones(1))
    x = np.array([b.x[0] for b in branch.points])
    p = np.array([b.parameter for b in branch.points])
    assert branch.complete and p[-1] == 8.0 and (np.diff(x) > 0).all()
    assert p[x < 0].max() == pytest.approx(2, abs=3e-2) and p[
        (x > 0) & (x < 1.5)
    ].min() == pytest.approx(-2, abs=3e-2)
    assert branch.calls < 5 * len(branch.points)


def test_a_corner_that_folds_is_turned():
    """The branch must come back behind the corner: not stop, and not run back on itself."""

    def corner(x, p):
        return Dense(
            np.array([x[0] - p + 3 * max(0.0, -x[0] + 1) * (x[0] < 1)]),
            np.array([[1.0 - 3.0 * (x[0] < 1)]]),
            np.array([-1.0]),
        )

    # x < 1: -2 x + 3 = p, falling; x > 1: x = p, rising: a fold with a corner at x = 1, p = 1
    branch = follow(corner, start_at(corner, -1.0, 5.0), 0.0, np.ones(1), Settings(max_points=200))
    x = np.array([b.x[0] for b in branch.points])
    assert x.max() > 3 and (np.diff(x) > 0).all() and "turned back" in branch.ended


def test_gap_is_marked_and_bridged():
    """No solution between p = 5 and 7: failed points stay in the branch, and it goes on behind the
    gap."""

    def gap(x, p):
        d = x[0] - p
        if 5 < p < 7:
            return Dense(np.array([1 + d * d]), np.array([[2 * d + 1e-9]]), np.array([-2 * d]))
        return Dense(np.array([d]), np.eye(1), np.array([-1.0]))

    branch = follow(gap, start_at(gap, 0.0, 0.0), 20.0, np.ones(1))
    assert not all(b.converged for b in branch.points) and branch.points[
        -1
    ].parameter == pytest.approx(20)


def test_a_jump_to_another_branch_is_refused():
    """Two parallel lines: from one, no converged point of the other may be taken."""

    def lines(x, p):
        a, b = x[0] - p, x[0] - p - 0.3
        return Dense(np.array([a * b]), np.array([[a + b]]), np.array([-(a + b)]))

    branch = follow(lines, start_at(lines, 5.0, 5.0), 10.0, np.ones(1))
    assert branch.complete and np.allclose(
        [b.x[0] - b.parameter for b in branch.points], 0, atol=1e-6
    )


def test_of_points_behind_nothing_large_is_kept():
    held = set()

    class Large(Dense):
        """What it factorises it holds."""

        def _solve(self, row, corner, right):
            held.add(id(self))
            return super()._solve(row, corner, right)

        def forget(self):
            held.discard(id(self))

    def evaluate(x, p):
        return Large(x**3 - 3 * x - p, np.diag(3 * x**2 - 3), np.array([-1.0]))

    branch = follow(evaluate, start_at(evaluate, -2.5, -8.0), 8.0, np.ones(1))
    assert branch.complete and len(branch.points) > 15
    assert id(branch.points[-1].detail) in held
    assert not held & {id(point.detail) for point in branch.points[:-1]}


def endless(x, p):
    """From p = 5 on the branch x = p goes to and fro for ever; the branch x = -p leads on."""
    a, slope = (
        (x[0], 1.0) if x[0] < 5 else (5 + 0.2 * np.sin(5 * (x[0] - 5)), np.cos(5 * (x[0] - 5)))
    )
    b = x[0] + p
    return Dense(np.array([(a - p) * b]), np.array([[slope * b + a - p]]), np.array([a - p - b]))


def test_endless_folds_are_left_by_a_named_restart():
    branch = follow(
        endless,
        start_at(endless, 1.0, 1.0),
        10.0,
        np.ones(1),
        Settings(patience=50),
        restart=lambda p: start_at(endless, -p, p),
    )
    assert (
        branch.complete
        and branch.restarts[-1][0] == pytest.approx(5.2, abs=0.02)
        and branch.restarts[-1][1] < 5.5
    )
    assert all(b.converged for b in branch.points) and branch.points[-1].x[0] == pytest.approx(-10)


def test_points_of_a_restart_lie_in_growing_steps():
    """Towards the folds at p = 5.2, beyond which nothing lies; no step is left out."""

    def folds(x, p):
        a, slope = 5 + 0.2 * np.sin(5 * (x[0] - 5)), np.cos(5 * (x[0] - 5))
        if x[0] < 5:
            a, slope = x[0], 1.0
        other = x[0] - 4
        return Dense(np.array([(a - p) * other]), np.array([[slope * other + a - p]]), -x + 4)

    branch = follow(folds, start_at(folds, 1.0, 1.0), 10.0, np.ones(1), Settings(patience=50))
    begin, to = branch.restarts[0]
    jumps = [b.parameter for b in branch.points if b.jump and b.parameter <= to]
    steps = np.diff([begin, *jumps])
    assert len(steps) > 1 and jumps[-1] == to
    assert steps[0] <= 1e-3 * 9 and (steps[1:] <= 1.5 * steps[:-1] * (1 + 1e-9)).all()


@pytest.mark.filterwarnings("ignore:invalid value encountered in det")
def test_steps_that_are_no_number_are_not_evaluated():
    def broken(x, p):
        assert np.isfinite(p) and np.isfinite(x).all()
        return Dense(
            np.array([x[0] ** 3 - p]),
            np.array([[3 * x[0] ** 2 if p < 3 else np.nan]]),
            np.array([-1.0]),
        )

    branch = follow(broken, start_at(broken, 1.0, 1.0), 10.0, np.ones(1))
    assert not branch.complete and "no further point" in branch.ended


def test_between_lies_on_the_branch():
    branch = follow(s_curve, start_at(s_curve, -2.5, -8.0), 8.0, np.ones(1))
    a, b = branch.points[4:6]
    point = between(s_curve, a, b, 0.5, np.ones(1))
    assert point.converged and a.x < point.x < b.x
    assert point.x[0] ** 3 - 3 * point.x[0] == pytest.approx(point.parameter, abs=1e-8)


def test_a_long_last_step_is_evaluated_again():
    """Newton contracts fast, 1e-2 to 1e-5, then steps by 1e-3 over a kink behind which the slope is
    10: root 1.0105005.

    Taken on trust, that step would leave a residual of 5e-3.
    """

    def kinked(x, p):
        pieces = [
            (x[0] - 1.01, 1.0),
            (1e-2 * (x[0] - 1.0105) - 5e-6, 1e-2),
            (10 * (x[0] - 1.0105) - 5e-6, 10.0),
        ]
        f, slope = pieces[int(x[0] > 1.009) + int(x[0] > 1.0105)]
        return Dense(np.array([f]), np.array([[slope]]), np.zeros(1))

    metric = Metric(np.ones(1), 1.0, 1.0)
    point = correct(kinked, Plane(np.ones(1), 0.0, np.zeros(1), 1.0), metric, DEFAULT)
    assert point.converged and abs(kinked(point.x, 0.0).residual[0]) < 1e-9


def test_branch_is_cut_at_the_border():
    """The S curve from its left arm at p = 0.6: out on the middle arm, round the fold at -2, in on
    the right."""
    branch = follow(s_curve, start_at(s_curve, -1.6, 0.6), 8.0, np.ones(1), Settings(outside=10.0))
    p, x = (
        np.array([getattr(b, name) for b in branch.points]).ravel() for name in ("parameter", "x")
    )
    assert branch.complete and (p >= 0.6).all() and branch.outside == pytest.approx(-2, abs=0.05)
    # roots of x^3 - 3 x = 0.6
    assert np.allclose(x[p == 0.6], [-1.6217355, -0.2027794, 1.8245149], atol=1e-6)


def test_a_closed_branch_is_named():
    """The circle x^2 + (p - 1.5)^2 = 1 from p = 1.2: it leaves the band, comes round and begins
    again."""

    def circle(x, p):
        return Dense(
            np.array([x[0] ** 2 + (p - 1.5) ** 2 - 1]),
            np.array([[2 * x[0]]]),
            np.array([2 * p - 3.0]),
        )

    branch = follow(
        circle, start_at(circle, 0.9, 1.2), 4.0, np.ones(1), Settings(max_points=400, outside=1.0)
    )
    assert not branch.complete and "closed" in branch.ended


@pytest.mark.parametrize("end", sorted(set(ENDS) - {"static", *COMPLETE}))
def test_every_end_names_a_remedy(end):
    """One sentence: what happened, where, and after the last semicolon or colon what to do about
    it."""
    branch = Branch()
    branch.finish(end, 3.25)
    what, remedy = (
        branch.ended.rsplit(";", 1) if ";" in branch.ended else branch.ended.rsplit(":", 1)
    )
    assert "3.25" in what and "\n" not in branch.ended and len(remedy.split()) >= 5
    assert any(word in remedy for word in ("direction", "damping", "harmonics", "stiffness"))


def test_points_that_the_branch_does_not_lead_to_are_marked():
    """Where endless folds were left, and nowhere else."""
    branch = follow(
        endless,
        start_at(endless, 1.0, 1.0),
        10.0,
        np.ones(1),
        Settings(patience=50),
        restart=lambda p: start_at(endless, -p, p),
    )
    x = np.array([b.x[0] for b in branch.points])
    jumps = np.flatnonzero([b.jump for b in branch.points])
    assert (
        len(jumps)
        and (np.diff(jumps) == 1).all()
        and (x[: jumps[0]] > 0).all()
        and (x[jumps[-1] :] < 0).all()
    )


def test_the_way_back_into_the_band_is_marked():
    """From p = -1 over both folds: below -1 the branch is left out, it comes back where x^3 - 3 x =
    -1 for the third time."""
    branch = follow(s_curve, start_at(s_curve, -1.9, -1.0), 8.0, np.ones(1), Settings(outside=5.0))
    jumps = [b for b in branch.points if b.jump]
    assert branch.complete and len(jumps) == 1 and jumps[0].parameter == -1.0
    assert jumps[0].x[0] == pytest.approx(2 * np.cos(2 * np.pi / 9))


def test_a_step_beyond_a_kink_does_not_lead_back():
    """Onto the line that was followed: not; ahead, and beside it on another line: yes."""

    def line(x, p):
        return Dense(np.array([x[0] - p]), np.eye(1), np.array([-1.0]))

    tracer = BranchTracer(line, start_at(line, 1.0, 1.0), 10.0, np.ones(1), DEFAULT, None)
    while len(tracer.branch.points) < 8:
        tracer.accept(tracer.next_point(), None)
    last, metric = tracer.run[-1], tracer.metric()

    def retraces(dx, dp):
        found = start_at(line, last.x[0] + dx, last.parameter + dx)
        found = replace(found, parameter=last.parameter + dp)
        length = metric.norm(found.x - last.x, dp)
        return tracer._retraces(found, length, metric)

    assert retraces(-0.02, -0.02) and not retraces(0.02, 0.02) and not retraces(-0.02, 0.02)


def test_a_branch_lost_on_its_way_back_does_not_run_home():
    """Behind the first fold of the S the branch ends at a step: ahead of there lies what was just
    followed, and beyond the fold the upper part."""

    def broken(x, p):
        whole = s_curve(x, p)
        lifted = 5.0 * ((x > 0.2) & (x < 1.2))
        return Dense(whole.residual + lifted, whole.J, whole.by_parameter)

    branch = follow(broken, start_at(broken, -2.5, -8.0), 8.0, np.ones(1))
    p = np.array([b.parameter for b in branch.points if b.converged])
    x = np.array([b.x[0] for b in branch.points if b.converged])
    assert branch.complete and p[-1] == 8.0 and 0 < len(branch.restarts) <= DEFAULT.max_gaps
    left, taken_up = branch.restarts[-1]
    assert left == pytest.approx(2, abs=0.1) and taken_up > left
    assert p[x > -1].min() > -1  # nowhere back down to the start
