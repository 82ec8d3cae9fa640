"""A branch through a solution inside a band, both ways: once round, or to the ends of the band."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tipdamp.hbm.continuation.beyond import cut
from tipdamp.hbm.continuation.branch import Branch, BranchTracer
from tipdamp.hbm.continuation.corrector import heading, reverse
from tipdamp.hbm.continuation.follow import BudgetExceeded
from tipdamp.hbm.continuation.point import Evaluate, Metric, OnPoint, Point, size
from tipdamp.hbm.continuation.settings import Settings

Meets = Callable[[Point, Point], Point | None]
LEAVES = ("end", "left")  # the band, where it ends or where it starts
ASIDE = 0.3  # of a step: how far beside it the start may lie for the branch to pass through it


def follow_both_ways(
    evaluate: Evaluate,
    start: Point,
    band: tuple[float, float],
    weights: np.ndarray,
    settings: Settings,
    most: int,
    on_point: OnPoint | None = None,
) -> Branch:
    """The branch through a solved point inside a band (from, to), in at most that many points each
    way; on_point(point, step) : called for each.

    A branch that returns to the start is closed: it then begins and ends with its point of the
    lowest parameter. Else it runs from where it leaves the band, or stops, to where it does so the
    other way.
    """
    first, last = band
    onwards = follow_one_way(evaluate, start, band, weights, settings, most, on_point)
    if onwards.end == "round":
        points = onwards.points
        lowest = int(np.argmin([point.parameter for point in points[:-1]]))
        onwards.points = [*points[lowest:-1], *points[: lowest + 1]]
        return onwards
    back = follow_one_way(evaluate, start, (last, first), weights, settings, most, on_point)
    points = [*map(reverse, back.points[:0:-1]), *onwards.points]
    whole = Branch(points, calls=onwards.calls + back.calls)
    stopped = next((way for way in (onwards, back) if way.end not in LEAVES), None)
    whole.finish(*(("through", last) if stopped is None else (stopped.end, stopped.at)))
    return whole


def follow_away(
    evaluate: Evaluate,
    ends: tuple[Point, Point],
    band: tuple[float, float],
    weights: np.ndarray,
    settings: Settings,
    most: int,
    meets: Meets,
) -> Branch:
    """The branch from a point of another one over a solved point beside it, inside a band (low,
    high), in at most that many points.

    meets(before, new) : the point of the other branch between two points, where this one ends, or
    None
    """
    (root, start), (low, high) = ends, band
    tx, tp = heading(start, 1.0).tangent
    metric = Metric(weights, max(size(weights * start.x), 1e-300), high - low)
    away = metric.inner(tx, tp, start.x - root.x, start.parameter - root.parameter)
    way = (low, high) if away >= 0 else (high, low)
    branch = follow_one_way(evaluate, start, way, weights, settings, most, meets=meets)
    chord = start.x - root.x, start.parameter - root.parameter  # the root has tangents of both
    branch.points.insert(0, replace(root, tangent=chord, orientation=start.orientation))
    return branch


def follow_one_way(
    evaluate: Evaluate,
    start: Point,
    band: tuple[float, float],
    weights: np.ndarray,
    settings: Settings,
    most: int,
    on_point: OnPoint | None = None,
    meets: Meets | None = None,
) -> Branch:
    """The branch from a solved point inside a band (from, to), first towards its end, in at most
    that many points: until it leaves the band, returns to the start, or `meets` another one."""
    begin, end = band
    settings = replace(settings, max_points=most, outside=0.0)
    tracer = BranchTracer(evaluate, start, end, weights, settings, None, begin)
    branch = tracer.branch
    while not branch.end:
        try:
            new = tracer.next_point()
        except BudgetExceeded:
            branch.finish("budget", branch.points[-1].parameter)
            return branch
        if new is None:
            if tracer.lost:
                branch.finish("no point", branch.points[-1].parameter)
            continue
        before = branch.points[-1]
        met = meets(before, new) if meets else None
        if met is not None:
            chord = met.x - before.x, met.parameter - before.parameter
            branch.points.append(replace(met, tangent=chord, orientation=before.orientation))
            branch.finish("meets", met.parameter)
            continue
        tracer.accept(new, on_point)
        if not branch.end and len(branch.points) > 3 and _passes(tracer, before, new):
            branch.points[-1] = branch.points[0]
            branch.finish("round", start.parameter)

    def border(a: Point, b: Point) -> Point | None:
        found = tracer.solve_between(a, b, begin)
        return found if found.converged else None

    branch.points = cut(branch.points, lambda p: tracer.outside(p) > 0, border)
    return branch


def _passes(tracer: BranchTracer, before: Point, new: Point) -> bool:
    """Whether the branch passes through its start between two points."""
    start, metric = tracer.branch.points[0], tracer.metric()
    step = new.x - before.x, new.parameter - before.parameter
    tx, tp = start.tangent
    near = metric.beside_chord(start, before, new) < ASIDE * metric.norm(*step)
    return near and metric.inner(tx, tp, *step) > 0
