"""Where a quantity passes zero between two points of a branch, on a curve in closed form."""

import numpy as np
import pytest

from tests.hbm.continuation.test_arc import METRIC, parabola
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.enclosing import enclosed

LENGTH = 1e-5
AT = 0.83  # x, where the quantity passes zero

# of x; beyond or before `AT` the distance may not be known
MEASURES = {
    "linear": lambda x: x - AT,
    "known beyond alone": lambda x: (x - AT) * (1 + x) if x > AT else -np.inf,
    "known before alone": lambda x: np.inf if x > AT else (x - AT) * np.cos(x),
    "a jump": lambda x: 1.0 if x > AT else -1.0,
    "known nowhere": lambda x: np.inf if x > AT else -np.inf,
    "not linear": lambda x: (x - AT) ** 3,
}


@pytest.mark.parametrize("name", MEASURES)
@pytest.mark.parametrize("back", [False, True])
def test_what_passes_zero_is_enclosed(name, back):
    """From both ends; in fewer steps than by halving where the distance is told on one side."""
    evaluate, point = parabola(1.0)
    ends = [point(x, -1 if back else 1) for x in (0.2, 0.95)]
    a, b = ends[::-1] if back else ends
    solved = []

    def measure(q):
        solved.append(q)
        return MEASURES[name](q.x[0])

    near = enclosed(evaluate, a, b, measure, METRIC, LENGTH)
    assert arc.distance(*near, METRIC) <= LENGTH
    first, last = (q.x[0] > AT for q in near)
    assert (first, last) == (back, not back)
    halvings = int(np.ceil(np.log2(arc.distance(a, b, METRIC) / LENGTH)))
    fewer = {"linear": 2, "known beyond alone": 2, "known before alone": 1.5, "not linear": 0.3}
    assert len(solved) - 2 <= halvings / fewer.get(name, 0.9)


def test_two_points_that_are_near_stay():
    evaluate, point = parabola(1.0)
    a, b = point(0.5, 1), point(0.5 + 1e-8, 1)
    assert enclosed(evaluate, a, b, lambda q: q.x[0] - 0.5 - 5e-9, METRIC, LENGTH) == (a, b)
