"""Steady states of time integration: integrated until the period map repeats, or by Newton's method
on that map.

The unknowns of the shooting are the motion and the memory of the contacts at the begin of a period.
The derivative of the map comes from differences, column by column for small systems, else in a
Krylov space.
"""

import inspect
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from tipdamp.hbm.time.base import IntegratedCycle, Integrator

# the relative tolerance of GMRES was called tol up to SciPy 1.13
GMRES_TOLERANCE = "rtol" if "rtol" in inspect.signature(gmres).parameters else "tol"


@dataclass(frozen=True)
class Steady:
    """Steady state by time integration.

    harmonics : (m, H+1) complex of the outputs; motion : (P nd, H+1) complex of the relative motion
    at the contacts, m
    period_change : change of the state over the last period, relative to the vibration
    periodic : whether that is below the tolerance; periods : how many were integrated
    dissipated : (P,) J per cycle that each contact takes out of the motion
    state : at the begin of a period, of the kind that the integrator takes
    by_newton : whether Newton on the period map led there; integration alone leaves unstable orbits
    finished : False where the events of a period were too many (chatter)
    method : of the integration: 'event-driven', or 'sampled' where a law is not piecewise linear
    origin, start : of the balance whose problem was integrated, as in ForcedResponse
    """

    harmonics: np.ndarray
    motion: np.ndarray
    period_change: float
    periodic: bool
    periods: int
    dissipated: np.ndarray
    state: Any
    by_newton: bool
    finished: bool
    method: str
    origin: str
    start: str

    def __repr__(self) -> str:
        return (
            f"<Steady: {'periodic' if self.periodic else 'not periodic'} after {self.periods} "
            f"periods (change {self.period_change:.1e}), {len(self.harmonics)} outputs, "
            f"{self.method} integration>"
        )


def integrate(
    integrator: Integrator, state: Any, rows: np.ndarray, max_periods: int | None = None
) -> Steady:
    """From a state until the period map repeats, over at most `max_periods`; rows (m, r) are the
    outputs."""
    max_periods = max_periods or integrator.settings.max_periods
    return _steady(integrator, rows, *_until_periodic(integrator, state, max_periods))


def shoot(integrator: Integrator, state: Any, rows: np.ndarray) -> Steady:
    """Newton on the period map from a state, then integration until the map repeats; rows (m, r)
    are the outputs."""
    settings, size = integrator.settings, integrator.size
    v, used, by_newton = integrator.vector(state), 0, False
    for _ in range(settings.newton_on_map):
        base, finished = period_map(integrator, v)
        used += 1
        if not finished or np.abs(base - v).max() <= 0.1 * settings.repeats * size:
            break
        newton = newton_by_columns if len(v) <= settings.max_columns else newton_by_krylov
        (step, more), by_newton = newton(integrator, v, base, size), True
        used += more
        v, more = _shortened(integrator, v, step, base)
        used += more
    cycle, change, more = _until_periodic(
        integrator, integrator.from_vector(v), settings.periods_after_newton
    )
    return _steady(integrator, rows, cycle, change, used + more, by_newton)


def period_map(integrator: Integrator, v: np.ndarray) -> tuple[np.ndarray, bool]:
    """The unknowns a period after v, and whether the integration finished."""
    cycle = integrator.periods(integrator.from_vector(v))
    return integrator.vector(cycle.state), cycle.finished


def newton_by_columns(
    integrator: Integrator, v: np.ndarray, base: np.ndarray, size: float
) -> tuple[np.ndarray, int]:
    """(Newton's step, periods integrated) from the whole derivative of the map; base =
    period_map(v)."""
    J, h = np.empty((len(v), len(v))), integrator.settings.difference * size
    for c in range(len(v)):
        moved = v.copy()
        moved[c] += h
        J[:, c] = (period_map(integrator, moved)[0] - base) / h
    step = np.linalg.lstsq(np.eye(len(v)) - J, base - v, rcond=1e-9)[0]
    return step, len(v)


def newton_by_krylov(
    integrator: Integrator, v: np.ndarray, base: np.ndarray, size: float
) -> tuple[np.ndarray, int]:
    """(Newton's step, periods integrated) by GMRES on the differences of the map; base =
    period_map(v)."""
    used = 0

    def apply(p: np.ndarray) -> np.ndarray:
        nonlocal used
        used += 1
        h = integrator.settings.difference * size / max(np.abs(p).max(), 1e-300)
        return p - (period_map(integrator, v + h * p)[0] - base) / h

    operator = LinearOperator((len(v), len(v)), matvec=apply)
    error = np.abs(base - v).max()  # of the order of 1, or GMRES takes it for solved
    tolerance = {GMRES_TOLERANCE: integrator.settings.krylov}
    step, _ = gmres(operator, (base - v) / error, restart=40, maxiter=1, atol=0.0, **tolerance)
    return step * error, used


def _shortened(
    integrator: Integrator, v: np.ndarray, step: np.ndarray, base: np.ndarray
) -> tuple[np.ndarray, int]:
    """(v, periods integrated): Newton's step, shortened until the map moves the state less; the
    plain map else."""
    error, fractions = np.linalg.norm(base - v), integrator.settings.fractions
    for k, fraction in enumerate(fractions):
        new = v + fraction * step
        if np.linalg.norm(period_map(integrator, new)[0] - new) < error:
            return new, k + 1
    return base, len(fractions)


def _until_periodic(
    integrator: Integrator, state: Any, max_periods: int
) -> tuple[IntegratedCycle, float, int]:
    """(last cycle, change over it, periods)."""
    n = 0
    while True:
        n += 1
        cycle = integrator.periods(state)
        change = integrator.change(state, cycle) if cycle.finished else np.inf
        if change <= integrator.settings.repeats or not cycle.finished or n >= max_periods:
            return cycle, change, n
        state = cycle.state


def _steady(
    integrator: Integrator,
    rows: np.ndarray,
    cycle: IntegratedCycle,
    change: float,
    n: int,
    by_newton: bool = False,
) -> Steady:
    stuck, repeats = integrator.stuck, integrator.settings.repeats
    return Steady(
        stuck.harmonics(rows, cycle.force),
        stuck.relative_motion(cycle.force),
        change,
        bool(change <= repeats),
        n,
        cycle.dissipated,
        cycle.state,
        by_newton,
        bool(cycle.finished),
        integrator.method,
        "preloaded" if stuck.balance.problem.preloaded else "unloaded",
        stuck.balance.start.name,
    )
