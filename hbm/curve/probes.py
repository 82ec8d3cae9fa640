"""Points of a curve, solved again with more orders: how many a whole curve needs."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Unpack

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency, Parameter
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.checked_input import CheckedInput, Forcing, at_hz
from tipdamp.hbm.curve.enough_harmonics import (
    SETTINGS,
    Probe,
    Probed,
    error_of,
    orders_by_points,
)
from tipdamp.hbm.curve.guess import with_orders
from tipdamp.hbm.curve.options import CurveKeywords, CurveOptions, curve_options
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.truncation import TruncationEstimate
from tipdamp.hbm.errors import Doubt
from tipdamp.hbm.result import ForcedResponse


def more_harmonics(
    problem: ContactProblem,
    forcing: Forcing,
    curve: ForcedResponse,
    **options: Unpack[CurveKeywords],
) -> int | None:
    """The number of harmonics with which a curve of follow_band is within the `tolerance`, by some
    of its points, solved again; None where it is, where it stops, or has as many as are tried.

    options : those of the curve
    """
    chosen = curve_options(options)
    if not curve.complete or error_of(curve) <= chosen.tolerance:
        return None
    varied = Frequency(), np.nan
    probing = partial(probed, problem, forcing, varied, chosen)
    return orders_by_points(curve, chosen.tolerance, probing)


def probed(
    problem: ContactProblem,
    forcing: Forcing,
    varied: tuple[Parameter, float],
    options: CurveOptions,
    H: int,
    probes: Sequence[Probe],
) -> list[Probed]:
    """Points of a curve, solved again with H orders; those without a solution are left out."""
    parameter, hz = varied
    parameter = parameter.over(options.periods)
    options = replace(options, harmonics=H, journal=None)
    case = CheckedInput.checked(problem, forcing, options)
    if not np.isnan(hz):
        problem, case = at_hz(problem, case, hz, options.periods)
    w = 2 * np.pi * (probes[0].value if np.isnan(hz) else hz) / options.periods
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Doubt)  # of its memory, as of a whole curve
        balance = case.balance(problem, options, w)
    equation = Equation(balance, parameter, hz, options.periods)
    estimate = TruncationEstimate(equation, case.rows)
    found = []
    for value, unknowns in probes:
        x, p = with_orders(unknowns, balance), parameter.scale * value
        weights = equation.weights
        calls = SETTINGS.calls
        point = solve_fixed(equation.evaluate, x, p, weights, case.settings, calls)
        if callable(options.progress):
            options.progress(value, 0.0, point.iterations)
        if point.converged:
            found.append(Probed(Probe(value, point.x), _relative(estimate, point)))
    return found


def _relative(estimate: TruncationEstimate, point: Point) -> float:
    """The largest change of an output, of the largest vibration of one; infinite where nothing
    moves."""
    size = fourier.rms(Outputs(estimate.rows).at(point.detail)).max()
    change = np.max(estimate.of(point), initial=0.0)
    with np.errstate(divide="ignore"):
        return float(np.divide(change, size)) if change > 0 else 0.0
