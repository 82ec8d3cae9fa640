"""The continuation by itself, on equations that have nothing to do with vibration; then in level, preload and mu."""

from dataclasses import replace

import numpy as np
import pytest

from hbm.balance.residual import HarmonicBalance
from hbm.continuation.corrector import between, correct, solve_fixed
from hbm.continuation.follow import follow
from hbm.continuation.point import Metric, Plane
from hbm.continuation.settings import DEFAULT, Settings
from hbm.errors import InputError
from hbm.response import follow_band, follow_parameter
from hbm.starts import first_point
from tests.hbm.cases import beam, rig, solve


class Dense:
    """What `evaluate` must return, for small equations."""

    def __init__(self, residual, J, by_parameter):
        self.residual, self.J, self.by_parameter = residual, J, by_parameter

    def _solve(self, row, corner, right):
        A = np.block([[self.J, self.by_parameter[:, None]], [row[None], np.array([[corner]])]])
        y = np.linalg.solve(A, right)
        return y[:-1], y[-1], np.sign(np.linalg.det(A))

    def solve(self, row, corner, value, residual=None):
        return self._solve(row, corner, np.r_[-(self.residual if residual is None else residual), value])[:2]

    def moved(self, dx, dp):
        return self

    def restoring(self, away):
        return 0 * away

    def direction(self, row, corner):
        return self._solve(row, corner, np.r_[0 * self.residual, 1.0])


def s_curve(x, p):
    """x^3 - 3 x = p: folds at p = 2, x = -1 and p = -2, x = 1."""
    return Dense(x**3 - 3 * x - p, np.diag(3 * x**2 - 3), np.array([-1.0]))


def start_at(evaluate, x, p):
    point = solve_fixed(evaluate, np.array([x]), p, np.ones(1))
    assert point.converged
    return point


def test_folds_are_followed():
    branch = follow(s_curve, start_at(s_curve, -2.5, -8.0), 8.0, np.ones(1))
    x, p = np.array([b.x[0] for b in branch.points]), np.array([b.parameter for b in branch.points])
    assert branch.complete and p[-1] == 8.0 and (np.diff(x) > 0).all()
    assert p[x < 0].max() == pytest.approx(2, abs=3e-2) and p[(x > 0) & (x < 1.5)].min() == pytest.approx(-2, abs=3e-2)
    assert branch.calls < 5 * len(branch.points)


def test_a_corner_that_folds_is_turned():
    """The branch must come back behind the corner: not stop, and not run back on itself."""
    def corner(x, p):
        return Dense(np.array([x[0] - p + 3 * max(0.0, -x[0] + 1) * (x[0] < 1)]),
                     np.array([[1.0 - 3.0 * (x[0] < 1)]]), np.array([-1.0]))
    # x < 1: -2 x + 3 = p, falling; x > 1: x = p, rising: a fold with a corner at x = 1, p = 1
    branch = follow(corner, start_at(corner, -1.0, 5.0), 0.0, np.ones(1),
                                 Settings(max_points=200))
    x = np.array([b.x[0] for b in branch.points])
    assert x.max() > 3 and (np.diff(x) > 0).all() and "turned back" in branch.ended


def test_a_branch_that_ends_is_marked_and_left():
    """No solution between p = 5 and 7: failed points stay in the branch, and it goes on behind the gap."""
    def gap(x, p):
        d = x[0] - p
        if 5 < p < 7:
            return Dense(np.array([1 + d * d]), np.array([[2 * d + 1e-9]]), np.array([-2 * d]))
        return Dense(np.array([d]), np.eye(1), np.array([-1.0]))
    branch = follow(gap, start_at(gap, 0.0, 0.0), 20.0, np.ones(1))
    assert not all(b.converged for b in branch.points) and branch.points[-1].parameter == pytest.approx(20)


def test_a_jump_to_another_branch_is_refused():
    """Two parallel lines: from one, no converged point of the other may be taken."""
    def lines(x, p):
        a, b = x[0] - p, x[0] - p - 0.3
        return Dense(np.array([a * b]), np.array([[a + b]]), np.array([-(a + b)]))
    branch = follow(lines, start_at(lines, 5.0, 5.0), 10.0, np.ones(1))
    assert branch.complete and np.allclose([b.x[0] - b.parameter for b in branch.points], 0, atol=1e-6)


def test_a_branch_that_folds_on_and_on_is_left_by_a_named_leap():
    """From p = 5 on the branch x = p goes to and fro for ever; the branch x = -p leads on."""
    def endless(x, p):
        a, slope = (x[0], 1.0) if x[0] < 5 else (5 + 0.2 * np.sin(5 * (x[0] - 5)), np.cos(5 * (x[0] - 5)))
        b = x[0] + p
        return Dense(np.array([(a - p) * b]), np.array([[slope * b + a - p]]), np.array([a - p - b]))
    branch = follow(endless, start_at(endless, 1.0, 1.0), 10.0, np.ones(1),
                                 Settings(patience=50), restart=lambda p: start_at(endless, -p, p))
    assert branch.complete and branch.restarts[-1][0] == pytest.approx(5.2, abs=0.02) and branch.restarts[-1][1] < 5.5
    assert all(b.converged for b in branch.points) and branch.points[-1].x[0] == pytest.approx(-10)


@pytest.mark.filterwarnings("ignore:invalid value encountered in det")
def test_nothing_is_evaluated_where_a_step_is_not_a_number():
    def broken(x, p):
        assert np.isfinite(p) and np.isfinite(x).all()
        return Dense(np.array([x[0]**3 - p]), np.array([[3 * x[0]**2 if p < 3 else np.nan]]), np.array([-1.0]))
    branch = follow(broken, start_at(broken, 1.0, 1.0), 10.0, np.ones(1))
    assert not branch.complete and "no further point" in branch.ended


def test_between_lies_on_the_branch():
    branch = follow(s_curve, start_at(s_curve, -2.5, -8.0), 8.0, np.ones(1))
    a, b = branch.points[4:6]
    point = between(s_curve, a, b, 0.5, np.ones(1))
    assert point.converged and a.x < point.x < b.x
    assert point.x[0] ** 3 - 3 * point.x[0] == pytest.approx(point.parameter, abs=1e-8)


@pytest.mark.parametrize("name,between", [("level", (1.0, 40.0)), ("preload", (3.0, 1.0)), ("mu", (3.0, 1.0)),
                                          ("kn", (0.3, 1.0)), ("kt", (3.0, 1.0))])
def test_level_preload_and_friction_end_where_the_frequency_curve_is(name, between):
    """C8 at 932.1 Hz, H = 3: the branch ends at the state of 40 N with the preload and mu of the model."""
    problem, force, outputs = beam("C8")
    expected = np.abs(outputs["tip"] @ solve(problem, 40 * force, 2 * np.pi * 932.1, 3)[0][:, 1])
    curve = follow_parameter(problem, force if name == "level" else 40 * force, 932.1, name, between, harmonics=3,
                             outputs=outputs)
    assert curve.complete and curve.parameter[-1] == pytest.approx(between[1])
    assert abs(curve.harmonics[-1, 0, 1]) == pytest.approx(expected, rel=1e-6)
    assert (curve.frequency == 932.1).all() and curve.parameter_name == name


@pytest.mark.parametrize("name", ["kn", "kt"])
def test_a_branch_over_a_contact_stiffness_leads_to_the_model_with_that_stiffness(name):
    """From 1 to 2: the end is the solution of the model whose springs are twice as stiff."""
    problem, force, outputs = beam("C8")
    curve = follow_parameter(problem, 40 * force, 932.1, name, (1.0, 2.0), harmonics=3, outputs=outputs)
    other = replace(problem, pairs=replace(problem.pairs, **{name: 2 * getattr(problem.pairs, name)}))
    expected = outputs["tip"] @ solve(other, 40 * force, 2 * np.pi * 932.1, 3)[0]
    assert curve.complete and np.abs(curve.harmonics[-1, 0] - expected).max() < 1e-8 * np.abs(expected).max()


def test_unknown_parameter():
    problem, force, outputs = beam("B8")
    with pytest.raises(InputError, match="level"):
        follow_parameter(problem, force, 900.0, "levels", (1, 2), outputs=outputs)


@pytest.mark.parametrize("case,level,H", [("B8", 20, 7), ("C8", 40, 7), ("C8", 200, 3)])
def test_points_whose_last_step_was_not_evaluated_again_solve_the_equations(case, level, H):
    """Every accepted point, its outputs and its forces, put back into the residual."""
    problem, force, outputs = beam(case)
    balance = HarmonicBalance(problem, {1: level * force}, H)
    begin = first_point(balance, 2 * np.pi * 700, Settings())
    branch = follow(balance.evaluate, begin, 2 * np.pi * 1200, balance.weights)
    linearised = 0
    for point in branch.points:
        again = balance.evaluate(point.x, point.parameter)
        size = np.linalg.norm(balance.weights * point.x)
        assert np.linalg.norm(again.residual) < 1e-9 * size
        assert np.abs(again.modal - point.detail.modal).max() < 1e-9 * np.abs(again.modal).max()
        assert np.abs(again.forces.g - point.detail.forces.g).max() <= 1e-8 * np.abs(again.forces.g).max()
        linearised += point.detail.x is not point.x and np.linalg.norm(point.detail.residual) > 1e-10 * size
    assert branch.complete and linearised > 0.5 * len(branch.points)


def test_a_long_last_step_is_evaluated_again():
    """Newton contracts fast, 1e-2 to 1e-5, then steps by 1e-3 over a kink behind which the slope is 10: root 1.0105005.

    Taken on trust, that step would leave a residual of 5e-3.
    """
    def kinked(x, p):
        pieces = [(x[0] - 1.01, 1.0), (1e-2 * (x[0] - 1.0105) - 5e-6, 1e-2), (10 * (x[0] - 1.0105) - 5e-6, 10.0)]
        f, slope = pieces[int(x[0] > 1.009) + int(x[0] > 1.0105)]
        return Dense(np.array([f]), np.array([[slope]]), np.zeros(1))

    metric = Metric(np.ones(1), 1.0, 1.0)
    point = correct(kinked, Plane(np.ones(1), 0.0, np.zeros(1), 1.0), metric, DEFAULT)
    assert point.converged and abs(kinked(point.x, 0.0).residual[0]) < 1e-9


def test_residual_calls_and_points_of_the_rig():
    """The rig's 18 pairs at H = 5 and 20 N: the figures that are promised."""
    problem, force, outputs = rig()
    curve = follow_band(problem, 20 * force, (2300, 3300), harmonics=5, outputs=outputs)
    assert curve.complete and curve.residual_calls <= 3 * len(curve.frequency) and len(curve.frequency) <= 300


@pytest.mark.slow
@pytest.mark.parametrize("H", [1, 3])
def test_the_damper_of_the_rig_rolls_at_40_newton_where_nothing_resists(H):
    """With the flat's roll stiffness the curve is complete; without it it ends in words: the damper lies along y."""
    problem, force, outputs = rig(roll=True)
    held = follow_band(problem, 40 * force, (2300, 3300), harmonics=H, outputs=outputs)
    assert held.complete and held.converged.all() and "rolls" not in held.ended
    problem, force, outputs = rig(roll=False)
    free = follow_band(problem, 40 * force, (2300, 3300), harmonics=H, outputs=outputs)
    assert not free.complete and len(free.frequency) < 300
    assert "the damper rolls (body 'damper' rotates about (0.00, 1.00, 0.00))" in free.ended
    assert "no periodic state exists there" in free.ended
