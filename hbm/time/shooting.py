"""Steady states of the time integration: by marching until the period map repeats, and by Newton on that map.

The unknowns of the shooting are the motion and the sliders at the begin of a period. Its monodromy comes from
differences, column by column for small systems, so that the Floquet multipliers are known too, else in a Krylov space.
"""

import inspect
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

REPEATS = 1e-8           # relative change of the state over one period that counts as periodic
MOST_COLUMNS = 80        # unknowns up to which the monodromy is computed whole
DIFFERENCE = 1e-6        # of the motion
KRYLOV = 1e-3            # residual of Newton's step by GMRES
SHARES = (1.0, 0.5, 0.2, 0.05)
# the relative tolerance of GMRES was called tol up to SciPy 1.13
GMRES_TOLERANCE = "rtol" if "rtol" in inspect.signature(gmres).parameters else "tol"


@dataclass(frozen=True)
class Steady:
    """Steady state by time integration.

    harmonics : (m, H+1) complex of the outputs; period_change : relative change of the state over the last period
    periodic : whether that is below the tolerance; periods : how many were marched; work : (P,) J per cycle by friction
    multiplier : largest modulus of the Floquet multipliers of the motion that are not 1 of a slider at rest, NaN where
        the monodromy was not computed
    by_newton : whether Newton on the period map led there, and not marching alone, which leaves unstable orbits
    finished : False where the transitions of a period were too many (chatter)
    origin, start : of the balance whose problem was integrated, as in ForcedResponse
    """

    harmonics: np.ndarray
    period_change: float
    periodic: bool
    periods: int
    work: np.ndarray
    multiplier: float
    by_newton: bool
    finished: bool
    origin: str
    start: str

    def __repr__(self) -> str:
        return (f"<Steady: {'periodic' if self.periodic else 'not periodic'} after {self.periods} periods (change "
                f"{self.period_change:.1e}), {len(self.harmonics)} outputs, multiplier {self.multiplier:.4g}>")


def march_on(march, state, rows, tolerance=REPEATS, most_periods=2000) -> Steady:
    """Marching from a state until the period map repeats; rows (m, r) are the outputs."""
    return _steady(march, *_until_it_repeats(march, state, tolerance, most_periods), rows, tolerance)


def shoot(march, state, rows, tolerance=REPEATS, most_steps=8, most_periods=20) -> Steady:
    """Newton on the period map from a state, then marching until the map repeats, over at most `most_periods`."""
    v, used, multiplier, by_newton = march.vector(state), 0, np.nan, False
    size = march.size[0]
    for _ in range(most_steps):
        base = _map(march, v)
        used += 1
        if not march.finished or np.abs(base - v).max() <= 0.1 * tolerance * size:
            break
        newton = _by_columns if len(v) <= MOST_COLUMNS else _by_krylov
        (step, more, multiplier), by_newton = newton(march, v, base, size), True
        used += more
        v, more = _shortened(march, v, step, base)
        used += more
    state, change, more = _until_it_repeats(march, march.from_vector(v), tolerance, most_periods)
    return _steady(march, state, change, used + more, rows, tolerance, multiplier, by_newton)


def _map(march, v):
    return march.vector(march.periods(march.from_vector(v)))


def _by_columns(march, v, base, size):
    """(Newton's step, periods marched, largest multiplier) from the whole monodromy."""
    J, h = np.empty((len(v), len(v))), DIFFERENCE * size
    for c in range(len(v)):
        moved = v.copy()
        moved[c] += h
        J[:, c] = (_map(march, moved) - base) / h
    step = np.linalg.lstsq(np.eye(len(v)) - J, base - v, rcond=1e-9)[0]
    moduli = np.abs(np.linalg.eigvals(J))
    resting = np.abs(moduli - 1) < 1e-4
    return step, len(v), float(moduli[~resting].max(initial=0.0))


def _by_krylov(march, v, base, size):
    """(Newton's step, periods marched, NaN) by GMRES on the differences of the map."""
    used = 0

    def apply(p):
        nonlocal used
        used += 1
        h = DIFFERENCE * size / max(np.abs(p).max(), 1e-300)
        return p - (_map(march, v + h * p) - base) / h

    operator = LinearOperator((len(v), len(v)), matvec=apply)
    error = np.abs(base - v).max()             # of the order of 1, or GMRES takes it for solved
    step, _ = gmres(operator, (base - v) / error, restart=40, maxiter=1, atol=0.0, **{GMRES_TOLERANCE: KRYLOV})
    return step * error, used, np.nan


def _shortened(march, v, step, base):
    """(v, periods marched): Newton's step, shortened until the map moves the state less; the plain map else."""
    error = np.linalg.norm(base - v)
    for k, share in enumerate(SHARES):
        new = v + share * step
        if np.linalg.norm(_map(march, new) - new) < error:
            return new, k + 1
    return base, len(SHARES)


def _until_it_repeats(march, state, tolerance, most_periods):
    """(state, change over the last period, periods)."""
    n, change = 0, np.inf
    while n < most_periods:
        n += 1
        after = march.periods(state)
        change = march.change(state, after) if march.finished else np.inf
        state = after
        if change <= tolerance or not march.finished:
            break
    return state, change, n


def _steady(march, state, change, n, rows, tolerance, multiplier=np.nan, by_newton=False):
    sliders, from_position = march.balance.start
    return Steady(march.harmonics(rows), change, bool(change <= tolerance), n, march.work.copy(), multiplier,
                  by_newton, bool(march.finished), "preloaded" if march.balance.problem.preloaded else "unloaded",
                  "zero_force" if from_position else "given" if sliders.any() else "zero_slider")
