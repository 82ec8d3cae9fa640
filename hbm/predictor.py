"""Where the next point of a branch is looked for: tangents, and polynomials through the points before."""

import numpy as np


def predict(run, metric, step, order, sign):
    """x and parameter a step beyond the last of the points: along their polynomial, or the tangent at a single one."""
    if len(run) > 1:
        return extrapolate(run, metric, step, min(order, len(run) - 1))
    tx, tp = tangent(run[-1].detail, np.zeros(len(run[-1].x)), 1.0, sign, metric)
    return run[-1].x + step * tx, run[-1].parameter + step * tp


def extrapolate(points, metric, step, order):
    """Polynomial through the last order + 1 points, over their distances, at a step beyond the last."""
    used = points[-(order + 1):]
    weights = _lagrange(_places(used, metric), step)
    return sum(w * q.x for w, q in zip(weights, used, strict=True)), \
        sum(w * q.parameter for w, q in zip(weights, used, strict=True))


def prediction_errors(points, new, metric):
    """How far from `new` the polynomials of order 1, 2, ... through the last of the points would have led."""
    if len(points) < 2:
        return np.empty(0)
    places = _places(points, metric)
    step = metric.norm(new.x - points[-1].x, new.parameter - points[-1].parameter)
    weights = np.zeros((len(points) - 1, len(points)))
    for order in range(1, len(points)):
        weights[order - 1, -order - 1:] = _lagrange(places[-order - 1:], step)
    x = weights @ np.array([q.x for q in points]) - new.x
    p = weights @ np.array([q.parameter for q in points]) - new.parameter
    return np.array([metric.norm(*error) for error in zip(x, p, strict=True)])


def _places(points, metric):
    """Distances along the points, zero at the last."""
    gone = [metric.norm(b.x - a.x, b.parameter - a.parameter) for a, b in zip(points[:-1], points[1:], strict=True)]
    return np.r_[-np.cumsum(gone[::-1])[::-1], 0.0]


def _lagrange(places, at):
    """Weights with which values at the places make up the interpolating polynomial elsewhere."""
    apart = places[:, None] - places
    np.fill_diagonal(apart, 1.0)
    ahead = np.tile(at - places, (len(places), 1))
    np.fill_diagonal(ahead, 1.0)
    return np.prod(ahead, axis=1) / np.prod(apart, axis=1)


def tangent(e, row, corner, sign, metric):
    """Unit tangent (dx, dp) of the linearisation e, forward along the branch."""
    tx, tp, s = e.direction(row, corner)
    unit = np.sign(s) * sign / metric.norm(tx, tp)
    return unit * tx, unit * tp


def on_branch(new, last, x, p, metric, step, sign) -> bool:
    """A converged point that lies far from its prediction or far along, or that runs backward, is refused."""
    gone = metric.norm(new.x - last.x, new.parameter - last.parameter)
    corrected = metric.norm(new.x - x, new.parameter - p)
    if gone > 2 * step or corrected > 0.5 * step:
        return False
    return corrected < 0.1 * step or forward(new, last, metric, sign)


def forward(new, last, metric, sign) -> bool:
    """Whether the step from the last point to the new one runs forward along the branch."""
    row, corner = metric.border(new.x - last.x, new.parameter - last.parameter)
    tx, tp = tangent(new.detail, row, corner, sign, metric)
    return row @ tx + corner * tp > 0
