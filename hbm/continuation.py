"""Follows a branch of R(x, parameter) = 0 by arc length. Knows nothing of what R means.

`evaluate(x, parameter)` returns an object with

    residual (n,),   solve(row, corner, value) -> dx, dp   and   direction(row, corner) -> tx, tp, sign

where solve answers the bordered system [J, R_p; row', corner] [dx; dp] = [-residual; value], and direction that with
[0; 1] on the right, with the sign of the determinant. The bordered matrix is regular at folds, where J alone is not.
R need not be smooth: the sign of det [J, R_p; t'] for a tangent t stays the same along a branch through folds and
kinks alike, so that it tells forward from backward where the direction itself jumps.

`weights` (n,) say how much each unknown counts in the arc length. Lengths are relative: a step of 0.1 changes the
weighted unknowns by a tenth of their size, or the parameter by a hundredth of the way.
"""

from dataclasses import dataclass, field, replace

import numpy as np


@dataclass(frozen=True)
class Settings:
    """Numbers of the method. `parameter_share`: a unit step moves the parameter by this share of the way."""

    first_step: float = 0.05
    largest_step: float = 0.25
    smallest_step: float = 1e-5
    parameter_share: float = 0.1
    tolerance: float = 1e-10      # of the residual, relative to the weighted unknowns
    most_iterations: int = 12
    most_points: int = 4000
    most_gaps: int = 3
    runaway: float = 1e8          # unknowns this many times those of the start mean that no solution exists further on
    stall: int = 200              # points within a thousandth of the way


@dataclass(frozen=True, eq=False)
class Point:
    """One point of a branch; x is NaN where the corrector failed."""

    x: np.ndarray
    parameter: float
    converged: bool
    iterations: int               # evaluations of the residual
    detail: object = None         # what `evaluate` returned last


@dataclass
class Branch:
    """Points in order, the sentence that says why it ended, and whether it reached the end."""

    points: list = field(default_factory=list)
    ended: str = ""
    complete: bool = False
    calls: int = 0


@dataclass(frozen=True)
class Metric:
    """Arc length: |(dx, dp)|^2 = |weights dx|^2 / size^2 + (dp / length)^2."""

    weights: np.ndarray
    size: float
    length: float

    def norm(self, dx, dp) -> float:
        return float(np.hypot(np.linalg.norm(self.weights * dx) / self.size, dp / self.length))

    def border(self, dx, dp):
        """Row and corner of the unit plane normal to (dx, dp)."""
        unit = 1 / self.norm(dx, dp)
        return self.weights**2 * dx * (unit / self.size**2), dp * unit / self.length**2


def correct(evaluate, x, p, row, corner, metric, settings) -> Point:
    """Newton on the plane through (x, p) with normal (row, corner)."""
    x0, p0 = x, p
    for iteration in range(1, settings.most_iterations + 1):
        e = evaluate(x, p)
        size = np.clip(np.linalg.norm(metric.weights * x), 1e-6 * metric.size, 10 * metric.size)
        error = np.linalg.norm(e.residual)
        if error <= settings.tolerance * size:
            return Point(x, p, True, iteration, e)
        if not np.isfinite(error) or error > 1e8 * size:
            break
        dx, dp = e.solve(row, corner, -(row @ (x - x0) + corner * (p - p0)))
        x, p = x + dx, p + dp
    return Point(np.full_like(x, np.nan), p0, False, iteration)


def solve_at(evaluate, x, p, weights, settings=Settings()) -> Point:
    """Damped Newton at a fixed parameter, for a first point or a restart."""
    none = np.zeros(len(x))
    e = evaluate(x, p)
    calls = 1
    reach = 1e3 * max(np.linalg.norm(x), np.linalg.norm(e.residual))     # a Jacobian near singular sends x far away
    for _ in range(6 * settings.most_iterations):
        error = np.linalg.norm(e.residual)
        if error <= settings.tolerance * min(max(np.linalg.norm(weights * x), 1e-300), reach):
            return Point(x, p, True, calls, e)
        dx, _ = e.solve(none, 1.0, 0.0)
        gone = np.linalg.norm(dx)
        if not np.isfinite(error + gone) or np.linalg.norm(x) > 100 * reach:
            break
        share = min(1.0, reach / gone) if gone else 1.0
        for _ in range(7):
            trial = evaluate(x + share * dx, p)
            calls += 1
            if np.linalg.norm(trial.residual) < (1 - 0.1 * share) * error:
                break
            share *= 0.5
        x, e = x + share * dx, trial
    return Point(np.full_like(x, np.nan), p, False, calls)


def extrapolate(points, metric, step, order):
    """Polynomial through the last order + 1 points, over their distances, at a step beyond the last."""
    used = points[-(order + 1):]
    s = [0.0]
    for a, b in zip(used[::-1][:-1], used[::-1][1:], strict=True):
        s.append(s[-1] - metric.norm(a.x - b.x, a.parameter - b.parameter))
    x, p = 0.0, 0.0
    for i, point in enumerate(used[::-1]):
        weight = np.prod([(step - s[j]) / (s[i] - s[j]) for j in range(len(s)) if j != i])
        x, p = x + weight * point.x, p + weight * point.parameter
    return x, p


def follow(evaluate, start: Point, end: float, weights, settings=Settings(), on_point=None) -> Branch:
    """Follow the branch from a converged start until the parameter passes `end`.

    on_point(point, step) is called for each accepted point. A failed corrector is tried again with smaller steps and
    lower predictors, then across the gap at fixed parameters; what cannot be had stays in the branch as failed.
    """
    branch = Branch([start], calls=start.iterations)
    begin, sense = start.parameter, np.sign(end - start.parameter)
    length = settings.parameter_share * abs(end - begin)
    run = [start]                     # points since the last gap
    sign = _sign(start.detail, len(weights), sense)
    step, order, largest = settings.first_step, 3, np.linalg.norm(weights * start.x)
    while len(branch.points) < settings.most_points:
        last = run[-1]
        size = np.linalg.norm(weights * last.x)
        largest = max(largest, size)
        metric = Metric(weights, max(size, 1e-3 * largest) or 1.0, length)
        x, p = _predict(run, metric, step, order, sign)
        row, corner = metric.border(x - last.x, p - last.parameter)
        new = correct(evaluate, x, p, row, corner, metric, settings)
        branch.calls += new.iterations
        if not new.converged or not _on_branch(new, last, x, p, metric, step, sign):
            turned = _turn(evaluate, last, x, p, metric, step, sign, settings, branch) if step < 2e-2 else None
            if turned is None and step > settings.smallest_step:
                step, order = 0.4 * step, min(order, 1 if step < 1e-2 else 2)
                continue
            run = [last]
            new = turned or _across(evaluate, last, end, sense, weights, length, settings, branch)
            if new is None:
                branch.ended = (f"stopped at {last.parameter:.6g}: the corrector found no further point; "
                                "try the other direction, more harmonics or a lower level first")
                return branch
            if turned is None:
                run, step = [], settings.first_step
                sign = _sign(new.detail, len(weights), sense)
        if sense * (new.parameter - end) >= 0 and run:
            return _finish(evaluate, branch, run, new, end, weights, settings, on_point)
        branch.points.append(new)
        run.append(new)
        if on_point:
            on_point(new, step)
        if sense * (new.parameter - end) >= 0:
            branch.complete, branch.ended = True, "reached the end of the band"
            return branch
        if sense * (new.parameter - begin) < 0:
            branch.ended = f"the branch turned back and left the band where it began, at {begin:.6g}"
            return branch
        if _lost(branch, new, weights, length, settings):
            return branch
        order = 3
        step = min(step * _growth(new.iterations), settings.largest_step)
    branch.ended = (f"stopped at {branch.points[-1].parameter:.6g} after {settings.most_points} points: the branch "
                    "folds again and again; more damping, more or fewer harmonics, or the other direction may help")
    return branch


def _lost(branch, new, weights, length, settings) -> bool:
    """Set the end of a branch that runs away, or that no longer gets on."""
    limit = settings.runaway * max(np.linalg.norm(p.x) for p in branch.points[:2] if p.converged)
    if np.linalg.norm(new.x) > limit:
        branch.ended = f"stopped at {new.parameter:.6g}: the solution grows without bound"
    recent = [p.parameter for p in branch.points[-settings.stall:]]
    if len(recent) == settings.stall and max(recent) - min(recent) < 1e-3 * length / settings.parameter_share:
        branch.ended = (f"stopped at {new.parameter:.6g}: no way on in {settings.stall} points; "
                        "try the other direction or more damping")
    if sum(not p.converged for p in branch.points) > settings.most_gaps * 12:
        branch.ended = f"stopped at {new.parameter:.6g}: the branch was lost again and again"
    return bool(branch.ended)


def _growth(iterations):
    return {1: 1.8, 2: 1.8, 3: 1.3, 4: 0.9, 5: 0.7}.get(iterations, 0.5)


def _sign(e, n, sense) -> float:
    """Sign of the bordered determinant for the tangent that runs in the sense of the parameter."""
    tx, tp, sign = e.direction(np.zeros(n), 1.0)
    return sense * np.sign(sign)


def _tangent(e, row, corner, sign, metric):
    """Unit tangent (dx, dp) of the linearisation e, forward along the branch."""
    tx, tp, s = e.direction(row, corner)
    unit = np.sign(s) * sign / metric.norm(tx, tp)
    return unit * tx, unit * tp


def _predict(run, metric, step, order, sign):
    if len(run) > 1:
        return extrapolate(run, metric, step, min(order, len(run) - 1))
    tx, tp = _tangent(run[-1].detail, np.zeros(len(run[-1].x)), 1.0, sign, metric)
    return run[-1].x + step * tx, run[-1].parameter + step * tp


def _on_branch(new, last, x, p, metric, step, sign) -> bool:
    """A converged point that lies far from its prediction or far along, or that runs backward, is refused."""
    gone = metric.norm(new.x - last.x, new.parameter - last.parameter)
    corrected = metric.norm(new.x - x, new.parameter - p)
    if gone > 2 * step or corrected > 0.5 * step:
        return False
    return corrected < 0.1 * step or _forward(new, last, metric, sign)


def _forward(new, last, metric, sign) -> bool:
    row, corner = metric.border(new.x - last.x, new.parameter - last.parameter)
    tx, tp = _tangent(new.detail, row, corner, sign, metric)
    return row @ tx + corner * tp > 0


def _turn(evaluate, last, x, p, metric, step, sign, settings, branch):
    """Past a kink: the tangent of the linearisation beyond it leads on. None where that does not help."""
    row, corner = metric.border(x - last.x, p - last.parameter)
    for probe in (1.0, 4.0):
        e = evaluate(last.x + probe * (x - last.x), last.parameter + probe * (p - last.parameter))
        branch.calls += 1
        tx, tp = _tangent(e, row, corner, sign, metric)
        if not np.isfinite(tp):
            continue
        for reach in (step, 4 * step):
            tried = correct(evaluate, last.x + reach * tx, last.parameter + reach * tp,
                            *metric.border(tx, tp), metric, settings)
            branch.calls += tried.iterations
            if not tried.converged:
                continue
            gone = metric.norm(tried.x - last.x, tried.parameter - last.parameter)
            if 0.1 * reach < gone < 3 * reach and _forward(tried, last, metric, sign):
                return tried
    return None


def _across(evaluate, last, end, sense, weights, length, settings, branch):
    """Past a place where the branch is lost: mark it as failed and try fixed parameters ahead."""
    branch.points.append(Point(np.full_like(last.x, np.nan), last.parameter + sense * 1e-3 * length, False, 0))
    for ahead in (0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0):
        p = last.parameter + sense * ahead * length
        if sense * (p - end) > 0:
            p = end
        for guess in (last.x, np.zeros_like(last.x)):
            new = solve_at(evaluate, guess, p, weights, settings)
            branch.calls += new.iterations
            if new.converged:
                return new
        branch.points.append(replace(new, parameter=p))
    return None


def _finish(evaluate, branch, run, beyond, end, weights, settings, on_point):
    """The last point exactly at the end, between the last accepted one and the one beyond."""
    last = run[-1]
    share = (end - last.parameter) / (beyond.parameter - last.parameter)
    new = solve_at(evaluate, last.x + share * (beyond.x - last.x), end, weights, settings)
    branch.calls += new.iterations
    branch.points.append(new)
    if on_point:
        on_point(new, 0.0)
    branch.complete = new.converged
    branch.ended = "reached the end of the band" if new.converged else "the last point of the band did not converge"
    return branch


def between(evaluate, a: Point, b: Point, share: float, weights, settings=Settings(), guess=None) -> Point:
    """The point of the branch on the plane across the chord from a to b, at a share in (0, 1) of it."""
    metric = Metric(weights, max(np.linalg.norm(weights * a.x), np.linalg.norm(weights * b.x), 1e-300),
                    max(abs(a.parameter), abs(b.parameter), 1e-300) * 1e-2)
    row, corner = metric.border(b.x - a.x, b.parameter - a.parameter)
    x = a.x + share * (b.x - a.x)
    p = a.parameter + share * (b.parameter - a.parameter)
    if guess is not None:
        gx, gp = guess
        slip = row @ (gx - x) + corner * (gp - p)      # bring the guess onto the plane
        direction = row @ (b.x - a.x) + corner * (b.parameter - a.parameter)
        x = gx - slip / direction * (b.x - a.x)
        p = gp - slip / direction * (b.parameter - a.parameter)
    return correct(evaluate, x, p, row, corner, metric, settings)
