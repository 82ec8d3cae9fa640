"""Solved points wherever a branch crosses a value of its parameter."""

from dataclasses import replace

import numpy as np

from hbm.continuation.branch import Branch
from hbm.continuation.corrector import between, solve_fixed
from hbm.continuation.point import Evaluate, Point
from hbm.continuation.settings import Settings


def crossings(evaluate: Evaluate, points: list[Point], parameter: float, weights: np.ndarray,
              settings: Settings) -> list[tuple[Point, int, int]]:
    """[(point, residual calls, index of the point behind it)] of every crossing of the parameter between two points.

    Newton at the fixed parameter; where it leads away from the two points, these are first brought closer together.
    The tip of a fold may reach further than its points: there, more points are solved first.
    """
    found = []
    for i, (a, b) in enumerate(zip(points[:-1], points[1:], strict=True)):
        if a.converged and b.converged and (a.parameter - parameter) * (b.parameter - parameter) < 0:
            point, calls = _crossing(evaluate, a, b, parameter, weights, settings)
            found.append((point, calls, i + 1))
    for i, fold in enumerate(zip(points[:-2], points[1:-1], points[2:], strict=True), 1):
        if _turns(*fold, parameter):
            tip, calls = _tip(evaluate, fold, parameter, weights, settings)
            for place, (a, b) in zip((i, i + 1), zip(tip[:-1], tip[1:], strict=True), strict=False):
                point, more = _crossing(evaluate, a, b, parameter, weights, settings)
                found.append((point, calls + more, place))
                calls = 0
    return sorted(found, key=lambda one: one[2])


def insert_crossings(evaluate: Evaluate, branch: Branch, at: np.ndarray, weights: np.ndarray,
                     settings: Settings) -> None:
    """Insert a solved point wherever the branch crosses one of the parameters `at`."""
    for parameter in at:
        for point, calls, place in reversed(crossings(evaluate, branch.points, parameter, weights, settings)):
            branch.calls += calls
            if point.converged:
                branch.points.insert(place, point)


def _turns(a, b, c, parameter):
    """Whether the branch turns back at b, short of the parameter."""
    beyond = parameter - b.parameter
    return (all(p.converged for p in (a, b, c)) and beyond * (b.parameter - a.parameter) > 0
            and beyond * (b.parameter - c.parameter) > 0)


def _tip(evaluate, fold, parameter, weights, settings):
    """([points before, beyond and after the parameter], residual calls) of a fold whose three points do not reach it;
    no points where by the parabola through the highest three its tip does not either."""
    calls = 0
    for _ in range(settings.max_fold_bisections):
        if not _reaches(fold, parameter, weights):
            break
        a, b, c = fold
        middles = [between(evaluate, *ends, 0.5, weights, settings) for ends in ((a, b), (b, c))]
        calls += sum(middle.iterations for middle in middles)
        if not all(middle.converged for middle in middles):
            break
        finer = [a, middles[0], b, middles[1], c]
        toward = np.sign(parameter - b.parameter)
        highest = min(max(int(np.argmax([toward * p.parameter for p in finer])), 1), 3)
        fold = finer[highest - 1:highest + 2]
        if toward * (fold[1].parameter - parameter) > 0:
            return fold, calls
    return [], calls


def _reaches(fold, parameter, weights):
    """Whether twice the distance from the highest of three points to the tip of their parabola covers the parameter."""
    a, b, c = fold
    before, after = (np.linalg.norm(weights * (q.x - p.x)) for p, q in ((a, b), (b, c)))
    rise, fall = (b.parameter - a.parameter) / before, (c.parameter - b.parameter) / after
    curvature = (fall - rise) / (before + after)
    slope = (rise * after + fall * before) / (before + after)
    return abs(parameter - b.parameter) <= 2 * abs(slope**2 / (4 * curvature)) if curvature else False


def _crossing(evaluate, a, b, parameter, weights, settings):
    calls, beside = 0, None
    for _ in range(settings.max_bisections):
        share = (parameter - a.parameter) / (b.parameter - a.parameter)
        guess, apart = a.x + share * (b.x - a.x), np.linalg.norm(weights * (b.x - a.x))
        new = solve_fixed(evaluate, guess, parameter, weights, settings, 30)
        calls += new.iterations
        if new.converged and np.linalg.norm(weights * (new.x - guess)) <= 0.5 * apart + 1e-9 * np.linalg.norm(a.x):
            if -1e-6 <= _along(a, b, new.x, weights) <= 1 + 1e-6:
                return new, calls
            beside = beside or new          # next to a fold: perhaps the solution on its other side
        middle = between(evaluate, a, b, 0.5, weights, settings)
        calls += middle.iterations
        if not middle.converged:
            break
        a, b = (a, middle) if (a.parameter - parameter) * (middle.parameter - parameter) <= 0 else (middle, b)
    return beside or replace(new, x=np.full_like(new.x, np.nan), converged=False), calls


def _along(a, b, x, weights):
    """Position of x along the chord from point a (0) to point b (1)."""
    chord = weights * (b.x - a.x)
    return (weights * (x - a.x)) @ chord / max(chord @ chord, 1e-300)
