"""Single solutions beside the branch: the first one, those where a frequency was asked for, those around a peak."""

from dataclasses import replace

import numpy as np

from hbm import continuation, fourier
from hbm.curve import parabola

PEAK_TOLERANCE = 1e-10


def first_point(balance, w, settings):
    """A solution at w: from the stuck response, else by raising the force from zero, else from a marched motion."""
    x = balance.linear(w)
    point = continuation.solve_at(balance.evaluate, x, w, balance.weights, settings)
    if point.converged:
        return point
    calls = point.iterations
    for guess in (_raise_level, _march_on):
        x, more = guess(balance, w, settings)
        calls += more
        if x is not None:
            point = continuation.solve_at(balance.evaluate, x, w, balance.weights, settings)
            calls += point.iterations
            if point.converged:
                break
    return replace(point, iterations=calls)


def _raise_level(balance, w, settings):
    """(x or None, residual calls): the branch over the force level, from almost nothing to the whole force."""
    def by_level(x, level):
        return balance.evaluate(x, w, level, by="level")

    low = continuation.solve_at(by_level, 1e-3 * balance.linear(w), 1e-3, balance.weights, settings)
    if not low.converged:
        return None, low.iterations
    branch = continuation.follow(by_level, low, 1.0, balance.weights, replace(settings, most_points=150, most_leaps=0))
    return branch.points[-1].x if branch.complete else None, branch.calls


def _march_on(balance, w, settings):
    """(x or None, residual calls): where time integration from rest gets to; corridor laws only."""
    from hbm import march
    if not balance.problem.law.corridor:
        return None, 0
    motion = march.March(balance, w, tolerance=1e-4)
    motion.periods(motion.at_rest(), 60)
    x = motion.harmonics_of_motion()
    return x if np.isfinite(x).all() else None, 0


def solve_passages(balance, branch, at, settings):
    """Insert a solved point wherever the branch passes one of the angular frequencies."""
    for w in at:
        for a, b in list(zip(branch.points[:-1], branch.points[1:], strict=True)):
            if not (a.converged and b.converged and (a.parameter - w) * (b.parameter - w) < 0):
                continue
            x = a.x + (w - a.parameter) / (b.parameter - a.parameter) * (b.x - a.x)
            new = continuation.solve_at(balance.evaluate, x, w, balance.weights, settings)
            branch.calls += new.iterations
            if new.converged:
                branch.points.insert(branch.points.index(b), new)


def refine_peaks(balance, branch, recover, settings):
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
            metric = continuation.Metric(balance.weights, np.linalg.norm(balance.weights * b.x), 0.01 * b.parameter)
            s = np.array([-metric.norm(b.x - a.x, b.parameter - a.parameter), 0.0,
                          metric.norm(c.x - b.x, c.parameter - b.parameter)])
            top, value = parabola(s, heights[i - 1:i + 2])
            if max(-s[0], s[2]) < 1e-5 or (abs(value - heights[i]) < PEAK_TOLERANCE * heights[i]
                                           and max(-s[0], s[2]) < 5e-3):
                break
            if -s[0] > 4 * s[2] or s[2] > 4 * -s[0] or not s[0] < top < s[2]:
                top = 0.5 * s[0] if -s[0] > s[2] else 0.5 * s[2]
            elif abs(top) < 0.02 * max(-s[0], s[2]):
                top = 0.1 * s[2] if s[2] > -s[0] else 0.1 * s[0]
            left, right, share = (a, b, 1 - top / s[0]) if top < 0 else (b, c, top / s[2])
            new = continuation.between(balance.evaluate, left, right, share, balance.weights, settings)
            branch.calls += new.iterations
            if not new.converged:
                break
            branch.points.insert(branch.points.index(right), new)
            good.insert(good.index(right), new)
            table.insert(good.index(new), fourier.half_peak_to_peak(recover @ new.detail.modal).tolist())
