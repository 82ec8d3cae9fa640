"""What may vary along a branch: the frequency, level or direction of the force, a setting of
contacts, damping, K(p).

    follow_parameter(problem, F, 930.0, "mu", (1.0, 0.1), ...)  # of all contacts, by a factor
    follow_parameter(problem, F, 930.0, ContactSetting("kt", contacts=(3,)), ...)  # of one contact
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeAlias

import numpy as np

from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance, Terms, by_frequency, by_level
from tipdamp.hbm.balance.varying import at_frequency
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws.records import Contacts
from tipdamp.hbm.result import FACTOR
from tipdamp.hbm.validation import (
    MOST_HARMONICS,
    check_call,
    check_forcing,
    check_kind,
)

Rebuild: TypeAlias = tuple[ContactProblem, dict]
SMALLEST = 1e-9  # value below which nothing is evaluated
DIFFERENCE = 1e-6  # step of the central differences, relative to the value


class Parameter:
    """A quantity of the problem that varies along a branch.

    name : as in ForcedResponse.parameter_name; unit : of its values, for messages
    scale : units of the branch in one of the parameter

    >>> given: list[Parameter] = [Level(), Damping(), ContactSetting("mu"), ContactSetting("kt", 3)]
    >>> for parameter in given:
    ...     print(parameter.named(0.5))
    level = 0.5
    damping factor = 0.5
    mu factor = 0.5
    kt of contacts 3 factor = 0.5
    """

    name: str
    unit: str = ""
    scale: float = 1.0

    @property
    def stiffens(self) -> bool:
        """Whether it is one of the springs of stuck contacts, and the stuck modes follow it."""
        return False

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces {harmonic: (r,) N}) at a value."""
        return problem, forces

    def over(self, periods: int) -> "Parameter":
        """The same for motions that repeat after so many periods of the excitation."""
        return self

    def check(self, problem: ContactProblem) -> None:
        """InputError where it cannot vary in a problem at a fixed frequency."""

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and p, in units of the branch, of a balance that is that of the
        value 1."""
        raise NotImplementedError

    def held(self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float) -> Linearisation:
        """The same with the derivative by the angular frequency, the parameter held."""
        return self._evaluate_at(balance, p)(x, w)

    def _evaluate_at(self, balance: HarmonicBalance, p: float) -> Callable[..., Linearisation]:
        """`HarmonicBalance.evaluate` at p, in units of the branch."""
        return balance.evaluate

    def settings_at(self, problem: ContactProblem, p: float) -> Contacts:
        """Of the contacts of a problem at p, in units of the branch."""
        return problem.contacts

    def angular_frequency(self, w: float, p: float) -> float:
        """rad/s at p; w where it does not vary."""
        return w

    def frequencies(self, hz: float, values: np.ndarray) -> np.ndarray:
        """(n,) Hz at the values (n,); hz where it does not vary."""
        return np.full(len(values), hz)

    def measured_in(self, forces: dict) -> str:
        """Unit of its values, of forces {harmonic: (r,) N} at the value 1; '' where it has none."""
        return self.unit.strip()

    def named(self, value: float) -> str:
        """A value for messages."""
        return f"{value:.6g}{self.unit}" if self.unit else f"{self.name} = {value:.6g}"


class Scaling(Parameter):
    """A factor on what the problem has."""

    def measured_in(self, forces: dict) -> str:
        """That it is a factor."""
        return FACTOR

    def named(self, value: float) -> str:
        """A value for messages."""
        return f"{self.name} {FACTOR} = {value:.6g}"


@dataclass(frozen=True)
class Frequency(Parameter):
    """The frequency of the force in Hz; branches run in rad/s.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> Frequency().named(931.5)
    '931.5 Hz'
    >>> Frequency().check(problem)
    Traceback (most recent call last):
    tipdamp.hbm.errors.InputError: parameter 'frequency': use follow_band
    """

    name: str = "frequency"
    unit: str = " Hz"
    scale: float = 2 * np.pi

    def over(self, periods: int) -> Parameter:
        """The branch runs in rad/s of the motion, its values stay those of the excitation."""
        return replace(self, scale=2 * np.pi / periods)

    def check(self, problem: ContactProblem) -> None:
        """It varies in a band only."""
        raise InputError("parameter 'frequency': use follow_band")

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and p rad/s."""
        if balance.problem.varying is None:
            return balance.evaluate(x, p)
        if p <= 0:
            raise InputError(f"forces and matrices at {p / self.scale:g} Hz: must be above 0")
        value = p / self.scale
        there = balance.rebuilt(*self.rebuild(balance.problem, balance.forces, value))

        def derivative(now: HarmonicBalance, t: Terms) -> np.ndarray:
            return by_frequency(now, t) + self._rate(balance, now, t)

        return there.evaluate(x, p, derivative=derivative)

    def _rate(self, balance: HarmonicBalance, now: HarmonicBalance, t: Terms) -> np.ndarray:
        """(m, H+1) derivative of the modal q by p, through the forces and matrices that vary."""
        varying = balance.problem.varying
        periods = self.periods
        assert varying is not None, "nothing varies"
        matrices, forces = varying.rate(balance.forces, periods * t.w, periods)
        push = np.zeros_like(t.push)
        orders = t.w * np.arange(t.push.shape[1])
        for k, F in forces.items():
            push[:, k] += now.receptance.into.T @ F
        q = now.receptance.shapes @ (t.factors * t.push)
        if "K" in matrices:
            push = push - now.receptance.into.T @ (matrices["K"] @ q)
        if "C" in matrices:
            push = push - now.receptance.into.T @ (1j * orders * (matrices["C"] @ q))
        return periods * t.factors * push

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value: what varies with the frequency has that of the value."""
        if problem.varying is None:
            return problem, forces
        w = 2 * np.pi * value
        return at_frequency(problem, w), problem.varying.forces_at(forces, w, self.periods)

    @property
    def periods(self) -> int:
        """Of the excitation in one of the motion."""
        return round(2 * np.pi / self.scale)

    def angular_frequency(self, w: float, p: float) -> float:
        """p."""
        return p

    def frequencies(self, hz: float, values: np.ndarray) -> np.ndarray:
        """The values."""
        return values


@dataclass(frozen=True)
class Level(Parameter):
    """A factor on the force.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> level, rows = Level(), {"tip": [1.0]}
    >>> curve = follow_parameter(problem, np.array([1.0]), 860, level, (0.1, 5), outputs=rows)
    >>> grown = curve.amplitude()[-1, 0] / curve.amplitude()[0, 0]
    >>> bool(grown < 50 / 2)  # the contact slips: 50 times the force, less than half of that
    True
    """

    name: str = "level"

    def measured_in(self, forces: dict) -> str:
        """N where the largest force of the value 1 is 1 N, else times that."""
        largest = max(float(np.abs(F).max()) for F in forces.values())
        return "N" if largest == 1 else "times the force"

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value."""
        return problem, {k: value * F for k, F in forces.items()}

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and the factor p."""
        return self._evaluate_at(balance, p)(x, w, derivative=by_level)

    def _evaluate_at(self, balance: HarmonicBalance, p: float) -> Callable[..., Linearisation]:
        """At the factor p."""
        return partial(balance.evaluate, level=p)


class Rebuilt(Parameter):
    """A parameter that changes the linear system: the problem is made anew at each new value and at
    two beside it, for the derivative by central differences."""

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and the value p."""
        value = max(p, SMALLEST)
        h = DIFFERENCE * value
        here, after, before = (
            self._at(balance, v).evaluate(x, w) for v in (value, value + h, value - h)
        )
        rate = (after.displacement() - before.displacement()) / (2 * h)
        return replace(
            here,
            by_parameter=(after.residual - before.residual) / (2 * h),
            modal_rate=np.linalg.lstsq(here.balance.receptance.shapes, rate, rcond=None)[0],
        )

    def _evaluate_at(self, balance: HarmonicBalance, p: float) -> Callable[..., Linearisation]:
        """At the value p."""
        return self._at(balance, max(p, SMALLEST)).evaluate

    def _at(self, balance: HarmonicBalance, value: float) -> HarmonicBalance:
        try:
            return balance.rebuilt(*self.rebuild(balance.problem, balance.forces, value))
        except InputError as error:  # of a value inside the branch, which its ends do not show
            raise InputError(f"{self.named(value)}: {error}") from None


@dataclass(frozen=True)
class Damping(Scaling):
    """A factor on the damping: on the damping ratios where the problem has these, else on C.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> given = dict(outputs={"tip": [1.0]}, harmonics=1, truncation=False)
    >>> curve = follow_parameter(problem, np.array([0.1]), 872, Damping(), (1, 0.5), **given)
    >>> print(np.round(curve.amplitude()[-1] / curve.amplitude()[0], 1))  # no slip: half of it
    [2.]
    """

    name: str = "damping"

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value."""
        return problem.with_damping(value), forces

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and the factor p."""
        value = max(p, SMALLEST)

        def derivative(there: HarmonicBalance, t: Terms) -> np.ndarray:
            return -t.factors * there.damping_push(t.factors * t.push, t.w) / value

        return self._evaluate_at(balance, p)(x, w, derivative=derivative)

    def _evaluate_at(self, balance: HarmonicBalance, p: float) -> Callable[..., Linearisation]:
        """At the factor p."""
        return balance.with_damping(max(p, SMALLEST)).evaluate


@dataclass(frozen=True)
class ModelParameter(Rebuilt):
    """Any parameter of the problem, for example a stiffness K(p) or a setting of the law.

    of_value : function (problem, value) -> problem; it must be defined a little beyond the ends of
        the branch too. It is called three times at each new value, and the modes of the stuck
        system are found each time: on large models a setting of contacts, the damping or the level
        is cheaper

        ModelParameter("spring", lambda problem, k: replace(problem, K=K0 + k * K1))

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> from dataclasses import replace
    >>> spring = ModelParameter("spring", lambda problem, k: replace(problem, K=np.array([[k]])))
    >>> given = dict(outputs={"tip": [1.0]}, harmonics=1, truncation=False)
    >>> curve = follow_parameter(problem, np.array([5.0]), 800, spring, (1e6, 9e5), **given)
    >>> curve.parameter_name, curve.complete
    ('spring', True)
    """

    name: str
    of_value: Callable

    def __post_init__(self) -> None:
        check_call(f"parameter '{self.name}': of_value", self.of_value, "problem", "value")

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value."""
        made = check_kind(
            f"parameter '{self.name}' at {value:g}",
            self.of_value(problem, value),
            ContactProblem,
            "replace(problem, ...)",
        )
        return made, forces


@dataclass(frozen=True)
class ForceParameter(Rebuilt):
    """Any parameter of the force, for example its direction or the phase between two points where
    it acts.

    of_value : function value -> forcing, as in `forced_response`, in the place of that of the call,
        which gives the orders and must not be zero. It must be defined a little beyond the ends of
        the branch too; these are above zero: an angle may be counted from 360 degrees

        ForceParameter("angle", lambda a: 5.0 * (np.cos(a) * along + np.sin(a) * across))

    >>> turn = ForceParameter("angle", lambda a: 5.0 * np.array([np.cos(a), np.sin(a)]))
    >>> tip = Problem(M=0.05 * np.eye(2), K=np.diag([1e6, 2e6]), damping_ratio=0.01)
    >>> problem = tip.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> _, forces = turn.rebuild(problem, {1: np.ones(2)}, np.pi / 2)
    >>> print(forces[1].round(6))
    [0. 5.]
    """

    name: str
    of_value: Callable
    periods: int = field(default=1, init=False)

    def __post_init__(self) -> None:
        check_call(f"parameter '{self.name}': of_value", self.of_value, "value")

    def over(self, periods: int) -> Parameter:
        """Its forces stand at that many times their orders."""
        same = replace(self)
        object.__setattr__(same, "periods", periods)
        return same

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value; InputError where the given ones are zero, or of other
        orders."""
        made = check_forcing(self.of_value(value), len(problem.K), MOST_HARMONICS)
        made = {self.periods * k: F for k, F in made.items()}
        if made.keys() != forces.keys() or not any(np.any(F) for F in forces.values()):
            raise InputError(
                f"parameter '{self.name}': its forcing has the orders {sorted(made)}, the forcing "
                "of the call must have the same and not be zero"
            )
        return problem, made
