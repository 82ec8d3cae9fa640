"""The contract of a contact law: `ContactLaw`. A new law states its data sheet and `step`; the rest
has defaults.

A law knows the relative motion of its contacts and nothing of dofs, harmonics or solvers. How to
write one: docs/studies/own_law/README.md.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.laws import LAWS, sampled
from tipdamp.hbm.laws.friction import each_limited
from tipdamp.hbm.laws.piecewise import PiecewiseLinear
from tipdamp.hbm.laws.records import (
    ContactForces,
    Contacts,
    ContactState,
    Motion,
    SampleGrid,
    SliderStart,
    Tangents,
)
from tipdamp.hbm.laws.variation import Variation, of_smooth_force
from tipdamp.hbm.validation import brief, check_call

__all__ = [
    "ContactForces",
    "ContactLaw",
    "ContactState",
    "Contacts",
    "Motion",
    "SliderStart",
    "Tangents",
]


COMPLEX_STEP = 1j * sampled.SETTINGS.step


@dataclass(frozen=True)
class ContactLaw:
    """Base of every contact law: a frozen dataclass whose fields are the parameters of the law.

    A parameter is one number, or a sequence with one number per contact, which becomes a read-only
    array (P,).

    components : of the relative motion, a subset of ('t1', 't2', 'n') in this order; of what is no
        contact, coordinates of any other names
    states : length of the state of a contact; sliders : its leading entries that are slider
        positions in m, from which slip is told; a law without sliders slips where it dissipates
    tested : whether tests hold its derivatives, as `class MyLaw(ContactLaw, tested=True)` states of
        this class alone; those of other laws are compared with differences before each curve
    steps_together : of time integration, of which `step` is asked at once; 1 where many cost it as
        much as one after the other

    >>> class Dashpot(ContactLaw):
    ...     components = ("t1",)
    ...
    ...     def step(self, motion, state, contacts):
    ...         return contacts.mu[:, None] * motion.v, state
    >>> check_law(Dashpot())  # silent: it keeps the contract
    """

    components: ClassVar[tuple] = ("t1", "t2", "n")
    states: ClassVar[int] = 0
    sliders: ClassVar[int] = 0
    tested: ClassVar[bool] = False
    steps_together: ClassVar[int] = 64

    def __init_subclass__(cls, tested: bool = False, **more: Any) -> None:
        super().__init_subclass__(**more)
        cls.tested = tested

    def __post_init__(self) -> None:
        for name, value in list(vars(self).items()):
            if isinstance(value, list | tuple | np.ndarray):
                object.__setattr__(self, name, _numbers(self.name, name, value))

    @property
    def name(self) -> str:
        """Name in messages and results."""
        return type(self).__name__

    def doubt(self, contacts: Contacts) -> str:
        """What is probably not meant in settings that can be used, in words; empty by default."""
        return ""

    def step(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force (P, nd) N and state (P, ns) after a step: the formula of the law.

        motion : at the end of the step; state (P, ns) : before it. Rows are independent contacts.
        Arrays may be complex, for derivatives by the complex step [Squire, Trapp 1998]: the formula
        must be analytic where it is smooth (sqrt(a*a + b*b), not abs), and comparisons take real
        parts.
        """
        raise InputError(
            f"law {self.name} has no step: define step(self, motion, state, contacts), which "
            "returns force and state"
        )

    def friction(self, trial: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force (P, nt) N of sliders whose springs would carry trial (P, nt) N under the limit mu N
        (P,) N, and which of them slip (P, nt): also of the static solution that a response starts
        from. By default each tangent has the limit by itself (`laws.friction`)."""
        return each_limited(trial, limit)

    def initial_state(self, u: np.ndarray, start: SliderStart, contacts: Contacts) -> np.ndarray:
        """(P, ns) state at t = 0, where the motion is u (P, nd), perhaps complex; default zero."""
        return np.zeros((len(u), self.states), dtype=u.dtype)

    def start_at_rest(
        self,
        sticks: np.ndarray,
        u: np.ndarray,
        force: np.ndarray,
        start: SliderStart,
        contacts: Contacts,
    ) -> SliderStart:
        """Where steps in time start sliders, so that those at rest stay where a cycle has them.

        sticks : (P,) bool, throughout the cycle; u, force : (P, nd) m and N, their means over it
        The default is `start`.
        """
        return start

    def state_at(self, u: np.ndarray, state: np.ndarray, contacts: Contacts) -> np.ndarray:
        """(P, ns) the state moved to a nearby motion u (P, nd), where shooting varies it and the
        motion separately.

        Entries that `initial_state` takes from the motion or from the sliders are as it gives them,
        the others stay."""
        along = COMPLEX_STEP * np.sqrt(np.arange(2, 2 + len(self.components)))
        sliders = SliderStart(state[:, : self.sliders] + COMPLEX_STEP, False)
        found = self.initial_state(u + along, sliders, contacts)
        return np.where(np.imag(found) != 0, np.real(found), state)

    def stuck_stiffness(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N/m, stiffness K_c that the linear system takes over; the solution does not
        depend on it."""
        return np.zeros((len(contacts), len(self.components)))

    def stuck_force(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N at u = 0 of the stuck springs: preload on the normal of a unilateral law, zero
        else."""
        return np.zeros((len(contacts), len(self.components)))

    def force_at_rest(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N, force at u = 0."""
        return self.step(*self._rest(contacts))[0]

    def stiffness_at_rest(self, contacts: Contacts) -> np.ndarray:
        """(P, nd, nd) N/m, derivative of the force at u = 0: zero for a contact that is open
        there."""
        return self.tangents(*self._rest(contacts))[2].force_u

    def _rest(self, contacts: Contacts) -> tuple[Motion, np.ndarray, Contacts]:
        zero = np.zeros((len(contacts), len(self.components)))
        start = SliderStart(np.zeros((len(contacts), self.sliders)), True)
        return Motion(zero, zero, 1.0), self.initial_state(zero, start, contacts), contacts

    def tangents(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray, Tangents]:
        """Force, state and `Tangents` of one step; by complex steps of `step`, exact to
        rounding."""
        return sampled.tangents(self, motion, state, contacts)

    def harmonics(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> ContactForces:
        """Forces of the periodic cycle at the relative motion x (P, nd, nh) m and omega rad/s.

        grid : of `aft.sample_grid`. The default steps through the samples, until the state repeats.
        """
        return sampled.harmonics(self, contacts, x, start, grid, omega)

    def more_orders(
        self,
        contacts: Contacts,
        x: np.ndarray,
        start: SliderStart,
        grid: SampleGrid,
        omega: float,
        known: ContactForces,
    ) -> ContactForces:
        """`harmonics` of a motion with further orders, which are zero in x; known : without
        them."""
        return self.harmonics(contacts, x, start, grid, omega)

    def variation(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> Variation | None:
        """How the forces follow a disturbance of the cycle that `harmonics` is of; None where that
        is not known, as of a law with states that does not say."""
        return None if self.states else of_smooth_force(self, contacts, x, omega)

    def by_friction(
        self, contacts: Contacts, x: np.ndarray, forces: ContactForces
    ) -> np.ndarray | None:
        """(P, nd, nh) N: derivative of the forces at the relative motion x (P, nd, nh) by a factor
        on mu; None: not known in closed form."""
        return None

    def by_stiffness(
        self, contacts: Contacts, x: np.ndarray, force: np.ndarray, forces: ContactForces
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """(P, nd, nh) N each: derivatives of the whole force at the relative motion x (P, nd, nh)
        by a factor on kn and by one on kt; None: not known in closed form.

        force : (P, nd, nh) N the whole force; forces : its derivatives, D and by_preload those of
        the deviation from the stuck springs of these contacts
        """
        return None

    def sticks_surely(self, contacts: Contacts, amplitude: np.ndarray) -> np.ndarray:
        """(P,) bool, guaranteed to stay stuck for any motion with component amplitudes up to
        `amplitude` (P, nd) m about that at which their sliders carry no force; False where that is
        not known."""
        return np.zeros(len(contacts), dtype=bool)

    def piecewise_linear(self, contacts: Contacts) -> PiecewiseLinear | None:
        """Table for event-driven time integration; None: the law is integrated by `step`."""
        return None

    def default_samples(self, H: int) -> int:
        """Samples of a cycle: coupled friction by its step alone is below 1e-3 of the limit force
        at 256."""
        return max(256, 1 << int(np.ceil(np.log2(12 * max(H, 1)))))

    def select(self, at: np.ndarray) -> Self:
        """The law of some contacts, by a mask or by indices: parameters with one entry per contact
        are cut."""
        cut = {}
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                if np.asarray(at).dtype == bool and len(at) != len(value):
                    raise InputError(_misfit(self.name, name, value, len(at)))
                cut[name] = value[at]
        return replace(self, **cut) if cut else self

    def check(self, contacts: Contacts) -> None:
        """InputError where components are none of the motion or in another order, parameters do not
        fit the contacts, or methods return arrays of the wrong shape or, at rest, of numbers that
        are not finite."""
        self._check_components()
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray) and len(value) != len(contacts):
                raise InputError(_misfit(self.name, name, value, len(contacts)))
        for name, method, *arguments in (
            ("step", self.step, "motion", "state", "contacts"),
            ("initial_state", self.initial_state, "u", "start", "contacts"),
            ("stuck_stiffness", self.stuck_stiffness, "contacts"),
            ("stuck_force", self.stuck_force, "contacts"),
        ):
            check_call(f"law {self.name}: {name}", method, *arguments)
        columns = {"components": len(self.components), "states": self.states}
        for what, value, of in self._returned(contacts):
            shape = len(contacts), columns[of]
            if np.shape(value) != shape:
                raise InputError(
                    f"law {self.name}: {what} has the shape {np.shape(value)}, must be (P, {of}) = "
                    f"{shape}"
                )
            if not np.isfinite(value).all():
                raise InputError(
                    f"law {self.name}: {what} at rest is not finite{self._stated()}; what it "
                    "divides by must not be 0"
                )

    def _check_components(self) -> None:
        order = [c for c in ContactLaw.components if c in self.components]
        own = not order and 0 < len(self.components) == len(set(self.components))
        if not own and (not order or list(self.components) != order):
            raise InputError(
                f"law {self.name}: components = {self.components}, must be of "
                f"{ContactLaw.components}, in this order"
            )

    def _returned(self, contacts: Contacts) -> list[tuple[str, Any, str]]:
        """(what, value, what its columns are) of all that the methods return at rest."""
        rest = self._rest(contacts)
        found = [
            ("stuck_stiffness", self.stuck_stiffness(contacts), "components"),
            ("stuck_force", self.stuck_force(contacts), "components"),
            ("initial_state", rest[1], "states"),
        ]
        if np.shape(rest[1]) == (len(contacts), self.states):
            with np.errstate(all="ignore"):  # what is not finite is told by `check`
                force, state = self.step(*rest)
            found += [("force of step", force, "components"), ("state of step", state, "states")]
        return found

    def _stated(self) -> str:
        values = {name: v for name, v in vars(self).items() if isinstance(v, int | float)}
        return " with " * bool(values) + ", ".join(f"{n} = {brief(v)}" for n, v in values.items())

    def check_range(
        self, name: str, low: float = -np.inf, high: float = np.inf, above: bool = False
    ) -> None:
        """InputError where a parameter is not a finite number within low..high (above low, where
        `above`)."""
        value = _numbers(self.name, name, vars(self)[name])
        if (
            not np.isfinite(value).all()
            or (value <= low if above else value < low).any()
            or (value > high).any()
        ):
            bounds = [f"{'above' if above else 'at least'} {low:g}"] * (low > -np.inf) + [
                f"at most {high:g}"
            ] * (high < np.inf)
            raise InputError(
                f"law {self.name}: {name} = {brief(vars(self)[name])}, must be "
                f"{' and '.join(['finite', *bounds])}"
            )


def check_law(law: ContactLaw) -> ContactLaw:
    """The law; InputError where it is none."""
    if isinstance(law, ContactLaw):
        return law
    if isinstance(law, type) and issubclass(law, ContactLaw):
        raise InputError(
            f"law = {law.__name__}: is the class of a law; make one: {law.__name__}(...)"
        )
    raise InputError(
        f"law = {brief(law)}: must be a contact law, one of {', '.join(LAWS)}, MixedLaw, or a "
        "class of your own derived from tipdamp.ContactLaw"
    )


def _numbers(law: str, name: str, value: Any) -> np.ndarray:
    """(P,) read-only array; InputError where it does not hold one number per contact."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.ndim > 1 or isinstance(value, bool | str):
        raise InputError(
            f"law {law}: {name} = {brief(value)}, must be a number or one number per contact"
        )
    array.flags.writeable = False
    return array


def _misfit(law: str, name: str, value: np.ndarray, P: int) -> str:
    return f"law {law}: {name} has {len(value)} values, must be one number or one per contact ({P})"
