"""Frequencies in Hz or angular, points of a curve by their number."""

import inspect

import numpy as np
import pytest

import tipdamp
from tipdamp import (
    CubicSpring,
    DryFriction2T,
    ForcedResponse,
    Jenkins1D,
    MeasuredResponse,
    OwnForce,
    Problem,
    compare,
    fit_damping,
    follow_band,
    follow_fold,
    follow_parameter,
    follow_peak,
    forced_response,
    limit_cycle,
    linear_response,
    point_derivatives,
    solutions_at,
    solve_at,
    time_history,
)
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.example import two_blades

DUFFING = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
GIVEN = {"outputs": {"x": 0}, "harmonics": 3}
PLAIN = {"outputs": {"x": [1.0]}, "harmonics": 1}
CURVE = DUFFING.follow_band((0.08, 0.35), **GIVEN)
MATRICES, FORCE = DUFFING.contact_problem, np.array([0.2])
SELF_EXCITED = Problem([[1.0]], [[0.0]], [[1.0]]).add(
    OwnForce(lambda u, v: 0.5 * (u**2 - 1) * v, 1), 0
)
BLADES, PAIRS = two_blades()
TIP = BLADES.displacement_row("blade1", 1, [0, 1, 0])
DAMPED = Problem([[0.05]], K=[[1e6]], damping_ratio=0.02)
DAMPED = DAMPED.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
RUN = DAMPED.force(0, 5.0).follow_band((600, 1000), outputs={"x": 0}, harmonics=1)
RUN = MeasuredResponse(RUN.frequency, abs(RUN.harmonics[:, 0, 1]), [1.0], level=5.0)


def friction(band, **given):
    given |= {"damping_ratio": 0.01, "outputs": {"tip": TIP}, "harmonics": 1}
    return forced_response(BLADES, PAIRS, DryFriction2T(), TIP, band, **given)


# what each is asked for, f(place, **given), its answer as numbers, the place in Hz, and its name
ASKED = {
    Problem.follow_band: (
        lambda band, **given: DUFFING.follow_band(band, **GIVEN, **given).peak("x"),
        ("band", (0.08, 0.35)),
    ),
    Problem.solve_at: (
        lambda hz, **given: DUFFING.solve_at(hz, **GIVEN, **given).unknowns,
        ("hz", 0.12),
    ),
    Problem.limit_cycle: (
        lambda hz, **given: SELF_EXCITED.limit_cycle(hz, **GIVEN, **given).frequency,
        ("hz", 0.16),
    ),
    follow_band: (
        lambda band, **given: follow_band(MATRICES, FORCE, band, **PLAIN, **given).peak("x"),
        ("band", (0.08, 0.35)),
    ),
    forced_response: (
        lambda band, **given: friction(band, **given).peak("tip"),
        ("band", (650.0, 750.0)),
    ),
    follow_parameter: (
        lambda hz, **given: follow_parameter(
            MATRICES, FORCE, hz, "level", (0.1, 1), **PLAIN, **given
        ).amplitude()[-1],
        ("hz", 0.12),
    ),
    follow_peak: (
        lambda band, **given: follow_peak(
            MATRICES, FORCE, "level", (1, 0.5), band=band, **PLAIN, **given
        ).height[-1],
        ("band", (0.1, 0.4)),
    ),
    follow_fold: (
        lambda band, **given: follow_fold(
            MATRICES, FORCE, "level", (1, 0.8), band=band, **PLAIN, **given
        ).frequency[-1],
        ("band", (0.1, 0.4)),
    ),
    solve_at: (
        lambda hz, **given: solve_at(MATRICES, FORCE, hz, **PLAIN, **given).unknowns,
        ("hz", 0.12),
    ),
    limit_cycle: (
        lambda hz, **given: (
            limit_cycle(SELF_EXCITED.contact_problem, hz, **PLAIN, **given).frequency
        ),
        ("hz", 0.16),
    ),
    linear_response: (
        lambda hz, **given: linear_response(
            BLADES, None, TIP, hz, 0.01, {"tip": TIP}, **given
        ).view(float),
        ("frequencies", [600.0, 711.8]),
    ),
    fit_damping: (
        lambda band, **given: (
            fit_damping(DAMPED, [1.0], [RUN], band=band, harmonics=1, **given).values
        ),
        ("band", (700.0, 900.0)),
    ),
    ForcedResponse.at: (
        lambda value, **given: CURVE.at(value, **given).frequency,
        ("value", 0.1),
    ),
    solutions_at: (
        lambda value, **given: solutions_at(CURVE, DUFFING, value, **given).view(float),
        ("value", 0.1),
    ),
    time_history: (
        lambda value, **given: time_history(CURVE, DUFFING, "x", value, **given),
        ("value", 0.1),
    ),
    point_derivatives: (
        lambda value, **given: point_derivatives(CURVE, DUFFING, "x", value, **given).amplitude,
        ("value", 0.1),
    ),
    compare: (
        lambda value, **given: compare(CURVE, DUFFING, value, **given).hz,
        ("value", 0.1),
    ),
}
each = pytest.mark.parametrize("what", ASKED, ids=lambda what: what.__qualname__)


@each
def test_either_unit(what):
    ask, (_, place) = ASKED[what]
    angular = tuple(2 * np.pi * np.atleast_1d(place))
    found = ask(None, omega=angular if np.ndim(place) else angular[0])
    assert np.allclose(found, ask(place), rtol=1e-9, atol=0)


@each
def test_either_or(what):
    """None of both is refused too, but where a place need not be given."""
    ask, (name, place) = ASKED[what]
    said = f"either a {name} or a point" if what is compare else f"either {name} in Hz or omega"
    with pytest.raises(InputError, match=f"either {name} in Hz or omega in rad/s"):
        ask(place, omega=place)
    if what is not fit_damping:
        with pytest.raises(InputError, match=said):
            ask(None)


# of data, in the Hz of curves and readers
OF_RECORDS = {tipdamp.half_power, tipdamp.to_nlvib}


def test_whatever_takes_a_frequency_takes_either_unit():
    """Functions of the face, and methods of what curves are asked of, by names of arguments."""
    faces = [getattr(tipdamp, name) for name in tipdamp.__all__]
    asked = [*faces, *vars(Problem).values(), *vars(ForcedResponse).values()]
    takes = {
        one
        for one in filter(inspect.isfunction, asked)
        if set(inspect.signature(one).parameters) & {"band", "hz", "frequencies", "value"}
        and not one.__name__.startswith("_")
    }
    takes -= OF_RECORDS
    without = {one for one in takes if "omega" not in inspect.signature(one).parameters}
    assert without == set() and takes == set(ASKED)


def test_only_a_frequency_has_units():
    curve = follow_parameter(MATRICES, FORCE, 0.12, "level", (0.1, 1), **PLAIN)
    with pytest.raises(InputError, match="omega: the curve runs over level; give value"):
        curve.at(omega=0.5)


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
