"""Frequencies in Hz or angular, points of a curve by their number."""

import numpy as np
import pytest

from tipdamp import CubicSpring, Problem, compare
from tipdamp.hbm.errors import InputError

DUFFING = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
GIVEN = {"outputs": {"x": 0}, "harmonics": 3}


def test_a_band_in_either_unit_is_one_curve():
    hz = DUFFING.follow_band((0.08, 0.35), **GIVEN)
    angular = DUFFING.follow_band(omega=(0.08 * 2 * np.pi, 0.35 * 2 * np.pi), **GIVEN)
    assert angular.peak("x") == pytest.approx(hz.peak("x"), rel=1e-9)


def test_one_solution_in_either_unit():
    hz = DUFFING.solve_at(0.12, **GIVEN)
    angular = DUFFING.solve_at(omega=0.12 * 2 * np.pi, **GIVEN)
    assert angular.frequency == pytest.approx(0.12) and angular.unknowns == pytest.approx(
        hz.unknowns
    )


@pytest.mark.parametrize("given", [{}, {"band": (0.1, 0.2), "omega": (1.0, 2.0)}])
def test_either_or(given):
    with pytest.raises(InputError, match="either band in Hz or omega in rad/s"):
        DUFFING.follow_band(**given, **GIVEN)


def test_a_point_of_a_curve_is_compared_by_its_number():
    """On the fold, where three motions have one frequency, without counting them."""
    curve = DUFFING.follow_band((0.08, 0.35), **{**GIVEN, "harmonics": 9})
    top = int(curve.amplitude()[:, 0].argmax())
    found = compare(curve, DUFFING, point=top)
    assert found.hz == pytest.approx(curve.frequency[top]) and found.difference < 1e-3
    for wrong in ({}, {"value": 0.2, "point": 3}):
        with pytest.raises(InputError, match="either a value or a point"):
            compare(curve, DUFFING, **wrong)
    with pytest.raises(InputError, match="point 9999"):
        compare(curve, DUFFING, point=9999)
