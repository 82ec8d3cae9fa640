"""A quantity along a branch whose equations are sampled: small ripples, each with a maximum of its
own.

Where an event of the cycle passes from one sample to the next the derivatives of a sampled law
jump. Between two points of a branch there may then be several maxima close to one another; points
are added until each stands alone.
"""

from collections.abc import Callable

from tipdamp.hbm.continuation.arc import MeasuredPoint, distance, lies_between
from tipdamp.hbm.continuation.corrector import between
from tipdamp.hbm.continuation.point import Evaluate, Metric, Point
from tipdamp.hbm.continuation.settings import Settings


class TooManyRipples(Exception):
    """More points than the settings allow; calls : evaluations of the residual until then."""

    def __init__(self, calls: int) -> None:
        super().__init__()
        self.calls = calls


def resolve(
    evaluate: Evaluate,
    known: list[MeasuredPoint],
    measure: Callable[[Point], MeasuredPoint],
    metric: Metric,
    settings: Settings,
) -> tuple[list[MeasuredPoint], int]:
    """(the points of a branch with those between, residual calls): each maximum that may be the
    largest has a bracket.

    A part of the branch is halved until its middle agrees with the cubic through its ends or, at a
    kink, it was concave several times over, and where it cannot reach the highest point. Raises
    TooManyRipples.
    """
    best, calls, found = max(end.value for end in known), 0, [known[0]]
    parts = [(a, b, 0) for a, b in zip(known[-2::-1], known[:0:-1], strict=True)]
    while parts:
        a, b, halvings = parts.pop()
        if a.point.parameter == b.point.parameter or b.point.jump:
            found.append(b)
            continue
        point = between(evaluate, a.point, b.point, 0.5, metric.weights, settings)
        calls += point.iterations
        if len(found) + len(parts) > len(known) + settings.max_ripple_points:
            raise TooManyRipples(calls)
        if not lies_between(point, a.point, b.point, metric):
            found.append(b)
            continue
        middle = measure(point)
        best = max(best, middle.value)
        error = abs(middle.value - _cubic(a, b, distance(a.point, b.point, metric)))
        halvings = halvings + 1 if _concave(a, middle, b, metric) else 0
        reach = (
            max(_crest(a, middle, metric), _crest(middle, b, metric))
            + settings.ripple_margin * error
        )
        if (
            reach < best
            or halvings == settings.concave_halvings
            or error <= settings.peak_tolerance * best
        ):
            found += [middle, b]
        else:
            parts += [(middle, b, halvings), (a, middle, halvings)]
    return found, calls


def _cubic(a: MeasuredPoint, b: MeasuredPoint, apart: float) -> float:
    """Half way on the Hermite cubic."""
    return 0.5 * (a.value + b.value) + 0.125 * apart * (a.slope - b.slope)


def _crest(a: MeasuredPoint, b: MeasuredPoint, metric: Metric) -> float:
    """What the Hermite cubic between two points does not exceed: 4/27 is the largest of s (1 -
    s)^2."""
    slopes = max(a.slope, 0.0) + max(-b.slope, 0.0)
    return max(a.value, b.value) + 4 / 27 * distance(a.point, b.point, metric) * slopes


def _concave(a: MeasuredPoint, middle: MeasuredPoint, b: MeasuredPoint, metric: Metric) -> bool:
    """Whether three points and their tangents are those of a concave quantity."""
    return all(
        right.value <= left.value + left.slope * apart
        and left.value <= right.value - right.slope * apart
        for left, right in ((a, middle), (middle, b))
        for apart in (distance(left.point, right.point, metric) * (1 + 1e-6),)
    )
