"""Between two solved points of a branch: where a quantity passes zero that may tell its distance on
one side alone, as the share of slip in a cycle does, which is zero wherever a contact sticks.

A secant through the two points nearest to zero, which may lie on one side, says where to look. The
branch is solved as far beyond as the secant may be wrong, so that zero is enclosed, and then as far
before; further before, where that is still beyond. What does not narrow is halved.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.corrector import between
from tipdamp.hbm.continuation.point import Evaluate, Metric, Point
from tipdamp.hbm.continuation.settings import DEFAULT

SHORT = 0.4  # of the length asked for, from the zero of the secant to the points about it
WRONG = 0.1  # of the product of the distances of two points to the zero of their secant
FURTHER = 30.0  # times as far, where a point before the zero of the secant is still beyond
PATIENCE = 3  # steps in which the arc halves


@dataclass(frozen=True)
class _Told:
    """place : along the arc, 0 to 1; value : of the quantity there, finite."""

    place: float
    value: float


def enclosed(
    evaluate: Evaluate,
    a: Point,
    b: Point,
    measure: Callable[[Point], float],
    metric: Metric,
    length: float,
) -> tuple[Point, Point]:
    """Two points of the branch, at most an arc length apart, between which the measure changes its
    sign, from those between which it does; wider where rounding ends the search.

    measure : grows about linearly from zero; of infinite size where only its sign is known
    """
    first, whole = measure(a), max(arc.distance(a, b, metric), 1e-300)
    ends, least = (0.0, 1.0), SHORT * length / whole
    told = [_Told(*one) for one in zip(ends, (first, measure(b)), strict=True)]
    told = [one for one in told if np.isfinite(one.value)]
    widths = [2.0] * PATIENCE
    for _ in range(PATIENCE * DEFAULT.max_bisections):
        width = arc.distance(a, b, metric) / whole
        if width * whole <= length:
            break
        share = 0.5
        if width <= 0.5 * widths[-PATIENCE]:
            share = _share(told, ends, least)
        middle = between(evaluate, a, b, share, metric.weights)
        if not arc.lies_between(middle, a, b, metric):
            break
        widths.append(width)
        place, value = ends[0] + share * (ends[1] - ends[0]), measure(middle)
        if np.isfinite(value):
            told = sorted([*told, _Told(place, value)], key=lambda one: abs(one.value))[:2]
        if np.sign(value) == np.sign(first):
            a, ends = middle, (place, ends[1])
        else:
            b, ends = middle, (ends[0], place)
        middle.detail.forget()
    return a, b


def _share(told: list[_Told], ends: tuple[float, float], least: float) -> float:
    """Of the arc between the ends, where to look next; half way without a secant."""
    for near, far in pairwise(told):
        if near.value == far.value:
            break
        zero = near.place - near.value * (far.place - near.place) / (far.value - near.value)
        wrong = max(WRONG * abs((zero - near.place) * (zero - far.place)), least)
        way = np.sign(zero - near.place)
        place = zero + way * wrong
        while way * (place - near.place) > 0:
            if ends[0] < place < ends[1]:
                return (place - ends[0]) / (ends[1] - ends[0])
            place = zero - way * wrong
            wrong *= FURTHER
    return 0.5
