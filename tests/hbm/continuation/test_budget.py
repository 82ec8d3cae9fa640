"""The budget of residual calls."""

from dataclasses import replace

import pytest

from tipdamp.hbm.continuation.follow import Budget, BudgetExceeded
from tipdamp.hbm.continuation.settings import DEFAULT

TICK = DEFAULT.progress_interval


def test_progress_between_points_and_the_limit():
    told = []
    budget = Budget(
        replace(DEFAULT, max_calls=5 * TICK, calls_per_point=1),
        lambda *what: told.append(what),
        80.0,
        400,
    )
    budget.point(81.0, 0.1, 3)
    for _ in range(5 * TICK + 1):
        budget.call()
    assert told == [(81.0, 0.1, 3)] + [(81.0, 0.0, k * TICK) for k in range(1, 6)]
    for _ in range(2):
        with pytest.raises(BudgetExceeded):
            budget.call()


def test_the_first_point_has_a_limit_of_its_own():
    budget = Budget(replace(DEFAULT, max_calls=1000, max_first_calls=3), None, 80.0, 400)
    for _ in range(3):
        budget.call()
    with pytest.raises(BudgetExceeded):
        budget.call()
    budget.point(81.0, 0.1, 4)
    budget.call()
