"""Points where the drawn curve needs them: an output linked by PCHIP through the solved points.

Each point knows its slope, so that the cubic of an interval with the true slopes (Hermite) tells
how far the drawn one (PCHIP, [Fritsch, Butland 1984]) is off: most where a contact begins to slip
and the curve has a kink. There the new point is solved where the tangents of both ends meet.
"""

from collections.abc import Sequence

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.continuation.arc import lies_between, metric_at
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import between
from tipdamp.hbm.continuation.crossings import may_fold
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.outputs import Outputs

SHARES = np.array([0.25, 0.5, 0.75])[:, None, None]  # of an interval, where its error is looked at


def refine_drawn(
    equation: Equation, branch: Branch, outputs: Outputs, marks: np.ndarray, settings: Settings
) -> np.ndarray:
    """Insert points until half peak to peak of no output, linked by PCHIP, is off by more than
    `drawn_error`.

    Where the branch may fold between two points nothing is drawn by one function of the parameter:
    it stays as it is.
    marks : (n, m) bool of the points. Returns the marks of the branch as it is afterwards.
    """
    points = branch.points
    kept = list(marks)
    values, rates = _drawn(outputs, points)
    scale = np.nanmax(values, axis=0, initial=0.0)
    scale[scale <= outputs.noise(points)] = np.inf
    failed: set[int] = set()  # points behind which none could be solved
    for _ in range(settings.drawn_passes):
        p = np.array([point.parameter for point in points])
        inserted = list[int]()
        for i, share in reversed(_coarse(p, values / scale, rates / scale, settings.drawn_error)):
            a, b = points[i : i + 2]
            if id(a) in failed or may_fold(a, b, metric_at(a, equation.weights)):
                continue
            new = between(equation.evaluate, a, b, share, equation.weights, settings)
            branch.calls += new.iterations
            if lies_between(new, a, b, metric_at(a, equation.weights)):
                inserted.append(i)
                points.insert(i + 1, new)
                kept.insert(i + 1, np.zeros(marks.shape[1], dtype=bool))
                new.detail.forget()
            else:
                failed.add(id(a))
        if not inserted:
            break
        values, rates = _drawn(outputs, points)
    return np.array(kept)


def _drawn(outputs: Outputs, points: Sequence[Point]) -> tuple[np.ndarray, np.ndarray]:
    """Half peak to peak at points, and its slopes by the parameter, (n, m) each; NaN where a point
    failed."""
    values, slopes = outputs.amplitudes(points)
    along = np.array([point.tangent[1] if point.tangent else np.nan for point in points])
    along[along == 0] = np.nan
    return values, slopes / along[:, None]


def _coarse(
    p: np.ndarray, values: np.ndarray, slopes: np.ndarray, tolerance: float
) -> list[tuple[int, float]]:
    """[(interval, share of it where a point is wanted)] of the intervals where an output is drawn
    too coarsely."""
    h, rise = np.diff(p)[:, None], np.diff(values, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = _drawn_slopes(h, rise / h, slopes) - slopes
        before, after = off[:-1] * h, off[1:] * h
        error = np.abs(SHARES * (1 - SHARES) ** 2 * before - SHARES**2 * (1 - SHARES) * after).max(
            axis=0
        )
        error = np.nan_to_num(error, posinf=0.0)
        meet = (rise / h - slopes[1:]) / (slopes[:-1] - slopes[1:])
    worst = error.argmax(axis=1)
    return [
        (int(i), float(meet[i, worst[i]]) if 0.1 < meet[i, worst[i]] < 0.9 else 0.5)
        for i in np.flatnonzero(error.max(axis=1) > tolerance)
    ]


def _drawn_slopes(h: np.ndarray, chords: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(n, m) slopes of PCHIP at the points, by the intervals h (n-1, 1) and the slopes of their
    chords; at the ends, and where the branch turns, the true ones."""
    one, two = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    inner = np.where(
        chords[:-1] * chords[1:] > 0, (one + two) / (one / chords[:-1] + two / chords[1:]), 0.0
    )
    drawn = slopes.copy()
    drawn[1:-1] = np.where(h[:-1] * h[1:] > 0, inner, slopes[1:-1])
    return drawn
