"""The forced response of a model with friction contacts, over a frequency band or over another
parameter.

    curve = forced_response(model, pairs, DryFriction2T(), F, (900, 1400), damping_ratio=0.01,
    outputs={"tip": row})

The story: the equations of the harmonic balance (`tipdamp.hbm.balance`), one parameter that varies
in them (`tipdamp.hbm.balance.parameter`), a first solution (`tipdamp.hbm.curve.starts`), the branch
through it (`tipdamp.hbm.continuation`), solved points where values were asked for and at the peaks,
and the arrays of the curve (`tipdamp.hbm.result`).
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation, as_parameter
from tipdamp.hbm.balance.parameter import Frequency, Parameter
from tipdamp.hbm.balance.problem import (
    AnyProblem,
    ContactProblem,
    contact_problem_of,
    doubted_problem,
)
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.contact_doubts import contact_doubts
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import insert_crossings
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.band_end import band_ends
from tipdamp.hbm.curve.checked_input import CheckedInput, Forcing, at_hz, forcing_of
from tipdamp.hbm.curve.drawn import refine_drawn
from tipdamp.hbm.curve.enough_harmonics import AUTO, enough_harmonics
from tipdamp.hbm.curve.equilibrium import check_carried, settle, with_residuals
from tipdamp.hbm.curve.folds_and_transitions import named_points
from tipdamp.hbm.curve.guess import (
    Guess,
    orders_of_guess,
    place_and_unknowns,
    repeats,
    solved,
    with_orders,
)
from tipdamp.hbm.curve.hold_check import hold_in_words, stiffer_change
from tipdamp.hbm.curve.options import (
    CurveKeywords,
    CurveOptions,
    PointsOfInterest,
    curve_options,
    with_options_named,
)
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.peaks import refine_largest
from tipdamp.hbm.curve.probes import probed
from tipdamp.hbm.curve.starts import first_of, starts
from tipdamp.hbm.curve.trace import of_contacts, record, slides, trace
from tipdamp.hbm.curve.truncation import TruncationEstimate, peak_multipliers, with_estimates
from tipdamp.hbm.curve.watched import Finishing, watched
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.hold.spring import Hold
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.modes.derivatives import with_derivatives
from tipdamp.hbm.periodic_solution import PeriodicSolution
from tipdamp.hbm.result import DOUBTFUL, ForcedResponse
from tipdamp.hbm.stability.multipliers import Stability
from tipdamp.hbm.validation import (
    MOST_HARMONICS,
    check_beyond,
    check_forcing,
    check_names,
    check_values,
    check_whole,
    in_hz,
    interval,
    numbers,
    one_of,
    positive,
)


@with_options_named
def forced_response(
    model: ReducedModel,
    pairs: ContactTable,
    law: ContactLaw,
    forcing: Forcing,
    band: Sequence[float] | None = None,
    *,
    omega: Sequence[float] | None = None,
    damping_ratio: ArrayLike | None = None,
    origin: str = "preloaded",
    static: np.ndarray | None = None,
    hold: Hold | Sequence[Hold] = (),
    **options: Unpack[CurveKeywords],
) -> ForcedResponse:
    """Curve of periodic responses over a frequency band.

    model : ReducedModel; pairs : ContactTable (pairs of weight 0 are left out); law : a law of
    `tipdamp.hbm.laws`
    forcing : (r,) real or complex amplitude F of Re F exp(i w t) in N, or {harmonic: (r,)}
    band : (from, to) Hz, or omega : (from, to) rad/s; from > to runs downwards
    damping_ratio : of the modes of the stuck system, a number or one per mode; None takes the
    model's C
    origin : 'preloaded' - q = 0 is the preloaded state, N = max(0, preload + kn u_n); 'unloaded' -
        q = 0 is the unloaded state, N = max(0, kn (u_n - gap)), and `static` (r,) N carries the
        static loads
    hold : rigid motions that no contact resists and that are held, such as Hold("y") of the damper;
        the peak and the mean force that this takes are solved again with ten times the stiffness,
        and a change of more than 1e-4 is warned of (`ForcedResponse.held_change`)
    options : of CurveOptions; `outputs` must be given
    Raises InputError on unusable input, before anything heavy. A point that does not converge stays
    in the result.

    >>> model, pairs = two_blades()
    >>> tip = model.displacement_row("blade1", 1, [0, 1, 0])
    >>> given = dict(damping_ratio=0.01, outputs={"tip": tip}, harmonics=1)
    >>> curve = forced_response(model, pairs, DryFriction2T(), 20 * tip, (600, 800), **given)
    >>> hz, height = curve.peak("tip")
    >>> print(f"{hz:.0f} Hz, {1e6 * height:.0f} um")
    694 Hz, 493 um
    """
    if origin == "preloaded" and static is not None:
        raise InputError(
            "static: the preloaded state holds the static loads already; use origin = 'unloaded'"
        )
    problem, kept, doubts = doubted_problem(
        model, pairs, law, (origin, static, damping_ratio, hold)
    )
    for doubt in (*doubts, *contact_doubts(model, pairs.select(kept))):
        warnings.warn(doubt, Doubt, stacklevel=2)
    start = options.get("start")
    if start is not None and not isinstance(start, str):
        start = numbers(
            "start", start, "must be 'zero_force', 'zero_slider' or slider positions (P, 2) in m"
        )
        options["start"] = start[kept] if start.shape[:1] == kept.shape else start
    curve = follow_band(problem, forcing, band, omega=omega, **options)
    for sentence in hold_in_words(curve, problem):
        warnings.warn(sentence, Doubt, stacklevel=2)
    return _with_all_pairs(curve, kept)


@with_options_named
def follow_band(
    problem: AnyProblem,
    forcing: Forcing | None,
    band: Sequence[float] | None = None,
    *,
    omega: Sequence[float] | None = None,
    **options: Unpack[CurveKeywords],
) -> ForcedResponse:
    """forced_response of a Problem or ContactProblem, for matrices without a node table; options :
    of CurveOptions.

    forcing : (r,) N of order 1, or {order: (r,)}; None for the forces of the Problem
    band : (from, to) Hz; or omega : (from, to) rad/s

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> rows = {"tip": [1.0]}
    >>> up = follow_band(problem, np.array([5.0]), (600, 1000), outputs=rows)
    >>> down = follow_band(problem, np.array([5.0]), (1000, 600), outputs=rows)
    >>> np.allclose(up.peak("tip"), down.peak("tip"), rtol=1e-6)
    True
    """
    ends, whole = in_hz("band", band, omega), contact_problem_of(problem)
    forcing = forcing_of(problem.forces, whole, forcing)
    return _curve(whole, forcing, (Frequency(), np.nan), ("band", ends), curve_options(options))


@with_options_named
def follow_parameter(
    problem: AnyProblem,
    forcing: Forcing | None,
    hz: float | None,
    parameter: str | Parameter,
    between: Sequence[float],
    *,
    omega: float | None = None,
    **options: Unpack[CurveKeywords],
) -> ForcedResponse:
    """Branch of periodic responses at one frequency over another parameter.

    forcing : as in `follow_band`
    hz : of the force; or None, and omega in rad/s
    parameter : 'level' (of the force), 'damping', 'preload', 'pull', 'gap', 'mu', 'kn' or 'kt' as
        a factor on all contacts (`ContactSetting`), or a Parameter of
        `tipdamp.hbm.balance.parameter`
    between : (from, to) of the parameter; both positive
    options : of CurveOptions. Raises InputError as forced_response.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, harmonics=1)
    >>> curve = follow_parameter(problem, np.array([5.0]), 760, "preload", (0.2, 4), **given)
    >>> best = curve.amplitude()[:, 0].argmin()
    >>> bool(0 < best < len(curve.parameter) - 1)  # neither loose nor stuck
    True
    """
    parameter, whole = as_parameter(parameter), contact_problem_of(problem)
    parameter.check(whole)
    return _curve(
        whole,
        forcing_of(problem.forces, whole, forcing),
        (parameter, positive("hz", in_hz("hz", hz, omega), " Hz")),
        ("between", between),
        curve_options(options),
    )


@with_options_named
def solve_at(
    problem: AnyProblem,
    forcing: Forcing | None,
    hz: float | None = None,
    *,
    omega: float | None = None,
    **options: Unpack[CurveKeywords],
) -> PeriodicSolution:
    """The periodic response of a Problem or ContactProblem at one frequency, hz or omega in rad/s.

    forcing : as in `follow_band`
    options : outputs, harmonics, periods, guess, start, samples, stability, settings of
        CurveOptions; with stability other than "none" the solution has its `multipliers`
    Where several solutions exist it is one of them: the crossings of a curve are all
    (`forced_response`, `solutions_at`).
    Raises InputError on unusable input; where no solution is found, `converged` is False. Warns
    where rounding, as of static forces 1e12 times the excitation, leaves a residual that is more
    than that of the points of a curve.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> found = solve_at(problem, np.array([5.0]), 760, outputs={"tip": [1.0]})
    >>> near = solve_at(
    ...     problem, np.array([5.0]), 770, outputs={"tip": [1.0]}, guess=found.unknowns
    ... )
    >>> found.converged, near.converged
    (True, True)

    A guess by hand, in the layout of `CurveOptions.guess`: two stops of one component, two orders.

    >>> two = (
    ...     Problem(np.eye(2), 0.1 * np.eye(2), np.eye(2)).force(0, 1.0)
    ...     .add(UnilateralSpring(), 0, kn=1.0, preload=1.0)
    ...     .add(UnilateralSpring(), (1, 0), kn=1.0, preload=1.0)
    ... )
    >>> guess = np.zeros((2, 1, 5))  # contacts, components, [mean, cos 1, -sin 1, cos 2, -sin 2]
    >>> guess[:, 0, 1] = 0.5  # both move as 0.5 cos tau
    >>> found = two.solve_at(0.2, outputs={"x": 0}, harmonics=2, guess=guess.ravel())
    >>> found.unknowns.reshape(guess.shape)[0, 0, 2] == found.contact_motion[0, 0, 1].imag
    True
    """
    chosen, whole = curve_options(options), contact_problem_of(problem)
    problem, forcing = whole, forcing_of(problem.forces, whole, forcing)
    asked = one_of("stability", chosen.stability, get_args(PointsOfInterest)) != "none"
    case = CheckedInput.checked(problem, forcing, chosen)
    hz = positive("hz", in_hz("hz", hz, omega), " Hz")
    problem, case = at_hz(problem, case, hz, chosen.periods)
    w = 2 * np.pi * hz / chosen.periods
    check_carried(problem, case.forces, w)
    balance, settings = case.balance(problem, chosen, w), case.settings
    point = _near(balance, chosen.guess, hz, w, settings)
    points, equation = [point], Equation(balance, Frequency(), periods=chosen.periods)
    (residual,), (energy,), (bad,) = settle(equation, points, [w])
    found = points[0].converged and not bad
    for sentence in _doubts(points[0], equation, hz, residual if found else None):
        warnings.warn(sentence, Doubt, stacklevel=2)
    solved = replace(points[0], converged=found)
    solution = as_solution(solved, balance, hz, case, float(residual))
    solution = replace(solution, periods=chosen.periods)
    return _with_stability(solution, balance, solved, case.rows) if asked and found else solution


def _near(
    balance: HarmonicBalance, guess: Guess | None, hz: float, w: float, settings: Settings
) -> Point:
    """The solution at w rad/s, hz of the excitation, near a guess; without one as curves begin."""
    if guess is None:
        return first_of(starts(balance, w, settings))
    x = with_orders(place_and_unknowns(guess, hz, hz)[1], balance)
    return solve_fixed(balance.evaluate, x, w, balance.weights, settings)


def _doubts(point: Point, equation: Equation, hz: float, residual: float | None) -> Iterator[str]:
    """Sentences on a single solution; residual : over the force scale, None where none was
    found."""
    if residual is None:
        if why := slides(equation.balance.problem):
            yield (
                f"solve_at: no solution was found at {hz:g} Hz; {why}give a `guess` that is near, "
                "or less force"
            )
        return
    if earlier := repeats(point, equation):
        yield (
            f"solve_at: the solution found at {hz:g} Hz {earlier}; give a `guess` that is nearer "
            "to one that lasts them all"
        )
    if residual > DEFAULT.equilibrium:
        yield (
            f"solve_at: the forces balance to {residual:.0e} of their scale only, by the rounding "
            "of static forces beside the excitation, or of the given matrices: more digits of "
            "the vibration are not known"
        )


def _with_stability(
    solution: PeriodicSolution, balance: HarmonicBalance, solved: Point, rows: np.ndarray
) -> PeriodicSolution:
    """With its multipliers, and the estimated error without which they say nothing."""
    estimate = TruncationEstimate(Equation(balance, Frequency()), rows, Stability())
    error, multipliers = estimate.of(solved), estimate.multipliers(solved)
    trusted = error.max() <= DOUBTFUL * solution.amplitude("rms").max()
    largest = np.abs(multipliers[0]) if trusted else np.nan
    return replace(
        solution,
        truncation=error,
        multipliers=multipliers,
        stable=bool(largest < 1),
        unstable=bool(largest > 1),
    )


def _curve(
    problem: ContactProblem,
    forcing: Forcing,
    varied: tuple[Parameter, float],
    between: tuple[str, ArrayLike],
    options: CurveOptions,
) -> ForcedResponse:
    """With the given number of harmonics, or as many as the tolerance needs."""
    branch = partial(_branch, problem, forcing, varied, between)
    if options.harmonics != AUTO:
        return branch(options)
    tolerance = positive("tolerance", options.tolerance)
    if options.journal is not None:
        raise InputError(
            "journal: is of one curve, and harmonics = 'auto' makes several; give a number"
        )
    orders = check_forcing(forcing, problem.K.shape[0], MOST_HARMONICS)
    of_guess = orders_of_guess(options.guess, problem.B.shape[0])
    return enough_harmonics(
        lambda H: branch(replace(options, harmonics=H, truncation=True)),
        partial(probed, problem, forcing, varied, options),
        tolerance,
        max(check_whole("periods", options.periods, 1) * max(orders, default=1), of_guess),
    )


def _branch(
    problem: ContactProblem,
    forcing: Forcing,
    varied: tuple[Parameter, float],
    between: tuple[str, ArrayLike],
    options: CurveOptions,
) -> ForcedResponse:
    """The branch between two values of a parameter, as a ForcedResponse; varied : (parameter,
    Hz)."""
    began, (parameter, hz), (argument, ends) = time.perf_counter(), varied, between
    first, last = interval(argument, ends, parameter.unit)
    parameter = parameter.over(check_whole("periods", options.periods, 1))
    case = CheckedInput.checked(problem, forcing, options)
    at = check_values(options.at, argument, first, last, parameter.unit)
    problem, case, w = _at_ends(problem, case, (parameter, hz), (first, last), options.periods)
    equation = Equation(case.balance(problem, options, w), parameter, hz, options.periods)
    begin, settings, scale = None, case.settings, parameter.scale
    if options.guess is not None:
        value, x = place_and_unknowns(options.guess, first, last)
        begin = solved(equation, x, value, settings=settings)
    past = check_beyond(options.beyond, argument, (first, last), parameter.unit)
    past = None if past is None else scale * past
    check_names("derivatives", options.derivatives, case.names)
    everywhere = one_of("stability", options.stability, get_args(PointsOfInterest)) == "all"
    outputs, estimate = Outputs(case.rows), None
    if options.truncation or everywhere:
        estimate = TruncationEstimate(equation, case.rows, Stability() if everywhere else None)

    def note(point: Point) -> None:
        outputs.along(point)
        if estimate:
            estimate.of(point)

    along = scale * first, scale * last
    with watched(options.progress, first, last, parameter.unit) as progress:
        branch = trace(equation, *along, settings, progress, note, past, begin)
        equation.balance.on_call = finishing = Finishing(progress, last)
        at_ends = band_ends(equation, branch, scale * last, past, settings)
        peak_points = _refined(equation, branch, outputs, case, scale * at)
        for point in branch.points:  # those that were put between have not been noted
            if point.converged:
                note(point)
                finishing()
            if point.detail is not None:
                point.detail.forget()
        change = stiffer_change(equation, branch, outputs, settings)
        settled = settle(equation, branch.points, (*along, *scale * at))
        curve = record(
            branch,
            equation,
            (case.names, outputs),
            options.contact,
            (peak_points, change),
            time.perf_counter() - began,
        )
        curve = replace(
            curve,
            further=at_ends.further,
            end_confirmed=at_ends.confirmed,
            ended=f"{curve.ended}; {at_ends.further}" if at_ends.further else curve.ended,
        )
        if estimate:
            curve = with_estimates(curve, estimate, branch.points, options.truncation)
        if options.stability == "peaks":
            multipliers = peak_multipliers(equation, case.rows, branch.points, peak_points)
            curve = replace(curve, multipliers=multipliers)
        curve = with_residuals(curve, settled, equation, branch.points)
        if everywhere and curve.converged.any():
            named = named_points(curve, problem, parameter, on_call=finishing)
            curve = replace(curve, named_points=named)
    return with_derivatives(curve, problem, options.derivatives) if options.derivatives else curve


def _at_ends(
    problem: ContactProblem,
    case: CheckedInput,
    varied: tuple[Parameter, float],
    ends: tuple[float, float],
    periods: int,
) -> tuple[ContactProblem, CheckedInput, float]:
    """(problem, checked input, w in rad/s at the last end) at the frequency, where another
    parameter varies; InputError where one cannot be at an end of the branch."""
    parameter, hz = varied
    if not np.isnan(hz):
        problem, case = at_hz(problem, case, hz, periods)
    elif problem.varying is not None:
        for end in ends:
            problem.varying.check_frequency(end)
    for value in ends:
        there, forces = parameter.rebuild(problem, case.forces, value)
        w = parameter.angular_frequency(2 * np.pi * hz / periods, parameter.scale * value)
        check_carried(there, forces, w)
    return problem, case, w


def _refined(
    equation: Equation, branch: Branch, outputs: Outputs, case: CheckedInput, at: np.ndarray
) -> np.ndarray:
    """Insert the points that were asked for at values (k,) of the branch, the peaks, and what a
    drawn curve needs; (n, m) bool, which of the points are peaks."""
    parameter, settings = equation.parameter, case.settings
    for p in insert_crossings(equation.evaluate, branch, at, equation.weights, settings):
        warnings.warn(
            f"at = {parameter.named(p / parameter.scale)}: a crossing could not be solved",
            Doubt,
            stacklevel=4,
        )
    if len(branch.points) <= 2:
        return np.empty((0, 0), dtype=bool)
    peak_points = refine_largest(equation, branch, outputs, case.groups, settings)
    return refine_drawn(equation, branch, outputs, peak_points, settings)


def _with_all_pairs(curve: ForcedResponse, kept: np.ndarray) -> ForcedResponse:
    """The pairs that were left out come back as open through the cycle."""
    if kept.all():
        return curve
    n = len(curve.frequency)
    columns: dict[str, Any] = {"carrying": kept}
    for name in ("share_stick", "share_slip", "share_open", "dissipated", "contact_force"):
        part = vars(curve)[name]
        if part.size:
            columns[name] = np.zeros((n, len(kept), *part.shape[2:]), dtype=part.dtype)
            columns[name][:, kept] = part
    every = np.r_[np.flatnonzero(kept), -1]  # the last for a point that is no contact's
    columns["named_points"] = tuple(
        replace(one, contact=int(every[one.contact])) for one in curve.named_points
    )
    columns["derivatives"] = {name: by.of_pairs(kept) for name, by in curve.derivatives.items()}
    return replace(curve, **columns)


def as_solution(
    point: Point, balance: HarmonicBalance, hz: float, case: CheckedInput, residual: float
) -> PeriodicSolution:
    """The PeriodicSolution of a point; NaN where it did not converge."""
    contacts = of_contacts([point], Equation(balance, Frequency()), True)
    found: dict[str, Any] = {name: values[0] for name, values in contacts.items()}
    motion = np.full_like(found["contact_force"], np.nan)
    harmonics = np.full((len(case.rows), balance.H + 1), np.nan, dtype=complex)
    if point.converged:
        motion = fourier.to_complex(point.x.reshape(len(motion), balance.nd, balance.nh))
        harmonics = point.detail.outputs(case.rows)
    held = tuple(one.name for one in balance.problem.held)
    return PeriodicSolution(
        frequency=hz,
        output_names=tuple(case.names),
        held=held,
        harmonics=harmonics,
        contact_motion=motion,
        converged=point.converged,
        iterations=point.iterations,
        unknowns=point.x,
        force_orders=tuple(case.forces),
        force_residual=residual,
        **found,
    )
