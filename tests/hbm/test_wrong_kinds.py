"""What belongs to a curve takes a Problem as well as its ContactProblem, and tells arguments of
another kind in one line."""

from functools import cache

import numpy as np
import pytest

from tipdamp import (
    CubicSpring,
    InputError,
    Problem,
    backbone,
    branch_from,
    compare,
    contact_cycles,
    curves_beside,
    energy_balance,
    find_peaks,
    follow_band,
    limit_cycle,
    named_points,
    solutions_at,
    time_history,
    whole_motion,
)
from tipdamp.hbm.time.settings import IntegrationSettings

DUFFING = Problem([[1.0]], [[0.12]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
ROW = {"x": [1.0]}
COARSE = IntegrationSettings(samples=64)


@cache
def curve():
    return DUFFING.follow_band((0.15, 0.26), outputs={"x": 0}, harmonics=1, samples=16)


OF_A_CURVE = {
    "solutions_at": lambda problem: solutions_at(curve(), problem, 0.16),
    "time_history": lambda problem: time_history(curve(), problem, "x", 0.16)[1],
    "named_points": lambda problem: [p.parameter for p in named_points(curve(), problem)],
    "find_peaks": lambda problem: find_peaks(curve(), problem, "x"),
    "energy_balance": lambda problem: energy_balance(curve(), problem, 0).input,
    "contact_cycles": lambda problem: contact_cycles(curve(), problem, 0).force,
    "whole_motion": lambda problem: whole_motion(curve(), problem, 0),
    "compare": lambda problem: compare(curve(), problem, 0.16, settings=COARSE).difference,
    "backbone": lambda problem: backbone(problem, 1, (0.1, 0.2), outputs=ROW).frequency,
}


@pytest.mark.parametrize("name", OF_A_CURVE)
def test_a_problem_is_taken_as_it_is(name):
    of = OF_A_CURVE[name]
    assert np.array_equal(of(DUFFING), of(DUFFING.contact_problem))


BAD = {
    "point = \\(1, 2\\): must be a NamedPoint": lambda: branch_from(curve(), DUFFING, (1, 2)),
    "point = None: must be a NamedPoint": lambda: branch_from(curve(), DUFFING, None),
    "point = 3: must be a NamedPoint": lambda: branch_from(curve(), DUFFING, 3),
    "point = 'fold': must be a NamedPoint": lambda: branch_from(curve(), DUFFING, "fold"),
    "the point is a fold": lambda: branch_from(curve(), DUFFING, named_points(curve(), DUFFING)[0]),
    "problem = None: must be a Problem": lambda: solutions_at(curve(), None, 0.2),
    "problem = 'a'": lambda: limit_cycle("a", 1.0, outputs=ROW),
    "curve = 'c': must be a ForcedResponse": lambda: named_points("c", DUFFING),
    "value = 'a'": lambda: solutions_at(curve(), DUFFING, "a"),
    "the curve runs over frequency, not over level": lambda: solutions_at(
        curve(), DUFFING, 0.2, "level"
    ),
    "problem = 3: must be a Problem": lambda: follow_band(3, [0.2], (0.1, 0.2), outputs=ROW),
    "problem = 3": lambda: curves_beside(curve(), 3),
}


@pytest.mark.parametrize("said", BAD)
def test_other_kinds_are_told_in_a_line(said):
    with pytest.raises(InputError, match=said) as told:
        BAD[said]()
    assert "\n" not in str(told.value)
