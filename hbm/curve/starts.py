"""A first solution at a frequency: from the stuck response, by the level of the force, by time
integration."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency, Level
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.follow import follow
from tipdamp.hbm.continuation.point import Point, failed
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.settings import IntegrationSettings

# from where a first point is reached, relative to its frequency
OFF_BAND = (0.95, 0.85, 0.7, 1.05, 1.15, 1.3)
LOW_LEVEL = 1e-3  # of the force: where the level is raised from


def first_point(balance: HarmonicBalance, w: float, settings: Settings) -> Point:
    """A solution at the angular frequency w: from the stuck response, by raising the force, or by
    integration."""
    return first_of(starts(balance, w, settings, off_band=False))


def starts(
    balance: HarmonicBalance, w: float, settings: Settings, off_band: bool = True
) -> Iterator[Point]:
    """Solutions at w, or failed points, each with the residual calls it took: one way to a first
    point after the other.

    off_band : whether to come from other frequencies too, where the ways at w are exhausted
    """

    def solved(x: np.ndarray) -> Point:
        return solve_fixed(balance.evaluate, x, w, balance.weights, settings, settings.start_calls)

    yield solved(balance.linear(w))
    for guess in (_raise_level, _integrate):
        x, calls = guess(balance, w, settings)
        if x is not None:
            point = solved(x)
            yield replace(point, iterations=calls + point.iterations)
        else:
            yield failed(len(balance.weights), w, calls)
    for share in OFF_BAND if off_band else ():
        yield _from_frequency(balance, share * w, w, settings)


def first_of(points: Iterable[Point]) -> Point:
    """The first that converged, with the residual calls of all that were tried; else the last."""
    calls = 0
    for point in points:
        calls += point.iterations
        if point.converged:
            break
    return replace(point, iterations=calls)


def _raise_level(
    balance: HarmonicBalance, w: float, settings: Settings
) -> tuple[np.ndarray | None, int]:
    """(x or None, residual calls): the branch over the force level, from almost nothing to the
    whole force."""
    equation = Equation(balance, Level(), w / (2 * np.pi))
    low = solve_fixed(
        equation.evaluate, balance.linear(w, LOW_LEVEL), LOW_LEVEL, balance.weights, settings
    )
    if not low.converged:
        return None, low.iterations
    branch = follow(
        equation.evaluate,
        low,
        1.0,
        balance.weights,
        replace(settings, max_points=150, max_restarts=0),
    )
    return branch.points[-1].x if branch.complete else None, branch.calls


def _integrate(
    balance: HarmonicBalance, w: float, settings: Settings
) -> tuple[np.ndarray | None, int]:
    """(x or None, residual calls): where time integration from rest leads; piecewise-linear laws
    only, as long as no period takes too many steps."""
    problem = balance.problem
    no_motion = problem.structural is not None  # in time
    if no_motion or problem.law.piecewise_linear(problem.contacts) is None:
        return None, 0
    usual = IntegrationSettings()
    motions = len(balance.problem.contacts) * balance.nd
    steps = max(1, min(usual.max_steps, int(settings.start_steps * (100 / motions) ** 2)))
    integrator = ExactIntegrator(balance, w, replace(usual, tolerance=1e-4, max_steps=steps))
    cycle = integrator.periods(integrator.at_rest(), 60)
    x = fourier.to_real(integrator.stuck.relative_motion(cycle.force)).ravel()
    return x if cycle.finished and np.isfinite(x).all() else None, 0


def _from_frequency(balance: HarmonicBalance, other: float, w: float, settings: Settings) -> Point:
    """The branch from a solution at another frequency to w."""
    begin = first_point(balance, other, settings)
    if not begin.converged:
        return failed(len(balance.weights), w, begin.iterations)
    branch = follow(
        Equation(balance, Frequency()).evaluate,
        begin,
        w,
        balance.weights,
        replace(settings, max_points=500, max_restarts=1, outside=0.0),
    )
    return (
        replace(branch.points[-1], iterations=branch.calls)
        if branch.complete
        else failed(len(balance.weights), w, branch.calls)
    )
