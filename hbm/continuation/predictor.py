"""Where the next point of a branch is expected: polynomials through the points before, along their
tangents."""

from collections.abc import Sequence

import numpy as np

from tipdamp.hbm.continuation.point import Linearised, Metric, Point, distance


def predict(run: list[Point], metric: Metric, step: float, order: int) -> tuple[np.ndarray, float]:
    """x (n,) and parameter at an arc length `step` beyond the last of the points, which know their
    tangents."""
    used = run[-(order // 2 + 1) :]
    units = [_unit(q, metric) for q in used]
    weights = _weights(_places(used, units, metric), step, order)[-1]
    X, P = _table(used, units)
    return weights @ X, float(weights @ P)


def prediction_errors(points: list[Point], new: Point, metric: Metric) -> np.ndarray:
    """How far from `new` the polynomials of order 1, 2, ... through the last of the points would
    have led."""
    units = [_unit(q, metric) for q in (*points, new)]
    places = _places([*points, new], units, metric)
    weights = _weights(places[:-1] - places[-2], -places[-2], 2 * len(points) - 1)
    X, P = _table(points, units[:-1])
    away = (weights @ X - new.x) * metric.weights
    return np.hypot(
        np.sqrt(np.sum(away * away, axis=1)) / metric.size,
        (weights @ P - new.parameter) / metric.length,
    )


def _table(
    points: Sequence[Point], units: Sequence[tuple[np.ndarray, float]]
) -> tuple[np.ndarray, np.ndarray]:
    """Points and unit tangents (2 points, n), the parameters likewise: what the weights are for."""
    return (
        np.array([q.x for q in points] + [tx for tx, _ in units]),
        np.array([q.parameter for q in points] + [tp for _, tp in units]),
    )


def _unit(point: Point, metric: Metric) -> tuple[np.ndarray, float]:
    tx, tp = point.tangent
    size = 1 / metric.norm(tx, tp)
    return size * tx, size * tp


def _places(
    points: Sequence[Point], units: Sequence[tuple[np.ndarray, float]], metric: Metric
) -> np.ndarray:
    """Arc lengths along the points, zero at the last: those of circles through two points with
    their tangents."""
    places = [0.0]
    for i in range(len(points) - 1, 0, -1):
        a, b, (ax, ap), (bx, bp) = points[i - 1], points[i], units[i - 1], units[i]
        turn = metric.norm(bx - ax, bp - ap)
        places.append(places[-1] - distance(a, b, metric) * (1 + min(turn, 1.0) ** 2 / 24))
    return np.array(places[::-1])


def _weights(places: np.ndarray, at: float, highest: int) -> np.ndarray:
    """(orders, 2 points) weights of the values and of the slopes at the places, by which
    polynomials continue to `at`.

    Order k passes through the first k + 1 of these: value and slope of the last point, of the one
    before, and so on (Newton's divided differences with each place counted twice). Numbers of
    Python: for six of them arrays are slower."""
    count = len(places)
    behind = [count - 1 - i // 2 for i in range(highest + 1)]
    place, unit = [places.tolist()[j] for j in behind], np.eye(2 * count).tolist()
    table = [unit[j] for j in behind]
    reach, weights, found = 1.0, table[0], []
    for k in range(1, highest + 1):
        # a point and itself: the slope stands for their difference
        table = [
            unit[count + behind[i]]
            if k == 1 and i % 2 == 0
            else _slope(table[i], table[i + 1], place[i + k] - place[i])
            for i in range(highest + 1 - k)
        ]
        reach *= at - place[k - 1]
        weights = [w + reach * t for w, t in zip(weights, table[0], strict=True)]
        found.append(weights)
    return np.array(found)


def _slope(low: Sequence[float], high: Sequence[float], apart: float) -> list[float]:
    """Not a number where two places are one, as arrays have it."""
    if apart == 0:
        return [np.nan] * len(low)
    return [(b - a) / apart for a, b in zip(low, high, strict=True)]


def tangent(
    e: Linearised, row: np.ndarray, corner: float, sign: float, metric: Metric
) -> tuple[np.ndarray, float]:
    """Unit tangent (dx, dp) of the linearisation e, forward along the branch."""
    tx, tp, s = e.direction(row, corner)
    unit = np.sign(s) * sign / metric.norm(tx, tp)
    return unit * tx, unit * tp


def on_branch(
    new: Point, last: Point, x: np.ndarray, p: float, metric: Metric, most: tuple[float, float]
) -> bool:
    """Whether a converged point belongs to the branch: near its prediction x, p, within two steps,
    and ahead.

    most : (step, error of the prediction): where that is larger a loop of the branch may have been
    passed over"""
    length = distance(last, new, metric)
    corrected, (step, error) = metric.norm(new.x - x, new.parameter - p), most
    return length <= 2 * step and corrected <= min(0.5 * step, error) and forward(new, last, metric)


def forward(new: Point, last: Point, metric: Metric) -> bool:
    """Whether the step from the last point to the new one runs forward along the branch."""
    row, corner = metric.across(last, new)
    return row @ new.tangent[0] + corner * new.tangent[1] > 0
