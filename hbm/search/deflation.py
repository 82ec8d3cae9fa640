"""Newton's method at a fixed parameter, away from solutions that are known: deflation
[Farrell, Birkisson, Funke 2015, SIAM J. Sci. Comput. 37, A2026].

The residual is multiplied by m(x) = prod_i (1 + s^2 / |x - x_i|^2) over the known solutions x_i,
which keeps Newton's method from coming back to them. By Sherman and Morrison's formula the step of
the product is Newton's step dx of R, stretched: dx / (1 - grad m . dx / m). No other system is
solved.
"""

from collections.abc import Sequence

import numpy as np

from tipdamp.hbm.continuation.point import Evaluate, Point, failed, size
from tipdamp.hbm.continuation.settings import Settings

LONGEST = 1.0  # step, of the largest of the present and the known motions
FURTHEST = 10.0  # times Newton's step: beside a pole of m it would be as long as one likes


def newton(
    evaluate: Evaluate,
    x: np.ndarray,
    p: float,
    weights: np.ndarray,
    known: Sequence[np.ndarray],
    settings: Settings,
    most: int,
) -> Point:
    """A solution at the fixed parameter p that is none of the known ones, from x (n,), in at most
    that many residual calls; failed where Newton's method does not lead to one.

    weights (n,) : how much each unknown counts in the distance of two solutions
    """
    zero = np.zeros(len(x))
    largest = max([size(weights * x), *(size(weights * one) for one in known)])
    for calls in range(1, most + 1):
        e = evaluate(x, p)
        now = size(weights * x)
        if size(e.residual) <= settings.tolerance * max(now, 1e-300):
            return Point(x, p, True, calls, e)
        dx, _ = e.solve(zero, 1.0, 0.0)
        if not np.isfinite(dx).all():
            break
        if known:
            dx = _stretch(x, dx, weights, known) * dx
        limit = LONGEST * max(now, largest)
        x = x + min(1.0, limit / max(size(weights * dx), 1e-300)) * dx
    return failed(len(x), p, calls)


def _stretch(
    x: np.ndarray, dx: np.ndarray, weights: np.ndarray, known: Sequence[np.ndarray]
) -> float:
    """1 / (1 - grad m . dx / m), bounded."""
    slope = 0.0
    for one in known:
        away = weights * (x - one)
        square, scale = float(away @ away), max(size(weights * one), 1e-300) ** 2
        slope -= 2 * scale * (away @ (weights * dx)) / max(square * (square + scale), 1e-300)
    stretch = 1 / (1 - slope) if slope != 1 else FURTHEST
    return float(np.clip(stretch, -FURTHEST, FURTHEST))
