"""Where a subharmonic curve ends: on the curve of fewer periods from which it branches off.

Its equations hold on its parent, too: past the place where they meet, as at a grazing, a branch
goes on along that, or stops.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import between
from tipdamp.hbm.continuation.point import Point, size
from tipdamp.hbm.curve.guess import periods_of

HALVED = 10  # times: the meeting is known to a thousandth of a step


def end_at_parent(equation: Equation, branch: Branch, begin: Point) -> None:
    """Cut a branch through `begin` to the motions that last as long as that, with the points at its
    ends where it meets one that repeats earlier; nothing where it does not, or is closed."""
    lasts = periods_of(begin, equation)
    if lasts == 1 or branch.end == "round":
        return

    def earlier(point: Point) -> bool:
        return point.converged and periods_of(point, equation) < lasts

    points = branch.points
    solved = [i for i, point in enumerate(points) if point.converged]
    start = min(solved, key=lambda i: size(points[i].x - begin.x))
    before, first = _own(points[start::-1], equation, earlier)
    after, last = _own(points[start:], equation, earlier)
    met = [point for point in (first, last) if point is not None]
    if not met:
        return
    ends = points[:1] * (start > 0 and first is None) + points[-1:] * (last is None)
    own = [*before[:0:-1], *after]
    branch.points = [*_at(first, own[0], -1), *own, *_at(last, own[-1], 1)]
    held = {point.parameter for point in own}
    branch.restarts = [(left, found) for left, found in branch.restarts if found in held]
    stops = not branch.complete and any(point.parameter == branch.at for point in ends)
    if not stops:  # at the end that is left
        branch.finish("parent", met[-1].parameter)


def _own(
    points: Sequence[Point], equation: Equation, earlier: Callable[[Point], bool]
) -> tuple[list[Point], Point | None]:
    """The points up to the first that repeats earlier, and the one where they meet its curve; all
    and None where there is none."""
    for i, point in enumerate(points):
        if not earlier(point):
            continue
        inner, met = points[i - 1], point
        for _ in range(HALVED):
            middle = between(equation.evaluate, inner, met, 0.5, equation.weights)
            if not middle.converged:
                break
            inner, met = (inner, middle) if earlier(middle) else (middle, met)
        return list(points[:i]), met
    return list(points), None


def _at(met: Point | None, end: Point, way: int) -> list[Point]:
    """The point where a branch meets its parent, with the chord to the end beside it for a tangent:
    it has those of both."""
    if met is None:
        return []
    chord = way * (met.x - end.x), way * (met.parameter - end.parameter)
    return [replace(met, tangent=chord, orientation=end.orientation, jump=False)]
