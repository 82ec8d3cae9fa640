"""A branch through a solution inside a band, both ways: once round, or to the ends of the band."""

from dataclasses import replace

import numpy as np

from tipdamp.hbm.continuation.beyond import cut
from tipdamp.hbm.continuation.branch import Branch, BranchTracer
from tipdamp.hbm.continuation.corrector import reverse
from tipdamp.hbm.continuation.point import Evaluate, Point
from tipdamp.hbm.continuation.settings import Settings

LEAVES = ("end", "left")  # the band, where it ends or where it starts
ASIDE = 0.3  # of a step: how far beside it the start may lie for the branch to pass through it


def follow_both_ways(
    evaluate: Evaluate,
    start: Point,
    band: tuple[float, float],
    weights: np.ndarray,
    settings: Settings,
    most: int,
) -> Branch:
    """The branch through a solved point inside a band (low, high), in at most that many points each
    way.

    A branch that returns to the start is closed: it then begins and ends with its point of the
    lowest parameter. Else it runs from where it leaves the band, or stops, to where it does so the
    other way.
    """
    low, high = band
    settings = replace(settings, max_points=most, outside=0.0)
    onwards = _one_way(evaluate, start, (low, high), weights, settings)
    if onwards.end == "round":
        points = onwards.points
        first = int(np.argmin([point.parameter for point in points[:-1]]))
        onwards.points = [*points[first:-1], *points[: first + 1]]
        return onwards
    back = _one_way(evaluate, start, (high, low), weights, settings)
    points = [*map(reverse, back.points[:0:-1]), *onwards.points]
    whole = Branch(points, calls=onwards.calls + back.calls)
    stopped = next((way for way in (onwards, back) if way.end not in LEAVES), None)
    whole.finish(*(("through", high) if stopped is None else (stopped.end, stopped.at)))
    return whole


def _one_way(evaluate, start, band, weights, settings):
    """The branch from the start, first towards the end of the band."""
    begin, end = band
    tracer = BranchTracer(evaluate, start, end, weights, settings, None, begin)
    branch = tracer.branch
    while not branch.end:
        new = tracer.next_point() or (tracer.across() if tracer.lost else None)
        if new is None:
            if tracer.lost:
                branch.finish("no point", branch.points[-1].parameter)
            continue
        before = branch.points[-1]
        tracer.accept(new, None)
        before.detail.forget()
        if not branch.end and len(branch.points) > 3 and _passes(tracer, before, new):
            branch.points[-1] = branch.points[0]
            branch.finish("round", start.parameter)

    def border(a, b):
        found = tracer.solve_between(a, b, begin)
        return found if found.converged else None

    branch.points = cut(branch.points, lambda p: tracer.outside(p) > 0, border)
    return branch


def _passes(tracer, before, new):
    """Whether the branch passes through its start between two points."""
    start, metric = tracer.branch.points[0], tracer.metric()
    step = new.x - before.x, new.parameter - before.parameter
    away = start.x - before.x, start.parameter - before.parameter
    length = metric.norm(*step)
    along = metric.inner(*away, *step) / length**2
    if not 0 < along <= 1 or metric.inner(*start.tangent, *step) <= 0:
        return False
    return metric.norm(away[0] - along * step[0], away[1] - along * step[1]) < ASIDE * length
