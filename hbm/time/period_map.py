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
    disturbed, settings = _Disturbed(integrator, state), integrator.settings
    n, closeness = len(disturbed.v), settings.resting * disturbed.h
    counted = _counted(disturbed.ends, len(integrator.stuck.weight), n, closeness)
    if not len(counted):
        moduli = np.zeros(0)
    elif len(counted) <= max(settings.max_columns, settings.multipliers + 2):
        moduli = _by_columns(disturbed.derivative, counted, n)
    else:
        moduli = _by_arnoldi(disturbed.derivative, counted, n, settings)
    largest = np.nan if disturbed.failed else float(moduli.max(initial=0.0))
    return largest, disturbed.used


class _Disturbed:
    """Periods beside a state.

    v (n,), h : unknowns of the state, size of a disturbance; used : periods integrated; failed :
    whether one of them did not finish
    """

    def __init__(self, integrator: Integrator, state: Any) -> None:
        self.integrator, self.v = integrator, integrator.vector(state)
        self.h = integrator.settings.disturbance * integrator.size
        self.used, self.failed = 0, False

    def ends(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The unknowns at the begin and at the end of a period that is disturbed by h p."""
        self.used += 1
        begin = self.integrator.from_vector(self.v + self.h * p)
        cycle = self.integrator.periods(begin)
        end = self.integrator.vector(cycle.state)
        self.failed = self.failed or not cycle.finished or not np.isfinite(end).all()
        return self.integrator.vector(begin), end

    def derivative(self, p: np.ndarray) -> np.ndarray:
        """(n,) of the period map along p; zeros once a period has failed."""
        scale = np.abs(p).max()
        if self.failed or scale == 0:
            return 0 * p
        found = (self.ends(p / scale)[1] - self.ends(-p / scale)[1]) * (scale / (2 * self.h))
        return 0 * p if self.failed else found


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
