"""Follows a branch of R(x, parameter) = 0 by arc length. Knows nothing of what R means.

`evaluate(x, parameter)` returns an object with

    residual (n,),   solve(row, corner, value, residual=None) -> dx, dp,   direction(row, corner) -> tx, tp, sign
    and   moved(dx, dp) -> the same, linearised, at x + dx and parameter + dp

where solve answers the bordered system [J, R_p; row', corner] [dx; dp] = [-residual; value], by default with its own
residual, and direction that with [0; 1] on the right, with the sign of the determinant. The bordered matrix is regular
at folds, where J alone is not. A system once factorised should be kept: it may be solved again for another residual.

R need not be smooth: the sign of det [J, R_p; t'] for a tangent t stays the same along a branch through folds and
kinks alike, so that it tells forward from backward where the direction itself jumps.

`weights` (n,) say how much each unknown counts in the arc length. Lengths are relative: a step of 0.1 changes the
weighted unknowns by a tenth of their size, or the parameter by a hundredth of the way.
"""

from dataclasses import dataclass, field, replace

import numpy as np

END = "reached the end of the band"
GAP = (1e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)     # places tried ahead of a lost branch, in units of `length`
SAFE = 8.0                                       # factor on the estimated error after the last step
BLIND = 1e-4                                     # length of a step that may be the last without evaluating again
PACE = 3e-3                                      # share of the way by which a branch must get on to be worth following
HOLE = 0.02                                      # share of the way without a solution that fails a branch
BACK = 400                                       # points in which a solution ahead is followed back
LEAP = 0.1                                       # distance over which a branch that folds on and on is left


@dataclass(frozen=True)
class Settings:
    """Numbers of the method. `parameter_share`: a unit step moves the parameter by this share of the way."""

    first_step: float = 0.05
    largest_step: float = 0.25
    smallest_step: float = 1e-5
    parameter_share: float = 0.1
    tolerance: float = 1e-10      # of the residual, relative to the weighted unknowns
    aim: float = 2.5e-3             # error of a predicted point, to which the steps are fitted
    highest_order: int = 5        # of the predicting polynomials
    most_iterations: int = 12
    most_points: int = 5000
    most_gaps: int = 3
    most_leaps: int = 12
    runaway: float = 1e8          # unknowns this many times those of the start mean that no solution exists further on
    patience: int = 250           # points without getting on, before the branch is left


DEFAULT = Settings()


@dataclass(frozen=True, eq=False)
class Point:
    """One point of a branch; x is NaN where the corrector failed."""

    x: np.ndarray
    parameter: float
    converged: bool
    iterations: int               # evaluations of the residual
    detail: object = None         # what `evaluate` returned last


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
    """Newton on the plane through (x, p) with normal (row, corner).

    A step that by the contraction so far leads below the tolerance is the last one: it is taken without evaluating
    again, and with the matrix of the step before where that is good enough [Deuflhard 2004, section 2.1].
    """
    x0, p0, before, least, held, stalls = x, p, np.inf, np.inf, None, 0
    for iteration in range(1, settings.most_iterations + 1):
        e = evaluate(x, p)
        size = np.clip(np.linalg.norm(metric.weights * x), 1e-6 * metric.size, 10 * metric.size)
        error = np.linalg.norm(e.residual) / size
        if error <= settings.tolerance:
            return Point(x, p, True, iteration, e)
        stalls += error > 0.5 * least          # more than once: it goes round between the pieces of a kink
        if not np.isfinite(error) or error > 1e8 or stalls > 1:
            break
        rate = error / before if held is not None else 1.0
        chord = held is not None and SAFE * rate * error <= settings.tolerance
        value = -(row @ (x - x0) + corner * (p - p0))
        dx, dp = (held if chord else e).solve(row, corner, value, e.residual)
        x, p = x + dx, p + dp
        if not np.isfinite(p) or not np.isfinite(x).all():
            break
        if (chord or SAFE * rate**2 * error <= settings.tolerance) and metric.norm(dx, dp) < BLIND:
            return Point(x, p, True, iteration, e.moved(dx, dp))
        before, least, held = error, min(error, least), e
    return Point(np.full_like(x0, np.nan), p0, False, iteration)


def solve_at(evaluate, x, p, weights, settings=DEFAULT, most=300) -> Point:
    """Damped Newton at a fixed parameter, for a first point or a restart, in about `most` evaluations."""
    none = np.zeros(len(x))
    e = evaluate(x, p)
    calls = 1
    reach = 1e3 * max(np.linalg.norm(x), np.linalg.norm(e.residual))     # a Jacobian near singular sends x far away
    while calls < most:
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


def between(evaluate, a: Point, b: Point, share: float, weights, settings=DEFAULT, guess=None) -> Point:
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


@dataclass
class Branch:
    """Points in order, the sentence that says why it ended, and whether it reached the end.

    leaps : (from, to) parameters: a branch that folds without getting on was left there and a solution taken up here;
        between them there are solutions found in small steps of the parameter, or none: then not far, or marked failed
    """

    points: list = field(default_factory=list)
    ended: str = ""
    complete: bool = False
    calls: int = 0
    leaps: list = field(default_factory=list)


def follow(evaluate, start: Point, end: float, weights, settings=DEFAULT, on_point=None, restart=None) -> Branch:
    """Follow the branch from a converged start until the parameter passes `end`.

    on_point(point, step) is called for each accepted point; restart(parameter) -> Point is a dearer way to a solution
    at a fixed parameter, asked where Newton from the last point fails. A failed corrector is tried again with smaller
    steps and lower predictors, then across the gap at fixed parameters; what cannot be had stays in the branch as
    failed. A branch that folds again and again without getting on is left for solutions ahead; the leap is recorded.
    """
    walk = _Walk(evaluate, start, end, weights, settings, restart)
    while not walk.branch.ended:
        new = walk.next_point()
        if new is not None:
            walk.accept(new, on_point)
    return walk.branch


class _Walk:
    """Where `follow` stands: the points since the last gap (`run`), the step, and how far the branch has got."""

    def __init__(self, evaluate, start, end, weights, settings, restart):
        self.evaluate, self.end, self.weights, self.settings, self.restart = evaluate, end, weights, settings, restart
        self.branch = Branch([start], calls=start.iterations)
        self.begin, self.sense = start.parameter, np.sign(end - start.parameter)
        self.way = abs(end - start.parameter)
        self.length = settings.parameter_share * self.way
        self.largest = np.linalg.norm(weights * start.x)
        self.furthest, self.stale, self.turns, self.gaps, self.attempts = start, 0, 0, 0, 0
        self._begin_at(start)

    def _begin_at(self, point):
        self.run, self.step, self.order = [point], self.settings.first_step, 1
        tx, tp, sign = point.detail.direction(np.zeros(len(self.weights)), 1.0)
        self.sign = self.sense * np.sign(sign)

    def _metric(self):
        size = np.linalg.norm(self.weights * self.run[-1].x)
        self.largest = max(self.largest, size)
        return Metric(self.weights, max(size, 1e-3 * self.largest) or 1.0, self.length)

    def next_point(self):
        """The next point of the branch; None where the step was too long, or where the branch was picked up ahead."""
        last, metric = self.run[-1], self._metric()
        x, p = _predict(self.run, metric, self.step, self.order, self.sign)
        row, corner = metric.border(x - last.x, p - last.parameter)
        new = correct(self.evaluate, x, p, row, corner, metric, self.settings)
        self.branch.calls += new.iterations
        if new.converged and _on_branch(new, last, x, p, metric, self.step, self.sign):
            return new
        if self.step < 2e-2:
            turned = self._turn(last, x, p, metric)
            if turned is not None:
                self.run = [last]
                return turned
        if self.step > self.settings.smallest_step:
            self.step, self.order = 0.4 * self.step, min(self.order, 1 if self.step < 1e-2 else 2)
            return None
        self._cross(last, metric)
        return None

    def accept(self, new, on_point):
        if self.sense * (new.parameter - self.end) >= 0:
            return self._finish(new, on_point)
        self._append(new, on_point)
        self._choose_step(new)
        if self.sense * (new.parameter - self.begin) < 0:
            self.branch.ended = f"the branch turned back and left the band where it began, at {self.begin:.6g}"
        elif np.linalg.norm(new.x) > self._bound():
            self.branch.ended = f"stopped at {new.parameter:.6g}: the solution grows without bound"
        elif len(self.branch.points) >= self.settings.most_points:
            self.branch.ended = f"stopped at {new.parameter:.6g} after {len(self.branch.points)} points" + _FOLDS
        elif self._wanders(new):
            self._leap(new)

    def _choose_step(self, new):
        """Order and length of the next step: those whose prediction of `new` would have erred as aimed."""
        most = self.settings.highest_order
        errors = prediction_errors(self.run[-most - 1:], new, self._metric())
        self.run.append(new)
        self.order = 1 + int(np.argmin(errors * 1.5 ** np.arange(len(errors)))) if len(errors) else 1
        error = max(errors[self.order - 1], 1e-12) if len(errors) else self.settings.aim
        growth = np.clip((self.settings.aim / error) ** (1 / (self.order + 1)), 0.5, 1.8)
        if new.iterations > 4:
            growth = min(growth, 0.6)
        self.step = min(self.step * growth, self.settings.largest_step)

    def _append(self, new, on_point):
        self.branch.points.append(new)
        if on_point:
            on_point(new, self.step)

    def _bound(self):
        return self.settings.runaway * max(np.linalg.norm(p.x) for p in self.branch.points[:2] if p.converged)

    def _wanders(self, new) -> bool:
        """Whether the branch folds on and on without getting further."""
        before = self.run[-3:-1]
        if len(before) == 2:
            self.turns += (new.parameter - before[1].parameter) * (before[1].parameter - before[0].parameter) < 0
        self.stale += 1
        if self.sense * (new.parameter - self.furthest.parameter) > PACE * self.way:
            self.furthest, self.stale, self.turns = new, 0, 0
        patience = self.settings.patience
        wanders = self.stale > patience and self.turns >= 6 or self.stale > 3 * patience
        return wanders and self.attempts < self.settings.most_leaps

    def _leap(self, new):
        """Leave a branch that does not get on: in steps of the parameter, else for a solution further ahead.

        Each further leap goes twice as far. Where nothing is found ahead the branch is followed on.
        """
        begin, taken_up, goal = self.furthest, None, LEAP * 2.0 ** min(len(self.branch.leaps), 5)
        beside = [p.x for p in sorted(self.run, key=lambda point: -self.sense * point.parameter)[4:64:12]]
        at, passed, step = begin, [], GAP[0]
        while at.parameter != self.end and self.sense * (at.parameter - begin.parameter) < goal * self.length:
            at, _ = self._ahead(at.parameter, (at.x, *beside), (step, 0.3 * step, 3 * step), 30)
            if at is None:
                break
            last = passed[-1] if passed else begin
            step = min(max(1.5 * abs(at.parameter - last.parameter) / self.length, GAP[0]), 0.05)
            passed.append(at)
        self.stale, self.turns, self.attempts = 0, 0, self.attempts + 1
        if at is None and self.restart:
            at, _ = self._ahead(begin.parameter, (), (goal, 2 * goal, 4 * goal, 8 * goal), 0)
            passed, taken_up = self._back(at, passed) if at else (passed, None)
        if passed:
            self.branch.leaps.append((begin.parameter, (taken_up or passed[-1]).parameter))
            self.branch.points += passed[:-1]
            self._resume(passed[-1])

    def _back(self, found, passed):
        """`passed` and the points up to one found ahead, which is followed back as far as it gets on, and the last.

        Where a hole stays that is wider than may be, a failed point marks it; while points are left for following the
        branch on, that is done instead and nothing comes back.
        """
        left = (passed[-1] if passed else self.furthest).parameter
        back = follow(self.evaluate, found, left, self.weights,
                      replace(self.settings, most_points=BACK, most_leaps=0, most_gaps=0))
        self.branch.calls += back.calls
        good = [q for q in back.points if q.converged]
        nearest = min(range(len(good)), key=lambda i: self.sense * good[i].parameter)
        if self.sense * (good[nearest].parameter - left) <= HOLE * self.way:
            return passed + good[nearest::-1], good[nearest]
        if len(self.branch.points) < 0.6 * self.settings.most_points:
            return [], None
        hole = Point(np.full_like(found.x, np.nan), 0.5 * (left + good[nearest].parameter), False, 0)
        return passed + [hole] + good[nearest::-1], good[nearest]

    def _cross(self, last, metric):
        """Past a place where the corrector fails: the same branch close by, else a gap with failed points in it."""
        found, tried = self._ahead(last.parameter, (last.x, np.zeros_like(last.x)))
        if found is None or metric.norm(found.x - last.x, found.parameter - last.parameter) > 0.1:
            mark = last.parameter + self.sense * 1e-3 * self.length
            failed = Point(np.full_like(last.x, np.nan), mark, False, 0)
            self.branch.points += [failed] + [replace(failed, parameter=p) for p in tried]
            self.gaps += 1
        if found is None:
            self.branch.ended = (f"stopped at {last.parameter:.6g}: the corrector found no further point; "
                                 "try the other direction, more harmonics or a lower level first")
        elif self.gaps > self.settings.most_gaps:
            self.branch.ended = f"stopped at {last.parameter:.6g}: the branch was lost again and again"
        else:
            self._resume(found)

    def _ahead(self, parameter, guesses, aheads=GAP, most=60):
        """(point at a fixed parameter ahead or None, parameters at which none was found)."""
        tried = []
        for ahead in aheads:
            p = parameter + self.sense * ahead * self.length
            p = self.end if self.sense * (p - self.end) > 0 else p
            for guess in guesses:
                new = solve_at(self.evaluate, guess, p, self.weights, self.settings, most)
                self.branch.calls += new.iterations
                if new.converged:
                    return new, tried
            if self.restart and (not guesses or aheads is GAP and ahead in (0.1, GAP[-1])):
                new = self.restart(p)
                self.branch.calls += new.iterations
                if new.converged:
                    return new, tried
            tried.append(p)
        return None, tried

    def _resume(self, found):
        self.branch.points.append(found)
        self._begin_at(found)
        self.furthest, self.stale, self.turns = found, 0, 0
        if self.sense * (found.parameter - self.end) >= 0:
            self.branch.complete, self.branch.ended = True, END

    def _turn(self, last, x, p, metric):
        """Past a kink: the tangent of the linearisation beyond it leads on. None where that does not help."""
        row, corner = metric.border(x - last.x, p - last.parameter)
        for probe in (1.0, 4.0):
            e = self.evaluate(last.x + probe * (x - last.x), last.parameter + probe * (p - last.parameter))
            self.branch.calls += 1
            tx, tp = _tangent(e, row, corner, self.sign, metric)
            if not np.isfinite(tp):
                continue
            for reach in (self.step, 4 * self.step):
                tried = correct(self.evaluate, last.x + reach * tx, last.parameter + reach * tp,
                                *metric.border(tx, tp), metric, self.settings)
                self.branch.calls += tried.iterations
                if not tried.converged:
                    continue
                gone = metric.norm(tried.x - last.x, tried.parameter - last.parameter)
                if 0.1 * reach < gone < 3 * reach and _forward(tried, last, metric, self.sign):
                    return tried
        return None

    def _finish(self, beyond, on_point):
        """The last point exactly at the end, between the last accepted one and the one beyond."""
        last = self.run[-1]
        share = (self.end - last.parameter) / (beyond.parameter - last.parameter)
        new = solve_at(self.evaluate, last.x + share * (beyond.x - last.x), self.end, self.weights, self.settings)
        self.branch.calls += new.iterations
        self._append(new, on_point)
        self.branch.complete = new.converged
        self.branch.ended = END if new.converged else "the last point of the band did not converge"


_FOLDS = (": the branch folds again and again; more damping, more or fewer harmonics, "
          "or the other direction may help")


def extrapolate(points, metric, step, order):
    """Polynomial through the last order + 1 points, over their distances, at a step beyond the last."""
    used = points[-(order + 1):]
    weights = _lagrange(_places(used, metric), step)
    return sum(w * q.x for w, q in zip(weights, used, strict=True)), \
        sum(w * q.parameter for w, q in zip(weights, used, strict=True))


def prediction_errors(points, new, metric):
    """How far from `new` the polynomials of order 1, 2, ... through the last of the points would have led."""
    if len(points) < 2:
        return np.empty(0)
    places = _places(points, metric)
    step = metric.norm(new.x - points[-1].x, new.parameter - points[-1].parameter)
    weights = np.zeros((len(points) - 1, len(points)))
    for order in range(1, len(points)):
        weights[order - 1, -order - 1:] = _lagrange(places[-order - 1:], step)
    x = weights @ np.array([q.x for q in points]) - new.x
    p = weights @ np.array([q.parameter for q in points]) - new.parameter
    return np.array([metric.norm(*error) for error in zip(x, p, strict=True)])


def _places(points, metric):
    """Distances along the points, zero at the last."""
    gone = [metric.norm(b.x - a.x, b.parameter - a.parameter) for a, b in zip(points[:-1], points[1:], strict=True)]
    return np.r_[-np.cumsum(gone[::-1])[::-1], 0.0]


def _lagrange(places, at):
    """Weights with which values at the places make up the interpolating polynomial elsewhere."""
    apart = places[:, None] - places
    np.fill_diagonal(apart, 1.0)
    ahead = np.tile(at - places, (len(places), 1))
    np.fill_diagonal(ahead, 1.0)
    return np.prod(ahead, axis=1) / np.prod(apart, axis=1)


def _predict(run, metric, step, order, sign):
    if len(run) > 1:
        return extrapolate(run, metric, step, min(order, len(run) - 1))
    tx, tp = _tangent(run[-1].detail, np.zeros(len(run[-1].x)), 1.0, sign, metric)
    return run[-1].x + step * tx, run[-1].parameter + step * tp


def _tangent(e, row, corner, sign, metric):
    """Unit tangent (dx, dp) of the linearisation e, forward along the branch."""
    tx, tp, s = e.direction(row, corner)
    unit = np.sign(s) * sign / metric.norm(tx, tp)
    return unit * tx, unit * tp


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
