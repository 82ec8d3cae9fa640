"""Peaks and folds of a curve, followed over a parameter.

peaks = follow_peak(problem, F, "level", (1, 300), outputs={"tip": row}, band=(900, 1400))
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tipdamp.hbm.amplitude import KINDS, amplitude, amplitude_along, orders_of
from tipdamp.hbm.balance.parameter import Parameter, as_parameter
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import insert_crossings
from tipdamp.hbm.continuation.follow import Budget, BudgetExceeded, follow
from tipdamp.hbm.continuation.point import Metric, Point, size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.outputs import ModalRows
from tipdamp.hbm.curve.trace import slides, unrestrained
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.following.extremum import Extremum, Slope
from tipdamp.hbm.following.result import Followed
from tipdamp.hbm.following.start import folds, highest_peak
from tipdamp.hbm.response import Forcing, follow_band
from tipdamp.hbm.validation import (
    MOST_HARMONICS,
    check_forcing,
    check_harmonics,
    check_outputs,
    check_settings,
    check_values,
    interval,
    one_of,
)

NEARBY = 0.01  # of the frequency: a unit of arc length along a curve
MOST_TAKEN_UP = 8  # times that another peak is taken up
BEYOND = 1e-3  # of the range: how far past an end another peak is looked for


class Met(BudgetExceeded):
    """A maximum has met a minimum: what follows is the minimum."""


@dataclass(frozen=True)
class _Case:
    """What is followed. rows (m, r) and names of all outputs, of which `row` (1, r) is measured."""

    problem: ContactProblem
    forces: dict
    parameter: Parameter
    what: str
    names: list
    rows: np.ndarray
    column: int
    kind: str
    band: tuple
    H: int
    start: Any
    samples: int | None
    settings: Settings

    @property
    def orders(self) -> list[int]:
        return orders_of(self.kind, None, self.H, list(self.forces))

    def curve(self, value):
        """(curve over the band, its problem) at a value of the parameter."""
        problem, forces = self.parameter.rebuild(self.problem, self.forces, value)
        given = dict(harmonics=self.H, samples=self.samples, truncation=False, start=self.start)
        outputs = {self.names[self.column]: self.rows[self.column]}
        return (
            follow_band(
                problem, forces, self.band, outputs=outputs, settings=self.settings, **given
            ),
            problem,
        )

    def slope(self) -> Slope:
        """Of the logarithm of what is extreme."""
        if self.what == "fold":
            return lambda found, tangent, length: tangent[1] / (found.w * length)
        modal, orders, kind = ModalRows(self.rows[[self.column]]), self.orders, self.kind

        def of_height(found, tangent, length):
            rows = modal.of(found.balance)
            X = rows @ found.modal
            change = rows @ (found.moved(*tangent).modal - found.modal)
            value, slope = amplitude_along(X, change, kind, orders)
            return float(slope[0] / (value[0] * length))

        return of_height

    def begin(self, value: float, near: float | None) -> tuple[np.ndarray, float] | None:
        """(x (n,), rad/s) of the highest peak, or of the fold nearest to `near` Hz, on the curve at
        a value."""
        curve, problem = self.curve(value)
        if self.what == "peak":
            return highest_peak(curve, problem, self.names[self.column], self.kind)
        found = folds(curve)
        hz = self.band[0] if near is None else near
        return min(found, key=lambda fold: abs(fold[1] - 2 * np.pi * hz), default=None)


def follow_peak(
    problem: AnyProblem,
    forcing: Forcing,
    parameter: str | Parameter,
    between: Sequence[float],
    *,
    outputs: Mapping[str, ArrayLike],
    band: Sequence[float],
    output: str | None = None,
    kind: str = "half_peak_to_peak",
    harmonics: int = 5,
    at: ArrayLike = (),
    start: str | np.ndarray | None = None,
    samples: int | None = None,
    settings: Settings | None = None,
    progress: Callable[[float, float, int], None] | None = None,
) -> Followed:
    """The highest peak of an output over a parameter, without a curve for each value.

    parameter, between, forcing : as in `follow_parameter`; between = (from, to)
    band : (low, high) Hz of the curve at the first value, whose highest peak is followed; where the
        peak ends another one is looked for in it and taken up
    outputs : {name: (r,) row}; output : name of the one whose peak it is, None the first
    kind : of amplitude, as in `ForcedResponse.amplitude`
    at : values of the parameter at which the peak is solved
    harmonics, start, samples, settings : as in CurveOptions; progress : function (value, step,
        calls)
    Raises InputError on unusable input, and where the first curve has no peak inside its band.
    Where a peak meets a minimum of the curve, or is lost, `ended` names it, as the values of `at`
    that are not solved. Another peak that grows above it on the way is not seen, and where the law
    bends the curve at the peak a step may lead to one beside it: a curve at the value that is
    chosen tells.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, band=(600, 1000), harmonics=1)
    >>> peaks = follow_peak(problem, np.array([5.0]), "preload", (4.0, 0.1), **given)
    >>> best = peaks.parameter[peaks.height.argmin()]
    >>> bool(0.1 < best < 4.0)  # a pull between stuck and loose damps best
    True
    """
    given = (problem, forcing, parameter, between, outputs, band, output, kind, harmonics)
    return _follow("peak", given, (start, samples, settings, progress), at, None)


def follow_fold(
    problem: AnyProblem,
    forcing: Forcing,
    parameter: str | Parameter,
    between: Sequence[float],
    *,
    outputs: Mapping[str, ArrayLike],
    band: Sequence[float],
    near: float | None = None,
    harmonics: int = 5,
    at: ArrayLike = (),
    start: str | np.ndarray | None = None,
    samples: int | None = None,
    settings: Settings | None = None,
    progress: Callable[[float, float, int], None] | None = None,
) -> Followed:
    """A fold of the curve over a parameter: where it turns back in frequency, and jumps begin.

    near : Hz, of the folds of the curve at the first value the nearest one; None the one nearest to
    the begin of the band. All else as in `follow_peak`; heights are those of the first output.
    Where two folds meet the curve does not turn back any more: `ended` says so.

    >>> duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0)
    >>> given = dict(outputs={"x": [1.0]}, band=(0.1, 0.9), harmonics=3)
    >>> problem, force = duffing.contact_problem, np.array([1.0])
    >>> fold = follow_fold(problem, force, "level", (1.0, 0.01), near=0.3, **given)
    >>> fold.complete, "two folds meet" in fold.ended  # with little force it does not turn back
    (False, True)
    """
    kind = KINDS[0]
    given = (problem, forcing, parameter, between, outputs, band, None, kind, harmonics)
    return _follow("fold", given, (start, samples, settings, progress), at, near)


def _follow(what, given, more, at, near) -> Followed:
    began = time.perf_counter()
    case, (first, last), progress = _checked(what, given, more)
    at = check_values(at, "between", first, last)
    scale = case.parameter.scale
    beginning = case.begin(first, near)
    if beginning is None:
        raise InputError(
            f"band = ({case.band[0]:g}, {case.band[1]:g}) Hz: the curve at "
            f"{case.parameter.named(first)} has no {what} inside it; widen the band"
        )
    runs, value = [], first
    while True:
        run = _run(case, beginning, (scale * value, scale * last), progress)
        runs.append(run)
        reached = run.branch.points[-1].parameter / scale
        value = reached + BEYOND * (last - first)
        past = (value - last) * (last - first) >= 0
        if run.branch.complete or past or what == "fold" or len(runs) > MOST_TAKEN_UP:
            break
        beginning = case.begin(value, near)
        if beginning is None:
            break
    for run in runs:
        insert_crossings(
            run.equation.evaluate, run.branch, scale * at, run.equation.weights, case.settings
        )
    return _record(case, runs, at, time.perf_counter() - began)


def _checked(what, given, more):
    problem, forcing, parameter, between, outputs, band, output, kind, harmonics = given
    start, samples, settings, progress = more
    problem = contact_problem_of(problem)
    if problem.varying is not None:
        raise InputError(
            "forces or matrices that depend on the frequency: a peak of theirs is not followed; "
            "use follow_band for each value"
        )
    parameter = as_parameter(parameter)
    parameter.check(problem)
    names, rows = check_outputs(outputs, len(problem.K))
    if output is not None and output not in names:
        raise InputError(f"output = '{output}': is none of outputs; {nearest(str(output), names)}")
    case = _Case(
        problem,
        check_forcing(forcing, len(problem.K), MOST_HARMONICS),
        parameter,
        what,
        names,
        rows,
        names.index(output or names[0]),
        one_of("kind", kind, KINDS),
        interval("band", band, " Hz"),
        check_harmonics(harmonics),
        start,
        samples,
        check_settings(settings, progress),
    )
    return case, interval("between", between), progress


@dataclass(frozen=True)
class _Run:
    """A branch of extrema, and whether it ended where a maximum met a minimum."""

    equation: Extremum
    branch: Branch
    met: bool


def _run(case: _Case, beginning, ends, progress) -> _Run:
    x, w = beginning
    start = "zero_slider" if case.start is None else case.start
    balance = HarmonicBalance(case.problem, case.forces, case.H, start, case.samples)
    metric = Metric(balance.weights, size(balance.weights * x), NEARBY * w)
    forward = np.zeros(len(x)), 1.0
    equation = Extremum(balance, case.parameter, case.slope(), metric, w, forward)
    if case.what == "fold":  # there the frequency is no way forward
        equation.along = metric.border(x / metric.size, 0.0)
    y, settings = equation.unknowns(x, w), case.settings
    begin = solve_fixed(equation.evaluate, y, ends[0], equation.weights, settings)
    if not begin.converged:
        raise InputError(
            f"the {case.what} at {case.parameter.named(ends[0] / case.parameter.scale)} is not "
            "smooth enough to be followed; begin at another value"
        )
    budget = Budget(settings, progress, ends[0], len(equation.weights))
    sign = np.sign(begin.detail.curvature)

    def report(point: Point, step: float) -> None:
        budget.point(point.parameter / case.parameter.scale, step, point.iterations)
        if point.detail is None or not point.converged:
            return
        equation.look_along(point.detail.tangent)
        turned = np.sign(point.detail.curvature) != sign
        point.detail.forget()
        if turned:
            raise Met

    balance.on_call = budget.call
    branch = follow(equation.evaluate, begin, ends[1], equation.weights, settings, report)
    balance.on_call = None
    branch.points = [p for p in branch.points if p.converged]
    last = branch.points[-1]
    met = not branch.complete and np.sign(last.detail.curvature) != sign
    if met:
        _to_the_meeting(equation, branch, np.sign(ends[1] - ends[0]), settings)
    return _Run(equation, branch, met)


def _to_the_meeting(equation, branch, sense, settings):
    """End the branch where the parameter turns back: there maximum and minimum are one."""
    a, b = branch.points[-2:]
    equation.near, equation.recent = 0.0, None
    metric = arc.metric_at(a, equation.weights)

    def measure(point):
        return arc.MeasuredPoint(
            point, sense * point.parameter, sense * point.tangent[1] / metric.norm(*point.tangent)
        )

    ends = measure(a), measure(b)
    if not ends[0].slope > 0 > ends[1].slope:
        branch.points.pop()
        return
    top = arc.maximum(equation.evaluate, ends, measure, metric, settings).best
    branch.points[-1:] = [] if top.point is a else [top.point]


def _record(case: _Case, runs: list[_Run], at: np.ndarray, seconds: float) -> Followed:
    points = [p for run in runs for p in run.branch.points]
    jumps = [p.jump or (p is run.branch.points[0]) for run in runs for p in run.branch.points]
    jumps[0] = False
    found = [p.detail.found for p in points]
    X = np.array([one.outputs(case.rows) for one in found])
    shares = np.array([one.forces.shares for one in found])
    w = [run.equation.frequency(p.x) for run in runs for p in run.branch.points]
    scale = case.parameter.scale
    return Followed(
        what=case.what,
        output=case.names[case.column],
        kind=case.kind,
        parameter_name=case.parameter.name,
        parameter=np.array([p.parameter for p in points]) / scale,
        frequency=np.array(w) / (2 * np.pi),
        height=amplitude(X[:, case.column], case.kind, case.orders),
        output_names=np.array(case.names, dtype=str),
        harmonics=X,
        share_stick=shares[..., 0],
        share_slip=shares[..., 1],
        share_open=shares[..., 2],
        curvature=np.array([p.detail.curvature for p in points]),
        jumps=np.array(jumps),
        ended=_ended(case, runs) + _unsolved(case, points, at),
        complete=bool(runs[-1].branch.complete),
        H=case.H,
        unknowns=np.array([p.x[:-1] for p in points]),
        calls=sum(run.branch.calls for run in runs),
        seconds=seconds,
    )


def _ended(case, runs):
    return "; another peak was taken up; ".join(_end_of(case, run) for run in runs)


def _unsolved(case, points, at):
    """Which of the wanted values the branch passes without a solved point, in words."""
    found = np.array([p.parameter for p in points])
    wanted = case.parameter.scale * at
    passed = (found.min() <= wanted) & (wanted <= found.max()) & ~np.isin(wanted, found)
    values = ", ".join(f"{value:g}" for value in at[passed])
    return f"; not solved at {case.parameter.name} = {values}" if values else ""


def _end_of(case, run):
    def named(p):
        return case.parameter.named(p / case.parameter.scale)

    last = run.branch.points[-1]
    place = named(last.parameter)
    if run.branch.complete:
        return "reached the last value"
    drifts = unrestrained(replace(last, detail=last.detail.found), case.problem)
    if drifts:
        return f"stopped at {place}{drifts}"
    why = slides(case.problem).removesuffix(" Where they are not to slide: ")
    also = f"; {why}" if why else ""
    if not run.met:
        return run.branch.sentence(named) + also
    if case.what == "peak":
        return f"at {place} the peak meets a minimum of the curve, and is none beyond{also}"
    return f"at {place} two folds meet, and the curve does not turn back there beyond{also}"
