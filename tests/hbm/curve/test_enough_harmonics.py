"""As many harmonics as a tolerance needs, beside solutions with many more."""

import warnings
from typing import NamedTuple

import numpy as np
import pytest

from tests.hbm.cases import coupled, load, unilateral
from tests.hbm.curve.test_truncation import BAND, CASES, OUTPUTS, chain, true_errors
from tests.hbm.oscillator import FORCE, Y2, oscillator
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.enough_harmonics import (
    SETTINGS,
    Probed,
    error_of,
    next_orders,
    orders_by_points,
)
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.response import follow_band, follow_parameter


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
@pytest.mark.parametrize("case", CASES)
def test_the_tolerance_is_met(case, tolerance):
    problem = chain(*CASES[case])
    curve = problem.follow_band(BAND, outputs=OUTPUTS, harmonics="auto", tolerance=tolerance)
    at = np.linspace(0, len(curve.frequency) - 1, 25).astype(int)
    true = true_errors(problem, curve, at, 40)
    assert curve.complete and np.mean(true <= tolerance) >= 0.95 and true.max() <= 2 * tolerance
    enough = curve.H if curve.H == SETTINGS.first else int(0.6 * curve.H)
    fewer = problem.follow_band(BAND, outputs=OUTPUTS, harmonics=enough)
    assert curve.H == SETTINGS.first or error_of(fewer) > tolerance


def test_no_number_meets_it():
    problem, force = unilateral(load("C1")["parameters"])
    with pytest.warns(UserWarning, match=r"the tolerance 1e-12 is not met.* with H = 3, .*H = 45"):
        curve = follow_band(
            problem, force, (0.1, 0.2), outputs={"x": [1.0]}, harmonics="auto", tolerance=1e-12
        )
    assert curve.H == 45 and curve.complete


def test_over_a_parameter_and_of_a_curve_that_stops():
    problem, force = coupled(load("D1")["parameters"])
    rows = {"x": np.eye(len(problem.K))[0]}
    curve = follow_parameter(
        problem, force, 0.2, "level", (0.5, 1.5), outputs=rows, harmonics="auto", tolerance=1e-5
    )
    assert curve.H > 3 and error_of(curve) <= 1e-5
    few = Settings(max_points=3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stops = follow_band(
            oscillator(), FORCE, (60.0, 300.0), outputs=Y2, harmonics="auto", settings=few
        )
    assert not stops.complete and stops.H == 3


def test_force_of_a_high_order():
    """The first number of harmonics holds twice the order of the force."""
    problem = chain(*CASES["cubic"]).force(0, 0.2, harmonic=4)
    curve = problem.follow_band((0.1, 0.2), outputs=OUTPUTS, harmonics="auto", tolerance=1e-2)
    assert curve.H >= 8


def test_orders_by_two_errors():
    """Where errors fall like H^-3, and where they hardly fall; odd numbers, for an even order adds
    nothing to a motion that is odd."""
    assert next_orders([(3, 1.1e-3)], 1e-3) == 5
    assert next_orders([(3, 8e-3)], 1e-3) == 7
    assert next_orders([(3, 8e-3), (6, 2e-3)], 1e-3) == 9
    assert next_orders([(3, 8e-3), (6, 7.9e-3)], 1e-3) == 19


class Curve(NamedTuple):
    """What is asked of a curve that misses 1e-3."""

    H: int
    relative_truncation: np.ndarray
    converged: np.ndarray
    parameter: np.ndarray
    unknowns: np.ndarray


def curve_of(H, errors):
    n = len(errors)
    return Curve(H, np.array(errors), np.ones(n, bool), np.arange(n) + 1.0, np.zeros((n, 1)))


@pytest.mark.parametrize(
    "error_at, wanted, asked",
    [
        (lambda H: 0.4 / H**4, 7, [7, 5]),  # H^3 is counted with: one smaller number is tried
        (lambda H: 0.4 / H**2, 29, [9, 27, 29]),  # slower: by the slope of two
        (lambda H: 0.05 / H, SETTINGS.most, [9, 27, 45]),  # never enough
        (lambda H: 2e-5, 5, [7, 5]),
    ],
)
def test_number_by_points(error_at, wanted, asked):
    """The least that the points ask for, to a quarter, with few numbers that are tried; half of the
    tolerance is aimed at."""
    made = []

    def probing(H, probes):
        made.append(H)
        return [Probed(probe, error_at(H)) for probe in probes]

    first = max(error_at(3), 5e-3)
    assert orders_by_points(curve_of(3, [first] * 40), 1e-3, probing) == wanted
    assert made == asked


def test_points_that_are_solved_with_more_orders():
    """Those that miss the tolerance, the worst hundredth left out; where one has no solution with
    more orders the others tell, and where none has the number that the errors ask for is taken."""
    errors = [1e-4] * 290 + [2e-3] * 7 + [1.0] * 3
    asked = []

    def probing(H, probes):
        asked.append([probe.value for probe in probes])
        return [Probed(probe, 2e-4) for probe in probes[len(asked) :]]

    assert orders_by_points(curve_of(3, errors), 1e-3, probing) == 5
    assert set(asked[0]) <= set(range(291, 301)) and len(asked[0]) > 2
    assert orders_by_points(curve_of(3, errors), 1e-3, lambda H, probes: []) == 5
    assert orders_by_points(curve_of(SETTINGS.most, errors), 1e-3, probing) is None


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_points_spare_curves(case):
    """At most three more beside the first, whatever the tolerance."""
    problem, made = chain(*CASES[case]), []

    def noted(hz, step, calls):
        made.append(hz)

    for tolerance in (1e-3, 1e-5):
        made.clear()
        curve = problem.follow_band(
            BAND, outputs=OUTPUTS, harmonics="auto", tolerance=tolerance, progress=noted
        )
        begun = np.count_nonzero(np.array(made) == BAND[0])
        assert begun <= 4 and (error_of(curve) <= tolerance or curve.H == SETTINGS.most)


@pytest.mark.parametrize(
    "options, said",
    [
        ({"harmonics": "all"}, "must be a whole number between 0 and 200, or 'auto'"),
        ({"harmonics": "auto", "tolerance": 0.0}, "tolerance"),
        ({"harmonics": "auto", "tolerance": "small"}, "tolerance"),
    ],
)
def test_what_it_cannot_be(options, said):
    problem = chain(*CASES["cubic"])
    with pytest.raises(InputError, match=said):
        problem.follow_band(BAND, outputs=OUTPUTS, **options)
