"""forced_response: from a reduced model, contact pairs and a forcing to the curve over a frequency band."""

import time
import warnings
from dataclasses import dataclass, replace

import numpy as np

from hbm.balance.receptance import describe_motion
from hbm.balance.residual import ContactProblem, HarmonicBalance
from hbm.contact import ContactTable, relative_motion, without_normal_motion
from hbm.continuation import follow as continuation
from hbm.continuation.budget import Spent, Work
from hbm.errors import InputError, nearest
from hbm.laws.records import Contacts
from hbm.laws.shipped import check_law
from hbm.model import ReducedModel
from hbm.peaks import refine_largest
from hbm.record import Parameter, contact_harmonics, record
from hbm.result import ForcedResponse
from hbm.solutions import Passages, first_of, solve_passages, starts
from hbm.validation import (
    check_at,
    check_band,
    check_forcing,
    check_harmonics,
    check_kind,
    check_outputs,
    check_settings,
    numbers,
)

NOISE = 1e-9             # of the motion of the whole model: an output below that is rounding
LEFT = ("left", "closed")        # ends of branches that leave the band for good
PARAMETERS = ("level", "preload", "mu", "kn", "kt")


def forced_response(model, pairs, law, forcing, band, *, harmonics=5, damping_ratio=None, outputs, origin="preloaded",
                    start=None, static=None, at=(), samples=None, contact=False, progress=None,
                    settings=None) -> ForcedResponse:
    """Curve of periodic responses over a frequency band.

    model : ReducedModel; pairs : ContactTable (pairs of weight 0 are left out); law : a law of `hbm.laws`
    forcing : (r,) real or complex amplitude F of Re F exp(i w t) in N, or {harmonic: (r,)}
    band : (from, to) Hz; from > to runs downwards
    harmonics : H, orders 0..H are kept
    damping_ratio : of the modes of the stuck system, a number or one per mode; None takes the model's C
    outputs : {name: (r,) row that takes the output out of q}
    origin : 'preloaded' - q = 0 is the preloaded state, N = max(0, preload + kn u_n); 'unloaded' - q = 0 is the
        unloaded state, N = max(0, kn (u_n - gap)), and `static` (r,) N carries the static loads
    start : where the sliders stand before the first of two marched periods: 'zero_slider' (T = 0 at q = 0, the default
        of 'preloaded'), 'zero_force' (T = 0 at the position of t = 0, the default of 'unloaded') or positions (P, 2)
    at : frequencies in Hz at which every passage of the curve is solved, for `solutions_at`
    samples : of a cycle, at least 8 and 4 H; None takes 64 or 12 H. They separate the transitions, which are located,
        and do not change the result; a law of sampled forces is as good as its samples (256 or 12 H)
    contact : whether to keep the harmonics of force and relative motion of every pair too
    progress : function (frequency_hz, step, calls), called at each point with the residual calls that it took, and at
        every 20 calls between points with step 0 and the calls since
    settings : numbers of the continuation, of steps, points and work; the default is DEFAULT, and
        replace(DEFAULT, most_calls=500) ends the curve sooner (see hbm.continuation.follow.Settings)
    Raises InputError on unusable input, before anything heavy. A point that does not converge stays in the result.
    """
    if origin not in ("preloaded", "unloaded"):
        raise InputError(f"origin = '{origin}': must be 'preloaded' or 'unloaded'")
    if origin == "preloaded" and static is not None:
        raise InputError("static: the preloaded state holds the static loads already; use origin = 'unloaded'")
    problem, kept = contact_problem(model, pairs, law, origin, static, damping_ratio)
    if start is not None and not isinstance(start, str):
        start = numbers("start", start, "must be 'zero_force', 'zero_slider' or slider positions (P, 2) in m")
        start = start[kept] if start.shape[:1] == kept.shape else start
    curve = follow_band(problem, forcing, band, harmonics=harmonics, outputs=outputs, start=start, at=at,
                        samples=samples, contact=contact, progress=progress, settings=settings)
    return _spread(curve, kept)


def _spread(curve, kept):
    """The pairs that were left out come back as open through the cycle."""
    if kept.all():
        return curve
    n = len(curve.frequency)
    columns = {}
    for name, value in (("share_stick", 0.0), ("share_slip", 0.0), ("share_open", 0.0), ("dissipated", 0.0)):
        full = np.full((n, len(kept)), value)
        full[:, kept] = getattr(curve, name)
        columns[name] = full
    for name in ("contact_force", "contact_motion"):
        part = getattr(curve, name)
        if part.size:
            columns[name] = np.zeros((n, len(kept), *part.shape[2:]), dtype=complex)
            columns[name][:, kept] = part
    return replace(curve, **columns)


def contact_problem(model, pairs, law, origin="preloaded", static=None, damping_ratio=None):
    """(ContactProblem of the carrying pairs, mask of these in the table)."""
    check_kind("model", model, ReducedModel, "ReducedModel.from_matrices, .from_files or .load")
    check_kind("pairs", pairs, ContactTable, "ContactTable.load or a contact detection")
    check_law(law)
    kept = pairs.carrying
    if not kept.any():
        raise InputError("no pair carries: every weight is 0; use linear_response for the model without damper")
    used = pairs.select(kept)
    preload = used.preload if origin == "preloaded" else -used.kn * used.weight * used.gap
    settings = Contacts(used.kn * used.weight, used.kt * used.weight, used.mu, preload)
    law = law.select(kept)
    B = relative_motion(model, used)
    if "n" in law.components and (lacking := without_normal_motion(B, used)):
        warnings.warn(lacking, stacklevel=3)
    if law.components != ("t1", "t2", "n"):
        rows = ["t1", "t2", "n"]
        B = B[np.concatenate([[3 * i + rows.index(c) for c in law.components] for i in range(len(used))])]
    return ContactProblem(model.M, model.C if damping_ratio is None else None, model.K, B, law, settings, static,
                          origin == "preloaded", damping_ratio, lambda v: describe_motion(model, v)), kept


def follow_band(problem: ContactProblem, forcing, band, *, harmonics=5, outputs, start=None, at=(), samples=None,
                contact=False, progress=None, settings=None) -> ForcedResponse:
    """forced_response for a ContactProblem: the door for matrices without a node table."""
    began = time.perf_counter()
    H = check_harmonics(harmonics)
    first, last = check_band(band)
    start = _default_start(problem, start)
    forces, at = check_forcing(forcing, problem.K.shape[0], H), _inside(check_at(at), "at", "band", first, last, " Hz")
    names, rows = check_outputs(outputs, problem.K.shape[0])
    settings = check_settings(settings, progress)
    balance = HarmonicBalance(problem, forces, H, start, samples)
    task = _Task(balance, Parameter(), balance.evaluate, lambda w: (balance, w), settings,
                 start, began)
    return _curve(task, names, rows, first, last, at, contact, progress)


def follow_parameter(problem: ContactProblem, forcing, hz, name, between, *, harmonics=5, outputs, start=None, at=(),
                     samples=None, contact=False, progress=None, settings=None) -> ForcedResponse:
    """Branch of periodic responses at one frequency over a factor on the force or on a setting of every pair.

    name : 'level' (of the force), 'preload', 'mu', 'kn' or 'kt'
    between : (from, to) of the factor; both positive
    at : values of the factor at which every passage of the curve is solved, for `solutions_at`
    progress : function (factor, step, calls), as in forced_response
    Everything else as in forced_response.
    """
    began = time.perf_counter()
    H = check_harmonics(harmonics)
    if name not in PARAMETERS:
        raise InputError(f"name = '{name}': this parameter is unknown; {nearest(name, PARAMETERS)}")
    if name == "preload" and not problem.preloaded:
        raise InputError("parameter 'preload': the unloaded origin has gaps, not preloads; use origin = 'preloaded'")
    first, last = _two_factors(between)
    w = 2 * np.pi * _one_frequency(hz)
    start = _default_start(problem, start)
    forces, at = check_forcing(forcing, problem.K.shape[0], H), _inside(_factors(at), "at", "between", first, last, "")
    names, rows = check_outputs(outputs, problem.K.shape[0])
    settings = check_settings(settings, progress)
    balance = HarmonicBalance(problem, forces, H, start, samples)

    def evaluate(x, value):
        # a long Newton step may ask for a negative stiffness: the settings end at zero
        setting = {"level": value} if name == "level" else {"factor": max(value, 1e-9)}
        return balance.evaluate(x, w, **setting, by=name)

    task = _Task(balance, Parameter(name, 1.0, hz), evaluate, lambda value: (balance.scaled(name, value), w),
                 settings, start, began)
    return _curve(task, names, rows, first, last, at, contact, progress)


@dataclass(frozen=True)
class _Task:
    """A branch to follow: evaluate(x, value) in the units of the branch, and (balance, w) at a value for first points.

    began : time at which the computation began
    """

    balance: HarmonicBalance
    parameter: Parameter
    evaluate: object
    frozen_at: object
    settings: continuation.Settings
    start: object
    began: float

    def starts(self, value, off_band):
        """Solutions at a value, one way after the other, as points of the branch."""
        for point in starts(*self.frozen_at(value), self.settings, off_band):
            if point.converged and self.parameter.hz is not None:
                again = continuation.solve_at(self.evaluate, point.x, value, self.balance.weights, self.settings)
                point = replace(again, iterations=point.iterations + again.iterations)
            yield point


def _curve(task, names, rows, first, last, at, contact, progress):
    """The branch of a task between two values of its parameter, as a ForcedResponse."""
    scale, evaluate, weights, settings = task.parameter.scale, task.evaluate, task.balance.weights, task.settings
    recover = rows @ task.balance.receptance.shapes
    branch = _branch(task, scale * first, scale * last, progress)
    tops, noise = np.empty((0, 0), dtype=bool), np.zeros(len(rows))
    if len(branch.points) > 2:
        solve_passages(evaluate, branch, scale * at, weights, settings)
        noise = _noise(branch, rows, task.balance)
        tops = refine_largest(evaluate, branch, recover, noise, weights, settings)
    curve = record(branch, task.balance, recover, names, task.balance.problem, task.start, task.parameter,
                   time.perf_counter() - task.began)
    beside = Passages(evaluate, branch, rows, recover, noise, scale, weights, settings, task.frozen_at)
    curve = replace(curve, tops=tops, passages=beside)
    return replace(curve, **contact_harmonics(branch, task.balance)) if contact else curve


def _noise(branch, rows, balance):
    """(m,) amplitudes of the outputs that are rounding beside the motion of the whole model."""
    point = max((p for p in branch.points if p.converged), key=lambda p: np.linalg.norm(p.detail.modal[:, 1:]))
    return NOISE * np.linalg.norm(rows, axis=1) * np.linalg.norm(balance.receptance.shapes @ point.detail.modal[:, 1:])


def _branch(task, first, last, progress):
    """The branch from `first` to `last`; progress is told of its points, and of the work between them."""
    work = Work(task.settings, progress, first / task.parameter.scale, len(task.balance.weights))
    task.balance.on_call = work.call
    found = []
    try:
        _first_staying(task, first, last, work, found)
    except Spent:                           # while further first points were looked for
        pass
    finally:
        task.balance.on_call = None
    if not found:
        none = continuation.Point(np.full(len(task.balance.weights), np.nan), first, False, 0)
        found.append(continuation.Branch([none]))
        found[0].finish("no start", first)
    best = found[-1] if found[-1].end not in LEFT else found[0]
    best.calls = work.calls
    return best


def _first_staying(task, first, last, work, found):
    """Fill `found` with branches from `first`, up to the first one that does not leave the band for good."""
    passed, known = [], []

    def report(point, step):
        for before in passed:
            before.detail.forget()          # what Newton needed there: too large to keep over a whole curve
        passed[:] = [point] if point.detail is not None else []
        work.point(point.parameter / task.parameter.scale, step, point.iterations)

    for begin in task.starts(first, True):
        if not begin.converged or any(_same(begin, other, task.balance.weights) for other in known):
            continue
        known.append(begin)
        if not task.balance.force.any():
            found.append(_static(task, begin, last))
            return
        report(begin, 0.0)
        found.append(continuation.follow(task.evaluate, begin, last, task.balance.weights, task.settings, report,
                                         lambda value: first_of(task.starts(value, False))))
        if found[-1].end not in LEFT:
            return


def _static(task, begin, last):
    end = continuation.solve_at(task.evaluate, begin.x, last, task.balance.weights, task.settings)
    return continuation.Branch([begin, end], "static", last, end.converged, 2)


def _same(a, b, weights) -> bool:
    return np.linalg.norm(weights * (a.x - b.x)) <= 1e-6 * np.linalg.norm(weights * b.x)


def _default_start(problem, start):
    return start if start is not None else ("zero_slider" if problem.preloaded else "zero_force")


def _two_factors(between):
    try:
        first, last = (float(b) for b in between)
    except (TypeError, ValueError):
        raise InputError(f"between = {between!r}: must be two factors, (from, to)") from None
    if not (np.isfinite(first) and np.isfinite(last) and first > 0 and last > 0) or first == last:
        raise InputError(f"between = ({first:g}, {last:g}): both must be positive, and different")
    return first, last


def _one_frequency(hz) -> float:
    if isinstance(hz, bool) or not isinstance(hz, int | float | np.number) or not (np.isfinite(hz) and hz > 0):
        raise InputError(f"hz = {hz!r}: must be one positive frequency in Hz")
    return float(hz)


def _factors(at):
    try:
        return np.atleast_1d(np.asarray(at, dtype=float)).ravel()
    except (TypeError, ValueError):
        raise InputError(f"at = {at!r}: must be factors, inside `between`") from None


def _inside(values, argument, band, first, last, unit):
    """The values, where they all lie in the band (first, last)."""
    out = [v for v in values if not min(first, last) <= v <= max(first, last)]
    if out:
        raise InputError(f"{argument} = {out[0]:g}{unit}: lies outside {band} = ({first:g}, {last:g}){unit}")
    return values
