"""Follows a branch of R(x, p) = 0 by arc length.

One point: `corrector`; where it is expected: `predictor`; one after the other: `branch`; past
places without a solution, or where the branch folds without progress: `restart`. A budget limits
the residual evaluations.
"""

from collections.abc import Callable

import numpy as np

from tipdamp.hbm.continuation.across_gaps import bridge_gap, restart_ahead
from tipdamp.hbm.continuation.beyond import cut
from tipdamp.hbm.continuation.branch import Branch, BranchTracer
from tipdamp.hbm.continuation.point import Evaluate, OnPoint, Point
from tipdamp.hbm.continuation.settings import DEFAULT, Settings


class BudgetExceeded(Exception):
    """A branch has cost more residual calls than its settings allow."""


class Budget:
    """Counts residual calls and points; `progress(value, step, calls)` or None is called for both.

    Between points progress comes with the value of the last one, step 0 and the calls since.
    """

    def __init__(
        self, settings: Settings, progress: Callable | None, first: float, unknowns: int
    ) -> None:
        # a call costs about the cube of the unknowns: small problems may make more
        self.most = settings.max_calls * max(1.0, settings.large / unknowns) ** 2
        self.settings, self.progress, self.value = settings, progress, first
        self.calls, self.points, self.since = 0, 0, 0

    def point(self, value: float, step: float, calls: int) -> None:
        """A point is taken into the branch."""
        self.points, self.value, self.since = self.points + 1, value, 0
        if self.progress:
            self.progress(value, step, calls)

    def call(self) -> None:
        """The residual is evaluated once more; raises BudgetExceeded above the limit, then and from
        then on."""
        self.calls, self.since = self.calls + 1, self.since + 1
        if self.progress and self.since % self.settings.progress_interval == 0:
            self.progress(self.value, 0.0, self.since)
        most = self.most if self.points else min(self.most, self.settings.max_first_calls)
        if self.calls > most + self.settings.calls_per_point * self.points:
            raise BudgetExceeded


def follow(
    evaluate: Evaluate,
    start: Point,
    end: float,
    weights: np.ndarray,
    settings: Settings = DEFAULT,
    on_point: OnPoint | None = None,
    restart: Callable[[float], Point] | None = None,
) -> Branch:
    """Follow the branch from a converged start until the parameter passes `end`.

    weights (n,) : how much each unknown counts in the arc length
    on_point(point, step) : called for each accepted point
    restart(parameter) -> Point : a costlier way to a solution at a fixed parameter, used where
        Newton from the last point fails
    A failed corrector is tried again with smaller steps and lower predictors, then across the gap
    at fixed parameters; points that are not found stay in the branch as failed. A branch that folds
    again and again without progress is left for solutions ahead; the restart is recorded. A branch
    that folds out of the band where it starts is followed there until it comes back; the points
    outside are not kept, and the branch is solved where it leaves and comes back. Where `evaluate`
    raises BudgetExceeded the branch ends.
    """
    tracer = BranchTracer(evaluate, start, end, weights, settings, restart)
    try:
        while not tracer.branch.end:
            _advance(tracer, on_point)
    except BudgetExceeded:
        tracer.branch.finish("budget", tracer.run[-1].parameter)
    _cut(tracer)
    return tracer.branch


def _advance(tracer: BranchTracer, on_point: OnPoint | None) -> None:
    new = tracer.next_point()
    if new is not None:
        tracer.accept(new, on_point)
        if not tracer.branch.end and tracer.makes_no_progress():
            restart_ahead(tracer, follow)
    elif tracer.lost:
        bridge_gap(tracer)


def _cut(tracer: BranchTracer) -> None:
    """Leave out what lies outside the band where it starts; solve where the branch goes out and
    comes in."""

    def border(before: Point, point: Point) -> Point | None:
        if tracer.branch.end == "budget":
            return None
        found = tracer.solve_between(before, point, tracer.begin)
        known = any(_same(found, end, tracer) for end in (before, point))
        return found if found.converged and not known else None

    tracer.branch.points = cut(tracer.branch.points, lambda p: tracer.outside(p) > 0, border)


def _same(a: Point, b: Point, tracer: BranchTracer) -> bool:
    return bool(
        a.parameter == b.parameter
        and np.linalg.norm(tracer.weights * (a.x - b.x)) <= 1e-6 * tracer.largest
    )
