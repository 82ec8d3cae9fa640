"""Maxima of a rippled quantity along a branch, in closed form."""

from itertools import pairwise

import numpy as np
import pytest

from tests.hbm.continuation.equations import Dense
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.corrector import heading
from tipdamp.hbm.continuation.point import Metric, Point
from tipdamp.hbm.continuation.ripples import TooManyRipples, _concave, _crest, resolve
from tipdamp.hbm.continuation.settings import DEFAULT, Settings

METRIC = Metric(np.ones(1), 1.0, 1.0)
RIPPLE, WAVES = 1e-4, 60.0


def quantity(p):
    """1 - p^2 with kinked ripples, and its derivative: the highest is that at p = pi / WAVES."""
    phase = WAVES * p / (2 * np.pi) + 0.25
    saw = 2 * abs(2 * (phase - np.floor(phase + 0.5))) - 1  # -1..1
    rising = 4 * np.sign(phase - np.floor(phase + 0.5)) * WAVES / (2 * np.pi)
    return 1 - p**2 + RIPPLE * saw, -2 * p + RIPPLE * rising


def evaluate(x, p):
    value, slope = quantity(p)
    return Dense(x - value, np.eye(1), np.array([-slope]))


def measure(q):
    return arc.MeasuredPoint(q, q.x[0], q.tangent[0][0] / METRIC.norm(*q.tangent))


def measured(first, last):
    """Five points of the branch from first to last."""
    return [
        measure(heading(Point(x, p, True, 1, evaluate(x, p)), np.sign(last - first)))
        for p in np.linspace(first, last, 5)
        for x in [np.array([quantity(p)[0]])]
    ]


@pytest.mark.parametrize("ends", [(-0.5, 0.6), (0.55, -0.4), (-0.7, 0.3)])
def test_the_highest_ripple_is_found(ends):
    found, calls = resolve(evaluate, measured(*ends), measure, METRIC, DEFAULT)
    best = max(
        arc.maximum(evaluate, (a, b), measure, METRIC, DEFAULT).best.value
        for a, b in pairwise(found)
        if a.slope > 0 >= b.slope
    )
    top = quantity(np.linspace(-0.1, 0.1, 2_000_001))[0].max()
    assert best == pytest.approx(top, rel=1e-9) and 0 < calls < 1000
    places = [end.point.parameter for end in found]
    assert places == sorted(places, reverse=ends[0] > ends[1])


def test_too_many_ripples_are_said():
    with pytest.raises(TooManyRipples):
        resolve(evaluate, measured(-0.5, 0.6), measure, METRIC, Settings(max_ripple_points=5))


def test_crest_bounds_the_cubic_and_no_more():
    """Of Hermite cubics between points 2 apart; from equal ends with one slope it is reached."""
    rng, s = np.random.default_rng(0), np.linspace(0, 1, 3001)
    points = [Point(np.zeros(1), p, True, 1, None) for p in (0.0, 2.0)]
    assert arc.distance(*points, METRIC) == 2.0
    shapes = np.array(
        [(1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s), 2 * s * (1 - s) ** 2, -2 * s**2 * (1 - s)]
    )
    for values in [[1.0, 1.0, 3.0, 0.0], *rng.normal(size=(200, 4))]:
        ends = (
            arc.MeasuredPoint(point, values[i], values[2 + i]) for i, point in enumerate(points)
        )
        top, crest = (values @ shapes).max(), _crest(*ends, METRIC)
        assert top <= crest + 1e-12
        if values[0] == values[1]:
            assert top == pytest.approx(crest, rel=1e-6)


@pytest.mark.parametrize(
    "places, concave",
    [
        ((0.2, 0.5, 0.9), True),  # rising, over the top, falling
        ((0.9, 1.6, 2.9), True),
        ((1.8, 2.4, 3.0), True),
        ((3.4, 3.9, 4.4), False),  # the same of the other half wave
        ((3.4, 4.5, 6.0), False),
        ((5.0, 5.5, 6.1), False),
        ((2.2, 2.6, 3.9), False),  # the middle on one side of the inflection, the end beyond it
        ((2.6, 3.6, 4.0), False),
    ],
)
def test_a_sine_is_concave_where_it_is_positive(places, concave):
    ends = [
        arc.MeasuredPoint(Point(np.zeros(1), p, True, 1, None), np.sin(p), np.cos(p))
        for p in places
    ]
    assert _concave(*ends, METRIC) is concave
