"""Peaks and folds of a curve, followed over a parameter.

peaks = follow_peak(problem, F, "level", (1, 300), outputs={"tip": row}, band=(900, 1400))
"""

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Unpack

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.amplitude import KINDS, amplitude
from tipdamp.hbm.balance.equation import as_parameter
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem, contact_problem_of
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.checked_input import Forcing, forcing_of
from tipdamp.hbm.curve.options import given_options, options_named
from tipdamp.hbm.curve.trace import NO_PERIOD, slides
from tipdamp.hbm.curve.watched import watched
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.following.case import Case, Extreme
from tipdamp.hbm.following.highest import highest
from tipdamp.hbm.following.options import FollowKeywords, FollowOptions
from tipdamp.hbm.following.result import Followed
from tipdamp.hbm.following.run import Run, near, run_from
from tipdamp.hbm.following.taken_up import Path, solve_at
from tipdamp.hbm.validation import (
    MOST_HARMONICS,
    check_forcing,
    check_harmonics,
    check_outputs,
    check_settings,
    check_values,
    in_hz,
    interval,
    one_of,
)


@options_named(FollowOptions)
def follow_peak(
    problem: AnyProblem,
    forcing: Forcing | None,
    parameter: str | Parameter,
    between: Sequence[float],
    *,
    output: str | Sequence[str] | None = None,
    kind: str = "half_peak_to_peak",
    **options: Unpack[FollowKeywords],
) -> Followed:
    """The highest peak of an output over a parameter, without a curve for each value.

    forcing : as in `follow_parameter`, or None for the forces of the Problem; what is given takes
        the place of these, it is not added
    parameter, between : as in `follow_parameter`; between = (from, to)
    output : name of the one whose peak it is, None the first; several: the largest of them at each
        value, and where another one becomes the largest is located
    kind : of amplitude, as in `ForcedResponse.amplitude`
    options : of FollowOptions; `outputs`, and `band` or `omega`, must be given
    Raises InputError on unusable input, and where the first curve has no peak inside its band.

    At the last value, and where the branch of peaks ends (it meets a minimum of the curve, it is
    lost at a kink, it leaves the band), a whole curve tells the highest peak of the band. Another
    one that is higher is followed back to where both are as high and taken up there; where its way
    back is lost, `ended` says between which values it may be the highest, and `complete` is False.
    `ended` names each such place, and the values of `at` that are not solved. Where the curve has a
    kink at its peak, places are maxima of short pieces of the curve (`fitted`). A peak that is the
    highest only in between, and not at such a place, is not seen.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, band=(600, 1000), harmonics=1)
    >>> peaks = follow_peak(problem, np.array([5.0]), "preload", (4.0, 0.1), **given)
    >>> best = peaks.parameter[peaks.height.argmin()]
    >>> bool(0.1 < best < 4.0)  # a pull between stuck and loose damps best
    True
    """
    began = time.perf_counter()
    case, given, ends = _checked("peak", problem, forcing, parameter, between, options)
    columns = _columns(output, case.names)
    kind = one_of("kind", kind, KINDS)
    unit = case.parameter.unit
    shown = interval("between", between)
    with watched(given.progress, *shown, unit, by_factors=True) as progress:
        case = replace(case, columns=columns, kind=kind, progress=progress)
        path = highest(case, _first(case, ends[0], None), ends)
    return _record(path, _wanted(case, given, between), began)


@options_named(FollowOptions)
def follow_fold(
    problem: AnyProblem,
    forcing: Forcing | None,
    parameter: str | Parameter,
    between: Sequence[float],
    *,
    near: float | None = None,
    **options: Unpack[FollowKeywords],
) -> Followed:
    """A fold of the curve over a parameter: where it turns back in frequency, and jumps begin.

    near : Hz, of the folds of the curve at the first value the nearest one; None the one nearest to
    the begin of the band
    options : of FollowOptions, as in `follow_peak`; heights are those of the first output
    Where two folds meet the curve does not turn back any more: `ended` says so.

    >>> duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0)
    >>> given = dict(outputs={"x": [1.0]}, band=(0.1, 0.9), harmonics=3)
    >>> problem, force = duffing.contact_problem, np.array([1.0])
    >>> fold = follow_fold(problem, force, "level", (1.0, 0.01), near=0.3, **given)
    >>> fold.complete, "two folds meet" in fold.ended  # with little force it does not turn back
    (False, True)
    """
    began = time.perf_counter()
    case, given, ends = _checked("fold", problem, forcing, parameter, between, options)
    unit = case.parameter.unit
    shown = interval("between", between)
    with watched(given.progress, *shown, unit, by_factors=True) as progress:
        case = replace(case, progress=progress)
        run = run_from(case, _first(case, ends[0], near), ends)
    if run is None:
        raise InputError(
            f"the fold at {case.named(ends[0])} is not smooth enough to be followed; begin at "
            "another value"
        )
    path = Path(case, ends, [run], [run.why or "reached the last value"], not run.why)
    return _record(path, _wanted(case, given, between), began)


def _checked(
    what: str,
    problem: AnyProblem,
    forcing: Forcing | None,
    parameter: str | Parameter,
    between: Sequence[float],
    options: Any,
) -> tuple[Case, FollowOptions, tuple[float, float]]:
    """(case of the first output, options, values at both ends in units of the branch)."""
    given = given_options(FollowOptions, options, ("outputs",))
    whole = problem
    problem = contact_problem_of(problem)
    if problem.varying is not None:
        raise InputError(
            "forces or matrices that depend on the frequency: a peak of theirs is not followed; "
            "use follow_band for each value"
        )
    parameter = as_parameter(parameter)
    parameter.check(problem)
    names, rows = check_outputs(given.outputs, len(problem.K))
    case = Case(
        problem,
        check_forcing(forcing_of(whole.forces, problem, forcing), len(problem.K), MOST_HARMONICS),
        parameter,
        what,
        names,
        rows,
        (0,),
        KINDS[0],
        interval("band", in_hz("band", given.band, given.omega), " Hz"),
        check_harmonics(given.harmonics),
        given.start,
        given.samples,
        check_settings(given.settings, given.progress),
    )
    first, last = interval("between", between)
    return case, given, (parameter.scale * first, parameter.scale * last)


def _columns(output: Sequence[str] | None, names: list[str]) -> tuple[int, ...]:
    """Columns of the outputs whose largest peak is followed."""
    chosen = [output or names[0]] if output is None or isinstance(output, str) else list(output)
    for name in chosen:
        if name not in names:
            raise InputError(f"output = '{name}': is none of outputs; {nearest(str(name), names)}")
    if not chosen:
        raise InputError("output = []: must name one of outputs, or more")
    return tuple(names.index(name) for name in chosen)


def _wanted(case: Case, given: FollowOptions, between: Sequence[float]) -> np.ndarray:
    first, last = between
    return case.parameter.scale * check_values(given.at, "between", first, last)


def _first(case: Case, p: float, near: float | None) -> Extreme:
    top = case.begin(p / case.parameter.scale, near)
    if top is None:
        raise InputError(
            f"band = ({case.band[0]:g}, {case.band[1]:g}) Hz: the curve at {case.named(p)} has no "
            f"{case.what} inside it; widen the band"
        )
    return top


def _record(path: Path, at: np.ndarray, began: float) -> Followed:
    case = path.case
    for value in at:
        solve_at(path, value)
    placed = [(run, point) for run in path.runs for point in run.points]
    points = [point for _, point in placed]
    found = [point.detail.found for point in points]
    columns = np.array([run.column for run, _ in placed])
    fitted = np.array([run.fitted for run, _ in placed])
    X = np.array([one.outputs(case.rows) for one in found])
    shares = np.array([one.forces.shares for one in found])
    names = np.array(case.names, dtype=str)
    curvature = np.array([point.detail.curvature for point in points])
    return Followed(
        what=case.what,
        output=", ".join(case.names[j] for j in case.columns),
        kind=case.kind,
        parameter_name=case.parameter.name,
        parameter_unit=case.parameter.measured_in(case.forces),
        parameter=np.array([point.parameter for point in points]) / case.parameter.scale,
        frequency=np.array([one.w for one in found]) / (2 * np.pi),
        height=amplitude(X[np.arange(len(X)), columns], case.kind, case.orders),
        peak_of=names[columns],
        output_names=names,
        harmonics=X,
        share_stick=shares[..., 0],
        share_slip=shares[..., 1],
        share_open=shares[..., 2],
        friction_W=np.array([_power(one) for one in found]),
        curvature=np.where(fitted, np.nan, curvature),
        jumps=_jumps(path.runs),
        fitted=fitted,
        ended=_ended(path, points, at),
        complete=path.complete,
        H=case.H,
        unknowns=np.array([one.x for one in found]),
        calls=sum(run.calls for run in path.runs),
        seconds=time.perf_counter() - began,
    )


def _power(found: Linearisation) -> np.ndarray:
    """(P,) W that the contacts take."""
    u = found.x.reshape(found.forces.g.shape)
    return fourier.work(found.forces.g, u) * found.w / (2 * np.pi)


def _jumps(runs: Sequence[Run]) -> np.ndarray:
    """(n,) bool: the first place of a run that is not near the last one of the run before."""
    jumps = [np.zeros(len(run.points), dtype=bool) for run in runs]
    for k in range(1, len(runs)):
        a, b = runs[k - 1].points[-1].detail.found, runs[k].points[0].detail.found
        jumps[k][0] = not near(a, b.x, b.w)
    return np.concatenate(jumps)


def _ended(path: Path, points: Sequence[Point], at: np.ndarray) -> str:
    """What is said along the path, and which of the wanted values are not solved."""
    ended = "; ".join(filter(None, path.said)) + _unsolved(path.case, points, at)
    early = not path.complete and any(run.why and not run.enough for run in path.runs)
    if not early or NO_PERIOD in ended:
        return ended
    # what nothing but friction restrains, where a run ended early and did not say it
    said = slides(path.case.problem).removesuffix(" Where they are not to slide: ")
    return f"{ended}; {said}" if said else ended


def _unsolved(case: Case, points: Sequence[Point], at: np.ndarray) -> str:
    """Which of the wanted values the branch passes without a solved point, in words."""
    found = np.array([p.parameter for p in points])
    passed = (found.min() <= at) & (at <= found.max()) & ~np.isin(at, found)
    if not passed.any():
        return ""
    first, *others = at[passed]
    further = "".join(f", {value / case.parameter.scale:g}" for value in others)
    return f"; not solved at {case.named(first)}{further}"
