"""Past places where a branch has no further point, or folds on and on without getting on: solutions ahead of it."""

from dataclasses import replace

import numpy as np

from hbm.continuation.corrector import Point, solve_at

GAP = (1e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)     # places tried ahead of a lost branch, in units of `length`
HOLE = 0.02                                      # share of the way without a solution that fails a branch
BACK = 400                                       # points in which a solution ahead is followed back
LEAP = 0.1                                       # distance over which a branch that folds on and on is left


def cross(walk):
    """Past a place where the corrector fails: the same branch close by, else a gap with failed points in it."""
    last, metric = walk.run[-1], walk.metric()
    found, tried = _solution_ahead(walk, last.parameter, (last.x, np.zeros_like(last.x)))
    if found is None or metric.norm(found.x - last.x, found.parameter - last.parameter) > 0.1:
        mark = last.parameter + walk.sense * 1e-3 * walk.length
        failed = Point(np.full_like(last.x, np.nan), mark, False, 0)
        walk.branch.points += [failed] + [replace(failed, parameter=p) for p in tried]
        walk.gaps += 1
    if found is None:
        walk.branch.finish("no point", last.parameter)
    elif walk.gaps > walk.settings.most_gaps:
        walk.branch.finish("lost", last.parameter)
    else:
        walk.resume(found)


def leap(walk, follow):
    """Leave a branch that does not get on: in steps of the parameter, else for a solution further ahead.

    Each further leap goes twice as far. Where nothing is found ahead the branch is followed on.
    """
    begin, taken_up, goal = walk.furthest, None, LEAP * 2.0 ** min(len(walk.branch.leaps), 5)
    passed, at = _in_steps(walk, begin, goal)
    walk.stale, walk.turns, walk.attempts = 0, 0, walk.attempts + 1
    if at is None and walk.restart:
        at, _ = _solution_ahead(walk, begin.parameter, (), (goal, 2 * goal, 4 * goal, 8 * goal), 0)
        passed, taken_up = _back(walk, at, passed, follow) if at else (passed, None)
    if passed:
        walk.branch.leaps.append((begin.parameter, (taken_up or passed[-1]).parameter))
        walk.branch.points += passed[:-1]
        walk.resume(passed[-1])


def _in_steps(walk, begin, goal):
    """(points found one from the other in steps of the parameter, the last of them or None where one was not)."""
    beside = [p.x for p in sorted(walk.run, key=lambda point: -walk.sense * point.parameter)[4:64:12]]
    at, passed, step = begin, [], GAP[0]
    while at.parameter != walk.end and walk.ahead(at.parameter, begin.parameter) < goal * walk.length:
        at, _ = _solution_ahead(walk, at.parameter, (at.x, *beside), (step, 0.3 * step, 3 * step), 30)
        if at is None:
            break
        last = passed[-1] if passed else begin
        step = min(max(1.5 * abs(at.parameter - last.parameter) / walk.length, GAP[0]), 0.05)
        passed.append(at)
    return passed, at


def _back(walk, found, passed, follow):
    """`passed` and the points up to one found ahead, which is followed back as far as it gets on, and the last.

    Where a hole stays that is wider than may be, a failed point marks it; while points are left for following the
    branch on, that is done instead and nothing comes back.
    """
    left = (passed[-1] if passed else walk.furthest).parameter
    back = follow(walk.evaluate, found, left, walk.weights,
                  replace(walk.settings, most_points=BACK, most_leaps=0, most_gaps=0, outside=0.0))
    walk.branch.calls += back.calls
    good = [q for q in back.points if q.converged]
    nearest = min(range(len(good)), key=lambda i: walk.sense * good[i].parameter)
    if walk.ahead(good[nearest].parameter, left) <= HOLE * walk.way:
        return passed + good[nearest::-1], good[nearest]
    if len(walk.branch.points) < 0.6 * walk.settings.most_points:
        return [], None
    hole = Point(np.full_like(found.x, np.nan), 0.5 * (left + good[nearest].parameter), False, 0)
    return passed + [hole] + good[nearest::-1], good[nearest]


def _solution_ahead(walk, parameter, guesses, aheads=GAP, most=60):
    """(point at a fixed parameter ahead or None, parameters at which none was found)."""
    tried = []
    for ahead in aheads:
        p = parameter + walk.sense * ahead * walk.length
        p = walk.end if walk.ahead(p, walk.end) > 0 else p
        for guess in guesses:
            new = solve_at(walk.evaluate, guess, p, walk.weights, walk.settings, most)
            walk.branch.calls += new.iterations
            if new.converged:
                return new, tried
        if walk.restart and (not guesses or aheads is GAP and ahead in (0.1, GAP[-1])):
            new = walk.restart(p)
            walk.branch.calls += new.iterations
            if new.converged:
                return new, tried
        tried.append(p)
    return None, tried
