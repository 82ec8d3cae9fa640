"""One point of a branch after the other: steps and their size, kinks, and why the branch ended."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from tipdamp.hbm.continuation.corrector import correct, heading, oriented, solve_fixed
from tipdamp.hbm.continuation.point import (
    Evaluate,
    Linearised,
    Metric,
    OnPoint,
    Plane,
    Point,
    distance,
    size,
)
from tipdamp.hbm.continuation.predictor import (
    forward,
    on_branch,
    predict,
    prediction_errors,
    tangent,
)
from tipdamp.hbm.continuation.settings import Settings

ENDS = {  # why a branch ended, and the remedy
    "end": "reached the end of the band",
    "left": (
        "stopped at {at}: the branch turned back, left the band where it starts and did not "
        "return; start the band further out, or run in the other direction"
    ),
    "closed": (
        "stopped at {at}: the branch is closed, it returned to its start; run in the other "
        "direction, or start the band further out"
    ),
    "unbounded": (
        "stopped at {at}: the solution grows without bound; give the motion a stiffness, or more "
        "damping"
    ),
    "points": (
        "stopped at {at} after {n} points: the branch folds again and again; more damping, more "
        "or fewer harmonics, or the other direction may help"
    ),
    "drift": (
        "stopped at {at}: the mean friction force is not balanced: rigid-body drift; restrain "
        "that motion by a stiffness"
    ),
    "upright": (
        "stopped at {at}: the branch goes on there with motions of any size, as where it leaves "
        "another one; the other direction, or more harmonics, may lead on"
    ),
    "budget": (
        "stopped at {at} after {n} points: they cost more evaluations of the residual than "
        "allowed; try the other direction, more or fewer harmonics, more damping or a lower "
        "level first, or allow more (`max_calls` of the settings)"
    ),
    "no point": (
        "stopped at {at}: the corrector found no further point; try the other direction, more "
        "harmonics or a lower level first"
    ),
    "lost": (
        "stopped at {at}: the branch was lost several times; try the other direction, more "
        "harmonics or more damping"
    ),
    "last": (
        "the last point, at {at}, did not converge; end the band a little earlier or later, or "
        "run in the other direction"
    ),
    "no start": (
        "no solution found at {at}, where the band starts; start it further from the resonance, "
        "run in the other direction, or try more harmonics or more damping"
    ),
    "static": "no force: the static state",
    "round": "closed: it returned to where it begins",
    "through": "it leaves the band at both ends",
    "meets": "reached the curve again from which it branches off",
    "parent": "reached, at {at}, the motion of fewer periods from which it branches off",
}
COMPLETE = ("end", "round", "through", "meets", "parent")
ACROSS = (0.003, 0.01, 0.03, 0.1)  # arc lengths tried across a place where branches cross
BEFORE = 12  # points behind a kink, onto which no step beyond it may lead back ...
RETRACED = 0.05  # ... by this share of the step
ALONG = 0.9  # cosine of the angle by which the branch may turn there


@dataclass
class Branch:
    """Points in order, why and where it ended, and whether it reached the end.

    end : a key of ENDS, empty while the branch is followed; at : the parameter there
    calls : evaluations of the residual
    restarts : (from, to) parameters: a branch that folds without progress was left there and a
        solution taken up here; between them there are solutions found in small steps of the
        parameter, or none: then not far, or marked failed
    outside : the parameter furthest out of the band where it starts that the branch went through,
    or None
    beyond : the parameter furthest beyond the end of the band from which the branch came back, or
    None
    count : points when it ended
    """

    points: list[Point] = field(default_factory=list)
    end: str = ""
    at: float = np.nan
    complete: bool = False
    calls: int = 0
    restarts: list[tuple[float, float]] = field(default_factory=list)
    outside: float | None = None
    beyond: float | None = None
    count: int = 0

    @property
    def ended(self) -> str:
        """The sentence that says why it ended."""
        return self.sentence(lambda parameter: f"{parameter:.6g}")

    def sentence(self, named: Callable[[float], str]) -> str:
        """The same with the parameter as `named(parameter)` writes it."""
        return ENDS[self.end].format(at=named(self.at), n=self.count)

    def finish(self, end: str, at: float) -> None:
        """Note why and where it ended."""
        self.end, self.at, self.complete, self.count = end, at, end in COMPLETE, len(self.points)


class BranchTracer:
    """State of `follow`: the points since the last gap (`run`), the step, and the progress of the
    branch.

    lost : no step from the last point is short enough; shortened : whether the step was, since the
    last point
    begin, way, sense : of the parameter: where the band starts, its width, and the direction;
    settled : the last point at which it had moved noticeably
    sign : of the bordered determinant, forward along the branch; largest : weighted size of the
    unknowns so far
    stale, turns : points and folds since the last progress; gaps, attempts : gaps bridged and
    restarts tried
    fruitless : restarts tried since the last progress; beyond : from where points ahead were looked
    for, and these"""

    def __init__(
        self,
        evaluate: Evaluate,
        start: Point,
        end: float,
        weights: np.ndarray,
        settings: Settings,
        restart: Callable[[float], Point] | None,
        begin: float | None = None,
    ) -> None:
        self.evaluate, self.weights, self.settings = evaluate, weights, settings
        self.end, self.restart = end, restart
        self.branch = Branch([start], calls=start.iterations)
        self.begin = start.parameter if begin is None else begin
        self.sense, self.way = np.sign(end - self.begin), abs(end - self.begin)
        self.largest = size(weights * start.x)
        self.gaps, self.attempts, self.settled = 0, 0, start
        self.beyond: tuple[float, list[Point]] | None = None
        self.begin_at(start)

    @property
    def range(self) -> float:
        """Of the parameter, by which steps and progress are measured: in a very wide band, some
        times the parameter."""
        return min(self.way, self.settings.widest * abs(self.run[-1].parameter) or self.way)

    @property
    def length(self) -> float:
        """By which a unit step moves the parameter."""
        return self.settings.parameter_share * self.range

    def begin_at(self, point: Point) -> None:
        """Start again, from a point that does not continue the points before."""
        self.step, self.order, self.lost, self.shortened = self.settings.first_step, 1, False, False
        self.progressed(point)
        self.run = [heading(point, self.sense)]
        self.orientation = self.run[0].orientation
        self.branch.points[-1] = self.run[0]

    def progressed(self, to: Point) -> None:
        """The branch has come further than before."""
        self.furthest, self.stale, self.turns, self.fruitless = to, 0, 0, 0

    @property
    def late(self) -> bool:
        """Whether few points are left."""
        return len(self.branch.points) >= self.settings.late * self.settings.max_points

    def resume(self, found: Point) -> None:
        """Continue from a solution found ahead."""
        self.take(found)
        self.begin_at(found)
        if self.ahead(found.parameter, self.end) >= 0:
            self.branch.finish("end", self.end)

    def ahead(self, parameter: float, of: float) -> float:
        """How far a parameter lies ahead of another, in the direction of the band."""
        return self.sense * (parameter - of)

    def outside(self, parameter: float) -> float:
        """How far a parameter lies out of the band where that starts; not positive inside."""
        return self.ahead(self.begin, parameter)

    def metric(self) -> Metric:
        """Of the arc length at the last point."""
        now = size(self.weights * self.run[-1].x)
        self.largest = max(self.largest, now)
        return Metric(self.weights, max(now, 1e-3 * self.largest) or 1.0, self.length)

    def next_point(self) -> Point | None:
        """The next point of the branch; None where the step was too long, or the branch is lost."""
        last, metric = self.run[-1], self.metric()
        x, p = predict(self.run, metric, self.step, self.order)
        new = self._correct(metric.plane(x, p, x - last.x, p - last.parameter), metric)
        if new.converged and on_branch(
            new, last, x, p, metric, (self.step, self.settings.largest_error)
        ):
            return new
        if self.step < 2e-2:
            turned = self._turn(new, last, x, p, metric)
            if turned is not None:
                self.run = [last]
                return turned
        self.lost = self.step <= self.settings.smallest_step
        self.shortened = True
        if self.lost:
            return self._across()
        self.order, self.step = shorter_step(self.step, self.order)
        return None

    def _correct(self, plane: Plane, metric: Metric) -> Point:
        """The point of the branch on a plane, with its tangent."""
        new = correct(self.evaluate, plane, metric, self.settings, self.run[-1].x)
        self.branch.calls += new.iterations
        if not new.converged:
            return new
        along = tangent(new.detail, plane.row, plane.corner, self.orientation, metric)
        return replace(new, tangent=along, orientation=self.orientation)

    def accept(self, new: Point, on_point: OnPoint | None) -> None:
        """Take a point into the branch; check whether that is the end, and choose the next step."""
        if self.ahead(new.parameter, self.end) >= 0:
            return self._finish(new, on_point)
        before = self.run[-1]
        self._append(new, on_point)
        self._choose_step(new)
        if self.outside(new.parameter) > 0:
            self._note_outside(new)
        elif self.outside(before.parameter) > 0 and self._closed(before, new):
            self.branch.finish("closed", self.begin)
        elif self._grows(new):
            self.branch.finish("unbounded", new.parameter)
        elif self._drifts():
            self.branch.finish("drift", new.parameter)
        elif len(self.branch.points) >= self.settings.max_points:
            self.branch.finish("points", new.parameter)

    def _drifts(self) -> bool:
        """Whether the branch continues at one value of the parameter: a motion grows that the
        equations leave free."""
        settings = self.settings
        points = self.branch.points[-settings.drift_points :]
        if len(points) < settings.drift_points or not all(p.converged for p in points):
            return False
        values = [p.parameter for p in points]
        still = max(values) - min(values) < settings.drift_still * self.length
        return still and self.metric().norm(points[-1].x - points[0].x, 0.0) > settings.drift_far

    def makes_no_progress(self) -> bool:
        """Whether the branch folds again and again without progress, and may still be left."""
        patience = self.settings.patience * (1 if self.late else 2**self.fruitless)
        folds = self.stale > patience and self.turns >= 6 or self.stale > 3 * patience
        return folds and self.attempts < self.settings.max_restarts

    def _choose_step(self, new: Point) -> None:
        """Order and length of the next step, by the errors that the predictors of `new` had."""
        most = self.settings.highest_order
        errors = prediction_errors(self.run[-(most // 2 + 1) :], new, self.metric())[:most]
        self.run.append(new)
        self._note_progress(new)
        self.order, self.step = next_step(
            self.step, errors, new.iterations, self.shortened, self.settings
        )
        self.shortened = False

    def _note_progress(self, new: Point) -> None:
        before = self.run[-3:-1]
        if len(before) == 2:
            self.turns += (new.parameter - before[1].parameter) * (
                before[1].parameter - before[0].parameter
            ) < 0
        self.stale += 1
        if self.ahead(new.parameter, self.furthest.parameter) > self.settings.progress * self.range:
            self.progressed(new)

    def _note_outside(self, new: Point) -> None:
        out, known = self.outside(new.parameter), self.branch.outside
        if known is None or out > self.outside(known):
            self.branch.outside = new.parameter
        if out > self.settings.outside * abs(self.begin):
            self.branch.finish("left", self.begin)

    def _closed(self, before: Point, new: Point) -> bool:
        """Whether the branch returns to its start."""
        start = self.branch.points[0]
        border = self.solve_between(before, new, self.begin)
        return border.converged and self.metric().norm(border.x - start.x, 0.0) < 1e-6

    def _append(self, new: Point, on_point: OnPoint | None) -> None:
        self.take(new)
        if on_point:
            on_point(new, self.step)

    def take(self, new: Point) -> None:
        """The next point; what Newton's method needed at the one before is too large to keep over a
        whole branch."""
        before = self.branch.points[-1]
        if before.detail is not None:
            before.detail.forget()
        self.branch.points.append(new)

    def _grows(self, new: Point) -> bool:
        """Whether the unknowns grow without bound while the parameter all but stands."""
        before = self.settled.parameter
        if abs(new.parameter - before) > self.settings.apart * abs(before):
            self.settled = new
        start = max(size(p.x) for p in (*self.branch.points[:2], self.settled) if p.converged)
        return size(new.x) > self.settings.runaway * start

    def _turn(
        self, new: Point, last: Point, x: np.ndarray, p: float, metric: Metric
    ) -> Point | None:
        """Past a kink: the tangent of the linearisation beyond it leads on. None where that does
        not help."""
        row, corner = metric.border(x - last.x, p - last.parameter)
        for e in self._beyond(new, last, x, p):
            tx, tp = tangent(e, row, corner, self.orientation, metric)
            for reach in (self.step, 4 * self.step) if np.isfinite(tp) else ():
                tried = self._correct(
                    metric.plane(last.x + reach * tx, last.parameter + reach * tp, tx, tp), metric
                )
                if not tried.converged:
                    continue
                length = distance(last, tried, metric)
                on = 0.1 * reach < length < 3 * reach and forward(tried, last, metric)
                if on and not self._retraces(tried, length, metric):
                    return tried
        return None

    def _retraces(self, tried: Point, length: float, metric: Metric) -> bool:
        """Whether a point so far from the last one lies back where the branch came from: where the
        force jumps the determinant may change its sign, and with it the way of the tangent."""
        last = self.run[-1]
        (tx, tp), dx, dp = last.tangent, tried.x - last.x, tried.parameter - last.parameter
        if metric.inner(tx, tp, dx, dp) >= 0:
            return False
        points = [point for point in self.branch.points[-BEFORE:] if point.converged]
        return any(
            metric.beside_chord(tried, a, b) <= RETRACED * length for a, b in pairwise(points)
        )

    def knows(self, point: Point) -> bool:
        """Whether a solution lies on the branch as it is so far."""
        metric = self.metric()
        return any(
            metric.beside_chord(point, a, b) <= RETRACED * distance(a, b, metric)
            for a, b in pairwise(self.branch.points)
            if a.converged and b.converged
        )

    def _across(self) -> Point | None:
        """The next point behind a place where another branch crosses: the determinant changes its
        sign there, and with it the orientation of this one. None where there is no such place."""
        last, metric = self.run[-1], self.metric()
        tx, tp = metric.unit(*last.tangent)
        for reach in ACROSS:
            plane = metric.plane(last.x + reach * tx, last.parameter + reach * tp, tx, tp)
            new = correct(self.evaluate, plane, metric, self.settings)
            self.branch.calls += new.iterations
            if not new.converged:
                continue
            bx, bp = tangent(new.detail, plane.row, plane.corner, -self.orientation, metric)
            beside = distance(plane, new, metric)
            if metric.inner(tx, tp, bx, bp) > ALONG and beside < 0.2 * reach:
                self.orientation = -self.orientation
                self.step, self.order, self.lost = reach, 1, False
                return replace(new, tangent=(bx, bp), orientation=self.orientation)
        return None

    def _beyond(self, new: Point, last: Point, x: np.ndarray, p: float) -> Iterator[Linearised]:
        """Linearisations that may lie beyond a kink: where the corrector was, and further on."""
        yield new.detail
        self.branch.calls += 1
        yield self.evaluate(last.x + 4 * (x - last.x), last.parameter + 4 * (p - last.parameter))

    def solve_between(self, a: Point, b: Point, parameter: float) -> Point:
        """The solution at a parameter between those of two points of the branch."""
        share = (parameter - a.parameter) / (b.parameter - a.parameter)
        new = solve_fixed(
            self.evaluate, a.x + share * (b.x - a.x), parameter, self.weights, self.settings
        )
        self.branch.calls += new.iterations
        return oriented(new, a.orientation, *self.metric().across(a, b)) if new.converged else new

    def _finish(self, beyond: Point, on_point: OnPoint | None) -> None:
        """The last point exactly at the end, between the last accepted one and the one beyond."""
        new = self.solve_between(self.run[-1], beyond, self.end)
        self._append(new, on_point)
        self.branch.finish("end" if new.converged else "last", self.end)


def next_step(
    step: float, errors: np.ndarray, iterations: int, shortened: bool, settings: Settings
) -> tuple[int, float]:
    """(order, arc length) of the step after an accepted point: those whose predicted error equals
    the target.

    step : that led to the point; errors : of the predictions of order 1, 2, ... of the point;
    iterations : of its corrector; shortened : whether a longer step had failed before
    """
    order = 1 + int(np.argmin(errors * 1.5 ** np.arange(len(errors))))
    error = max(errors[order - 1], 1e-12)
    growth = min(max((settings.aim / error) ** (1 / (order + 1)), 0.5), 1.8)
    if iterations > 4:
        growth = min(growth, 0.6)
    elif shortened:
        growth = min(growth, 1.0)  # what stopped the longer step still lies ahead
    return order, min(step * growth, settings.largest_step)


def shorter_step(step: float, order: int) -> tuple[int, float]:
    """(order, arc length) of the step after one that failed."""
    return min(order, 1 if step < 1e-2 else 2), 0.4 * step
