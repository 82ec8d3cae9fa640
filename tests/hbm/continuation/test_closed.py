"""A branch that returns to its start, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.continuation.equations import Dense, start_at
from tipdamp.hbm.continuation.closed import follow_both_ways, follow_one_way
from tipdamp.hbm.continuation.corrector import heading
from tipdamp.hbm.continuation.settings import DEFAULT


def ellipse(x, p):
    """(x - 3)^2 + (p - 5)^2 / 4 = 1."""
    value = (x - 3) ** 2 + (p - 5) ** 2 / 4 - 1
    return Dense(value, np.diag(2 * (x - 3)), np.array([(p - 5) / 2]))


def test_once_round_begins_and_ends_with_the_same_point():
    start = heading(start_at(ellipse, 4.0, 5.0), 1.0)
    settings = replace(DEFAULT, largest_step=0.1)
    branch = follow_both_ways(ellipse, start, (0.0, 10.0), np.ones(1), settings, 500)
    x = np.array([point.x[0] for point in branch.points])
    p = np.array([point.parameter for point in branch.points])
    assert branch.end == "round" and len(p) > 20
    assert (x[0], p[0]) == (x[-1], p[-1]) and p[0] == p.min() and p.max() > 6.8
    turned = np.unwrap(np.arctan2(x - 3, (p - 5) / 2))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi)
    assert (np.sign(np.diff(turned)) == np.sign(turned[-1] - turned[0])).all()


def test_one_way_round_ends_where_it_began():
    start = heading(start_at(ellipse, 4.0, 5.0), 1.0)
    branch = follow_one_way(ellipse, start, (0.0, 10.0), np.ones(1), DEFAULT, 500)
    assert branch.end == "round"
    assert branch.points[-1].x[0] == start.x[0] and branch.points[-1].parameter == start.parameter
