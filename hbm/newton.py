"""Newton's method for R(x, parameter) = 0: on a plane across a branch, or at a fixed parameter.

`evaluate(x, parameter)` returns an object with

    residual (n,),   solve(row, corner, value) -> dx, dp   and   direction(row, corner) -> tx, tp, sign

where solve answers the bordered system [J, R_p; row', corner] [dx; dp] = [-residual; value], and direction that with
[0; 1] on the right, with the sign of the determinant. The bordered matrix is regular at folds, where J alone is not.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settings:
    """Numbers of the method. `parameter_share`: a unit step moves the parameter by this share of the way."""

    first_step: float = 0.05
    largest_step: float = 0.25
    smallest_step: float = 1e-5
    parameter_share: float = 0.1
    tolerance: float = 1e-10      # of the residual, relative to the weighted unknowns
    most_iterations: int = 12
    most_points: int = 5000
    most_gaps: int = 3
    most_leaps: int = 12
    runaway: float = 1e8          # unknowns this many times those of the start mean that no solution exists further on
    patience: int = 400           # points without getting on by a thousandth of the way, before the branch is left


DEFAULT = Settings()


@dataclass(frozen=True, eq=False)
class Point:
    """One point of a branch; x is NaN where the corrector failed."""

    x: np.ndarray
    parameter: float
    converged: bool
    iterations: int               # evaluations of the residual
    detail: object = None         # what `evaluate` returned last


@dataclass(frozen=True)
class Metric:
    """Arc length: |(dx, dp)|^2 = |weights dx|^2 / size^2 + (dp / length)^2."""

    weights: np.ndarray
    size: float
    length: float

    def norm(self, dx, dp) -> float:
        return float(np.hypot(np.linalg.norm(self.weights * dx) / self.size, dp / self.length))

    def border(self, dx, dp):
        """Row and corner of the unit plane normal to (dx, dp)."""
        unit = 1 / self.norm(dx, dp)
        return self.weights**2 * dx * (unit / self.size**2), dp * unit / self.length**2


def correct(evaluate, x, p, row, corner, metric, settings) -> Point:
    """Newton on the plane through (x, p) with normal (row, corner)."""
    x0, p0 = x, p
    for iteration in range(1, settings.most_iterations + 1):
        e = evaluate(x, p)
        size = np.clip(np.linalg.norm(metric.weights * x), 1e-6 * metric.size, 10 * metric.size)
        error = np.linalg.norm(e.residual)
        if error <= settings.tolerance * size:
            return Point(x, p, True, iteration, e)
        if not np.isfinite(error) or error > 1e8 * size:
            break
        dx, dp = e.solve(row, corner, -(row @ (x - x0) + corner * (p - p0)))
        x, p = x + dx, p + dp
        if not np.isfinite(p) or not np.isfinite(x).all():
            break
    return Point(np.full_like(x, np.nan), p0, False, iteration)


def solve_at(evaluate, x, p, weights, settings=DEFAULT, most=300) -> Point:
    """Damped Newton at a fixed parameter, for a first point or a restart, in about `most` evaluations."""
    none = np.zeros(len(x))
    e = evaluate(x, p)
    calls = 1
    reach = 1e3 * max(np.linalg.norm(x), np.linalg.norm(e.residual))     # a Jacobian near singular sends x far away
    while calls < most:
        error = np.linalg.norm(e.residual)
        if error <= settings.tolerance * min(max(np.linalg.norm(weights * x), 1e-300), reach):
            return Point(x, p, True, calls, e)
        dx, _ = e.solve(none, 1.0, 0.0)
        gone = np.linalg.norm(dx)
        if not np.isfinite(error + gone) or np.linalg.norm(x) > 100 * reach:
            break
        share = min(1.0, reach / gone) if gone else 1.0
        for _ in range(7):
            trial = evaluate(x + share * dx, p)
            calls += 1
            if np.linalg.norm(trial.residual) < (1 - 0.1 * share) * error:
                break
            share *= 0.5
        x, e = x + share * dx, trial
    return Point(np.full_like(x, np.nan), p, False, calls)


def between(evaluate, a: Point, b: Point, share: float, weights, settings=DEFAULT, guess=None) -> Point:
    """The point of the branch on the plane across the chord from a to b, at a share in (0, 1) of it."""
    metric = Metric(weights, max(np.linalg.norm(weights * a.x), np.linalg.norm(weights * b.x), 1e-300),
                    max(abs(a.parameter), abs(b.parameter), 1e-300) * 1e-2)
    row, corner = metric.border(b.x - a.x, b.parameter - a.parameter)
    x = a.x + share * (b.x - a.x)
    p = a.parameter + share * (b.parameter - a.parameter)
    if guess is not None:
        gx, gp = guess
        slip = row @ (gx - x) + corner * (gp - p)      # bring the guess onto the plane
        direction = row @ (b.x - a.x) + corner * (b.parameter - a.parameter)
        x = gx - slip / direction * (b.x - a.x)
        p = gp - slip / direction * (b.parameter - a.parameter)
    return correct(evaluate, x, p, row, corner, metric, settings)
