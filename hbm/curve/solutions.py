"""Single solutions at a value of the parameter of a curve, and their course over a period."""

import warnings
from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import BY_NAME, Equation, as_parameter
from tipdamp.hbm.balance.parameter import Frequency, Parameter
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.varying import at_frequency
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import crossings
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.result import ForcedResponse, along
from tipdamp.hbm.validation import brief, check_kind, check_whole, numbers

# residual of a stored point relative to its motion, above which the problem is another one
SOLVES = 1e-6


def solutions_at(
    curve: ForcedResponse,
    problem: AnyProblem,
    value: float | None = None,
    parameter: Parameter | None = None,
    *,
    omega: float | None = None,
) -> np.ndarray:
    """(s, m, H+1) complex harmonics of every solution at a frequency in Hz, or omega in rad/s, one
    for each crossing of the curve.

    problem : the Problem or ContactProblem that the curve was made with
    value : in a curve over another parameter, a value of that; parameter : as given to
        `follow_parameter`, where that was no name
    Every solution is solved to the tolerance: those that the curve holds there (`at` of
    forced_response), and by Newton from the points around each other crossing. A crossing that
    could not be solved is left out, with a warning. Warns where there may be others: the curve is
    incomplete, or does not lead to all solutions that are known at the end of its band
    (`ForcedResponse.further`). Raises InputError outside the curve, and where the problem does not
    fit.

    >>> duffing = Problem([[1.0]], [[0.12]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
    >>> given = dict(outputs={"x": 0}, harmonics=1, samples=16, truncation=False)
    >>> curve = duffing.follow_band((0.15, 0.26), **given)
    >>> found = solutions_at(curve, duffing.contact_problem, 0.21)
    >>> print(np.abs(found[:, 0, 1]).round(2))  # three on the fold, in their order along the curve
    [1.06 0.88 0.29]
    """
    value = along(curve, value, omega)
    doubt = curve.further if curve.complete else f"it is incomplete, {curve.ended}"
    if doubt:
        warnings.warn(
            f"solutions at {value:g}: others than those of the curve are possible: {doubt}",
            Doubt,
            stacklevel=2,
        )
    equation, points = restored(curve, problem, parameter)
    found = [
        (place, point.detail.outputs(curve.output_rows) if at is None else curve.harmonics[at])
        for place, at, point in _places(curve, equation, points, value)
    ]
    return np.array([X for _, X in sorted(found, key=lambda one: one[0])]).reshape(
        -1, *curve.harmonics.shape[1:]
    )


def points_at(
    curve: ForcedResponse, problem: AnyProblem, value: float, parameter: Parameter | None = None
) -> tuple[HarmonicBalance, list[Point]]:
    """(balance at a value of the parameter, [points solved there]), in the order of `solutions_at`.

    Raises InputError as `solutions_at`; a point that the frozen balance does not solve again is not
    converged."""
    equation, points = restored(curve, problem, parameter)
    balance, w = equation.balance_at(equation.parameter.scale * value)
    return balance, [
        solve_fixed(balance.evaluate, point.x, w, balance.weights)
        for point in points_of(curve, equation, points, value)
    ]


def point_of(
    curve: ForcedResponse, problem: AnyProblem, point: int, parameter: Parameter | None = None
) -> tuple[HarmonicBalance, Point]:
    """(balance, a point of a curve solved there) by its number.

    Raises InputError where it was not solved, or the problem is not that of the curve."""
    equation, there = solved_point(curve, problem, point, parameter)
    balance, w = equation.balance_at(there.parameter)
    return balance, solve_fixed(balance.evaluate, there.x, w, balance.weights)


def solved_point(
    curve: ForcedResponse, problem: AnyProblem, point: int, parameter: Parameter | None
) -> tuple[Equation, Point]:
    """(equation, a point of a curve) by its number; InputError where it was not solved."""
    equation, points = restored(curve, problem, parameter)
    if not 0 <= check_whole("point", point, 0) < len(points) or not points[point].converged:
        raise InputError(f"point {point}: not a solved point of the curve, which has {len(points)}")
    return equation, points[point]


def points_of(
    curve: ForcedResponse, equation: Equation, points: list[Point], value: float
) -> list[Point]:
    """The points of a restored curve at a value of its parameter, in the order of
    `solutions_at`."""
    found = sorted(_places(curve, equation, points, value), key=lambda one: one[0])
    return [point for _, _, point in found]


def time_history(
    curve: ForcedResponse,
    problem: AnyProblem,
    name: str,
    value: float | None = None,
    which: int = 0,
    n: int = 256,
    parameter: Parameter | None = None,
    *,
    omega: float | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """(t (n,) s, x (n,) m) of an output over one period of the motion; value, omega, which : place
    in `solutions_at`.

    Raises InputError as `solutions_at`, and where the curve has no such solution.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> t, x = time_history(curve, problem, "tip", 700.0)
    >>> largest = np.abs(solutions_at(curve, problem, 700.0)).sum(axis=-1).item()
    >>> bool(np.ptp(x) / 2 <= largest), f"{256 * (t[1] - t[0]) * 700:.6f}"  # one period
    (True, '1.000000')
    """
    check_whole("time_history: n", n, 1)
    check_whole("time_history: which", which, 0)
    value = along(curve, value, omega)
    found = solutions_at(curve, problem, value, parameter)
    if which >= len(found):
        raise InputError(
            f"time_history: which = {which}: the curve has {len(found)} solutions at {value:g}"
        )
    hz = value if curve.parameter_name == "frequency" else curve.frequency[0]
    tau = 2 * np.pi * np.arange(n) / n
    return tau / (2 * np.pi * hz / curve.periods), fourier.basis(tau, curve.H) @ fourier.to_real(
        found[which, curve.column(name)]
    )


def restored(
    curve: ForcedResponse, problem: AnyProblem, parameter: Parameter | None = None
) -> tuple[Equation, list[Point]]:
    """The equation of a curve and its points, from its arrays and the problem that it was made
    with."""
    check_kind("curve", curve, ForcedResponse, "follow_band, or ForcedResponse.load")
    whole = contact_problem_of(problem)
    parameter = _parameter_of(curve, parameter)
    _check_fits(curve, whole)
    if parameter.name != "frequency":  # the forces of the curve are those at its frequency
        whole = at_frequency(whole, 2 * np.pi * float(curve.frequency[0]))
    start = curve.slider_start if curve.start == "given" else curve.start
    forces = dict(zip(curve.force_orders.tolist(), curve.forces, strict=True))
    balance = HarmonicBalance(whole, forces, curve.H, start, curve.samples)
    columns = (
        curve.unknowns,
        parameter.scale * curve.parameter,
        curve.converged,
        curve.iterations,
        curve.orientation,
        curve.jumps,
    )
    points = [
        Point(x, p, bool(good), int(calls), orientation=sign, jump=bool(jump))
        for x, p, good, calls, sign, jump in zip(*columns, strict=True)
    ]
    equation = Equation(balance, parameter, float(curve.frequency[0]), curve.periods)
    _check_solves(equation, [point for point in points if point.converged])
    return equation, points


def _parameter_of(curve: ForcedResponse, given: Parameter | None) -> Parameter:
    """What a curve runs over; given : as it was to `follow_parameter`, where that was no name."""
    known = {"frequency": Frequency(), **BY_NAME}
    if given is None and curve.parameter_name not in known:
        raise InputError(
            f"the curve runs over {curve.parameter_name}: give the `parameter` that it was made "
            "with"
        )
    parameter = known[curve.parameter_name] if given is None else as_parameter(given)
    if parameter.name != curve.parameter_name:
        raise InputError(
            f"parameter: the curve runs over {curve.parameter_name}, not over {parameter.name}"
        )
    return parameter.over(curve.periods)


def _check_fits(curve: ForcedResponse, whole: ContactProblem) -> None:
    """InputError where a curve is of another number of contacts or dofs, or holds no unknowns."""
    r = whole.K.shape[0]
    P = len(whole.contacts)
    kept = int(curve.carrying.sum())
    if not curve.unknowns.size:
        raise InputError("the curve holds no unknowns: it was measured, or made by another program")
    if kept != P or curve.forces.shape[1] != r:
        raise InputError(
            f"the problem has {P} contacts and {r} dofs, that of the curve had {kept} and "
            f"{curve.forces.shape[1]}"
        )


def _check_solves(equation: Equation, points: Sequence[Point]) -> None:
    """InputError where points of the curve do not solve the equation: the problem is another
    one."""
    for point in (
        {id(p): p for p in (points[0], points[len(points) // 2])}.values() if points else ()
    ):
        error = np.linalg.norm(equation.evaluate(point.x, point.parameter).residual)
        size = np.linalg.norm(point.x)
        value = point.parameter / equation.parameter.scale
        if error > SOLVES * size:
            raise InputError(
                "the problem is not that of the curve: its point at "
                f"{equation.parameter.named(value)} leaves a residual of {error / size:.1e} of "
                "the motion; give the problem that the curve was made with"
            )


def _places(
    curve: ForcedResponse, equation: Equation, points: Sequence[Point], value: float
) -> Iterator[tuple[int, int | None, Point]]:
    """(place in the curve, index where the curve holds it or None, point) of every solution at a
    value."""
    f = curve.parameter
    unit = equation.parameter.unit
    if np.shape(numbers("value", value, "must be one number")):
        raise InputError(f"value = {brief(value)}: must be one number")
    low, high = f.min(), f.max()
    if not low * (1 - 1e-12) <= value <= high * (1 + 1e-12):
        raise InputError(
            f"solutions at {value:g}{unit}: the band of the curve is {low:g} to {high:g}{unit}"
        )
    there = np.abs(f - value) <= 1e-12 * value
    for i in np.flatnonzero(there & curve.converged):
        yield i, i, points[i]
    p = equation.parameter.scale * value
    for point, _, i in crossings(equation.evaluate, points, p, equation.weights, DEFAULT):
        if not point.converged:
            warnings.warn(
                f"a crossing of {equation.parameter.named(value)} could not be solved: a solution "
                "is missing",
                Doubt,
                stacklevel=3,
            )
        elif not there[i - 1 : i + 1].any():
            yield i, None, point
