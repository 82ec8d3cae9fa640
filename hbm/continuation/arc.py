"""Between two solved points of a branch: the maximum of a quantity, and the crossing of a value of
the parameter.

Points know their tangent, so that every quantity has a slope along the arc. A maximum lies between
a point where the slope is positive and one where it is negative; the bracket is narrowed by the
maximum of the Hermite cubic (smooth maxima) and by the intersection of the two tangents (kinks) in
turn. Where the quantity is concave no point exceeds that intersection: it bounds what is left to
gain, and ends the search.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm.continuation.corrector import (
    between,
    correct,
    interpolate,
    oriented,
    polished,
    solve_fixed,
)
from tipdamp.hbm.continuation.point import Evaluate, Metric, Point, size
from tipdamp.hbm.continuation.point import distance as distance
from tipdamp.hbm.continuation.settings import Settings

# cosine of the angle between two tangents above which the arc is taken for its chord
STRAIGHT = 0.9
SMOOTH = 0.1  # of what the curvature adds half way: error of the cubic of a quantity without kinks
CLOSE = 0.98  # of the way to a corner: just beyond it there is no point of the branch
STEP = 8  # halvings, in which the height of a maximum above the points beside it falls by half
BENT = 0.1  # share of one side of a corner by which its bend may shift the corner along the other
FURTHER = 0.5  # the same, before a value is given up: an S-bend beside a fold is no corner


@dataclass(frozen=True)
class MeasuredPoint:
    """A solved point, the value of a quantity there, and its slope by the arc length."""

    point: Point
    value: float
    slope: float


@dataclass(frozen=True)
class Maximum:
    """best : the highest point; solved : whether it is the maximum, to the tolerance of the
    settings;
    points : all solved points from one end to the other; calls : evaluations of the residual."""

    best: MeasuredPoint
    solved: bool
    points: list[Point]
    calls: int


def metric_at(point: Point, weights: np.ndarray) -> Metric:
    """Arc length around a point, relative to its unknowns and to a hundredth of its parameter."""
    return Metric(
        weights, max(size(weights * point.x), 1e-300), 0.01 * max(abs(point.parameter), 1e-300)
    )


def maximum(
    evaluate: Evaluate,
    ends: tuple[MeasuredPoint, MeasuredPoint],
    measure: Callable[[Point], MeasuredPoint],
    metric: Metric,
    settings: Settings,
    enough: float = np.inf,
) -> Maximum:
    """The maximum between two points of a branch, or the first point that reaches the value
    `enough`."""
    a, b = ends
    points, calls, left, smooth = [a.point, b.point], 0, 0, False
    top = max(ends, key=lambda end: end.value)
    for attempt in range(settings.max_peak_points):
        apart, solved = distance(a.point, b.point, metric), _is_between(a, b, top, metric, settings)
        hopeless = enough < np.inf and bound(a, b, metric, FURTHER) < enough
        reached = max(a.value, b.value) >= enough
        if solved or reached or hopeless or calls > settings.max_peak_calls:
            return Maximum(top, solved, points, calls)
        share = _share(a, b, apart, attempt, smooth)
        new, more = _inside(evaluate, a.point, b.point, (share, attempt % 4 == 3), metric, settings)
        calls += more
        if not new.converged:
            break
        points.insert(left + 1, new)
        found = measure(new)
        top = max(top, found, key=lambda end: end.value)  # rounding may lift one above the last two
        # where the cubic has told the height of a point before, and now that of the maximum,
        # nothing is left to gain
        error = abs(found.value - _cubic(a, b, apart, share))
        curvature = (a.slope - b.slope) / apart
        if (
            smooth
            and found is top
            and error + found.slope**2 / curvature <= settings.peak_tolerance * abs(top.value)
        ):
            return Maximum(top, True, points, calls)
        smooth |= 0.1 < share < 0.9 and error <= SMOOTH * curvature * apart**2 / 8
        if found.slope > 0:
            a, left = found, left + 1
        else:
            b = found
    return Maximum(top, False, points, calls)


def _is_between(
    a: MeasuredPoint, b: MeasuredPoint, top: MeasuredPoint, metric: Metric, settings: Settings
) -> bool:
    """Whether the maximum is solved by what two points leave to gain; top : the highest of all."""
    best, apart = max(a, b, key=lambda end: end.value), distance(a.point, b.point, metric)
    highest = bound(a, b, metric)
    # where the tangents do not meet but are noise: what the slopes gain over the chord
    gain = highest - best.value if highest < np.inf else max(a.slope, -b.slope) * apart
    if not (gain <= settings.peak_tolerance * abs(best.value) or apart <= settings.shortest_chord):
        return False
    # where the slopes contradict the values they have led astray
    return top.value - best.value <= 10 * settings.peak_tolerance * abs(top.value)


def _inside(
    evaluate: Evaluate,
    a: Point,
    b: Point,
    where: tuple[float, bool],
    metric: Metric,
    settings: Settings,
) -> tuple[Point, int]:
    """(a solved point on the arc from a to b, residual calls); where : share of the chord, and
    whether even in a corner."""
    calls, (share, anyway) = 0, where
    if anyway or _corner(a, b, metric) is None:
        new = between(evaluate, a, b, share, metric.weights, settings)
        if lies_between(new, a, b, metric):
            return new, new.iterations
        calls = new.iterations
    new, more = _step_from(evaluate, a, b, metric, settings)
    return new, calls + more


def _cubic(a: MeasuredPoint, b: MeasuredPoint, apart: float, share: float) -> float:
    """Value at a share of the chord on the Hermite cubic."""
    rise, fall, rest = a.slope * apart, b.slope * apart, 1 - share
    return (
        a.value * rest**2 * (1 + 2 * share)
        + b.value * share**2 * (1 + 2 * rest)
        + share * rest * (rise * rest - fall * share)
    )


def maximum_by_value(
    evaluate: Evaluate,
    three: Sequence[MeasuredPoint],
    measure: Callable[[Point], MeasuredPoint],
    metric: Metric,
    settings: Settings,
) -> Maximum:
    """The maximum around the middle one of three points, by halving: where slopes mislead.

    Where a mean motion is all but undetermined, the tangent runs along it, and no slope along the
    arc means anything. A point on a step, which no halving brings nearer to the others, is none.
    """
    low, top, high = three
    points, calls, earlier = [end.point for end in three], 0, list[float]()
    for _ in range(settings.max_peak_points):
        earlier.append(top.value - min(low.value, high.value))
        if earlier[-1] <= 10 * settings.peak_tolerance * abs(top.value):
            return Maximum(top, True, points, calls)
        if len(earlier) > STEP and earlier[-1] > 0.5 * earlier[-1 - STEP]:
            break
        before = distance(low.point, top.point, metric) > distance(top.point, high.point, metric)
        a, b = (low, top) if before else (top, high)
        new = between(evaluate, a.point, b.point, 0.5, metric.weights, settings)
        calls += new.iterations
        if not new.converged:
            break
        points.insert(next(i for i, point in enumerate(points) if point is b.point), new)
        found = measure(new)
        if found.value > top.value:
            earlier.clear()
            low, top, high = (low, found, top) if before else (top, found, high)
        else:
            low, high = (found, high) if before else (low, found)
    return Maximum(top, False, points, calls)


def crossing(
    evaluate: Evaluate, a: Point, b: Point, parameter: float, metric: Metric, settings: Settings
) -> tuple[Point, int]:
    """(solution at a parameter between those of two points, residual calls); not converged where
    none was found.

    From a to b the parameter runs one way: a solution on the other sheet of a fold is told by its
    tangent.
    """
    calls, forward = 0, np.sign(b.parameter - a.parameter)
    settings = replace(settings, max_stalls=settings.patient_stalls)
    for _ in range(settings.max_bisections):
        new = solve_fixed(
            evaluate, on_cubic(a, b, parameter, metric), parameter, metric.weights, settings, 16
        )
        calls += new.iterations
        if new.converged:
            new = oriented(new, a.orientation, np.zeros(len(a.x)), 1.0)
            if np.sign(new.tangent[1]) == forward and _near(new, a, b, metric):
                return new, calls
        middle = between(evaluate, a, b, 0.5, metric.weights, settings)
        calls += middle.iterations
        if not lies_between(middle, a, b, metric):
            middle, more = _step_from(evaluate, a, b, metric, settings)
            calls += more
        if not middle.converged or distance(a, b, metric) <= settings.shortest_chord:
            break
        before = (a.parameter - parameter) * (middle.parameter - parameter) <= 0
        a, b = (a, middle) if before else (middle, b)
        if a.parameter == b.parameter:
            break
    return replace(new, x=np.full_like(new.x, np.nan), converged=False), calls


def on_cubic(a: Point, b: Point, parameter: float, metric: Metric) -> np.ndarray:
    """x (n,) on the cubic from a to b where its parameter has a value between theirs, by
    bisection."""
    low, high = 0.0, 1.0
    for _ in range(40):
        share = 0.5 * (low + high)
        x, p = interpolate(a, b, share, metric)
        low, high = (
            (share, high) if (p - parameter) * (a.parameter - parameter) > 0 else (low, share)
        )
    return x


def bound(a: MeasuredPoint, b: MeasuredPoint, metric: Metric, bent: float = BENT) -> float:
    """What a concave quantity cannot exceed between two points; infinite where their tangents do
    not meet between.

    bent : share of one side of a corner by which its bend may shift it along the other
    """
    if not a.slope > 0 >= b.slope:
        return np.inf
    corner = _corner(a.point, b.point, metric)
    if corner is not None:
        ahead, behind = corner[0] + bent * corner[1], corner[1] + bent * corner[0]
        return (
            max(a.value + a.slope * ahead, b.value - b.slope * behind)
            if min(corner) >= 0
            else np.inf
        )
    apart = distance(a.point, b.point, metric)
    meet = (b.value - a.value - b.slope * apart) / (a.slope - b.slope)
    return a.value + a.slope * meet if -1e-9 * apart <= meet <= (1 + 1e-9) * apart else np.inf


def _corner(a: Point, b: Point, metric: Metric) -> tuple[float, float] | None:
    """Arc lengths from a forward and from b backward to where their tangents pass each other; None
    where the branch hardly turns between them, and in a hairpin that is no corner."""
    (ax, ap), (bx, bp) = (metric.unit(*end.tangent) for end in (a, b))
    cosine = metric.inner(ax, ap, bx, bp)
    if cosine > STRAIGHT:
        return None
    dx, dp = b.x - a.x, b.parameter - a.parameter
    forward, backward = metric.inner(ax, ap, dx, dp), metric.inner(bx, bp, dx, dp)
    scale = 1 - cosine**2
    if scale < 1e-12:
        return None
    return (forward - cosine * backward) / scale, (backward - cosine * forward) / scale


def _share(a: MeasuredPoint, b: MeasuredPoint, apart: float, attempt: int, smooth: bool) -> float:
    """Where on the chord the maximum is predicted, in (0, 1): by the cubic, half way every fourth
    time, and by the tangents, a little beyond, of a quantity that is not known to be smooth."""
    rise, fall, chord = a.slope * apart, b.slope * apart, b.value - a.value
    share = 0.5
    if rise > 0 > fall and attempt % 4 != 3:
        if attempt > 0 and not smooth:
            share = (chord - fall) / (rise - fall)
            if share < 0.1:  # so that it is enclosed
                share = 2 * share
            elif share > 0.9:
                share = 2 * share - 1
        else:
            c2, c3 = 3 * chord - 2 * rise - fall, rise + fall - 2 * chord
            root = np.sqrt(max(c2 * c2 - 3 * c3 * rise, 0.0))
            share = rise / (root - c2) if root != c2 else 0.5  # of rise + 2 c2 s + 3 c3 s^2
    return float(np.clip(share, 1e-3, 1 - 1e-3))


def _near(new: Point, a: Point, b: Point, metric: Metric) -> bool:
    """Whether the unknowns of a solution lie about between those of two points."""
    apart = size(metric.weights * (b.x - a.x)) + 1e-9 * metric.size
    return all(size(metric.weights * (new.x - end.x)) <= 1.5 * apart for end in (a, b))


def lies_between(new: Point, a: Point, b: Point, metric: Metric) -> bool:
    """Whether a solved point lies on the arc from a to b: there the branch runs forward as the
    chord does.

    The plane across the chord of a hairpin may meet the branch before a or behind b, where it runs
    against the chord. At a branch point between a and b the orientation changes its sign."""
    if not new.converged:
        return False
    apart = distance(a, b, metric)
    return new.orientation in (a.orientation, b.orientation) and all(
        distance(end, new, metric) <= 1.2 * apart for end in (a, b)
    )


def _step_from(
    evaluate: Evaluate, a: Point, b: Point, metric: Metric, settings: Settings
) -> tuple[Point, int]:
    """(a solved point next to a or b on the arc between, residual calls), by ever smaller steps
    along the tangents.

    The first steps lead almost to where the tangents pass each other: in a hairpin that is further
    than b is from a."""
    calls, undetermined, apart, new = 0, 0, distance(a, b, metric), a
    settings = replace(settings, max_stalls=settings.patient_stalls, last_step=0.0)
    corner = _corner(a, b, metric) if a.tangent and b.tangent else None
    first = corner if corner is not None and min(corner) > 0 else (apart, apart)
    sides = sorted(((a, 1.0, first[0]), (b, -1.0, first[1])), key=lambda side: -side[2])
    for k in range(settings.max_halvings):
        for end, way, length in sides:
            if end.tangent is None:
                continue
            tx, tp = metric.unit(*end.tangent)
            step = CLOSE * length * 0.5**k
            plane = metric.plane(end.x + way * step * tx, end.parameter + way * step * tp, tx, tp)
            new = correct(evaluate, plane, metric, settings)
            calls += new.iterations
            # a far correction would lead to another part of the branch
            if new.converged and distance(plane, new, metric) <= 0.5 * step:
                exact = polished(evaluate, new, plane, metric, settings)
                calls += exact.iterations - new.iterations
                if exact.converged and exact.orientation in (a.orientation, b.orientation):
                    return exact, calls
                # no shorter step helps where Newton's are not small at a solution: a motion is all
                # but undetermined
                undetermined += not exact.converged
        if undetermined > 1:
            break
    return replace(new, converged=False), calls
