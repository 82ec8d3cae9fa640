"""Beyond the end of a band: where the branch folds there, and what of it lies inside the band."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.branch import Branch, BranchTracer
from tipdamp.hbm.continuation.point import Evaluate, Point, failed
from tipdamp.hbm.continuation.settings import Settings

Border = Callable[[Point, Point], Point | None]


def cut(points: Iterable[Point], outside: Callable[[float], bool], border: Border) -> list[Point]:
    """The points of a branch that do not lie outside, and those where it goes out and comes in.

    outside(parameter) : whether it is; border(before, point) : the point between two of which one
    is outside, or None where it is not solved
    """
    kept, before, left = list[Point](), None, False
    for point in points:
        out = outside(point.parameter)
        if (
            before is not None
            and out != outside(before.parameter)
            and before.converged
            and point.converged
        ):
            there = border(before, point)
            if there is not None:
                kept.append(replace(there, jump=left))
                left = False
        if not out:
            kept.append(replace(point, jump=True) if left else point)
        before, left = point, out
    return kept


def cut_at_end(
    evaluate: Evaluate, branch: Branch, end: float, weights: np.ndarray, settings: Settings
) -> None:
    """Leave out of a branch that was followed beyond `end` what lies there.

    It then ends with its last point at `end`; `branch.beyond` says from how far it came back.
    """
    sense, points = np.sign(end - branch.points[0].parameter), branch.points

    def border(a: Point, b: Point) -> Point | None:
        if end in (a.parameter, b.parameter):
            return None
        new, calls = arc.crossing(evaluate, a, b, end, arc.metric_at(a, weights), settings)
        branch.calls += calls
        return new if new.converged else None

    inside = [sense * (point.parameter - end) <= 0 for point in points]
    last = max(i for i, within in enumerate(inside) if within)
    if not all(inside[:last]):
        branch.beyond = max((p.parameter for p in points[:last]), key=lambda value: sense * value)
    branch.points = cut(points, lambda p: sense * (p - end) > 0, border)
    if branch.complete and branch.points[-1].parameter != end:
        branch.points.append(failed(len(weights), end))
        branch.finish("last", end)


def fold_ahead(
    evaluate: Evaluate,
    start: Point,
    limit: float,
    weights: np.ndarray,
    settings: Settings,
    most: int,
) -> tuple[float | None, float, int]:
    """(parameter of the next fold of a branch from a point on, or None; the parameter up to which
    the branch was followed; residual calls).

    limit : of the parameter; most : residual calls
    """
    tracer = BranchTracer(evaluate, start, limit, weights, settings, None)
    furthest = start.parameter
    for new in _onwards(tracer, most):
        furthest = max(furthest, new.parameter, key=lambda value: tracer.sense * value)
        if tracer.sense * new.tangent[1] < 0:
            return furthest, furthest, tracer.branch.calls
    return None, limit if tracer.branch.end == "end" else furthest, tracer.branch.calls


def return_ahead(
    evaluate: Evaluate,
    start: Point,
    limit: float,
    weights: np.ndarray,
    settings: Settings,
    most: int,
) -> tuple[float | None, float, int]:
    """As `fold_ahead`, of the furthest fold over which the branch comes back to where it starts;
    None where it does not."""
    tracer = BranchTracer(evaluate, start, limit, weights, settings, None)
    furthest = start.parameter
    for new in _onwards(tracer, most):
        if tracer.outside(new.parameter) > 0:
            return furthest, furthest, tracer.branch.calls
        furthest = max(furthest, new.parameter, key=lambda value: tracer.sense * value)
    return None, furthest, tracer.branch.calls


def _onwards(tracer: BranchTracer, most: int) -> Iterator[Point]:
    """Points of a branch, for so many residual calls; of those behind only the place is kept."""
    points = tracer.branch.points
    while not (tracer.branch.end or tracer.lost) and tracer.branch.calls < most:
        new = tracer.next_point()
        if new is None:
            continue
        yield new
        tracer.accept(new, None)
        if len(points) > 2:
            points[-3] = replace(points[-3], detail=None)
