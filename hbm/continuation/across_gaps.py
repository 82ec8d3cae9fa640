"""Across places where a branch has no further point, or folds again and again without progress:
solutions ahead."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from tipdamp.hbm.continuation.branch import BranchTracer
from tipdamp.hbm.continuation.corrector import heading, reverse, solve_fixed
from tipdamp.hbm.continuation.point import Point, distance, failed

# places tried ahead of a lost branch, in unit steps of the parameter
AHEAD = (1e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)


def bridge_gap(tracer: BranchTracer) -> None:
    """Past a place where the corrector fails: the same branch close by, else a gap with failed
    points in it.

    A branch that ran back when it was lost has behind it what lies ahead of there: it is taken up
    where it had come furthest."""
    last = tracer.run[-1]
    aheads = AHEAD[: tracer.settings.places_ahead]
    guesses = last.x, np.zeros_like(last.x)
    found, tried = _solution_ahead(tracer, last.parameter, guesses, aheads)
    if found is not None and tracer.knows(found):
        solved = (point for point in tracer.branch.points if point.converged)
        left = max(solved, key=lambda point: tracer.sense * point.parameter)
        found, tried = _solution_ahead(tracer, left.parameter, (left.x, np.zeros_like(left.x)))
        if found is not None and tracer.gaps < tracer.settings.max_gaps:
            tracer.branch.restarts.append((left.parameter, found.parameter))
            tracer.gaps += 1
            return tracer.resume(replace(found, jump=True))
    if found is None or distance(last, found, tracer.metric()) > 0.1:
        marks = [last.parameter + tracer.sense * 1e-3 * tracer.length, *tried]
        tracer.branch.points += [failed(len(last.x), p) for p in marks]
        tracer.gaps += 1
    if found is None:
        tracer.branch.finish("no point", last.parameter)
    elif tracer.gaps > tracer.settings.max_gaps:
        tracer.branch.finish("lost", last.parameter)
    else:
        tracer.resume(found)


def restart_ahead(tracer: BranchTracer, follow: Callable) -> None:
    """Leave a branch without progress: in steps of the parameter, else for a solution further
    ahead.

    Each further restart goes twice as far. Where nothing is found ahead the branch is followed on;
    a solution ahead from which the way back was not found is kept for later.
    follow : the function of that name, by which a solution ahead is followed back
    """
    begin, taken_up = tracer.furthest, None
    goal = tracer.settings.restart_distance * 2.0 ** min(len(tracer.branch.restarts), 5)
    passed, at = _in_steps(tracer, begin, goal)
    tracer.stale = tracer.turns = 0
    tracer.attempts += 1
    tracer.fruitless += 1
    if at is None and tracer.restart:
        left = (passed[-1] if passed else begin).parameter
        if not _known_beyond(tracer, begin, left, goal):
            at, _ = _solution_ahead(
                tracer, begin.parameter, (), (goal, 2 * goal, 4 * goal, 8 * goal), 0
            )
            tracer.beyond = begin.parameter, _followed_back(tracer, at, left, follow) if at else []
        passed, taken_up = _back(tracer, left, passed)
    if passed:
        tracer.branch.restarts.append((begin.parameter, (taken_up or passed[-1]).parameter))
        for point in passed[:-1]:
            tracer.take(point)
        tracer.resume(passed[-1])


def _in_steps(tracer: BranchTracer, begin: Point, goal: float) -> tuple[list[Point], Point | None]:
    """(points found one from the other in steps of the parameter, the last of them or None where
    one was not)."""
    beside = [
        p.x for p in sorted(tracer.run, key=lambda point: -tracer.sense * point.parameter)[4:64:12]
    ]
    at, step = begin, AHEAD[0]
    passed: list[Point] = []
    while (
        at.parameter != tracer.end
        and tracer.ahead(at.parameter, begin.parameter) < goal * tracer.length
    ):
        found, _ = _solution_ahead(
            tracer, at.parameter, (at.x, *beside), (step, 0.3 * step, 3 * step), 30
        )
        if found is None:
            return passed, None
        at = found
        last = passed[-1] if passed else begin
        last.detail.forget()
        step = min(max(1.5 * abs(at.parameter - last.parameter) / tracer.length, AHEAD[0]), 0.05)
        passed.append(replace(at, jump=True))
    return passed, at


def _known_beyond(tracer: BranchTracer, begin: Point, left: float, goal: float) -> bool:
    """Whether it is known what lies ahead: looked for from not far behind, and still ahead where
    there is something."""
    if tracer.beyond is None:
        return False
    where, points = tracer.beyond
    near = tracer.ahead(begin.parameter, where) < goal * tracer.length
    return near and (not points or tracer.ahead(points[0].parameter, left) > 0)


def _followed_back(
    tracer: BranchTracer, found: Point, left: float, follow: Callable
) -> list[Point]:
    """The points from one found ahead back towards `left`, in the direction of the band, the
    nearest one first."""
    settings = tracer.settings
    few = replace(
        settings, max_points=settings.points_back, max_restarts=0, max_gaps=0, outside=0.0
    )
    back = follow(tracer.evaluate, found, left, tracer.weights, few)
    tracer.branch.calls += back.calls
    good = [reverse(q) for q in back.points if q.converged]
    nearest = min(range(len(good)), key=lambda i: tracer.sense * good[i].parameter)
    return [replace(good[nearest], jump=True), *good[:nearest][::-1]]


def _back(
    tracer: BranchTracer, left: float, passed: list[Point]
) -> tuple[list[Point], Point | None]:
    """`passed` and the points that lead on from beyond the place where the branch was left, and the
    first of these.

    Where a wide hole stays, a failed point marks it; while points are left for following the branch
    on, that is done instead and nothing comes back.
    """
    assert tracer.beyond is not None, "looked ahead before"
    (_, good), settings = tracer.beyond, tracer.settings
    if not good:
        return passed, None
    if tracer.ahead(good[0].parameter, left) <= settings.hole * tracer.way:
        return passed + good, good[0]
    if not tracer.late:
        return [], None
    hole = failed(len(good[0].x), 0.5 * (left + good[0].parameter))
    return [*passed, hole, *good], good[0]


def _solution_ahead(
    tracer: BranchTracer,
    parameter: float,
    guesses: tuple[np.ndarray, ...],
    aheads: tuple[float, ...] = AHEAD,
    max_calls: int = 60,
) -> tuple[Point | None, list[float]]:
    """(point at a fixed parameter ahead or None, parameters at which none was found)."""
    tried: list[float] = []

    def solutions(p: float, costlier: bool) -> Iterator[Point]:
        for guess in guesses:
            given = p, tracer.weights, tracer.settings, max_calls
            yield solve_fixed(tracer.evaluate, guess, *given)
        if tracer.restart and costlier:
            yield tracer.restart(p)

    for ahead in aheads:
        p = parameter + tracer.sense * ahead * tracer.length
        p = tracer.end if tracer.ahead(p, tracer.end) > 0 else p
        costlier = not guesses or aheads is AHEAD and ahead in (0.1, AHEAD[-1])
        for new in solutions(p, costlier):
            tracer.branch.calls += new.iterations
            if new.converged:
                return heading(new, tracer.sense), tried
        tried.append(p)
    return None, tried
