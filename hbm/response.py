"""forced_response: from a reduced model, contact pairs and a forcing to the curve over a frequency band."""

import time
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from hbm import continuation, fourier
from hbm.contact import relative_motion
from hbm.errors import InputError, nearest
from hbm.laws import PairSettings
from hbm.linear import describe_motion
from hbm.residual import ContactProblem, HarmonicBalance

PARAMETERS = ("level", "preload", "mu", "kn", "kt")
KINDS = ("half_peak_to_peak", "harmonic", "rms")
MOST_HARMONICS = 200
ORDER_ZERO_WEIGHT = 0.01    # the mean position is nearly indeterminate in slip: it counts little in the arc length
PEAK_TOLERANCE = 1e-10


@dataclass(frozen=True)
class ForcedResponse:
    """A branch of periodic solutions over frequency: n points, m outputs, P pairs, harmonics 0..H.

    frequency : (n,) Hz, in the order of the branch (not monotone where it folds)
    output_names : (m,) str
    harmonics : (n, m, H+1) complex, m - x(t) = X0 + Re sum X_k exp(i k w t); NaN where a point failed
    parameter_name, parameter : what the branch was followed in, and its (n,) values: 'frequency' in Hz, or 'level',
        'preload', 'mu', 'kn' or 'kt' as factors on the force or on that setting of every pair, at one frequency
    share_stick, share_slip, share_open : (n, P) share of the cycle
    dissipated : (n, P) J per cycle by friction
    converged : (n,) bool; iterations : (n,) evaluations of the residual
    ended : why the curve ends, with the remedy; complete : it covers the band without a failed point
    leaps : (k, 2) parameters between which a branch that folds on and on was left, and the band stepped over in small
        steps, each solved from the one before; empty where the curve is one branch
    contact_force, contact_motion : (n, P, nd, H+1) complex, N and m - of each pair in the order of the law,
        the force of the damper on the blade and the relative motion that makes it; empty unless asked for
    """

    frequency: np.ndarray
    output_names: np.ndarray
    harmonics: np.ndarray
    parameter_name: str
    parameter: np.ndarray
    share_stick: np.ndarray
    share_slip: np.ndarray
    share_open: np.ndarray
    dissipated: np.ndarray
    converged: np.ndarray
    iterations: np.ndarray
    ended: str
    complete: bool
    H: int
    origin: str
    start: str
    seconds: float
    residual_calls: int
    leaps: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    contact_force: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))
    contact_motion: np.ndarray = field(default_factory=lambda: np.empty((0, 0, 0, 0)))

    def amplitude(self, kind: str = "half_peak_to_peak") -> np.ndarray:
        """(n, m) amplitude, m: 'half_peak_to_peak' of the whole cycle, 'harmonic' |X_1|, or 'rms' of the vibration."""
        if kind == "half_peak_to_peak":
            return fourier.half_peak_to_peak(self.harmonics)
        if kind == "harmonic":
            return np.abs(self.harmonics[..., 1]) if self.H else np.zeros(self.harmonics.shape[:-1])
        if kind == "rms":
            return fourier.rms(self.harmonics)
        raise InputError(f"amplitude kind '{kind}' is unknown; {nearest(kind, KINDS)}")

    def column(self, name: str) -> int:
        """Column of an output."""
        names = self.output_names.tolist()
        if name not in names:
            raise InputError(f"output '{name}' is not in this response; {nearest(name, names)}")
        return names.index(name)

    def peak(self, name: str, kind: str = "half_peak_to_peak") -> tuple[float, float]:
        """(Hz, m) largest amplitude of an output; the curve was refined there when it was computed."""
        a = self.amplitude(kind)[:, self.column(name)]
        if not np.isfinite(a).any():
            return float("nan"), float("nan")
        i = int(np.nanargmax(a))
        if not 0 < i < len(a) - 1 or not np.isfinite(a[i - 1:i + 2]).all():
            return float(self.frequency[i]), float(a[i])
        f = self.frequency[i - 1:i + 2]
        top, value = _parabola(f - f[1], a[i - 1:i + 2])
        inside = min(f) <= f[1] + top <= max(f)
        return (float(f[1] + top), float(value)) if inside else (float(f[1]), float(a[i]))

    def solutions_at(self, hz: float) -> np.ndarray:
        """(s, m, H+1) complex harmonics of every solution at a frequency, one for each passage of the curve.

        Solved ones where the frequency was asked for (`at` of forced_response), else interpolated linearly.
        """
        f, X = self.frequency, self.harmonics
        close = np.abs(f - hz) <= 1e-12 * hz
        if (close & self.converged).any():
            return X[close & self.converged]
        i = np.flatnonzero(((f[:-1] - hz) * (f[1:] - hz) < 0) & self.converged[:-1] & self.converged[1:])
        share = ((hz - f[i]) / (f[i + 1] - f[i]))[:, None, None]
        return (1 - share) * X[i] + share * X[i + 1]

    @property
    def slipping_pairs(self) -> np.ndarray:
        """Indices of the pairs that slip or open anywhere in the band."""
        return np.flatnonzero(np.nanmax(self.share_slip + self.share_open, axis=0, initial=0.0) > 1e-6)

    def save(self, path) -> Path:
        """One .npz of plain arrays."""
        path = Path(path)
        np.savez(path, **{f.name: np.asarray(getattr(self, f.name)) for f in fields(self)})
        return path

    @classmethod
    def load(cls, path) -> "ForcedResponse":
        path = Path(path)
        if not path.is_file():
            raise InputError(f"forced response not found: {path}")
        with np.load(path, allow_pickle=False) as z:
            missing = [f.name for f in fields(cls) if f.name not in z and f.default_factory is MISSING]
            if missing:
                raise InputError(f"{path}: is not a forced response, '{missing[0]}' is missing")
            plain = {str: str, bool: bool, int: int, float: float}
            return cls(**{f.name: plain[f.type](z[f.name]) if f.type in plain else z[f.name] for f in fields(cls)
                          if f.name in z})


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
        start = np.asarray(start, dtype=float)
        start = start[kept] if start.shape[:1] == kept.shape else start
    curve = follow_band(problem, forcing, band, harmonics=harmonics, outputs=outputs, start=start, at=at,
                        samples=samples, contact=contact, progress=progress, settings=settings)
    return _spread(curve, kept)


def contact_problem(model, pairs, law, origin="preloaded", static=None, damping_ratio=None):
    """(ContactProblem of the carrying pairs, mask of these in the table)."""
    kept = pairs.carrying
    if not kept.any():
        raise InputError("no pair carries: every weight is 0; use linear_response for the model without damper")
    used = pairs.select(kept)
    preload = used.preload if origin == "preloaded" else -used.kn * used.weight * used.gap
    settings = PairSettings(used.kn * used.weight, used.kt * used.weight, used.mu, preload)
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
    H = _check_harmonics(harmonics)
    first, last = _check_band(band)
    start = start if start is not None else ("zero_slider" if problem.preloaded else "zero_force")
    forces = _check_forcing(forcing, problem.K.shape[0], H)
    names, rows = _check_outputs(outputs, problem.K.shape[0])
    settings = settings or continuation.Settings()
    balance = HarmonicBalance(problem, forces, H, start, samples)
    weights = np.tile(np.r_[ORDER_ZERO_WEIGHT, np.ones(balance.nh - 1)], balance.n_components)
    recover = rows @ balance.receptance.shapes

    passed = []

    def report(point, step):
        for before in passed:
            before.detail.parts.clear()          # what Newton needed there: too large to keep over a whole curve
        passed[:] = [point] if point.detail is not None else []
        if progress:
            progress(point.parameter / (2 * np.pi), step, point.iterations)

    two_pi = 2 * np.pi
    begin = first_point(balance, two_pi * first, weights, settings)
    if not begin.converged:
        branch = continuation.Branch([begin], f"no solution found at {first:g} Hz, where the band begins; begin it "
                                     "further from the resonance", False, begin.iterations)
    elif not any(np.any(F) for F in forces.values()):
        end = continuation.solve_at(balance.evaluate, begin.x, two_pi * last, weights, settings)
        branch = continuation.Branch([begin, end], "no force: the static state", end.converged, 2)
    else:
        report(begin, 0.0)
        branch = continuation.follow(balance.evaluate, begin, two_pi * last, weights, settings, report,
                                     lambda w: first_point(balance, w, weights, settings))
        solve_passages(balance, branch, two_pi * np.asarray(at, dtype=float), weights, settings)
        refine_peaks(balance, branch, recover, weights, settings)
    ended = _explain(branch, balance, problem)
    curve = _record(branch, balance, recover, names, ended, problem, start, time.perf_counter() - began)
    return replace(curve, **_contact(branch, balance)) if contact else curve


def follow_parameter(problem: ContactProblem, forcing, hz, name, between, *, harmonics=5, outputs, start=None,
                     samples=None, settings=None) -> ForcedResponse:
    """Branch of periodic responses at one frequency over a factor on the force or on a setting of every pair.

    name : 'level' (of the force), 'preload', 'mu', 'kn' or 'kt'
    between : (from, to) of the factor; 0 < from. Everything else as in forced_response.
    """
    began = time.perf_counter()
    H = _check_harmonics(harmonics)
    if name not in PARAMETERS:
        raise InputError(f"parameter '{name}' is unknown; {nearest(name, PARAMETERS)}")
    if name == "preload" and not problem.preloaded:
        raise InputError("parameter 'preload': the unloaded origin has gaps, not preloads; use origin = 'preloaded'")
    first, last = _check_band(between)
    w = 2 * np.pi * _check_band((hz, 2 * hz))[0]
    start = start if start is not None else ("zero_slider" if problem.preloaded else "zero_force")
    names, rows = _check_outputs(outputs, problem.K.shape[0])
    settings = settings or continuation.Settings()
    balance = HarmonicBalance(problem, _check_forcing(forcing, problem.K.shape[0], H), H, start, samples)
    weights = np.tile(np.r_[ORDER_ZERO_WEIGHT, np.ones(balance.nh - 1)], balance.n_components)

    def evaluate(x, value):
        # a long Newton step may ask for a negative stiffness: the settings end at zero
        setting = {"level": value} if name == "level" else {"factor": max(value, 1e-9)}
        return balance.evaluate(x, w, **setting, by=name)

    guess = balance.linear(w) * (first if name == "level" else 1.0)
    begin = continuation.solve_at(evaluate, guess, first, weights, settings)
    if begin.converged:
        branch = continuation.follow(evaluate, begin, last, weights, settings)
    else:
        branch = continuation.Branch([begin], f"no solution found at {name} = {first:g}; begin elsewhere")
    curve = _record(branch, balance, rows @ balance.receptance.shapes, names, branch.ended, problem, start, 0.0)
    values = 2 * np.pi * curve.frequency
    return replace(curve, parameter_name=name, parameter=values, frequency=np.full(len(values), float(hz)),
                   leaps=2 * np.pi * curve.leaps,
                   seconds=time.perf_counter() - began)


def first_point(balance, w, weights, settings):
    """A solution at w: from the stuck response, else by raising the force from zero, else from a marched motion."""
    x = balance.linear(w)
    point = continuation.solve_at(balance.evaluate, x, w, weights, settings)
    if point.converged:
        return point
    calls = point.iterations
    for guess in (_raise_level, _march_on):
        x, more = guess(balance, w, weights, settings)
        calls += more
        if x is not None:
            point = continuation.solve_at(balance.evaluate, x, w, weights, settings)
            calls += point.iterations
            if point.converged:
                break
    return replace(point, iterations=calls)


def _raise_level(balance, w, weights, settings):
    """(x or None, residual calls): the branch over the force level, from almost nothing to the whole force."""
    def by_level(x, level):
        return balance.evaluate(x, w, level, by="level")

    low = continuation.solve_at(by_level, 1e-3 * balance.linear(w), 1e-3, weights, settings)
    if not low.converged:
        return None, low.iterations
    branch = continuation.follow(by_level, low, 1.0, weights, replace(settings, most_points=150, most_leaps=0))
    return branch.points[-1].x if branch.complete else None, branch.calls


def _march_on(balance, w, weights, settings):
    """(x or None, residual calls): where time integration from rest gets to; corridor laws only."""
    from hbm import march
    if not balance.problem.law.corridor:
        return None, 0
    motion = march.March(balance, w, 512)
    motion.periods(motion.at_rest(), 60)
    x = motion.harmonics_of_motion()
    return x if np.isfinite(x).all() else None, 0


def solve_passages(balance, branch, at, weights, settings):
    """Insert a solved point wherever the branch passes one of the angular frequencies."""
    for w in at:
        for a, b in list(zip(branch.points[:-1], branch.points[1:], strict=True)):
            if not (a.converged and b.converged and (a.parameter - w) * (b.parameter - w) < 0):
                continue
            x = a.x + (w - a.parameter) / (b.parameter - a.parameter) * (b.x - a.x)
            new = continuation.solve_at(balance.evaluate, x, w, weights, settings)
            branch.calls += new.iterations
            if new.converged:
                branch.points.insert(branch.points.index(b), new)


def refine_peaks(balance, branch, recover, weights, settings):
    """Insert solved points around the largest amplitude of every output, until its parabola's top stands still."""
    good = [p for p in branch.points if p.converged]
    table = fourier.half_peak_to_peak(np.array([recover @ p.detail.modal for p in good])).tolist()
    for j in range(len(recover)):
        for _ in range(8):
            heights = np.array([row[j] for row in table])
            i = int(heights.argmax())
            if not 0 < i < len(good) - 1 or heights[i] == 0:
                break
            a, b, c = good[i - 1:i + 2]
            metric = continuation.Metric(weights, np.linalg.norm(weights * b.x), 0.01 * b.parameter)
            s = np.array([-metric.norm(b.x - a.x, b.parameter - a.parameter), 0.0,
                          metric.norm(c.x - b.x, c.parameter - b.parameter)])
            top, value = _parabola(s, heights[i - 1:i + 2])
            if max(-s[0], s[2]) < 1e-5 or (abs(value - heights[i]) < PEAK_TOLERANCE * heights[i]
                                           and max(-s[0], s[2]) < 3e-2):
                break
            if -s[0] > 4 * s[2] or s[2] > 4 * -s[0] or not s[0] < top < s[2]:
                top = 0.5 * s[0] if -s[0] > s[2] else 0.5 * s[2]
            elif abs(top) < 0.02 * max(-s[0], s[2]):
                top = 0.1 * s[2] if s[2] > -s[0] else 0.1 * s[0]
            left, right, share = (a, b, 1 - top / s[0]) if top < 0 else (b, c, top / s[2])
            new = continuation.between(balance.evaluate, left, right, share, weights, settings)
            branch.calls += new.iterations
            if not new.converged:
                break
            branch.points.insert(branch.points.index(right), new)
            good.insert(good.index(right), new)
            table.insert(good.index(new), fourier.half_peak_to_peak(recover @ new.detail.modal).tolist())


def _parabola(s, y):
    """(place, value) of the extremum of the parabola through three points."""
    c = np.polyfit(s / np.abs(s).max(), y, 2)
    if c[0] >= 0:
        return float("inf"), float(y[1])
    top = -0.5 * c[1] / c[0]
    return float(top * np.abs(s).max()), float(np.polyval(c, top))


def _record(branch, balance, recover, names, ended, problem, start, seconds):
    n, m, P, H = len(branch.points), len(names), len(problem.pairs), balance.H
    harmonics = np.full((n, m, H + 1), np.nan, dtype=complex)
    shares, work = np.full((n, P, 3), np.nan), np.full((n, P), np.nan)
    for i, point in enumerate(branch.points):
        if point.converged:
            harmonics[i] = recover @ point.detail.modal
            shares[i] = point.detail.bracket.shares
            work[i] = _dissipated(point, balance, problem.law.tangents)
    hz = np.array([p.parameter for p in branch.points]) / (2 * np.pi)
    return ForcedResponse(
        frequency=hz, parameter_name="frequency", parameter=hz, output_names=np.array(names, dtype=str),
        harmonics=harmonics, share_stick=shares[..., 0], share_slip=shares[..., 1], share_open=shares[..., 2],
        dissipated=work, converged=np.array([p.converged for p in branch.points]),
        iterations=np.array([p.iterations for p in branch.points]), ended=ended,
        complete=bool(branch.complete and all(p.converged for p in branch.points)), H=H,
        origin="preloaded" if problem.preloaded else "unloaded", start=start if isinstance(start, str) else "given",
        seconds=seconds, residual_calls=branch.calls, leaps=np.reshape(branch.leaps, (-1, 2)) / (2 * np.pi))


def _contact(branch, balance):
    shape = (len(branch.points), len(balance.problem.pairs), balance.nd, balance.H + 1)
    force, motion = np.full(shape, np.nan, dtype=complex), np.full(shape, np.nan, dtype=complex)
    for i, point in enumerate(branch.points):
        if point.converged:
            force[i], motion[i] = point.detail.contact()
    return {"contact_force": force, "contact_motion": motion}


def _dissipated(point, balance, tangents):
    """(P,) J per cycle: sum of pi k Im(f_k conj(u_k)) over the tangents; the springs give nothing."""
    g = fourier.to_complex(point.detail.bracket.g)[:, :tangents, 1:]
    u = fourier.to_complex(point.x.reshape(-1, balance.nd, balance.nh))[:, :tangents, 1:]
    return np.pi * np.sum(np.arange(1, balance.H + 1) * (g * u.conj()).imag, axis=(1, 2))


def _explain(branch, balance, problem):
    """The end in Hz, where points failed or the branch was left, and the motion that no force holds, if that is why."""
    ended = branch.ended
    good = [p for p in branch.points if p.converged]
    if not good:
        return ended
    last, failed = good[-1], [p for p in branch.points if not p.converged]
    for parameter in (last.parameter, branch.points[0].parameter):
        ended = ended.replace(f"{parameter:.6g}", f"{parameter / (2 * np.pi):.6g} Hz")
    if branch.leaps:
        places = ", ".join(f"{a / (2 * np.pi):.6g} to {b / (2 * np.pi):.6g}" for a, b in branch.leaps)
        ended += (f"; not one branch: it folds on and on, and was left and stepped over at {places} Hz (more damping, "
                  "or more or fewer harmonics, may give one)")
    if failed and branch.complete:
        ended += (f"; {len(failed)} point{'s' * (len(failed) > 1)} failed near {failed[0].parameter / (2 * np.pi):.6g} "
                  "Hz: run the other direction, or other harmonics, there")
    if branch.complete:
        return ended
    value, q = last.detail.smallest_motion()
    if q is not None and value < 1e-4 and np.abs(q[:, 0]).max() > 0.9 * np.abs(q).max():
        motion = q[:, 0].real
        named = problem.describe(motion) if problem.describe else f"mostly dof {np.abs(motion).argmax() + 1}"
        verb = "the damper rolls" if "rotates" in named else "a mean motion is held by nothing"
        ended += f"; {verb} ({named}): no periodic state exists there unless a stiffness holds that motion"
    return ended


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


def _check_harmonics(H):
    if isinstance(H, bool) or not isinstance(H, int | np.integer) or not 0 <= H <= MOST_HARMONICS:
        raise InputError(f"harmonics = {H!r}: must be a whole number between 0 and {MOST_HARMONICS}")
    return int(H)


def _check_band(band):
    try:
        first, last = (float(b) for b in band)
    except (TypeError, ValueError):
        raise InputError(f"band = {band!r}: must be two frequencies in Hz, (from, to)") from None
    if not (np.isfinite(first) and np.isfinite(last) and first > 0 and last > 0) or first == last:
        raise InputError(f"band = ({first:g}, {last:g}) Hz: both must be positive, and different")
    return first, last


def _check_forcing(forcing, r, H):
    forces = forcing if isinstance(forcing, dict) else {1: forcing}
    checked = {}
    for k, F in forces.items():
        F = np.asarray(F)
        if not isinstance(k, int | np.integer) or not 0 < k:
            raise InputError(f"forcing of harmonic {k!r}: harmonics count from 1; constant loads go into `static`")
        if k > H:
            raise InputError(f"forcing of harmonic {k}: harmonics = {H} keeps orders 0..{H} only")
        if F.shape != (r,) or not np.isfinite(F).all():
            raise InputError(f"forcing of harmonic {k}: must be finite with shape ({r},), got shape {F.shape}")
        checked[int(k)] = F
    return checked


def _check_outputs(outputs, r):
    if not outputs:
        raise InputError("outputs: at least one {name: row} is needed")
    rows = []
    for name, row in outputs.items():
        row = row.toarray().ravel() if hasattr(row, "toarray") else np.asarray(row, dtype=float)
        if row.shape != (r,) or not np.isfinite(row).all():
            raise InputError(f"output '{name}': must be a finite row of length {r}, got shape {row.shape}")
        rows.append(row)
    return list(outputs), np.array(rows)
