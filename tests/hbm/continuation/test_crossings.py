"""Crossings of a value of the parameter along a branch, on a fold in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.continuation.test_arc import parabola
from tipdamp.hbm.continuation.arc import metric_at
from tipdamp.hbm.continuation.crossings import crossings, with_tangent
from tipdamp.hbm.continuation.point import failed
from tipdamp.hbm.continuation.settings import DEFAULT

HEIGHT = 0.965  # the fold is at p = 1, x = 1


@pytest.mark.parametrize("right", [1.2001, 1.1999, 1.21])
def test_a_fold_between_two_points_reaches_what_both_do_not(right):
    """Both points of the branch beside its fold are short of the value, at nearly the same one."""
    evaluate, point = parabola(1.0)
    points = [point(x, np.sign(1 - x)) for x in (0.0, 0.8, right, 2.0)]
    assert max(one.parameter for one in points) < HEIGHT
    found = crossings(evaluate, points, HEIGHT, np.ones(1), DEFAULT)
    away = np.sqrt(1 - HEIGHT)
    assert [one.x[0] for one, _, _ in found] == pytest.approx([1 - away, 1 + away], abs=1e-8)
    assert [place for _, _, place in found] == [2, 2]


def test_a_fold_short_of_the_value_is_not_crossed():
    evaluate, point = parabola(1.0)
    points = [point(x, np.sign(1 - x)) for x in (0.0, 0.8, 1.2001, 2.0)]
    assert crossings(evaluate, points, 1.001, np.ones(1), DEFAULT) == []


@pytest.mark.parametrize("way", [1, -1])
def test_tangent_of_a_point_between_two_that_were_not_found(way):
    """There is no chord that tells its way, and the orientation does: dp/dx = 2 (1 - x)."""
    evaluate, point = parabola(1.0)
    alone = replace(point(0.8, way), tangent=None)
    here = with_tangent(
        evaluate, [failed(1, 0.5), alone, failed(1, 0.98)], 1, metric_at(alone, np.ones(1))
    )
    (tx, tp) = here.tangent
    assert tp / tx[0] == pytest.approx(0.4) and here.orientation == alone.orientation
