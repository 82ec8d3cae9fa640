"""Newton's method away from solutions that are known, on an equation with three."""

from dataclasses import replace

import numpy as np
import pytest

from tests.hbm.continuation.equations import s_curve
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.search.deflation import newton

ROOTS = 2 * np.cos(2 * np.pi / 9 + 2 * np.pi / 3 * np.arange(3))  # of x^3 - 3 x + 1, closed form
SETTINGS = replace(DEFAULT, tolerance=1e-10)


def found_from(x, known):
    arrays = [np.array([one]) for one in known]
    return newton(s_curve, np.array([x]), -1.0, np.ones(1), arrays, SETTINGS, 200)


@pytest.mark.parametrize("x", [1.7, 2.5, 10.0])
def test_each_solution_once(x):
    known = []
    for _ in ROOTS:
        point = found_from(x, known)
        assert point.converged
        known.append(point.x[0])
    assert sorted(known) == pytest.approx(sorted(ROOTS), abs=1e-8)


def test_without_known_solutions_it_is_newtons_method():
    assert found_from(1.7, []).x[0] == pytest.approx(max(ROOTS))
    assert found_from(10.0, []).x[0] == pytest.approx(max(ROOTS))
