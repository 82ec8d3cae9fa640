"""Local maxima of a quantity along a branch, each refined by points that are solved around it."""

from collections.abc import Callable

import numpy as np

from hbm.continuation.branch import Branch
from hbm.continuation.corrector import between
from hbm.continuation.point import Evaluate, Metric, Point
from hbm.continuation.settings import Settings


class PeakRefinement:
    """Refines local maxima: the maximum of a line through the points is solved, until it is as predicted.

    The line is a polynomial through up to five points or, for a kink, straight from either side: whichever predicted
    the point before better. Two straight lines that leave no room for a higher point end the refinement too.

    table : one row (m,) of quantities for each point of the branch; it grows with the branch
    heights(point) -> (m,) : the row of a new point; column : the quantity that is to be largest
    """

    def __init__(self, evaluate: Evaluate, branch: Branch, table: list, heights: Callable[[Point], np.ndarray],
                 weights: np.ndarray, settings: Settings):
        self.evaluate, self.branch, self.table, self.heights = evaluate, branch, table, heights
        self.weights, self.settings = weights, settings

    def run(self, i: int, column: int = 0) -> Point:
        """The point at the maximum of a column, from point i, which is higher than its neighbours."""
        points, errors, settings = self.branch.points, np.array([1.0, np.inf]), self.settings
        for _ in range(settings.max_peak_points):
            s, y, k = self._around(i, column)
            lines, better = (_smooth(s, y, k), _kinked(s, y, k)), int(errors.argmin())
            model, top = lines[better]
            settled = errors[better] < settings.peak_trust and model(top) - y[k] < settings.peak_tolerance * y[k]
            if settled or _bound(s, y, k) - y[k] < settings.peak_trust * y[k]:
                break
            near, wide = sorted((-s[k - 1], s[k + 1]))
            if abs(top) < 0.05 * near:                     # two points in one place predict nothing
                top = np.sqrt(0.1 * near * wide) * (1 if s[k + 1] > -s[k - 1] else -1)
            left, share = (i - 1, 1 - top / s[k - 1]) if top < 0 else (i, top / s[k + 1])
            new = self._solve(left, share)
            if not new.converged:
                break
            there = s[k + left - i] + self._metric(points[i]).norm(new.x - points[left].x,
                                                                   new.parameter - points[left].parameter)
            points.insert(left + 1, new)
            self.table.insert(left + 1, self.heights(new))
            errors = np.abs([line(there) - self.table[left + 1][column] for line, _ in lines]) / y[k]
            i += self.table[i + 1][column] > self.table[i][column]
        return points[i]

    def _solve(self, left, share):
        a, b = self.branch.points[left:left + 2]
        new = between(self.evaluate, a, b, share, self.weights, self.settings)
        self.branch.calls += new.iterations
        return new

    def _metric(self, b):
        return Metric(self.weights, float(np.linalg.norm(self.weights * b.x)), 0.01 * abs(b.parameter))

    def _around(self, i, column):
        """Arc lengths from point i, heights of up to five points around it, and its place among them."""
        points = self.branch.points
        low, high = i - 1, i + 1
        if low > 0 and np.isfinite(self.table[low - 1][column]) and points[low - 1].parameter != points[low].parameter:
            low -= 1
        if high < len(points) - 1 and np.isfinite(self.table[high + 1][column]) \
                and points[high + 1].parameter != points[high].parameter:
            high += 1
        metric = self._metric(points[i])
        steps = [metric.norm(q.x - p.x, q.parameter - p.parameter)
                 for p, q in zip(points[low:high], points[low + 1:high + 1], strict=True)]
        s = np.r_[0.0, np.cumsum(steps)]
        return s - s[i - low], np.array([row[column] for row in self.table[low:high + 1]]), i - low


def _smooth(s, y, k):
    """(function of the arc length, its maximum between the neighbours of point k) of the polynomial through all."""
    model = np.polynomial.Polynomial.fit(s, y, len(s) - 1)
    roots = model.deriv().roots()
    inside = [float(r.real) for r in roots if abs(r.imag) < 1e-12 and s[k - 1] < r.real < s[k + 1]]
    return (model, max(inside, key=model)) if inside else _halved(s, y, k)


def _kinked(s, y, k):
    """The same of two lines, one from either side; the maximum of the branch lies where they meet, or below."""
    met = _lines(s, y, k)
    if not met:
        return _halved(s, y, k)
    _, top, a, d, up, down = max(met)
    return lambda x: min(y[a] + up * (x - s[a]), y[d] + down * (x - s[d])), top


def _bound(s, y, k):
    """A height that no point between the neighbours of point k exceeds where the branch is concave there."""
    met = _lines(s, y, k)
    return max(met)[0] if len(met) == 2 else np.inf


def _lines(s, y, k):
    """(height, place, first point, last point, slopes) where the lines from either side meet, before and behind k."""
    met = []
    for a, b, c, d in ((k - 1, k, k + 1, k + 2), (k - 2, k - 1, k, k + 1)):
        if a < 0 or d >= len(s):
            continue
        up, down = (y[b] - y[a]) / (s[b] - s[a]), (y[d] - y[c]) / (s[d] - s[c])
        top = (y[c] - y[b] + up * s[b] - down * s[c]) / (up - down) if up > down else np.nan
        if s[b] <= top <= s[c]:
            met.append((y[b] + up * (top - s[b]), top, a, d, up, down))
    return met


def _halved(s, y, k):
    """The same of straight lines between the points: the middle of the wider interval beside point k."""
    return lambda x: np.interp(x, s, y), 0.5 * (s[k - 1] if -s[k - 1] > s[k + 1] else s[k + 1])
