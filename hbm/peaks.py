"""Local maxima of the outputs along a branch, each brought to rest by points solved around it."""

import numpy as np

from hbm.continuation import follow as continuation
from hbm.record import harmonics
from hbm.result import KINDS, amplitude, crests

TOLERANCE = 1e-10        # of the amplitude: by how much a point may still lie under the top
TRUST = 1e-8             # error of a foretold height from which on the next is believed
MOST = 12                # points tried around one maximum


def refine_largest(evaluate, branch, recover, noise, weights, settings) -> np.ndarray:
    """Insert solved points at the largest local maximum of half peak to peak of every output, and say which they are.

    noise : (m,) amplitudes below which an output is rounding
    Returns (n, m) bool, for the branch as it is afterwards.
    """
    def heights(point):
        return amplitude(recover @ point.detail.modal, KINDS[0])

    table, tops = list(amplitude(harmonics(branch, recover), KINDS[0])), []
    for j in np.flatnonzero(np.nanmax(table, axis=0) > noise):
        column = np.array(table)[:, j]
        found = sorted(crests(column, [p.parameter for p in branch.points]), key=lambda i: -column[i])
        if found:
            tops.append((_Climb(evaluate, branch, table, j, heights, weights, settings).run(found[0]), j))
    place = {id(point): i for i, point in enumerate(branch.points)}
    marks = np.zeros((len(branch.points), len(recover)), dtype=bool)
    for point, j in tops:
        marks[place[id(point)], j] = True
    return marks


def all_maxima(evaluate, branch, row, column, solved, kind, weights, settings) -> list[tuple[float, float]]:
    """(parameter, amplitude) of every local maximum of one output in one kind of amplitude, solved.

    row : (nodal from modal) of the output; column : (n,) its amplitudes at the points of the branch, which
    gets more; solved : (n,) bool, maxima that are solved already
    """
    def heights(point):
        return amplitude(row @ point.detail.modal, kind)[None]

    table = [np.array([a]) for a in column]
    climb, tops = _Climb(evaluate, branch, table, 0, heights, weights, settings), []
    for begin, done in [(branch.points[i], solved[i]) for i in crests(column, [p.parameter for p in branch.points])]:
        top = begin if done else climb.run(branch.points.index(begin))
        tops.append((top.parameter, float(table[branch.points.index(top)][0])))
    return tops


class _Climb:
    """One local maximum of output j: the top of a line through the points around it is solved, until it is as foretold.

    The line is a polynomial through up to five points or, for a kink, straight from either side: whichever foretold the
    point before better. Two straight lines that leave no room for a higher point end the climb too.
    """

    def __init__(self, evaluate, branch, table, j, heights, weights, settings):
        self.evaluate, self.branch, self.table, self.j = evaluate, branch, table, j
        self.heights, self.weights, self.settings = heights, weights, settings

    def run(self, i):
        """The point at the top, from point i, which is higher than its neighbours."""
        points, errors = self.branch.points, np.array([1.0, np.inf])
        for _ in range(MOST):
            s, y, k = self._around(i)
            lines, better = (_smooth(s, y, k), _kinked(s, y, k)), int(errors.argmin())
            model, top = lines[better]
            if errors[better] < TRUST and model(top) - y[k] < TOLERANCE * y[k] or _bound(s, y, k) - y[k] < TRUST * y[k]:
                break
            near, wide = sorted((-s[k - 1], s[k + 1]))
            if abs(top) < 0.05 * near:                     # two points in one place foretell nothing
                top = np.sqrt(0.1 * near * wide) * (1 if s[k + 1] > -s[k - 1] else -1)
            left, share = (i - 1, 1 - top / s[k - 1]) if top < 0 else (i, top / s[k + 1])
            new = self._solve(left, share)
            if not new.converged:
                break
            there = s[k + left - i] + self._metric(points[i]).norm(new.x - points[left].x,
                                                                   new.parameter - points[left].parameter)
            points.insert(left + 1, new)
            self.table.insert(left + 1, self.heights(new))
            new.detail.forget()
            errors = np.abs([line(there) - self.table[left + 1][self.j] for line, _ in lines]) / y[k]
            i += self.table[i + 1][self.j] > self.table[i][self.j]
        return points[i]

    def _solve(self, left, share):
        a, b = self.branch.points[left:left + 2]
        new = continuation.between(self.evaluate, a, b, share, self.weights, self.settings)
        self.branch.calls += new.iterations
        return new

    def _metric(self, b):
        return continuation.Metric(self.weights, np.linalg.norm(self.weights * b.x), 0.01 * abs(b.parameter))

    def _around(self, i):
        """Arc lengths from point i, heights of up to five points around it, and its place among them."""
        points = self.branch.points
        low, high = i - 1, i + 1
        if low > 0 and np.isfinite(self.table[low - 1][self.j]) and points[low - 1].parameter != points[low].parameter:
            low -= 1
        if high < len(points) - 1 and np.isfinite(self.table[high + 1][self.j]) \
                and points[high + 1].parameter != points[high].parameter:
            high += 1
        metric = self._metric(points[i])
        steps = [metric.norm(q.x - p.x, q.parameter - p.parameter)
                 for p, q in zip(points[low:high], points[low + 1:high + 1], strict=True)]
        s = np.r_[0.0, np.cumsum(steps)]
        return s - s[i - low], np.array([row[self.j] for row in self.table[low:high + 1]]), i - low


def _smooth(s, y, k):
    """(function of the arc length, its maximum between the neighbours of point k) of the polynomial through all."""
    model = np.polynomial.Polynomial.fit(s, y, len(s) - 1)
    roots = model.deriv().roots()
    inside = [float(r.real) for r in roots if abs(r.imag) < 1e-12 and s[k - 1] < r.real < s[k + 1]]
    return (model, max(inside, key=model)) if inside else _halved(s, y, k)


def _kinked(s, y, k):
    """The same of two lines, one from either side; the top of the branch lies where they meet, or below."""
    met = _lines(s, y, k)
    if not met:
        return _halved(s, y, k)
    _, top, a, d, up, down = max(met)
    return lambda x: min(y[a] + up * (x - s[a]), y[d] + down * (x - s[d])), top


def _bound(s, y, k):
    """What no point between the neighbours of point k is higher than where the branch is concave there."""
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
