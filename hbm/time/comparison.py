"""A point of a curve held against time integration that starts on its orbit."""

import warnings
from dataclasses import dataclass

import numpy as np

from hbm.balance.residual import HarmonicBalance
from hbm.continuation.corrector import solve_fixed
from hbm.errors import InputError
from hbm.laws.uncoupled.law import CoulombFriction
from hbm.problem import ContactProblem
from hbm.result import ForcedResponse
from hbm.solutions import points_at
from hbm.time import shooting
from hbm.time.exact import MASSLESS, TOLERANCE, March
from hbm.time.sampled import STEPS, SampledMarch

ELSEWHERE = 0.2          # relative difference to the nearest point of the curve from which on it is another solution
SMALL = 1e-3             # relative difference above which more harmonics are advised
SAME = 1e-6              # relative distance of two solutions of the balance that are one
UNSOLVED = 3e-2          # relative difference of another orbit, where the balance finds no solution to tell them by
PATIENCE = 40            # periods marched from the orbit before Newton helps to find where they lead


@dataclass(frozen=True)
class Comparison:
    """A periodic solution of the harmonic balance beside the integration from its orbit.

    difference : of the amplitude of harmonic 1, the largest over the outputs and relative to the largest output
    steady : Steady state of the integration; left : whether that is another orbit, told by where the balance leads from
        it (see `_left`)
    said : one sentence; hz : frequency; H : harmonics of the balance; origin, start : as in ForcedResponse
    """

    difference: float
    steady: shooting.Steady
    left: bool
    said: str
    hz: float
    H: int
    origin: str
    start: str

    @property
    def agrees(self) -> bool:
        """Whether the integration is periodic and stayed on the orbit: then `difference` is an error."""
        return self.steady.periodic and not self.left


def compare(curve: ForcedResponse, problem: ContactProblem, value: float, which: int | None = None, parameter=None,
            **settings) -> Comparison:
    """A solution of a curve against time integration that starts on its orbit and runs until it repeats to 1e-8.

        problem, _ = contact_problem(model, pairs, law, damping_ratio=0.01)
        print(compare(curve, problem, 1250.0).said)

    problem, value, parameter : as in `hbm.solutions.solutions_at`; which : the place there, needed where the curve has
    several solutions; settings : as in `compare_point`. Raises InputError where there is no such solution.
    """
    balance, points = points_at(curve, problem, value, parameter)
    if which is None and len(points) > 1:
        sizes = ", ".join(f"{np.abs(p.detail.outputs(curve.output_rows)[:, 1]).max():.3g}" for p in points)
        raise InputError(f"compare: the curve has {len(points)} solutions at {value:g}, of amplitude {sizes} m; "
                         f"say which = 0 to {len(points) - 1}")
    if not 0 <= (which or 0) < len(points) or not points[which or 0].converged:
        raise InputError(f"compare: which = {which}: {len(points)} solutions of the curve are known at {value:g}")
    return compare_point(balance, points[which or 0], curve.output_rows, **settings)


def compare_point(balance: HarmonicBalance, point, rows, tolerance: float = TOLERANCE, most_periods: int = 1000,
            massless_above: float = MASSLESS, steps: int | None = None) -> Comparison:
    """Start at displacement, velocity and sliders of the point and integrate until the period map repeats to 1e-8.

    rows : (m, r) outputs; tolerance : of the corridor laws; steps : a period, of the laws that are known by their step
    Where the transient dies slowly, Newton on the period map finds where it leads; where Newton
    fails, up to `most_periods` are marched.
    """
    march = make(balance, point.parameter, tolerance, massless_above, steps)
    begin = march.on_orbit(point)
    steady = shooting.march_on(march, begin, rows, most_periods=min(PATIENCE, most_periods))
    if not steady.periodic and steady.finished and most_periods > PATIENCE:
        before = steady.periods
        steady = shooting.shoot(march, begin, rows)
        if not steady.periodic or _left(balance, point, march, _difference(balance, point, rows, steady)):
            steady = shooting.march_on(march, begin, rows, most_periods=most_periods - before)
    difference = _difference(balance, point, rows, steady)
    left = steady.periodic and _left(balance, point, march, difference)
    said = _said(steady, left, difference, balance.H)
    return Comparison(difference, steady, left, said, float(point.parameter) / (2 * np.pi), balance.H, steady.origin,
                      steady.start)


def make(balance, w, tolerance=TOLERANCE, massless_above=MASSLESS, steps=None) -> March:
    """The integration that the law of a balance takes."""
    if isinstance(balance.problem.law, CoulombFriction):
        return March(balance, w, tolerance, massless_above=massless_above)
    return SampledMarch(balance, w, steps or STEPS, massless_above)


def _difference(balance, point, rows, steady):
    X = np.asarray(rows) @ (balance.receptance.shapes @ point.detail.modal)
    return float(np.abs(np.abs(steady.harmonics[:, 1]) - np.abs(X[:, 1])).max() / np.abs(X[:, 1]).max())


def _left(balance, point, march, difference) -> bool:
    """Whether the integration has gone to another orbit than that of the point.

    With 2H + 1 harmonics (the next odd ones too, where even ones vanish) the balance is solved from the point and from
    the orbit that the integration came to. Where both lead to one solution they are one orbit, and what they differ by
    is what H harmonics leave out; where they lead to two, they are not. A threshold alone cannot tell: at H = 1 an
    orbit is missed by some per cent, and near a fold two orbits are closer than that.
    """
    if difference > ELSEWHERE:
        return True
    try:
        finer = _finer(balance)
        ends = [solve_fixed(finer.evaluate, _padded(x, finer), point.parameter, finer.weights)
                for x in (point.x, march.harmonics_of_motion())]
    except InputError:                                           # so many harmonics do not fit into the memory
        return bool(difference > UNSOLVED)
    if not all(end.converged for end in ends):
        return bool(difference > UNSOLVED)
    # the mean is left out: where every pair slides it may be any, and the orbit is the same
    swings = [(finer.weights * x).reshape(finer.n_components, -1)[:, 1:] for x in (ends[1].x - ends[0].x, ends[0].x)]
    return bool(np.linalg.norm(swings[0]) > SAME * np.linalg.norm(swings[1]))


def _finer(balance):
    """The balance with 2H + 1 harmonics."""
    samples = max(len(balance.grid[0]) - 1, balance.problem.law.default_samples(2 * balance.H + 1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")                          # of harmonics that nobody asked for
        finer = HarmonicBalance(balance.problem, balance.forces, 2 * balance.H + 1, balance.given_start, samples)
    finer.force[:, :balance.H + 1] = balance.force               # at its level
    return finer


def _padded(x, finer):
    """Coefficients of fewer harmonics as a guess for more."""
    full = np.zeros((finer.n_components, finer.nh))
    coefficients = x.reshape(finer.n_components, -1)
    full[:, :coefficients.shape[1]] = coefficients
    return full.ravel()


def _said(steady, left, difference, H):
    if not steady.finished:
        said = "the integration did not finish a period: transitions follow each other faster and faster"
    elif not steady.periodic:
        said = f"the integration is not periodic after {steady.periods} periods (change {steady.period_change:.1e})"
    elif left:
        said = f"the integration left for another orbit, {difference:.1%} away"
    elif steady.multiplier > 1 + 1e-6:
        said = (f"the orbit is there, {difference:.2e} away, but it is unstable (Floquet multiplier "
                f"{steady.multiplier:.4f}): left to itself the integration leaves it")
    elif steady.by_newton and np.isnan(steady.multiplier):
        said = (f"the orbit is there, {difference:.2e} away, found by Newton on the period map; with so many unknowns "
                "it is not known whether it is stable")
    else:
        said = f"the integration stays on the orbit, {difference:.2e} away"
    if steady.periodic and not left and difference > SMALL:
        said += f"; more harmonics than H = {H} bring it closer"
    return said
