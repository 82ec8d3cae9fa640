"""Where the next point of a branch is expected: polynomials through the points before, along their tangents."""

import numpy as np

from hbm.continuation.point import Linearised, Metric, Point


def predict(run: list[Point], metric: Metric, step: float, order: int) -> tuple[np.ndarray, float]:
    """x (n,) and parameter at an arc length `step` beyond the last of the points, which know their tangents."""
    used = run[-(order // 2 + 1):]
    weights = _weights(_places(used, metric), step, order)[-1]
    return _sum(weights, *_table(used, metric))


def prediction_errors(points: list[Point], new: Point, metric: Metric) -> np.ndarray:
    """How far from `new` the polynomials of order 1, 2, ... through the last of the points would have led."""
    places = _places([*points, new], metric)
    X, P = _table(points, metric)
    weights = _weights(places[:-1] - places[-2], places[-1] - places[-2], 2 * len(points) - 1)
    errors = zip(*_sum(weights, X, P), strict=True)
    return np.array([metric.norm(x - new.x, p - new.parameter) for x, p in errors])


def _table(points, metric):
    """Points and unit tangents (2 points, n), the parameters likewise: what the weights are for."""
    units = [_unit(q, metric) for q in points]
    return (np.array([q.x for q in points] + [tx for tx, _ in units]),
            np.array([q.parameter for q in points] + [tp for _, tp in units]))


def _sum(weights, X, P):
    return weights @ X, weights @ P


def _unit(point, metric):
    tx, tp = point.tangent
    size = 1 / metric.norm(tx, tp)
    return size * tx, size * tp


def _places(points, metric):
    """Arc lengths along the points, zero at the last: those of circles through two points with their tangents."""
    units = [_unit(q, metric) for q in points]
    lengths = []
    for i in range(len(points) - 1):
        a, b = points[i:i + 2]
        turn = metric.norm(units[i + 1][0] - units[i][0], units[i + 1][1] - units[i][1])
        lengths.append(metric.norm(b.x - a.x, b.parameter - a.parameter) * (1 + min(turn, 1.0)**2 / 24))
    return np.r_[-np.cumsum(lengths[::-1])[::-1], 0.0]


def _weights(places, at, highest):
    """(orders, 2 points) weights of the values and of the slopes at the places, by which polynomials continue to `at`.

    Order k passes through the first k + 1 of these: value and slope of the last point, of the one before, and so on
    (Newton's divided differences with each place counted twice).
    """
    count = len(places)
    of = np.repeat(np.arange(count)[::-1], 2)[:highest + 1]
    unit, place = np.eye(2 * count), places[of]
    table, reach = unit[of], 1.0
    weights = [table[0]]
    for k in range(1, highest + 1):
        apart = place[k:] - place[:-k]
        if k == 1:
            apart[::2] = 1.0                    # a point and itself: the slope stands for their difference
        table = (table[1:] - table[:-1]) / apart[:, None]
        if k == 1:
            table[::2] = unit[count + of[:-1:2]]
        reach *= at - place[k - 1]
        weights.append(weights[-1] + reach * table[0])
    return np.array(weights[1:])


def tangent(e: Linearised, row: np.ndarray, corner: float, sign: float, metric: Metric) -> tuple[np.ndarray, float]:
    """Unit tangent (dx, dp) of the linearisation e, forward along the branch."""
    tx, tp, s = e.direction(row, corner)
    unit = np.sign(s) * sign / metric.norm(tx, tp)
    return unit * tx, unit * tp


def on_branch(new: Point, last: Point, x: np.ndarray, p: float, metric: Metric, step: float) -> bool:
    """Whether a converged point belongs to the branch: near its prediction, within two steps, and ahead."""
    length = metric.norm(new.x - last.x, new.parameter - last.parameter)
    corrected = metric.norm(new.x - x, new.parameter - p)
    return length <= 2 * step and corrected <= 0.5 * step and forward(new, last, metric)


def forward(new: Point, last: Point, metric: Metric) -> bool:
    """Whether the step from the last point to the new one runs forward along the branch."""
    row, corner = metric.border(new.x - last.x, new.parameter - last.parameter)
    return row @ new.tangent[0] + corner * new.tangent[1] > 0
