"""A point of a curve held against time integration that starts on its orbit."""

from dataclasses import dataclass

import numpy as np

from hbm import shooting
from hbm.march import MASSLESS, TOLERANCE, March
from hbm.march_sampled import STEPS, SampledMarch
from hbm.residual import HarmonicBalance

LEFT = 3e-2              # relative difference from which on the integration has gone to another orbit
PATIENCE = 40            # periods marched from the orbit before Newton helps to find where they lead


@dataclass(frozen=True)
class Comparison:
    """A periodic solution of the harmonic balance beside the integration from its orbit.

    difference : of the amplitude of harmonic 1, the largest over the outputs and relative to the largest output
    steady : Steady state of the integration; left : whether that is another orbit
    said : one sentence
    """

    difference: float
    steady: shooting.Steady
    left: bool
    said: str

    @property
    def agrees(self) -> bool:
        """Whether the integration is periodic and stayed on the orbit: then `difference` is an error."""
        return self.steady.periodic and not self.left


def compare(balance: HarmonicBalance, point, rows, tolerance: float = TOLERANCE, most_periods: int = 1000,
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
        if not steady.periodic or _difference(balance, point, rows, steady) > LEFT:
            steady = shooting.march_on(march, begin, rows, most_periods=most_periods - before)
    return _said(steady, _difference(balance, point, rows, steady))


def make(balance, w, tolerance=TOLERANCE, massless_above=MASSLESS, steps=None) -> March:
    """The integration that the law of a balance takes."""
    if balance.problem.law.corridor:
        return March(balance, w, tolerance, massless_above=massless_above)
    return SampledMarch(balance, w, steps or STEPS, massless_above)


def _difference(balance, point, rows, steady):
    X = np.asarray(rows) @ (balance.receptance.shapes @ point.detail.modal)
    return float(np.abs(np.abs(steady.harmonics[:, 1]) - np.abs(X[:, 1])).max() / np.abs(X[:, 1]).max())


def _said(steady, difference):
    left = bool(difference > LEFT)
    if not steady.finished:
        said = "the integration did not finish a period: transitions follow each other faster and faster"
    elif not steady.periodic:
        said = f"the integration is not periodic after {steady.periods} periods (change {steady.period_change:.1e})"
    elif left:
        said = f"the integration left for another orbit, {difference:.1%} away"
    elif steady.multiplier > 1 + 1e-6:
        said = (f"the orbit is there, {difference:.2e} away, but it is unstable (Floquet multiplier "
                f"{steady.multiplier:.4f}): left to itself the integration leaves it")
    else:
        said = f"the integration stays on the orbit, {difference:.2e} away"
    return Comparison(difference, steady, left, said)
