"""Newton's method for one point of R(x, parameter) = 0: on a plane across a branch, or at a fixed parameter."""

from dataclasses import dataclass, replace

import numpy as np

SAFE = 8.0                                       # factor on the estimated error after the last step
BLIND = 1e-4                                     # length of a step that may be the last without evaluating again


@dataclass(frozen=True)
class Settings:
    """Numbers of the method; `replace(DEFAULT, most_calls=500)` changes one.

    Steps are lengths of arc: a step of 0.1 changes the unknowns by a tenth of their size, or the parameter by a tenth
    of `parameter_share` of the way.
    """

    first_step: float = 0.05
    largest_step: float = 0.25
    smallest_step: float = 1e-5
    parameter_share: float = 0.1  # of the way, by which a unit step moves the parameter
    tolerance: float = 1e-10      # of the residual, relative to the weighted unknowns
    aim: float = 1.2e-3           # error of a predicted point, to which the steps are fitted
    highest_order: int = 5        # of the predicting polynomials
    most_iterations: int = 12
    most_points: int = 5000
    most_calls: int = 2000        # of the residual from 400 unknowns on, (400/n)^2 times as many below; and for each
                                  # point as many more as the next line says
    calls_per_point: int = 12
    most_gaps: int = 3
    most_leaps: int = 12
    runaway: float = 1e8          # unknowns this many times those of the start mean that no solution exists further on
    patience: int = 250           # points without getting on, before the branch is left
    outside: float = 0.5          # how far out of the band a branch is followed, relative to the parameter at its begin


DEFAULT = Settings()


@dataclass(frozen=True, eq=False)
class Point:
    """One point of a branch; x is NaN where the corrector failed."""

    x: np.ndarray
    parameter: float
    converged: bool
    iterations: int               # evaluations of the residual
    detail: object = None         # what `evaluate` returned last; where the corrector failed, first
    tangent: tuple | None = None  # (dx, dp) along the branch


@dataclass(frozen=True)
class Metric:
    """Arc length: |(dx, dp)|^2 = |weights dx|^2 / size^2 + (dp / length)^2."""

    weights: np.ndarray
    size: float
    length: float

    def norm(self, dx, dp) -> float:
        """Length of a step."""
        return float(np.hypot(np.linalg.norm(self.weights * dx) / self.size, dp / self.length))

    def border(self, dx, dp):
        """Row and corner of the unit plane normal to (dx, dp)."""
        unit = 1 / self.norm(dx, dp)
        return self.weights**2 * dx * (unit / self.size**2), dp * unit / self.length**2


def correct(evaluate, x, p, row, corner, metric, settings, last=None) -> Point:
    """Newton on the plane through (x, p) with normal (row, corner), the next point after x = last of a branch.

    A step that by the contraction so far leads below the tolerance is the last one: it is taken without evaluating
    again, and with the matrix of the step before where that is good enough [Deuflhard 2004, section 2.1].
    The first step leaves at `last` what the equations do not determine (see `pull` in continuation).
    """
    x0, p0, before, least, held, first, stalls = x, p, np.inf, np.inf, None, None, 0
    for iteration in range(1, settings.most_iterations + 1):
        e = evaluate(x, p)
        first = first or e
        size = np.clip(np.linalg.norm(metric.weights * x), 1e-6 * metric.size, 10 * metric.size)
        error = np.linalg.norm(e.residual) / size
        if error <= settings.tolerance:
            return Point(x, p, True, iteration, e)
        stalls += error > 0.5 * least          # more than once: it goes round between the pieces of a kink
        if not np.isfinite(error) or error > 1e8 or stalls > 1:
            break
        rate = error / before if held is not None else 1.0
        chord = held is not None and SAFE * rate * error <= settings.tolerance
        value = -(row @ (x - x0) + corner * (p - p0))
        residual = e.residual
        if iteration == 1 and last is not None and hasattr(e, "pull"):
            residual = residual + e.pull(x - last)
        dx, dp = (held if chord else e).solve(row, corner, value, residual)
        x, p = x + dx, p + dp
        if not np.isfinite(p) or not np.isfinite(x).all():
            break
        if (chord or SAFE * rate**2 * error <= settings.tolerance) and metric.norm(dx, dp) < BLIND:
            return Point(x, p, True, iteration, e.moved(dx, dp))
        before, least, held = error, min(error, least), e
    return Point(np.full_like(x0, np.nan), p0, False, iteration, first)


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


def between(evaluate, a: Point, b: Point, share: float, weights, settings=DEFAULT) -> Point:
    """The point of the branch on the plane across the chord from a to b, at a share in (0, 1) of it."""
    metric = Metric(weights, max(np.linalg.norm(weights * a.x), np.linalg.norm(weights * b.x), 1e-300),
                    max(abs(a.parameter), abs(b.parameter), 1e-300) * 1e-2)
    dx, dp = b.x - a.x, b.parameter - a.parameter
    row, corner = metric.border(dx, dp)
    x, p = a.x + share * dx, a.parameter + share * dp
    bends = [_bend(q, dx, dp, row, corner, metric) for q in (a, b)]
    if all(bends):
        for weight, (bx, bp) in zip((share * (1 - share)**2, -share**2 * (1 - share)), bends, strict=True):
            x, p = x + weight * bx, p + weight * bp
    new = correct(evaluate, x, p, row, corner, metric, settings)
    return replace(new, tangent=new.detail.direction(row, corner)[:2]) if new.converged else new


def _bend(point, dx, dp, row, corner, metric):
    """By how much the tangent at a point leads away from a chord (dx, dp), over its length; None where it is unknown.

    The cubic through two points with their tangents is their chord and these, times weights.
    """
    if point.tangent is None:
        return None
    tx, tp = point.tangent
    along = row @ tx + corner * tp
    if not along > 0.5 * metric.norm(tx, tp):
        return None
    scale = metric.norm(dx, dp) / along
    return scale * tx - dx, scale * tp - dp
