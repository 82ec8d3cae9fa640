"""Stability of a periodic orbit: the largest Floquet multiplier of the period map of time
integration.

The monodromy matrix J is the derivative of the map at the orbit, by central differences: column by
column for small systems, else its leading eigenvalues by Arnoldi's method [Lehoucq, Sorensen, Yang,
ARPACK Users' Guide, 1998].

A slider that sticks all through the period ends where it began: its row of J is that of the unit
matrix and J is block triangular, so that a multiplier of exactly 1 belongs to it and the other
multipliers are those of J without its row and column. It means a continuum of orbits beside each
other, no instability, and is not counted.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

from tipdamp.hbm.time.base import Integrator
from tipdamp.hbm.time.settings import IntegrationSettings


def largest_multiplier(integrator: Integrator, state: Any) -> tuple[float, int]:
    """(largest modulus, periods integrated) of the Floquet multipliers at a state on a periodic
    orbit.

    Of the motion and of the sliders that move in the period. NaN where a period of the integration
    does not finish."""
    v, settings = integrator.vector(state), integrator.settings
    h = settings.disturbance * integrator.size
    used, failed = 0, False

    def ends(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The unknowns at the begin and at the end of a period that is disturbed by h p."""
        nonlocal used, failed
        used += 1
        begin = integrator.from_vector(v + h * p)
        cycle = integrator.periods(begin)
        end = integrator.vector(cycle.state)
        failed = failed or not cycle.finished or not np.isfinite(end).all()
        return integrator.vector(begin), end

    def derivative(p: np.ndarray) -> np.ndarray:
        scale = np.abs(p).max()
        if failed or scale == 0:
            return 0 * p
        found = (ends(p / scale)[1] - ends(-p / scale)[1]) * (scale / (2 * h))
        return 0 * p if failed else found

    counted = _counted(ends, len(integrator.stuck.weight), len(v), settings.resting * h)
    if not len(counted):
        moduli = np.zeros(0)
    elif len(counted) <= max(settings.max_columns, settings.multipliers + 2):
        moduli = _by_columns(derivative, counted, len(v))
    else:
        moduli = _by_arnoldi(derivative, counted, len(v), settings)
    return (np.nan if failed else float(moduli.max(initial=0.0))), used


def _counted(ends: Callable, motion: int, n: int, closeness: float) -> np.ndarray:
    """Indices of the `motion` leading ones of n unknowns and of those sliders that move in a
    disturbed period.

    Both signs are tried: a slider that just reaches its limit rests under one of them only.
    """
    random = np.random.default_rng(0)
    p = random.uniform(0.5, 1.0, n) * random.choice([-1.0, 1.0], n)
    moved = np.min([np.abs(np.subtract(*ends(way))) for way in (p, -p)], axis=0)
    return np.flatnonzero((np.arange(n) < motion) | (moved > closeness))


def _by_columns(derivative: Callable, counted: np.ndarray, n: int) -> np.ndarray:
    """Moduli of all multipliers."""
    J = np.array([derivative(np.eye(1, n, c)[0])[counted] for c in counted]).T
    return np.abs(np.linalg.eigvals(J))


def _by_arnoldi(
    derivative: Callable, counted: np.ndarray, n: int, settings: IntegrationSettings
) -> np.ndarray:
    """Moduli of the leading multipliers; of all where Arnoldi's method does not converge."""

    def apply(x: np.ndarray) -> np.ndarray:
        p = np.zeros(n)
        p[counted] = np.ravel(x)
        return derivative(p)[counted]

    k = len(counted)
    operator = LinearOperator((k, k), matvec=apply, dtype=float)
    try:
        found = eigs(
            operator,
            k=settings.multipliers,
            ncv=min(settings.arnoldi, k),
            maxiter=settings.arnoldi_restarts,
            tol=settings.multiplier_error,
            v0=np.random.default_rng(1).standard_normal(k),
            return_eigenvectors=False,
        )
    except ArpackError:
        return _by_columns(derivative, counted, n)
    return np.abs(found)
