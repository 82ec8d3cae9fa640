"""The least of a curve and its flat range: against a closed form."""

import numpy as np
import pytest

from tipdamp.comparison.optimum import envelope, lowest_at, optimum, ranks
from tipdamp.comparison.peaks import ComparedPeak

BEST = 8.0


def level(Fe, height, blade=1):
    return ComparedPeak(
        "a", "", "in_phase", blade, 100.0, Fe, 3, 1600.0, height, None, 0.0, (), None, True, ""
    )


def valley(ratio):
    """Of a damper between stuck and free: symmetric in log-log about its least, 1e-7 m/N."""
    return 1e-7 * 0.5 * (ratio / BEST + BEST / ratio)


def peaks(ratios):
    return [level(100.0 / r, valley(r)) for r in ratios]


def test_least_and_flat_range_of_a_valley():
    """5 % above the least: cosh(log(r / best)) = 1.05."""
    one = optimum(peaks(BEST * np.geomspace(0.1, 10, 41)))
    wide = np.exp(np.arccosh(1.05))
    assert one.ratio == pytest.approx(BEST) and one.m_per_N == pytest.approx(1e-7)
    assert one.low == pytest.approx(BEST / wide, rel=5e-3)
    assert one.high == pytest.approx(BEST * wide, rel=5e-3)
    assert one.at_end == ""


def test_ends_of_what_was_computed_are_told():
    assert optimum(peaks(BEST * np.geomspace(1, 10, 21))).at_end == "low"
    assert optimum(peaks(BEST * np.geomspace(0.1, 1, 21))).at_end == "high"
    assert optimum(peaks(BEST * np.geomspace(0.9, 1.1, 5))).at_end == "both"
    assert optimum(peaks([3.0])) is None


def test_larger_blade_counts_and_levels_without_a_peak_do_not():
    both = [level(10.0, 2e-7), level(10.0, 3e-7, 2), level(20.0, 5e-7), level(20.0, None, 2)]
    ratio, height = envelope(both)
    assert ratio.tolist() == [10.0] and height.tolist() == [3e-7]


def test_ranks_and_where_a_curve_is_lowest():
    assert ranks({"a": 2.0, "b": 1.0, "c": 2.0}) == {"a": 2, "b": 1, "c": 2}
    ratio = np.array([1.0, 10.0, 100.0])
    found = lowest_at(
        {
            "falls": (ratio, np.array([4.0, 2.0, 1.0])),
            "rises": (ratio[1:], np.array([1.0, 4.0])),
        }
    )
    assert found == {"falls": (1, 2), "rises": (1, 2)}  # over 10 to 100, where both are known
