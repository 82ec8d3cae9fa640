"""A nonlinear system written down piece by piece: matrices, laws where they act, forces.

duffing = Problem(M=[[1.0]], C=[[0.02]], K=[[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.2)
curve = duffing.follow_band((0.05, 0.3), outputs={"x": 0}, harmonics=5)
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Unpack, cast

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from tipdamp.hbm import response, self_excited, tables
from tipdamp.hbm.balance.open_damping import open_modes
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem
from tipdamp.hbm.balance.varying import Amplitude, Varying, amplitude_at, constant
from tipdamp.hbm.curve.checked_input import forcing_of
from tipdamp.hbm.curve.options import CurveKeywords, with_options_named
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.laws.base import ContactLaw, check_law
from tipdamp.hbm.laws.force import CubicSpring
from tipdamp.hbm.laws.mixed import MixedLaw
from tipdamp.hbm.laws.records import Contacts
from tipdamp.hbm.periodic_solution import PeriodicSolution
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.validation import brief, check_call, check_whole, numbers, row_of_dofs

Where = int | tuple[int, int] | ArrayLike
"""A dof, two dofs (a, b) for the motion q_a - q_b, or a row (r,) that takes a motion out of q."""

CANCELS = 1e-12  # of the largest force of a wave: what is left is rounding


@dataclass(frozen=True)
class Attached:
    """A law and where it acts.

    law : of one contact
    rows : (nd, r) - take the components of its motion out of q, in the order of the law
    settings : of that contact
    """

    law: ContactLaw
    rows: np.ndarray
    settings: Contacts


@dataclass(frozen=True, eq=False)
class Problem(AnyProblem):
    """M q'' + C q' + K q + sum of nonlinear forces = Re sum F_k exp(i k w t), put together by `add`
    and `force`.

    M, C, K : (r, r) kg, N s/m, N/m, dense or nested lists; C may be left out where damping_ratio is
    given
    damping_ratio : of the modes of the system in which every contact sticks; a stop with clearance
        is closed in it, too: where modes that never touch it get another ratio, a warning says so
    static : (r,) N - constant force
    preloaded : whether q = 0 is the state at rest (see `ContactProblem`)
    general, structural : matrices that are not symmetric, and damping by a loss factor (see
        `ContactProblem`)
    attached, forces, varying : what `add`, `force` and `of_speed` have collected; without a law
        the system is linear, and its responses are those

    Each call returns a new Problem. Raises InputError where shapes disagree.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> free, stuck = 711.8, 871.7  # Hz
    >>> hz, height = damped.follow_band((600, 1000), outputs={"tip": 0}).peak("tip")
    >>> free < hz < stuck
    True
    """

    M: ArrayLike
    C: ArrayLike | None = None
    K: ArrayLike | None = None
    damping_ratio: ArrayLike | None = None
    static: ArrayLike | None = None
    preloaded: bool = True
    general: bool = False
    structural: ArrayLike | None = None
    attached: tuple[Attached, ...] = ()
    forces: Mapping[int, np.ndarray] = field(default_factory=dict)
    varying: Varying | None = None

    def __post_init__(self) -> None:
        for name in "MCK":
            given = vars(self)[name]
            if given is not None and not sp.issparse(given):
                object.__setattr__(
                    self, name, np.atleast_2d(numbers(name, given, "must be a real matrix"))
                )
        if self.K is None:
            raise InputError(
                "K is missing: Problem(M, C, K), or Problem(M=..., K=..., damping_ratio=...)"
            )

    def __repr__(self) -> str:
        laws = ", ".join(one.law.name for one in self.attached) or "linear"
        orders = f", forces of orders {', '.join(map(str, self.forces))}" if self.forces else ""
        return f"<Problem of {self.size} dofs: {laws}{orders}>"

    def _repr_html_(self) -> str:
        rows = {f"law {k}": one.law.name for k, one in enumerate(self.attached)}
        rows |= {f"force of order {k}": f"{np.abs(f).max():.4g} N" for k, f in self.forces.items()}
        return tables.notebook_table(f"Problem of {self.size} dofs", rows)

    @property
    def size(self) -> int:
        """Number of dofs r."""
        return int(cast(np.ndarray, self.K).shape[0])

    def add(
        self,
        law: ContactLaw,
        where: Where | Sequence[Where],
        *,
        kn: float = 0.0,
        kt: float = 0.0,
        mu: float = 0.0,
        preload: float = 0.0,
    ) -> Problem:
        """With a law that acts on a motion.

        where : for a law of one component a dof, two dofs (a, b) for q_a - q_b, or a row (r,);
            for a law of several components a list of that many of these, in the order
            `law.components`
        kn, kt, mu, preload : N/m, N/m, -, N - of a contact (negative preload: open at rest by
            -preload / kn); laws that are no contact need none
        Raises InputError where the law or the place cannot be used.
        """
        check_law(law)
        rows = self._rows_of(law, where)
        settings = Contacts(*(np.array([value]) for value in (kn, kt, mu, preload)))
        law.check(settings)
        if doubt := law.doubt(settings):
            warnings.warn(doubt, Doubt, stacklevel=2)
        return replace(self, attached=(*self.attached, Attached(law, rows, settings)))

    def force(
        self, where: Where, amplitude: complex | Amplitude = 1.0, *, harmonic: int = 1
    ) -> Problem:
        """With Re amplitude exp(i harmonic w t), N, on a motion; added to what acts there already.

        where : a dof, two dofs (a, b), or a row (r,); a row is the pattern of the force
        amplitude : a number, or where it depends on the frequency a function of w rad/s, as
            `Unbalance` or `ForceTable`
        """
        return self._with_force(self.row(where), amplitude, harmonic)

    def base_motion(
        self, direction: ArrayLike, amplitude: complex | Amplitude, *, harmonic: int = 1
    ) -> Problem:
        """On a base that moves by Re amplitude exp(i harmonic w t), m: q is then the motion
        relative to it, and laws to the ground act on that.

        direction : (r,) motion of the dofs with the base by 1 m along its way
        amplitude : a number, or a function of the w of the excitation, rad/s; of an acceleration
            a : lambda w: -a / (harmonic * w)**2
        The force is that of inertia, (harmonic w)^2 M direction amplitude.

        >>> shaken = Problem(M=[[2.0]], C=[[8.0]], K=[[2e5]]).base_motion([1.0], 1e-4)
        """
        allowed = f"must be a row of {self.size} numbers"
        given = numbers("direction", direction, allowed)
        along = cast(Any, self.M) @ self._moving(given, "direction")
        of = amplitude if callable(amplitude) else constant("m", amplitude)
        check_call("base_motion: its amplitude", of, "w")
        return self._with_varying(
            (harmonic, along, lambda w: (harmonic * w) ** 2 * amplitude_at(of, w))
        )

    def travelling_wave(
        self,
        places: Sequence[Where],
        engine_order: int,
        amplitude: complex | Amplitude = 1.0,
        *,
        harmonic: int = 1,
    ) -> Problem:
        """With a force on each of N blades that an engine order excites: that on blade n is ahead
        by n 2 pi engine_order/N.

        places : of the N blades, one after the other; amplitude, harmonic : as in `force`
        """
        check_whole("engine_order", engine_order, 0)
        if not isinstance(places, Sequence | np.ndarray) or isinstance(places, str):
            raise InputError(f"places = {brief(places)}: must be a list, a place for each blade")
        turn = np.exp(2j * np.pi * engine_order * np.arange(len(places)) / max(len(places), 1))
        rows = [
            phase * self._moving(one, "places") for phase, one in zip(turn, places, strict=True)
        ]
        wave = np.sum(rows, axis=0)
        if np.abs(wave).max(initial=0.0) <= CANCELS * np.abs(rows).max(initial=0.0):
            raise InputError("travelling_wave: places is empty, or their forces cancel")
        return self._with_force(wave, amplitude, harmonic)

    def of_speed(
        self,
        *,
        C: Callable[[float], ArrayLike] | None = None,
        K: Callable[[float], ArrayLike] | None = None,
        engine_order: int = 1,
    ) -> Problem:
        """With matrices that are functions of the speed of rotation, rad/s, which is w /
        engine_order: gyroscopic forces, centrifugal stiffening. What a call leaves out stays as one
        before gave it. A loss factor `structural` is of the K given at rest.

        >>> turning = Problem(np.eye(2), 8 * np.eye(2), 1e5 * np.eye(2), general=True)
        >>> G = np.array([[0.0, 1.5], [-1.5, 0.0]])
        >>> rotor = turning.of_speed(C=lambda speed: 8 * np.eye(2) + speed * G)
        """
        before = self.varying or Varying()
        if before.of_matrices and before.engine_order != engine_order:
            raise InputError(
                f"of_speed: engine_order = {brief(engine_order)}, and {before.engine_order} in a "
                "call before: a problem has one"
            )
        C, K = (before.C if C is None else C), (before.K if K is None else K)
        return replace(self, varying=replace(before, C=C, K=K, engine_order=engine_order))

    def _with_force(
        self, pattern: np.ndarray, amplitude: complex | Amplitude, harmonic: int
    ) -> Problem:
        if callable(amplitude):
            check_call("force: its amplitude", amplitude, "w")
            return self._with_varying((harmonic, pattern, amplitude))
        more = constant("N", amplitude)(0.0) * pattern
        sum_of = {**self.forces, harmonic: self.forces.get(harmonic, 0.0) + more}
        return replace(self, forces=sum_of)

    def _with_varying(self, one: tuple) -> Problem:
        before = self.varying or Varying()
        return replace(self, varying=replace(before, forces=(*before.forces, one)))

    def row(self, where: Where) -> np.ndarray:
        """(r,) row that takes a motion out of q. Raises InputError where it is none."""
        return self._moving(where, "where")

    def _moving(self, where: Where, called: str) -> np.ndarray:
        """As `row`; called : the argument, in messages."""
        row = self._row(where, called)
        if not row.any():
            raise _nothing_moves(where, called)
        return row

    def _row(self, where: Where, called: str) -> np.ndarray:
        r = self.size

        def unit(dof: int) -> np.ndarray:
            if not 0 <= dof < r:
                raise InputError(
                    f"{called} = {brief(where)}: dof {dof} must be between 0 and {r - 1}"
                )
            row = np.zeros(r)
            row[dof] = 1.0
            return row

        by_dofs = row_of_dofs(where, unit)
        if by_dofs is not None:
            return by_dofs
        allowed = f"must be a dof 0..{r - 1}, two dofs (a, b), or a row of {r} numbers"
        row = numbers(called, where, allowed)
        if row.shape != (r,) or not np.isfinite(row).all():
            raise InputError(f"{called} = {brief(where)}: {allowed}")
        return row

    @property
    def contact_problem(self) -> ContactProblem:
        """The same as matrices, contacts and one law; without a law with a spring of no force."""
        if not self.attached:
            return self.add(CubicSpring(0.0), 0).contact_problem
        law, B = self._law_and_motion()
        names = ("kn", "kt", "mu", "preload")
        settings = Contacts(
            *(np.concatenate([vars(one.settings)[name] for one in self.attached]) for name in names)
        )
        static = self.static
        found = ContactProblem(
            cast(np.ndarray, self.M),
            cast(Any, self.C),
            cast(np.ndarray, self.K),
            B,
            law,
            settings,
            None if static is None else numbers("static", static, "must be numbers in N"),
            self.preloaded,
            self.damping_ratio,
            general=self.general,
            structural=self.structural,
            varying=self.varying,
        )
        opens = open_modes(found)
        if opens and (other := opens.farthest):
            doubt = (
                f"damping_ratio: {other.asked:.4g} is that of a mode with every contact closed; "
                f"while those stay open that are open at rest, mode {other.mode}, {other.hz:.4g} "
                f"Hz, has {other.own:.4g}: give C where that matters"
            )
            warnings.warn(doubt, Doubt, stacklevel=3)
        return found

    def _law_and_motion(self) -> tuple[ContactLaw, np.ndarray]:
        """(one law of all contacts, (P nd, r) that takes the components of their motion out of
        q)."""
        laws, of_contact = _kinds([one.law for one in self.attached])
        if len(laws) == 1:
            return laws[0], np.vstack([one.rows for one in self.attached])
        law = MixedLaw(laws, of_contact)
        return law, np.vstack([_all_components(one, law.components) for one in self.attached])

    @with_options_named
    def follow_band(
        self,
        band: Sequence[float] | None = None,
        *,
        omega: Sequence[float] | None = None,
        **options: Unpack[CurveKeywords],
    ) -> ForcedResponse:
        """The forced response over a band (low, high) in Hz, or over omega (low, high) in rad/s.

        options : of CurveOptions; outputs {name: a dof, two dofs (a, b), or a row (r,)}
        """
        problem, options = self.contact_problem, self._with_rows(options)
        forcing = forcing_of(self.forces, problem, None)
        return response.follow_band(problem, forcing, band, omega=omega, **options)

    @with_options_named
    def solve_at(
        self,
        hz: float | None = None,
        *,
        omega: float | None = None,
        **options: Unpack[CurveKeywords],
    ) -> PeriodicSolution:
        """The periodic response at one frequency, hz or omega in rad/s; options as in
        `tipdamp.hbm.response.solve_at`."""
        problem, options = self.contact_problem, self._with_rows(options)
        forcing = forcing_of(self.forces, problem, None)
        return response.solve_at(problem, forcing, hz, omega=omega, **options)

    @with_options_named
    def limit_cycle(
        self,
        hz: float | None = None,
        amplitude: float = 1.0,
        *,
        omega: float | None = None,
        **options: Unpack[CurveKeywords],
    ) -> PeriodicSolution:
        """A self-excited motion near a frequency, hz or omega in rad/s, which is found, and near
        an amplitude in m at the laws: see `tipdamp.hbm.self_excited.limit_cycle`."""
        if not self.attached:
            raise InputError("limit_cycle: a linear system has none; add(law, where)")
        if self.forces or (self.varying and self.varying.forces):
            raise InputError("limit_cycle: is a motion without forces, the problem has some")
        problem, options = self.contact_problem, self._with_rows(options)
        return self_excited.limit_cycle(problem, hz, amplitude, omega=omega, **options)

    def _rows_of(self, law: ContactLaw, where: Any) -> np.ndarray:
        """(nd, r), a row for each component of the law."""
        if len(law.components) == 1:
            return self.row(where)[None]
        wanted = ", ".join(law.components)
        if isinstance(where, int | np.integer | str) or len(where) != len(law.components):
            raise InputError(
                f"where = {brief(where)}: law {law.name} moves along {wanted}: a list of "
                f"{len(law.components)} dofs, pairs of dofs, or rows"
            )
        rows = np.array([self._row(one, "where") for one in where])
        if not rows.any():
            raise _nothing_moves(where, "where")
        return rows

    def _with_rows(self, options: CurveKeywords) -> CurveKeywords:
        """The options with a row (r,) for each output."""
        outputs = options.get("outputs")
        if not isinstance(outputs, dict):
            return options
        rows = {
            name: self._moving(cast(Where, where), f"output '{name}'")
            for name, where in outputs.items()
        }
        return cast(CurveKeywords, {**options, "outputs": rows})


def _kinds(laws: list[ContactLaw]) -> tuple[tuple[ContactLaw, ...], tuple[int, ...]]:
    """(the different laws, which of them each one is): equal ones are evaluated together."""
    kinds, of_contact = list[ContactLaw](), list[int]()
    for law in laws:
        place = next((i for i, kind in enumerate(kinds) if _equal(kind, law)), len(kinds))
        kinds += [law] * (place == len(kinds))
        of_contact.append(place)
    return tuple(kinds), tuple(of_contact)


def _equal(a: ContactLaw, b: ContactLaw) -> bool:
    """Whether two laws are one. Those with a parameter for each contact have no hash."""
    try:
        return a is b or hash(a) == hash(b) and a == b
    except TypeError:
        return False


def _nothing_moves(where: Any, called: str) -> InputError:
    return InputError(
        f"{called} = {brief(where)}: a row of zeros takes no motion out of q; a dof is given as "
        "its number alone, 0 for the first"
    )


def _all_components(one: Attached, components: tuple[str, ...]) -> np.ndarray:
    """(nd, r) rows of all components; zero where the law has no such one."""
    rows = np.zeros((len(components), one.rows.shape[1]))
    rows[[components.index(name) for name in one.law.components]] = one.rows
    return rows
