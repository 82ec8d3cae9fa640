"""The equation of a branch: a harmonic balance in which one parameter varies."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from tipdamp.hbm.balance.contact_setting import NAMES, ContactSetting
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import Damping, Level, Parameter
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.validation import check_call

BY_NAME = {
    "level": Level(),
    "damping": Damping(),
    **{name: ContactSetting(name) for name in NAMES},
}


def as_parameter(parameter: Parameter | str) -> Parameter:
    """A Parameter itself, or the one of a name: level, damping, preload, pull, gap, mu, kn, kt;
    InputError for anything else."""
    if isinstance(parameter, Parameter):
        rebuilds = f"parameter '{parameter.name}': rebuild"
        check_call(rebuilds, parameter.rebuild, "problem", "forces", "value")
        return parameter
    if not isinstance(parameter, str) or parameter not in BY_NAME:
        raise InputError(
            f"parameter = '{parameter}': is unknown; {nearest(str(parameter), BY_NAME)}"
        )
    return BY_NAME[parameter]


@dataclass(frozen=True)
class Equation:
    """R(x, p) = 0 of a branch: a harmonic balance in which one parameter varies.

    p : in units of the branch, parameter.scale times the value; hz : of the excitation, where the
    frequency does not vary; periods : of the excitation in one of the motion, whose orders the
    balance has
    """

    balance: HarmonicBalance
    parameter: Parameter
    hz: float = np.nan
    periods: int = 1

    @property
    def w(self) -> float:
        """rad/s of the motion, where the frequency does not vary."""
        return 2 * np.pi * self.hz / self.periods

    @property
    def weights(self) -> np.ndarray:
        """(n,) weights of the unknowns in the arc length."""
        return self.balance.weights

    def evaluate(self, x: np.ndarray, p: float) -> Linearisation:
        """Linearisation at x (n,) and p."""
        return self.parameter.evaluate(self.balance, x, self.w, p)

    def balance_at(self, p: float) -> tuple[HarmonicBalance, float]:
        """(balance, angular frequency) with the parameter fixed."""
        b = self.balance
        w = self.parameter.angular_frequency(self.w, p)
        problem, forces = self.parameter.rebuild(b.problem, b.forces, p / self.parameter.scale)
        return (b if problem is b.problem and forces is b.forces else b.rebuilt(problem, forces)), w

    def solutions(self, p: float, ways: Callable, settings: Settings) -> Iterator[Point]:
        """The solutions that ways(balance, w) yields with the parameter fixed, as points of the
        branch."""
        balance, w = self.balance_at(p)
        for point in ways(balance, w):
            if point.converged and balance is not self.balance:
                again = solve_fixed(self.evaluate, point.x, p, self.weights, settings)
                point = replace(again, iterations=point.iterations + again.iterations)
            yield point
