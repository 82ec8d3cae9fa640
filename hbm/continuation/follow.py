"""Follows a branch of R(x, parameter) = 0 by arc length. Knows nothing of what R means.

`evaluate(x, parameter)` returns an object with

    residual (n,),   solve(row, corner, value, residual=None) -> dx, dp,   direction(row, corner) -> tx, tp, sign
    and   moved(dx, dp) -> the same, linearised, at x + dx and parameter + dp

where solve answers the bordered system [J, R_p; row', corner] [dx; dp] = [-residual; value], by default with its own
residual, and direction that with [0; 1] on the right, with the sign of the determinant. The bordered matrix is regular
at folds, where J alone is not. A system once factorised should be kept: it may be solved again for another residual.

R need not be smooth: the sign of det [J, R_p; t'] for a tangent t stays the same along a branch through folds and
kinks alike, so that it tells forward from backward where the direction itself jumps.

Optional: `pull(away)` - what to add to the residual so that one Newton step brings back what R does not determine,
where x has come `away` from the last point. The polynomials through noise there would run off.

`weights` (n,) say how much each unknown counts in the arc length. Lengths are relative: a step of 0.1 changes the
weighted unknowns by a tenth of their size, or the parameter by a hundredth of the way.

One point: `corrector`; the place where it is looked for: `predictor`; one after the other: `walk`; past places where
there is none, or where the branch does not get on: `leaps`.
"""

import numpy as np

from hbm.continuation import restart as leaps
from hbm.continuation.branch import ENDS, Branch, Walk
from hbm.continuation.budget import Spent
from hbm.continuation.corrector import DEFAULT, Metric, Point, Settings, between, correct, solve_at

__all__ = ["DEFAULT", "ENDS", "Branch", "Metric", "Point", "Settings", "between", "correct", "follow", "solve_at"]


def follow(evaluate, start: Point, end: float, weights, settings=DEFAULT, on_point=None, restart=None) -> Branch:
    """Follow the branch from a converged start until the parameter passes `end`.

    on_point(point, step) is called for each accepted point; restart(parameter) -> Point is a dearer way to a solution
    at a fixed parameter, asked where Newton from the last point fails. A failed corrector is tried again with smaller
    steps and lower predictors, then across the gap at fixed parameters; what cannot be had stays in the branch as
    failed. A branch that folds again and again without getting on is left for solutions ahead; the leap is recorded.
    A branch that folds out of the band where it began is followed there until it comes back; the points outside are
    not kept, and the branch is solved where it leaves and comes back. Where `evaluate` raises Spent the branch ends.
    """
    walk = Walk(evaluate, start, end, weights, settings, restart)
    try:
        _go(walk, on_point)
    except Spent:
        walk.branch.finish("work", walk.run[-1].parameter)
    _cut(walk)
    return walk.branch


def _go(walk, on_point):
    while not walk.branch.end:
        new = walk.next_point()
        if new is not None:
            walk.accept(new, on_point)
            if not walk.branch.end and walk.wanders():
                leaps.leap(walk, follow)
        elif walk.lost:
            leaps.cross(walk)


def _cut(walk):
    """Leave out what lies outside the band where it begins; solve where the branch goes out and comes in."""
    branch, kept, before = walk.branch, [], None
    for point in branch.points:
        out = walk.outside(point.parameter) > 0
        crosses = before is not None and out != (walk.outside(before.parameter) > 0)
        if crosses and branch.end != "work" and before.converged and point.converged:
            border = walk.solve_between(before, point, walk.begin)
            if border.converged and not any(_same(border, known, walk) for known in (before, point)):
                kept.append(border)
        if not out:
            kept.append(point)
        before = point
    branch.points = kept


def _same(a, b, walk) -> bool:
    return a.parameter == b.parameter and np.linalg.norm(walk.weights * (a.x - b.x)) <= 1e-6 * walk.largest
