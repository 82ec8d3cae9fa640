"""What may vary along a branch: the frequency, level or direction of the force, a setting of
contacts, damping, K(p).

    follow_parameter(problem, F, 930.0, "mu", (1.0, 0.1), ...)  # of all contacts, by a factor
    follow_parameter(problem, F, 930.0, ContactSetting("kt", contacts=(3,)), ...)  # of one contact
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np

from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.residual import HarmonicBalance, Terms, by_frequency, by_level
from tipdamp.hbm.balance.varying import at_frequency
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.laws.records import Contacts
from tipdamp.hbm.result import FACTOR
from tipdamp.hbm.validation import (
    MOST_HARMONICS,
    brief,
    check_call,
    check_forcing,
    check_kind,
    numbers,
)

Rebuild: TypeAlias = tuple[ContactProblem, dict]
SETTINGS = ("preload", "mu", "kn", "kt")
HELD = {"pull": "preload", "gap": "preload"}  # by what contacts hold it
NAMES = (*SETTINGS, *HELD)
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
        return balance.evaluate(x, w)

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
        varying, periods = balance.problem.varying, self.periods
        assert varying is not None, "nothing varies"
        matrices, forces = varying.rate(balance.forces, periods * t.w, periods)
        push, orders = np.zeros_like(t.push), t.w * np.arange(t.push.shape[1])
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
        return balance.evaluate(x, w, level=p, derivative=by_level)

    def held(self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float) -> Linearisation:
        """At the factor p, by the angular frequency."""
        return balance.evaluate(x, w, level=p)


@dataclass(frozen=True)
class ContactSetting(Scaling):
    """A factor on kn, kt, mu or the preload of every contact, or of some.

    setting : 'kn', 'kt', 'mu', 'preload', 'pull' or 'gap'; contacts : index or indices of these
        contacts of the problem, None takes all
    A pull is a factor on the preloads, as where the contacts stay closed that carry it; a pull that
    moves them makes other preloads. A gap is that of contacts open at rest, the negative preload
    -kn gap.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> ContactSetting("mu", contacts=0).scaled(problem, 0.5).mu  # what it is at 0.5
    array([0.25])
    """

    setting: str
    contacts: tuple | int | None = None
    name: str = field(init=False)

    def __post_init__(self) -> None:
        if self.setting not in NAMES:
            raise InputError(
                f"contact setting '{self.setting}' is unknown; {nearest(str(self.setting), NAMES)}"
            )
        some = ""
        if self.contacts is not None:
            chosen = np.atleast_1d(
                numbers("contacts", self.contacts, "must be indices of contacts")
            )
            if chosen.ndim > 1 or not chosen.size or (chosen % 1).any():
                raise InputError(f"contacts = {brief(self.contacts)}: must be indices of contacts")
            contacts = tuple(map(int, chosen))
            object.__setattr__(self, "contacts", contacts)
            some = f" of contacts {', '.join(map(str, contacts))}"
        object.__setattr__(self, "name", self.setting + some)

    @property
    def stiffens(self) -> bool:
        """kn and kt do."""
        return self.setting in ("kn", "kt")

    @property
    def _held(self) -> str:
        """The field of the contacts that varies."""
        return HELD.get(self.setting, self.setting)

    def check(self, problem: ContactProblem) -> None:
        """Preloads are those of the preloaded origin, gaps are there, and the contacts those of the
        problem."""
        if self.setting in ("preload", "pull") and not problem.preloaded:
            raise InputError(
                f"parameter '{self.setting}': the unloaded origin has gaps, not preloads; "
                "use origin = 'preloaded'"
            )
        P = len(problem.contacts)
        chosen = np.atleast_1d(0 if self.contacts is None else self.contacts)
        if chosen.min() < 0 or chosen.max() >= P:
            raise InputError(
                f"contacts = {brief(self.contacts)}: must be indices from 0 to {P - 1}"
            )
        if self.setting == "gap" and not self.chosen(problem).any():
            raise InputError(
                f"parameter '{self.name}': no contact is open at rest; give one a negative preload "
                "-kn gap"
            )

    def rebuild(self, problem: ContactProblem, forces: dict, value: float) -> Rebuild:
        """(problem, forces) at a value."""
        return problem.with_contacts(self.scaled(problem, value)), forces

    def evaluate(
        self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float
    ) -> Linearisation:
        """Linearisation at x (n,) and the factor p."""
        # a long Newton step may ask for a negative stiffness: the settings end at zero
        value = max(p, SMALLEST)

        def derivative(balance: HarmonicBalance, t: Terms) -> np.ndarray:
            return -balance.modal_response(t, self.force_rate(balance, t, value))

        return balance.evaluate(
            x, w, contacts=self.scaled(balance.problem, value), derivative=derivative
        )

    def held(self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float) -> Linearisation:
        """With the factor p, by the angular frequency."""
        return balance.evaluate(x, w, contacts=self.settings_at(balance.problem, p))

    def settings_at(self, problem: ContactProblem, p: float) -> Contacts:
        """Those with the factor."""
        return self.scaled(problem, max(p, SMALLEST))

    def chosen(self, problem: ContactProblem) -> np.ndarray:
        """(P,) bool, the contacts whose setting varies."""
        mine = np.full(len(problem.contacts), self.contacts is None)
        if self.contacts is not None:
            mine[np.atleast_1d(self.contacts)] = True
        return mine & (problem.contacts.preload < 0) if self.setting == "gap" else mine

    def scaled(self, problem: ContactProblem, value: float) -> Contacts:
        """The settings of the contacts at a value."""
        factor = np.where(self.chosen(problem), value, 1.0)
        changed = {self._held: factor * vars(problem.contacts)[self._held]}
        if self.setting == "kn" and not problem.preloaded:
            changed["preload"] = factor * problem.contacts.preload  # -kn gap
        return replace(problem.contacts, **changed)

    def force_rate(self, balance: HarmonicBalance, t: Terms, value: float) -> np.ndarray:
        """(P, nd, nh) derivative of the contact forces by the factor at a given motion."""
        problem = balance.problem
        if self._held == "preload" and t.forces.by_preload is not None:
            rate = (problem.contacts.preload * self.chosen(problem))[
                :, None, None
            ] * t.forces.by_preload
            rate[:, :, 0] += balance.own.beyond_rest * self.chosen(problem)[:, None]
            return rate
        if self.setting == "mu":
            scaled = self.scaled(problem, value)
            rate = problem.law.by_friction(scaled, t.u, t.forces)
            if rate is not None:
                return rate * self.chosen(problem)[:, None, None] / value
        if self.stiffens:
            rate = self._stiffness_rate(balance, t, self.scaled(problem, value))
            if rate is not None:
                return rate * self.chosen(problem)[:, None, None] / value
        h = DIFFERENCE * max(value, 1e-3)
        value = max(value, h)
        after, before = (
            balance.contact_forces(t.u, t.w, self.scaled(problem, value + s)).g for s in (h, -h)
        )
        return (after - before) / (2 * h)

    def _stiffness_rate(
        self, balance: HarmonicBalance, t: Terms, contacts: Contacts
    ) -> np.ndarray | None:
        """(P, nd, nh) derivative of the contact forces by a relative change of kn or kt; None where
        the law does not know it."""
        law, cycle = balance.problem.law, balance.cycle(contacts)
        if t.forces.by_preload is None:
            return None
        force = t.forces.g + balance.springs[:, :, None] * t.u
        force[:, :, 0] += cycle.rest
        further = cycle.further_springs
        own = t.forces if further is None else t.forces.with_springs(-further, t.u)
        rates = law.by_stiffness(contacts, t.u, force, own)
        if rates is None:
            return None
        if self.setting == "kt":
            return rates[1]
        with_gap = np.zeros_like(force)
        if not balance.problem.preloaded:  # the preload is -kn gap
            with_gap = contacts.preload[:, None, None] * t.forces.by_preload
            with_gap[:, :, 0] += law.stuck_force(contacts)
        return rates[0] + with_gap


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

    def held(self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float) -> Linearisation:
        """At the value p, by the angular frequency."""
        return self._at(balance, max(p, SMALLEST)).evaluate(x, w)

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

        return balance.with_damping(value).evaluate(x, w, derivative=derivative)

    def held(self, balance: HarmonicBalance, x: np.ndarray, w: float, p: float) -> Linearisation:
        """At the factor p, by the angular frequency."""
        return balance.with_damping(max(p, SMALLEST)).evaluate(x, w)


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
        b, w = self.balance, self.parameter.angular_frequency(self.w, p)
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
