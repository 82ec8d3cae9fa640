"""Single solutions beside the branch: the first one, those where a frequency was asked for, those around a peak."""

from dataclasses import replace

import numpy as np

from hbm.continuation import follow as continuation
from hbm.laws.uncoupled.law import CoulombFriction

_TIP = 8       # times that the points of a fold are brought closer, each time to half
OFF_BAND = (0.95, 0.85, 0.7, 1.05, 1.15, 1.3)     # from where a first point is reached, relative to its frequency


def first_point(balance, w, settings):
    """A solution at w: from the stuck response, else by raising the force from zero, else from a marched motion."""
    return first_of(starts(balance, w, settings, off_band=False))


def starts(balance, w, settings, off_band=True):
    """Solutions at w, or failed points, each with the residual calls it took: one way to a first point after the other.

    off_band : whether to come from other frequencies too, where the ways at w are used up
    """
    yield continuation.solve_at(balance.evaluate, balance.linear(w), w, balance.weights, settings)
    for guess in (_raise_level, _march_on):
        x, calls = guess(balance, w, settings)
        if x is not None:
            point = continuation.solve_at(balance.evaluate, x, w, balance.weights, settings)
            yield replace(point, iterations=calls + point.iterations)
        else:
            yield _none(balance, w, calls)
    for share in OFF_BAND if off_band else ():
        yield _come_from(balance, share * w, w, settings)


def first_of(points):
    """The first that converged, with the residual calls of all that were tried; else the last."""
    calls = 0
    for point in points:
        calls += point.iterations
        if point.converged:
            break
    return replace(point, iterations=calls)


def _none(balance, w, calls):
    x = np.full(len(balance.weights), np.nan)
    return continuation.Point(x, w, False, calls)


def _raise_level(balance, w, settings):
    """(x or None, residual calls): the branch over the force level, from almost nothing to the whole force."""
    def by_level(x, level):
        return balance.evaluate(x, w, level, by="level")

    low = continuation.solve_at(by_level, balance.linear(w, 1e-3), 1e-3, balance.weights, settings)
    if not low.converged:
        return None, low.iterations
    branch = continuation.follow(by_level, low, 1.0, balance.weights,
                                 replace(settings, most_points=150, most_leaps=0))
    return branch.points[-1].x if branch.complete else None, branch.calls


def _march_on(balance, w, settings):
    """(x or None, residual calls): where time integration from rest gets to; event-driven laws only."""
    from hbm.time import exact as march
    if not isinstance(balance.problem.law, CoulombFriction):
        return None, 0
    motion = march.March(balance, w, tolerance=1e-4)
    motion.periods(motion.at_rest(), 60)
    x = motion.harmonics_of_motion()
    return x if np.isfinite(x).all() else None, 0


def _come_from(balance, other, w, settings):
    """The branch from a solution at another frequency to w."""
    begin = first_point(balance, other, settings)
    if not begin.converged:
        return _none(balance, w, begin.iterations)
    branch = continuation.follow(balance.evaluate, begin, w, balance.weights,
                                 replace(settings, most_points=500, most_leaps=1, outside=0.0))
    return replace(branch.points[-1], iterations=branch.calls) if branch.complete else _none(balance, w, branch.calls)


def passages(evaluate, points, parameter, weights, settings):
    """(point, residual calls, index of the point behind it) of every passage of the parameter between two points.

    Newton at the fixed parameter; where it leads away from the two points, they are first brought closer to each other.
    The tip of a fold may reach further than its points: there, more of it is solved before.
    """
    found = []
    for i, (a, b) in enumerate(zip(points[:-1], points[1:], strict=True)):
        if a.converged and b.converged and (a.parameter - parameter) * (b.parameter - parameter) < 0:
            point, calls = _passage(evaluate, a, b, parameter, weights, settings)
            found.append((point, calls, i + 1))
    for i, fold in enumerate(zip(points[:-2], points[1:-1], points[2:], strict=True), 1):
        if _turns(*fold, parameter):
            tip, calls = _tip(evaluate, fold, parameter, weights, settings)
            for place, (a, b) in zip((i, i + 1), zip(tip[:-1], tip[1:], strict=True), strict=False):
                point, more = _passage(evaluate, a, b, parameter, weights, settings)
                found.append((point, calls + more, place))
                calls = 0
    return sorted(found, key=lambda one: one[2])


def _turns(a, b, c, parameter):
    """Whether the branch turns back at b, without having come to the parameter."""
    beyond = parameter - b.parameter
    return (all(p.converged for p in (a, b, c)) and beyond * (b.parameter - a.parameter) > 0
            and beyond * (b.parameter - c.parameter) > 0)


def _tip(evaluate, fold, parameter, weights, settings):
    """([points before, beyond and after the parameter], residual calls) of a fold whose three points do not reach it;
    no points where its tip does not either, as the parabola through the highest three tells."""
    calls = 0
    for _ in range(_TIP):
        if not _reaches(fold, parameter, weights):
            break
        a, b, c = fold
        middles = [continuation.between(evaluate, *pair, 0.5, weights, settings) for pair in ((a, b), (b, c))]
        calls += sum(middle.iterations for middle in middles)
        if not all(middle.converged for middle in middles):
            break
        finer = [a, middles[0], b, middles[1], c]
        toward = np.sign(parameter - b.parameter)
        top = min(max(int(np.argmax([toward * p.parameter for p in finer])), 1), 3)
        fold = finer[top - 1:top + 2]
        if toward * (fold[1].parameter - parameter) > 0:
            return fold, calls
    return [], calls


def _reaches(fold, parameter, weights):
    """Whether twice the way from the highest of three points to the tip of their parabola leads past the parameter."""
    a, b, c = fold
    before, after = (np.linalg.norm(weights * (q.x - p.x)) for p, q in ((a, b), (b, c)))
    rise, fall = (b.parameter - a.parameter) / before, (c.parameter - b.parameter) / after
    bend = (fall - rise) / (before + after)
    slope = (rise * after + fall * before) / (before + after)
    return abs(parameter - b.parameter) <= 2 * abs(slope**2 / (4 * bend)) if bend else False


def _passage(evaluate, a, b, parameter, weights, settings):
    calls, beside = 0, None
    for _ in range(12):
        share = (parameter - a.parameter) / (b.parameter - a.parameter)
        guess, apart = a.x + share * (b.x - a.x), np.linalg.norm(weights * (b.x - a.x))
        new = continuation.solve_at(evaluate, guess, parameter, weights, settings, 30)
        calls += new.iterations
        if new.converged and np.linalg.norm(weights * (new.x - guess)) <= 0.5 * apart + 1e-9 * np.linalg.norm(a.x):
            if -1e-6 <= _along(a, b, new.x, weights) <= 1 + 1e-6:
                return new, calls
            beside = beside or new          # next to a fold: perhaps the solution on its other side
        middle = continuation.between(evaluate, a, b, 0.5, weights, settings)
        calls += middle.iterations
        if not middle.converged:
            break
        a, b = (a, middle) if (a.parameter - parameter) * (middle.parameter - parameter) <= 0 else (middle, b)
    return beside or replace(new, x=np.full_like(new.x, np.nan), converged=False), calls


def _along(a, b, x, weights):
    """How far x has come on the way from point a (0) to point b (1)."""
    way = weights * (b.x - a.x)
    return (weights * (x - a.x)) @ way / max(way @ way, 1e-300)


def solve_passages(evaluate, branch, at, weights, settings):
    """Insert a solved point wherever the branch passes one of the parameters."""
    for parameter in at:
        for point, calls, place in reversed(passages(evaluate, branch.points, parameter, weights, settings)):
            branch.calls += calls
            if point.converged:
                branch.points.insert(place, point)


class Passages:
    """Solutions beside the points of a branch, by Newton from them: `solutions_at` and `peaks` of a ForcedResponse.

    frozen_at(value) -> (balance, w) at a parameter of the branch; rows (m, r) take the outputs out of q;
    noise (m,): amplitudes below which an output is rounding
    """

    def __init__(self, evaluate, branch, rows, recover, noise, scale, weights, settings, frozen_at):
        self.points = [replace(p, detail=None) for p in branch.points]
        self.evaluate, self.rows, self.recover, self.noise, self.scale = evaluate, rows, recover, noise, scale
        self.weights, self.settings, self.frozen_at = weights, settings, frozen_at

    def __call__(self, value):
        """[(place in the curve, harmonics (m, H+1))] of the passages between its points."""
        found = passages(self.evaluate, self.points, self.scale * value, self.weights, self.settings)
        return [(place, self.recover @ point.detail.modal) for point, _, place in found if point.converged]

    def maxima(self, j, column, solved, kind):
        """[(parameter, amplitude)] of the local maxima of output j, whose amplitudes at the points are `column`.

        solved : (n,) bool, the points that are such maxima
        """
        from hbm.peaks import all_maxima
        if not np.nanmax(column, initial=0.0) > self.noise[j]:
            return []
        branch = continuation.Branch(list(self.points))
        found = all_maxima(self.evaluate, branch, self.recover[j], column, solved, kind, self.weights, self.settings)
        return [(parameter / self.scale, top) for parameter, top in found]

    def solved(self, value):
        """(balance, [solved points]) at a value, in the order of `solutions_at`."""
        target = self.scale * value
        there = [abs(p.parameter - target) <= 1e-12 * abs(target) for p in self.points]
        found = [(i, p.x) for i, p in enumerate(self.points) if there[i] and p.converged]
        between = passages(self.evaluate, self.points, target, self.weights, self.settings)
        found += [(i, p.x) for p, _, i in between if p.converged and not any(there[i - 1:i + 1])]
        balance, w = self.frozen_at(target)
        return balance, [continuation.solve_at(balance.evaluate, x, w, balance.weights, self.settings)
                         for _, x in sorted(found, key=lambda place: place[0])]
