"""Where the continuation looks for the next point, on curves whose points and tangents are
known."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.continuation.equations import s_curve
from tipdamp.hbm.continuation import predictor
from tipdamp.hbm.continuation.corrector import between
from tipdamp.hbm.continuation.point import Metric, Point

METRIC = Metric(np.ones(1), 1.0, 1.0)


def on_circle(s):
    """Point and tangent of the unit circle at a length of arc; the tangent of any length."""
    return Point(
        np.array([np.cos(s)]),
        np.sin(s),
        True,
        1,
        tangent=(-3 * np.array([np.sin(s)]), 3 * np.cos(s)),
    )


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_predictions_converge_at_their_order(order):
    """Steps of unequal length along a circle, halved: the error falls by 2^(order + 1)."""
    errors = []
    for h in (0.2, 0.1):
        x, p = predictor.predict(
            [on_circle(h * s) for s in (-2.5, -1.0, 0.0)], METRIC, 1.2 * h, order
        )
        errors.append(np.hypot(x[0] - np.cos(1.2 * h), p - np.sin(1.2 * h)))
    assert np.log2(errors[0] / errors[1]) > order + 0.8


def test_errors_are_those_that_the_predictions_had():
    """What the choice of order and step is made from, against predictions made beforehand."""
    run, new = [on_circle(s) for s in (-0.5, -0.2, 0.0)], on_circle(0.24)
    step = METRIC.norm(new.x - run[-1].x, new.parameter - run[-1].parameter) * (
        1 + (2 * np.sin(0.12)) ** 2 / 24
    )
    found = predictor.prediction_errors(run, new, METRIC)
    for order in range(1, 6):
        x, p = predictor.predict(run, METRIC, step, order)
        assert found[order - 1] == pytest.approx(
            METRIC.norm(x - new.x, p - new.parameter), rel=1e-9, abs=1e-15
        )


def test_point_that_runs_backward_is_refused():
    last, new = on_circle(0.0), on_circle(0.1)
    back = replace(new, tangent=(-new.tangent[0], -new.tangent[1]))
    assert predictor.on_branch(new, last, new.x, new.parameter, METRIC, (0.1, 1.0))
    assert not predictor.on_branch(back, last, new.x, new.parameter, METRIC, (0.1, 1.0))


def test_tangents_bring_a_point_between_two_others_close():
    """Newton's first residual on the S-shaped curve x^3 - 3 x = p, halved distances: the cubic's
    falls by 16."""

    def first_residual(reach):
        def watched(x, p):
            seen.append(s_curve(x, p))
            return seen[-1]

        seen, ends = [], (-1.7 - reach, -1.7 + reach)
        a, b = (
            Point(np.array([x]), x**3 - 3 * x, True, 1, tangent=(np.ones(1), 3 * x**2 - 3))
            for x in ends
        )
        assert between(watched, a, b, 0.4, np.ones(1)).converged
        return abs(seen[0].residual[0])

    assert first_residual(0.2) > 12 * first_residual(0.1)
