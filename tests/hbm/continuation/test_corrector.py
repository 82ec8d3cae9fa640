"""Points between two of a branch where a motion is all but undetermined."""

import numpy as np
import pytest

from tests.hbm.cases import jenkins
from tests.hbm.continuation.equations import Dense
from tipdamp.hbm.continuation.arc import metric_at
from tipdamp.hbm.continuation.corrector import between, polished
from tipdamp.hbm.continuation.crossings import with_tangent
from tipdamp.hbm.continuation.point import Metric, Plane, Point
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.response import follow_band

# of the points, at most: 16 % where a step that is not small ends the search, none else
LOST = 0.01


def test_a_point_between_two_whose_residual_is_rounding():
    """A contact a million times as stiff as the spring behind it: Newton's steps at rounding move
    the mean of what slides by more than a small step, and the points stand all the same."""
    problem, force = jenkins(dict(m=1.0, k=1.0, c=0.005, kt=1e6, slip_limit_muN=1.0, F=1.4))
    curve = follow_band(problem, force, (0.161, 0.157), harmonics=5, outputs={"x": [1.0]})
    assert curve.complete
    equation, points = restored(curve, problem)
    metric = metric_at(points[len(points) // 2], equation.weights)
    points = [with_tangent(equation.evaluate, points, i, metric) for i in range(len(points))]
    found = [
        between(equation.evaluate, a, b, share, equation.weights)
        for a, b in zip(points[:-1], points[1:], strict=True)
        for share in (0.1, 0.5, 0.9)
    ]
    solved = [point for point in found if point.converged]
    assert len(solved) >= (1 - LOST) * len(found) and all(
        np.isfinite(point.x).all() for point in solved
    )
    for point in solved:
        again = equation.evaluate(point.x, point.parameter)
        assert np.linalg.norm(again.residual) <= DEFAULT.patient_residual * np.linalg.norm(point.x)


@pytest.mark.parametrize("nearly", range(DEFAULT.max_polish + 1))
def test_steps_that_are_not_yet_small_are_taken_while_they_may_be(nearly):
    """Each a hundredth of the one before, and 4 times what is small after so many: one more makes
    it small; behind the last the safety still lets it pass, and then the point does not stand."""
    share, last = 0.01, DEFAULT.max_polish - 1

    def slow(x, p):
        return Dense(x, np.eye(1) / (1 - share), np.zeros(1))

    x = np.array([4 * DEFAULT.peak_step * share**-nearly / (1 - share)])
    plane = Plane(np.zeros(1), 0.0, np.zeros(1), 1.0)
    found = polished(
        slow, Point(x, 0.0, True, 1, slow(x, 0.0)), plane, Metric(np.ones(1), 1.0, 1.0), DEFAULT
    )
    assert found.converged == (nearly <= last)
    steps = nearly + 2 if nearly < last else DEFAULT.max_polish
    assert found.x == pytest.approx(x * share**steps, rel=1e-6)
    assert found.iterations == 1 + steps - found.converged


def test_the_plane_through_a_point_is_normal_to_its_direction():
    """In the metric, whose unknowns count unequally: the length belongs to the inner product, and
    a step in the plane is at right angles to its normal, which is of unit length."""
    rng = np.random.default_rng(0)
    metric = Metric(np.r_[0.01, rng.uniform(0.5, 2.0, 4)], 3.0, 0.7)
    normal, step = ((rng.normal(size=5), rng.normal()) for _ in range(2))
    assert metric.norm(*step) ** 2 == pytest.approx(metric.inner(*step, *step), rel=1e-12)
    row, corner = metric.border(*normal)
    along = metric.inner(*normal, *step) / metric.norm(*normal)
    assert row @ step[0] + corner * step[1] == pytest.approx(along, rel=1e-12)
    plane = metric.plane(np.ones(5), 2.0, *normal)
    share = (plane.row @ step[0] + plane.corner * step[1]) / metric.norm(*normal)
    inside = step[0] - share * normal[0], step[1] - share * normal[1]
    assert metric.inner(*normal, *inside) == pytest.approx(0.0, abs=1e-12)
