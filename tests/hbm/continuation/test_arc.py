"""Maxima and crossings between two points of a branch, on curves in closed form."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.corrector import heading
from tipdamp.hbm.continuation.point import Metric, Point
from tipdamp.hbm.continuation.settings import DEFAULT


@dataclass(frozen=True)
class Implicit:
    """R(x, p) = 0 with one unknown, and its derivatives."""

    value: float
    by_x: float
    by_p: float

    @property
    def residual(self):
        return np.array([self.value])

    def solve(self, row, corner, value, residual=None):
        R = self.residual if residual is None else residual
        dx, dp = np.linalg.solve([[self.by_x, self.by_p], [row[0], corner]], [-R[0], value])
        return np.array([dx]), dp

    def direction(self, row, corner):
        matrix = np.array([[self.by_x, self.by_p], [row[0], corner]])
        tx, tp = np.linalg.solve(matrix, [0.0, 1.0])
        return np.array([tx]), tp, np.sign(np.linalg.det(matrix))

    def restoring(self, away):
        return np.zeros(1)

    def moved(self, dx, dp):
        return self

    def forget(self):
        pass


def parabola(sharpness):
    """p = 1 - (x - 1)^2 / sharpness: a fold at x = 1, p = 1, the sharper the larger the number."""

    def evaluate(x, p):
        return Implicit(p - 1 + (x[0] - 1) ** 2 / sharpness, 2 * (x[0] - 1) / sharpness, 1.0)

    def point(x, way):
        p = 1 - (x - 1) ** 2 / sharpness
        return heading(Point(np.array([x]), p, True, 1, evaluate(np.array([x]), p)), way)

    return evaluate, point


METRIC = Metric(np.ones(1), 1.0, 0.01)


@pytest.mark.parametrize("sharpness", [0.1, 1.0, 1e2, 1e4])
def test_maximum_of_the_parameter_is_the_fold(sharpness):
    evaluate, point = parabola(sharpness)

    def measure(q):
        return arc.MeasuredPoint(q, q.parameter, q.tangent[1] / METRIC.norm(*q.tangent))

    ends = point(0.8, 1), point(1.3, -1)
    found = arc.maximum(evaluate, tuple(map(measure, ends)), measure, METRIC, DEFAULT)
    assert found.solved
    assert found.best.value == pytest.approx(1.0, rel=1e-10)
    assert [q.x[0] for q in found.points] == sorted(q.x[0] for q in found.points)


def test_kinked_maximum_is_found_by_its_two_tangents():
    """x = 1 - |p| has no derivative at its maximum: a handful of points must do."""

    def evaluate(x, p):
        return Implicit(x[0] - 1 + abs(p), 1.0, 1.0 if p >= 0 else -1.0)

    def measure(q):
        return arc.MeasuredPoint(q, q.x[0], q.tangent[0][0] / METRIC.norm(*q.tangent))

    ends = [
        heading(Point(np.array([1 - abs(p)]), p, True, 1, evaluate(np.array([1 - abs(p)]), p)), 1)
        for p in (-0.3, 0.7)
    ]
    found = arc.maximum(evaluate, tuple(map(measure, ends)), measure, METRIC, DEFAULT)
    assert found.solved and len(found.points) < 15
    assert found.best.value == pytest.approx(1.0, rel=1e-10)


def straight(x, p):
    """x = p."""
    return Implicit(x[0] - p, 1.0, -1.0)


def by_value(height, at):
    """Maximum of a height over x = p around the middle one of three points."""

    def measure(q):
        return arc.MeasuredPoint(q, height(q.parameter), np.nan)

    def point(p):
        return heading(Point(np.array([p]), p, True, 1, straight(np.array([p]), p)), 1)

    three = [measure(point(p)) for p in at]
    return arc.maximum_by_value(straight, three, measure, METRIC, DEFAULT)


@pytest.mark.parametrize(
    "height", [lambda p: 1 - (p - 0.1) ** 2, lambda p: 1 - abs(p - 0.1)], ids=["smooth", "kink"]
)
def test_maximum_by_values_alone(height):
    found = by_value(height, (-1.0, 0.0, 1.3))
    assert found.solved and found.best.value == pytest.approx(1.0, rel=2e-9)


def test_a_point_on_a_step_is_no_maximum():
    """One that is higher than all beside it, however near they are, is left after some halvings;
    where the step is that of the curve, its upper side is the highest."""
    found = by_value(lambda p: 1.0 if p == 0 else 1 - 1e-7 - 1e-9 * abs(p), (-1.0, 0.0, 1.3))
    assert not found.solved and found.best.point.parameter == 0 and len(found.points) < 15


@pytest.mark.parametrize("short", [1e-1, 1e-2, 1e-4])
@pytest.mark.parametrize("beyond", [-1e-3, 0.5])
@pytest.mark.parametrize("tangents", [True, False])
def test_crossing_is_on_the_sheet_between_its_points(short, beyond, tangents):
    """Next to a fold Newton at a fixed parameter finds either sheet: the tangent at the solution
    tells them apart."""
    evaluate, point = parabola(1.0)
    ends = point(0.2, 1), point(1 + beyond * short, 1 if beyond < 0 else -1)
    if not tangents:
        ends = tuple(replace(end, tangent=None) for end in ends)
    found, _ = arc.crossing(evaluate, *ends, 1 - short**2, METRIC, DEFAULT)
    assert found.converged and found.x[0] == pytest.approx(1 - short, abs=1e-2 * short)
