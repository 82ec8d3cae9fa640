"""Choices among values that are equal to rounding: the same whatever the last digits are."""

import numpy as np
import pytest

from tipdamp.hbm.ties import first_largest, in_order, levels


@pytest.mark.parametrize("seed", range(5))
def test_the_last_digit_decides_nothing(seed):
    noise = 1 + 1e-15 * np.random.default_rng(seed).normal(size=6)
    values = np.array([1.0, 3.0, 1.0, 3.0, 2.0, -3.0]) * noise
    assert first_largest(values) == 1
    assert levels(values).tolist() == [1, 3, 1, 3, 2, 0]
    assert in_order(values).tolist() == [5, 0, 2, 4, 1, 3]


def test_what_differs_is_told_apart():
    assert first_largest([1.0, 1.0 + 1e-6]) == 1 and levels([1.0, 1.0 + 1e-6]).tolist() == [0, 1]
    assert first_largest([-1.0, -1.0 - 1e-12]) == 0
    assert first_largest([-np.inf, 2.0, np.nan]) == 1
    assert levels([-np.inf, -np.inf, 0.0]).tolist() == [0, 0, 1]
    assert levels([]).tolist() == [] and in_order([4.0]).tolist() == [0]
    assert first_largest(np.zeros(3)) == 0 and first_largest([5]) == 0
