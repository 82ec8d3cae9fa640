"""What may vary along a branch: the frequency, the level of the force, a setting of the contacts, the damping, K(p).

    follow_parameter(problem, F, 930.0, "mu", (1.0, 0.1), ...)                       of all contacts, by a factor
    follow_parameter(problem, F, 930.0, ContactSetting("kt", contacts=(3,)), ...)    of one contact
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hbm.balance.residual import HarmonicBalance
from hbm.continuation.corrector import solve_fixed
from hbm.errors import InputError, nearest

SETTINGS = ("preload", "mu", "kn", "kt")


class Parameter:
    """A quantity of the problem that varies along a branch.

    name : as in ForcedResponse.parameter_name; unit : of its values, for messages
    scale : units of the branch in one of the parameter
    """

    name: str
    unit: str = ""
    scale: float = 1.0

    def rebuild(self, problem, forces: dict, value: float):
        """(problem, forces {harmonic: (r,) N}) at a value."""
        return problem, forces

    def check(self, problem):
        """InputError where it cannot vary in a problem at a fixed frequency."""

    def evaluate(self, balance: HarmonicBalance, x, w: float, p: float) -> Any:
        """Linearisation at x (n,) and p, in units of the branch, of a balance that is that of the value 1."""
        raise NotImplementedError

    def angular_frequency(self, w: float, p: float) -> float:
        """rad/s at p; w where it does not vary."""
        return w

    def frequencies(self, hz: float, values: np.ndarray) -> np.ndarray:
        """(n,) Hz at the values (n,); hz where it does not vary."""
        return np.full(len(values), hz)

    def named(self, value: float) -> str:
        """A value for messages."""
        return f"{self.name} = {value:.6g}"


@dataclass(frozen=True)
class Frequency(Parameter):
    """The frequency of the force in Hz; branches run in rad/s."""

    name: str = "frequency"
    unit: str = " Hz"
    scale: float = 2 * np.pi

    def check(self, problem):
        """It varies in a band only."""
        raise InputError("parameter 'frequency': use follow_band")

    def evaluate(self, balance, x, w, p):
        """Linearisation at x (n,) and p rad/s."""
        return balance.evaluate(x, p)

    def angular_frequency(self, w, p):
        """p."""
        return p

    def frequencies(self, hz, values):
        """The values."""
        return values

    def named(self, value):
        """A value for messages."""
        return f"{value:.6g} Hz"


@dataclass(frozen=True)
class Level(Parameter):
    """A factor on the force."""

    name: str = "level"

    def rebuild(self, problem, forces, value):
        """(problem, forces) at a value."""
        return problem, {k: value * F for k, F in forces.items()}

    def evaluate(self, balance, x, w, p):
        """Linearisation at x (n,) and the factor p."""
        return balance.evaluate(x, w, level=p, by="level")


@dataclass(frozen=True)
class ContactSetting(Parameter):
    """A factor on kn, kt, mu or the preload of every contact."""

    name: str

    def __post_init__(self):
        if self.name not in SETTINGS:
            raise InputError(f"contact setting '{self.name}' is unknown; {nearest(self.name, SETTINGS)}")

    def check(self, problem):
        """Preloads are those of the preloaded origin."""
        if self.name == "preload" and not problem.preloaded:
            raise InputError("parameter 'preload': the unloaded origin has gaps, not preloads; "
                             "use origin = 'preloaded'")

    def rebuild(self, problem, forces, value):
        """(problem, forces) at a value."""
        contacts = {self.name: value * getattr(problem.pairs, self.name)}
        if self.name == "kn" and not problem.preloaded:
            contacts["preload"] = value * problem.pairs.preload          # -kn gap
        other = replace(problem, pairs=replace(problem.pairs, **contacts))
        if self.name in ("preload", "mu"):
            other.__dict__["_receptance"] = problem.receptance()          # these do not change it
        return other, forces

    def evaluate(self, balance, x, w, p):
        """Linearisation at x (n,) and the factor p."""
        # a long Newton step may ask for a negative stiffness: the settings end at zero
        return balance.evaluate(x, w, factor=max(p, 1e-9), by=self.name)


BY_NAME = {"level": Level(), **{name: ContactSetting(name) for name in SETTINGS}}


def as_parameter(parameter) -> Parameter:
    """A Parameter itself, or the one of a name: level, preload, mu, kn, kt; InputError for anything else."""
    if isinstance(parameter, Parameter):
        return parameter
    if parameter not in BY_NAME:
        raise InputError(f"parameter = '{parameter}': is unknown; {nearest(str(parameter), BY_NAME)}")
    return BY_NAME[parameter]


@dataclass(frozen=True)
class Equation:
    """R(x, p) = 0 of a branch: a harmonic balance in which one parameter varies.

    p : in units of the branch, parameter.scale times the value; hz : where the frequency does not vary
    """

    balance: HarmonicBalance
    parameter: Parameter
    hz: float = np.nan

    @property
    def weights(self) -> np.ndarray:
        """(n,) weights of the unknowns in the arc length."""
        return self.balance.weights

    def evaluate(self, x: np.ndarray, p: float):
        """Linearisation at x (n,) and p."""
        return self.parameter.evaluate(self.balance, x, 2 * np.pi * self.hz, p)

    def balance_at(self, p: float) -> tuple[HarmonicBalance, float]:
        """(balance, angular frequency) with the parameter fixed."""
        b, w = self.balance, self.parameter.angular_frequency(2 * np.pi * self.hz, p)
        problem, forces = self.parameter.rebuild(b.problem, b.forces, p / self.parameter.scale)
        if problem is b.problem and forces is b.forces:
            return b, w
        other = HarmonicBalance(problem, forces, b.H, b.given_start, len(b.grid[0]) - 1)
        other.on_call = b.on_call
        return other, w

    def solutions(self, p: float, ways, settings):
        """The solutions that ways(balance, w) yields with the parameter fixed, as points of the branch."""
        balance, w = self.balance_at(p)
        for point in ways(balance, w):
            if point.converged and balance is not self.balance:
                again = solve_fixed(self.evaluate, point.x, p, self.weights, settings)
                point = replace(again, iterations=point.iterations + again.iterations)
            yield point
