"""Newton's method for one point of R(x, p) = 0: on a plane across a branch, or at a fixed
parameter."""

from dataclasses import replace
from typing import Any

import numpy as np

from tipdamp.hbm.continuation.point import Evaluate, Linearised, Metric, Plane, Point, size
from tipdamp.hbm.continuation.settings import DEFAULT, Settings


def correct(
    evaluate: Evaluate,
    plane: Plane,
    metric: Metric,
    settings: Settings = DEFAULT,
    last: np.ndarray | None = None,
) -> Point:
    """Newton on a plane from the point that it passes through, for the next point after x = last
    (n,) of a branch.

    A step that by the contraction so far leads below the tolerance is the last one: it is taken
    without evaluating again, and with the matrix of the step before where that is good enough
    [Deuflhard 2004, section 2.1].
    The first step removes what x has gained since `last` and R does not determine
    (`Linearised.restoring`).
    """
    (x, p, row, corner), first = plane, None
    kept: Linearised | None = None
    before, least, stalls = np.inf, np.inf, 0
    for iteration in range(1, settings.max_iterations + 1):
        e = evaluate(x, p)
        first = first or e
        unit = min(max(size(metric.weights * x), 1e-6 * metric.size), 10 * metric.size)
        error = size(e.residual) / unit
        if error <= settings.tolerance:
            return Point(x, p, True, iteration, e)
        stalls += error > 0.5 * least  # again and again: it alternates between the pieces of a kink
        if not np.isfinite(error) or error > 1e8 or stalls > settings.max_stalls:
            break
        rate = error / before if kept is not None else 1.0
        chord = kept if settings.safety * rate * error <= settings.tolerance else None
        value = -(row @ (x - plane.x) + corner * (p - plane.parameter))
        residual = e.residual
        if iteration == 1 and last is not None:
            residual = residual + e.restoring(x - last)
        dx, dp = (chord or e).solve(row, corner, value, residual)
        x, p = x + dx, p + dp
        if not np.isfinite(p) or not np.isfinite(x).all():
            break
        ends = chord or settings.safety * rate**2 * error <= settings.tolerance
        if ends and metric.norm(dx, dp) < settings.last_step:
            return Point(x, p, True, iteration, e.moved(dx, dp))
        before, least, kept = error, min(error, least), e
    return Point(np.full_like(plane.x, np.nan), plane.parameter, False, iteration, first)


def solve_fixed(
    evaluate: Evaluate,
    x: np.ndarray,
    p: float,
    weights: np.ndarray,
    settings: Settings = DEFAULT,
    max_calls: int = 300,
) -> Point:
    """Damped Newton from x (n,) at the fixed parameter p, for a first point or a restart, in about
    `max_calls`."""
    return damped(evaluate, Plane(x, p, np.zeros(len(x)), 1.0), weights, settings, max_calls)


def damped(
    evaluate: Evaluate, plane: Plane, weights: np.ndarray, settings: Settings, max_calls: int
) -> Point:
    """Damped Newton on a plane from the point that it passes through."""
    x, p, row, corner = plane
    e = evaluate(x, p)
    calls = 1
    reach = 1e3 * max(size(x), size(e.residual))  # a Jacobian near singular sends x far away
    while calls < max_calls:
        error = size(e.residual)
        if error <= settings.tolerance * min(max(size(weights * x), 1e-300), reach):
            return Point(x, p, True, calls, e)
        dx, dp = e.solve(row, corner, 0.0)
        length = size(dx)
        if not np.isfinite(error + length + dp) or size(x) > 100 * reach:
            break
        share = min(1.0, reach / length) if length else 1.0
        for _ in range(7):
            trial = evaluate(x + share * dx, p + share * dp)
            calls += 1
            if size(trial.residual) < (1 - 0.1 * share) * error:
                break
            share *= 0.5
        x, p, e = x + share * dx, p + share * dp, trial
    return Point(np.full_like(x, np.nan), plane.parameter, False, calls)


def between(
    evaluate: Evaluate,
    a: Point,
    b: Point,
    share: float,
    weights: np.ndarray,
    settings: Settings = DEFAULT,
) -> Point:
    """The point of the branch on the plane across the chord from a to b, at a share in (0, 1) of
    it, to rounding."""
    metric = Metric(
        weights,
        max(size(weights * a.x), size(weights * b.x), 1e-300),
        max(abs(a.parameter), abs(b.parameter), 1e-300) * 1e-2,
    )
    plane = Plane(*interpolate(a, b, share, metric), *metric.across(a, b))
    # no step without evaluating again: next to a kink the tangent of the point before would be
    # another one
    settings = replace(settings, max_stalls=settings.patient_stalls, last_step=0.0)
    new = polished(evaluate, correct(evaluate, plane, metric, settings), plane, metric, settings)
    if new.converged:
        return new
    strict = replace(settings, tolerance=settings.patient_residual)
    again = damped(evaluate, plane, weights, strict, settings.patient_calls)
    again = replace(again, iterations=new.iterations + again.iterations)
    return polished(evaluate, again, plane, metric, settings)


def polished(
    evaluate: Evaluate, point: Point, plane: Plane, metric: Metric, settings: Settings
) -> Point:
    """A point after Newton steps on its plane until these are small, the last one linearised; with
    its tangent.

    The residual does not tell: where springs are 1e6 times as stiff as the body, 1e-10 of the
    motion is 1e-4 of a contact force. Where no step is small, a point whose residual is rounding
    stays: a motion is all but undetermined."""
    for k in range(settings.max_polish if point.converged else 0):
        dx, dp = point.detail.solve(plane.row, plane.corner, 0.0)
        length = metric.norm(dx, dp)
        if length <= settings.peak_step * (1 if k < settings.max_polish - 1 else settings.safety):
            done, moved = leaving(point, plane.row, plane.corner), point.detail.moved(dx, dp)
            return replace(done, x=point.x + dx, parameter=point.parameter + dp, detail=moved)
        x, p = point.x + dx, point.parameter + dp
        point = Point(x, p, True, point.iterations + 1, evaluate(x, p))
    if point.converged and size(point.detail.residual) <= settings.patient_residual * size(
        metric.weights * point.x
    ):
        return leaving(point, plane.row, plane.corner)
    return replace(point, converged=False)


def interpolate(a: Point, b: Point, share: float, metric: Metric) -> tuple[np.ndarray, float]:
    """x (n,) and p at a share of the chord from a to b, on the cubic through both along their
    tangents (Hermite)."""
    dx, dp = b.x - a.x, b.parameter - a.parameter
    x, p = a.x + share * dx, a.parameter + share * dp
    slopes: list[Any] = [_beside_chord(q, (dx, dp), metric) for q in (a, b)]
    if all(slopes):
        for weight, (sx, sp) in zip(
            (share * (1 - share) ** 2, -(share**2) * (1 - share)), slopes, strict=True
        ):
            x, p = x + weight * sx, p + weight * sp
    return x, p


def leaving(point: Point, row: np.ndarray, corner: float) -> Point:
    """The point with the tangent that leaves a plane (row, corner) on its positive side."""
    tx, tp, sign = point.detail.direction(row, corner)
    return replace(point, tangent=(tx, tp), orientation=sign)


def oriented(point: Point, orientation: float, row: np.ndarray, corner: float) -> Point:
    """The point with the tangent of a branch of a given orientation, which is not parallel to a
    plane (row, corner)."""
    new = leaving(point, row, corner)
    return new if new.orientation == orientation else reverse(new)


def reverse(point: Point) -> Point:
    """The point on the branch traced the other way."""
    tx, tp = point.tangent
    return replace(point, tangent=(-tx, -tp), orientation=-point.orientation)


def heading(point: Point, way: float) -> Point:
    """The point with the tangent along which the parameter increases (way 1) or decreases (-1)."""
    new = leaving(point, np.zeros(len(point.x)), 1.0)
    return new if way > 0 else reverse(new)


def _beside_chord(
    point: Point, chord: tuple[np.ndarray, float], metric: Metric
) -> tuple[np.ndarray, float] | None:
    """The tangent at a point, scaled to a chord (dx, dp), minus the chord; None where it is unknown
    or runs across."""
    if point.tangent is None:
        return None
    (dx, dp), (tx, tp) = chord, point.tangent
    row, corner = metric.border(dx, dp)
    along = row @ tx + corner * tp
    if not along > 0.5 * metric.norm(tx, tp):
        return None
    scale = metric.norm(dx, dp) / along
    return scale * tx - dx, scale * tp - dp
