"""forced_response: from a reduced model, contact pairs and a forcing to the curve over a frequency band."""

import time
from dataclasses import replace

import numpy as np

from hbm import continuation
from hbm.contact import ContactTable, relative_motion
from hbm.curve import ForcedResponse, contact_harmonics, explain, record
from hbm.errors import InputError, nearest
from hbm.inputs import (
    check_at,
    check_band,
    check_forcing,
    check_harmonics,
    check_kind,
    check_law,
    check_outputs,
    numbers,
)
from hbm.laws import PairSettings
from hbm.linear import describe_motion
from hbm.model import ReducedModel
from hbm.residual import ContactProblem, HarmonicBalance
from hbm.solutions import first_point, refine_peaks, solve_passages

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
    contact : whether to keep the harmonics of force and relative motion of every pair too
    progress : function (frequency_hz, step, iterations), called at each point
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
    settings = PairSettings(used.kn * used.weight, used.kt * used.weight, used.mu, preload)
    if hasattr(law, "of_pairs"):
        law = law.of_pairs(kept)
    B = relative_motion(model, used)
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
    start = start if start is not None else ("zero_slider" if problem.preloaded else "zero_force")
    forces, at = check_forcing(forcing, problem.K.shape[0], H), check_at(at)
    names, rows = check_outputs(outputs, problem.K.shape[0])
    settings = settings or continuation.Settings()
    balance = HarmonicBalance(problem, forces, H, start, samples)
    recover = rows @ balance.receptance.shapes

    passed = []

    def report(point, step):
        for before in passed:
            before.detail.forget()          # what Newton needed there: too large to keep over a whole curve
        passed[:] = [point] if point.detail is not None else []
        if progress:
            progress(point.parameter / (2 * np.pi), step, point.iterations)

    two_pi = 2 * np.pi
    begin = first_point(balance, two_pi * first, settings)
    if not begin.converged:
        branch = continuation.Branch([begin], f"no solution found at {first:g} Hz, where the band begins; begin it "
                                     "further from the resonance", False, begin.iterations)
    elif not any(np.any(F) for F in forces.values()):
        end = continuation.solve_at(balance.evaluate, begin.x, two_pi * last, balance.weights, settings)
        branch = continuation.Branch([begin, end], "no force: the static state", end.converged, 2)
    else:
        report(begin, 0.0)
        branch = continuation.follow(balance.evaluate, begin, two_pi * last, balance.weights, settings, report,
                                     lambda w: first_point(balance, w, settings))
        solve_passages(balance, branch, two_pi * at, settings)
        refine_peaks(balance, branch, recover, settings)
    ended = explain(branch, balance, problem)
    curve = record(branch, balance, recover, names, ended, problem, start, time.perf_counter() - began)
    return replace(curve, **contact_harmonics(branch, balance)) if contact else curve


def follow_parameter(problem: ContactProblem, forcing, hz, name, between, *, harmonics=5, outputs, start=None,
                     samples=None, settings=None) -> ForcedResponse:
    """Branch of periodic responses at one frequency over a factor on the force or on a setting of every pair.

    name : 'level' (of the force), 'preload', 'mu', 'kn' or 'kt'
    between : (from, to) of the factor; 0 < from. Everything else as in forced_response.
    """
    began = time.perf_counter()
    H = check_harmonics(harmonics)
    if name not in PARAMETERS:
        raise InputError(f"parameter '{name}' is unknown; {nearest(name, PARAMETERS)}")
    if name == "preload" and not problem.preloaded:
        raise InputError("parameter 'preload': the unloaded origin has gaps, not preloads; use origin = 'preloaded'")
    first, last = check_band(between)
    w = 2 * np.pi * check_band((hz, 2 * hz))[0]
    start = start if start is not None else ("zero_slider" if problem.preloaded else "zero_force")
    names, rows = check_outputs(outputs, problem.K.shape[0])
    settings = settings or continuation.Settings()
    balance = HarmonicBalance(problem, check_forcing(forcing, problem.K.shape[0], H), H, start, samples)

    def evaluate(x, value):
        # a long Newton step may ask for a negative stiffness: the settings end at zero
        setting = {"level": value} if name == "level" else {"factor": max(value, 1e-9)}
        return balance.evaluate(x, w, **setting, by=name)

    guess = balance.linear(w) * (first if name == "level" else 1.0)
    begin = continuation.solve_at(evaluate, guess, first, balance.weights, settings)
    if begin.converged:
        branch = continuation.follow(evaluate, begin, last, balance.weights, settings)
    else:
        branch = continuation.Branch([begin], f"no solution found at {name} = {first:g}; begin elsewhere")
    curve = record(branch, balance, rows @ balance.receptance.shapes, names, branch.ended, problem, start, 0.0)
    values = 2 * np.pi * curve.frequency
    return replace(curve, parameter_name=name, parameter=values, frequency=np.full(len(values), float(hz)),
                   leaps=2 * np.pi * curve.leaps,
                   seconds=time.perf_counter() - began)
