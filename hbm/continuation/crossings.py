"""Solved points wherever a branch crosses a value of its parameter."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import between, oriented
from tipdamp.hbm.continuation.point import Evaluate, Metric, Point
from tipdamp.hbm.continuation.settings import Settings

# sum of the slopes at two points, by that of their chord: the cubic through them all but turns back
STEEP = 3.0
# of the distance between two points: how far beyond them the tip of their fold is looked for
TIP = 3.0


def crossings(
    evaluate: Evaluate,
    points: Sequence[Point],
    parameter: float,
    weights: np.ndarray,
    settings: Settings,
) -> list[tuple[Point, int, int]]:
    """[(point, residual calls, index of the point behind it)] of every crossing of the parameter
    between two points.

    Where the branch turns back short of the parameter though the tip of the fold may reach it, the
    tip is solved first."""
    found, points = [], list(points)
    for i in range(len(points) - 1):
        ends = points[i : i + 2]
        if not all(end.converged for end in ends):
            continue
        sides = [np.sign(end.parameter - parameter) for end in ends]
        apart = sides[0] != sides[1]
        turns = not apart and _turns(points, i, parameter)
        if 0 in sides or not (apart or turns or _near(ends, parameter)):
            continue
        metric, calls = arc.metric_at(points[i], weights), 0
        for k in (i, i + 1):
            points[k] = with_tangent(evaluate, points, k, metric)
        way = points[i : i + 2]
        if turns:
            way, calls = _tip(evaluate, way[0], way[1], parameter, metric, settings)
        elif not points[i + 1].jump:
            way, calls = _unfolded(evaluate, way, parameter, metric, settings)
        for a, b in pairwise(way):
            if (a.parameter - parameter) * (b.parameter - parameter) < 0:
                point, more = arc.crossing(evaluate, a, b, parameter, metric, settings)
                found.append((point, calls + more, i + 1))
                calls = 0
    return found


def _near(ends: Sequence[Point], parameter: float) -> bool:
    """Whether a loop between two points that do not enclose the parameter might reach it."""
    low, high = sorted(end.parameter for end in ends)
    return low - (high - low) < parameter < high + (high - low)


def _unfolded(
    evaluate: Evaluate, way: Sequence[Point], parameter: float, metric: Metric, settings: Settings
) -> tuple[list[Point], int]:
    """(points from the first to the last of `way`, residual calls), between which the branch
    crosses once at most.

    Where a loop of the branch may lie between two points the one half way is solved.
    """
    calls, done, left = 0, [way[0]], [(way[1], settings.max_loops)]
    while left:
        a, (b, most) = done[-1], left[-1]
        if most and _near((a, b), parameter) and may_fold(a, b, metric):
            middle = between(evaluate, a, b, 0.5, metric.weights, settings)
            calls += middle.iterations
            if arc.lies_between(middle, a, b, metric):
                left[-1:] = [(b, most - 1), (middle, most - 1)]
                continue
        done.append(b)
        left.pop()
    return done, calls


def may_fold(a: Point, b: Point, metric: Metric) -> bool:
    """Whether a loop may lie between two points of a branch: their tangents are steep beside the
    chord, or against."""
    chord = b.parameter - a.parameter
    slopes = [np.sign(chord) * end.tangent[1] / metric.norm(*end.tangent) for end in (a, b)]
    return min(slopes) < 0 or sum(slopes) * arc.distance(a, b, metric) > STEEP * abs(chord)


def insert_crossings(
    evaluate: Evaluate, branch: Branch, at: np.ndarray, weights: np.ndarray, settings: Settings
) -> list[float]:
    """Insert a solved point wherever the branch crosses one of the parameters `at`; those where one
    is not solved."""
    missed = []
    for parameter in at:
        for point, calls, place in reversed(
            crossings(evaluate, branch.points, parameter, weights, settings)
        ):
            branch.calls += calls
            if point.converged:
                branch.points.insert(place, point)
            else:
                missed.append(float(parameter))
    return missed


def with_tangent(evaluate: Evaluate, points: Sequence[Point], k: int, metric: Metric) -> Point:
    """Point k of a branch with its tangent, found anew from its orientation where it is not
    known.

    At an end on another branch the determinant is rounding: there the chord tells the way. A point
    with neither of its neighbours has no chord.
    """
    point = points[k]
    if point.tangent is not None:
        return point
    a, b = points[max(k - 1, 0)], points[min(k + 1, len(points) - 1)]
    a, b = (q if q.converged else point for q in (a, b))
    chord = b.x - a.x, b.parameter - a.parameter if a is not b else 1.0
    row, corner = metric.border(*chord)
    found = oriented(
        replace(point, detail=evaluate(point.x, point.parameter)), point.orientation, row, corner
    )
    (tx, tp), at_end = found.tangent, (a is point) != (b is point)
    if at_end and metric.inner(tx, tp, *chord) < 0:
        return replace(found, tangent=(-tx, -tp))
    return found


def _turns(points: Sequence[Point], i: int, parameter: float) -> bool:
    """Whether the branch turns back at point i or i + 1, short of the parameter."""
    for k in (i, i + 1):
        beside = [points[n] for n in (k - 1, k + 1)] if 0 < k < len(points) - 1 else []
        here, beyond = points[k].parameter, parameter - points[k].parameter
        back = [end.converged and beyond * (here - end.parameter) > 0 for end in beside]
        if back and all(back):
            return True
    return False


def _tip(
    evaluate: Evaluate, a: Point, b: Point, parameter: float, metric: Metric, settings: Settings
) -> tuple[list[Point], int]:
    """(points from a to b, residual calls), one of them beyond the parameter where a fold between
    them reaches it."""
    toward = np.sign(parameter - a.parameter)

    def measure(point: Point) -> arc.MeasuredPoint:
        return arc.MeasuredPoint(
            point, toward * point.parameter, toward * point.tangent[1] / metric.norm(*point.tangent)
        )

    ends = measure(a), measure(b)
    beyond = toward * parameter - max(end.value for end in ends)
    if not ends[0].slope > 0 > ends[1].slope or beyond > TIP * metric.length * arc.distance(
        a, b, metric
    ):
        return [a, b], 0
    found = arc.maximum(evaluate, ends, measure, metric, settings, enough=toward * parameter)
    return found.points, found.calls
