"""Self-excited motions: periodic without a force that prescribes the frequency.

The frequency is an unknown beside the motion, and the phase is free: that of one contact is held.
Where the motion begins is told by one mode: the amplitude at which the nonlinear forces put in as
much energy as the damping takes (describing function).
"""

import warnings
from dataclasses import dataclass, replace
from typing import Any, Unpack

import numpy as np
from scipy.optimize import brentq

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.differences import check_derivatives
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Frequency
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import damped
from tipdamp.hbm.continuation.point import Plane, Point, size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.checked_input import CheckedInput
from tipdamp.hbm.curve.equilibrium import force_residuals
from tipdamp.hbm.curve.guess import place_and_unknowns, with_orders
from tipdamp.hbm.curve.options import CurveKeywords, CurveOptions, curve_options, with_options_named
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.laws.base import ContactLaw
from tipdamp.hbm.laws.records import ContactForces, Contacts, Motion, SampleGrid, SliderStart
from tipdamp.hbm.periodic_solution import PeriodicSolution
from tipdamp.hbm.response import as_solution
from tipdamp.hbm.time.poles import poles
from tipdamp.hbm.validation import brief, in_hz, positive

LADDER = np.logspace(-6, 6, 73)  # times the amplitude: where the energy balance is looked at
CALLS = 200  # of the residual, from each place where it holds
ALIKE = 1e-6  # of a frequency: modes no farther apart have the same
NEITHER = 1e-12  # growth over rad/s, below which it is rounding: nothing damps or excites
FAR = 0.5  # of hz: a motion farther away may be another one than was meant
VANISHED = 1e-3  # of the motion begun with: what is left is the rest, or almost


@with_options_named
def limit_cycle(
    problem: AnyProblem,
    hz: float | None = None,
    amplitude: float = 1.0,
    *,
    omega: float | None = None,
    **options: Unpack[CurveKeywords],
) -> PeriodicSolution:
    """A self-excited motion of a problem without forces; `frequency` of the solution is found.

    hz : near it in Hz, or omega in rad/s, as the natural frequency of the mode that is excited
    amplitude : m, size of the motion at the contacts, to six decades
    options : outputs, harmonics, guess (unknowns of a motion at hz), samples, settings of
        CurveOptions. The time begins where the largest motion of a contact in order 1 does
    Of several it is the smallest one into which disturbances grow by the energy balance of one
    mode. Raises InputError where none is found.

    >>> van_der_pol = OwnForce(lambda u, v: 0.5 * (u**2 - 1) * v, 1)
    >>> oscillator = Problem([[1.0]], [[0.0]], [[1.0]]).add(van_der_pol, 0)
    >>> rows = {"x": [1.0]}
    >>> cycle = limit_cycle(oscillator.contact_problem, 0.16, outputs=rows, harmonics=9)
    >>> print(f"{abs(cycle.harmonics[0, 1]):.2f}, period {1 / cycle.frequency:.4f}")
    2.00, period 6.3807
    """
    chosen, hz = curve_options(options), positive("hz", in_hz("hz", hz, omega), " Hz")
    problem, case = _checked(problem, chosen)
    size_of = positive("amplitude", amplitude, " m")
    start = "zero_slider" if chosen.start is None else chosen.start
    plain, balance = (
        HarmonicBalance(one, {}, case.H, start, chosen.samples)
        for one in (problem, with_springs_taken_over(problem))
    )
    balances = _energy_balances(plain, hz, size_of)
    if chosen.guess is not None:
        x = with_orders(place_and_unknowns(chosen.guess, hz, hz)[1], balance)
        balances = [(2 * np.pi * hz, x)]
    if balances and not problem.law.tested:
        w, x = balances[0]
        u = x.reshape(len(problem.contacts), balance.nd, balance.nh)
        check_derivatives(problem.law, problem.contacts, u, w)
    for w, x in balances:
        point = _solved(balance, w, x, case.settings)
        if point is None:
            continue
        residual = force_residuals(Equation(balance, Frequency()), [point])[0][0]
        found = point.parameter / (2 * np.pi)
        if abs(found / hz - 1) > FAR:
            doubt = (
                f"limit_cycle: the motion found has {found:.6g} Hz, far from hz = {hz:g}: it "
                "may be another one than was meant"
            )
            warnings.warn(doubt, Doubt, stacklevel=3)
        return as_solution(point, balance, found, case, float(residual))
    raise InputError(
        f"limit_cycle: none was found near {hz:g} Hz and between {LADDER[0] * amplitude:g} and "
        f"{LADDER[-1] * amplitude:g} m ({len(balances)} tried): no energy balance of one mode "
        "leads there; give hz of another mode, or a guess"
    )


def _checked(problem: AnyProblem, chosen: CurveOptions) -> tuple[ContactProblem, CheckedInput]:
    """InputError for what no self-excited motion has."""
    if chosen.stability != "none":
        raise InputError(
            f"limit_cycle: stability = {brief(chosen.stability)}: multipliers are those of forced "
            "motions, and are not computed of self-excited ones; leave it out"
        )
    problem = contact_problem_of(problem)
    if problem.structural is not None or problem.varying is not None:
        raise InputError(
            "limit_cycle: needs damping and matrices that do not depend on the frequency; give C, "
            "and the matrices at one speed"
        )
    case = CheckedInput.checked(problem, {}, chosen)
    if case.H < 1:
        raise InputError("harmonics = 0: a limit cycle vibrates, at least 1")
    return problem, case


def _solved(balance: HarmonicBalance, w: float, x: np.ndarray, settings: Settings) -> Point | None:
    """The motion to which unknowns x (n,) and w rad/s lead; None where that is none, or at rest."""
    orders = np.abs(fourier.to_complex(x.reshape(-1, balance.nh))[:, 1])
    row = np.zeros_like(x)
    row[int(orders.argmax()) * balance.nh + 2] = 1.0  # its sine: the phase
    point = damped(balance.evaluate, Plane(x, w, row, 0.0), balance.weights, settings, CALLS)
    if not point.converged or point.parameter <= 0:
        return None
    least = VANISHED * size(balance.weights * x)
    return point if size(balance.weights * point.x) > least else None


def _energy_balances(balance: HarmonicBalance, hz: float, amplitude: float) -> list:
    """(w, unknowns) where the nonlinear forces balance the damping in the mode nearest to hz; those
    into which disturbances grow first."""
    mode = _OneMode.nearest(balance, hz)
    if mode is None:
        return []
    sizes = amplitude * LADDER
    rates = np.array([mode.exponent(a) for a in sizes])
    growth = rates.real
    if (np.abs(growth) <= NEITHER * np.abs(rates.imag)).all():
        return []
    at = np.flatnonzero(np.sign(growth[:-1]) * np.sign(growth[1:]) < 0)
    at = np.array(sorted(at, key=lambda i: (growth[i] < 0, i)), dtype=int)
    roots = [brentq(lambda a: mode.exponent(a).real, sizes[i], sizes[i + 1], rtol=1e-6) for i in at]
    return [(mode.exponent(a).imag, mode.motion(a).ravel()) for a in roots]


@dataclass(frozen=True)
class _OneMode:
    """A mode of the stuck system, alone.

    s : its pole; shape (nc,) : motion of the contacts, 1 at the one that moves most, which it moves
    by `unit`; into (nc,) : how contact forces drive it
    """

    balance: HarmonicBalance
    s: complex
    shape: np.ndarray
    unit: complex
    into: np.ndarray

    @classmethod
    def nearest(cls, balance: HarmonicBalance, hz: float) -> "_OneMode | None":
        """To a frequency; None where nothing swings."""
        found, B = poles(balance.receptance), balance.problem.B
        swings = np.flatnonzero(found.s.imag > 0)
        if not len(swings):
            return None
        away = np.abs(found.s.imag[swings] - 2 * np.pi * hz)
        # two modes that flutter have one frequency: the one that grows
        near = swings[away <= away.min() + ALIKE * 2 * np.pi * hz]
        j = near[found.s.real[near].argmax()]
        shape = B @ found.out[:, j]
        unit = shape[np.abs(shape).argmax()]
        return cls(balance, found.s[j], shape / unit, unit, B @ found.into[:, j])

    def motion(self, a: float) -> np.ndarray:
        """(nc, nh) of the contacts at an amplitude."""
        X = np.zeros((self.balance.n_components, self.balance.H + 1), dtype=complex)
        X[:, 1] = a * self.shape
        return fourier.to_real(X)

    def exponent(self, a: float) -> complex:
        """Growth and rad/s under the forces of the motion of the amplitude a."""
        hb, rate = self.balance, self.s
        u = self.motion(a).reshape(len(hb.problem.contacts), hb.nd, hb.nh)
        for _ in range(3):  # forces of the velocity depend on it
            g = fourier.to_complex(hb.contact_forces(u, rate.imag).g).reshape(len(self.into), -1)
            rate = self.s - (self.into @ g[:, 1]) * self.unit / (2 * a)
        return rate


@dataclass(frozen=True, eq=False)
class SpringsTakenOver(ContactLaw):
    """A law with further springs that the linear system takes over; the solution does not depend
    on them.

    A self-excited motion is near a resonance of the linear system, where its receptance is nothing
    to begin from; with the springs it is away from it.
    """

    law: Any
    further: np.ndarray

    def __post_init__(self) -> None:
        """Parameters are those of the law, and what it works with."""
        for name in ("components", "states", "sliders"):
            object.__setattr__(self, name, getattr(self.law, name))

    def step(
        self, motion: Motion, state: np.ndarray, contacts: Contacts
    ) -> tuple[np.ndarray, np.ndarray]:
        """Of the law."""
        return self.law.step(motion, state, contacts)

    def initial_state(self, u: np.ndarray, start: SliderStart, contacts: Contacts) -> np.ndarray:
        """Of the law."""
        return self.law.initial_state(u, start, contacts)

    def stuck_stiffness(self, contacts: Contacts) -> np.ndarray:
        """(P, nd) N/m with the springs."""
        return self.law.stuck_stiffness(contacts) + self.further

    def stuck_force(self, contacts: Contacts) -> np.ndarray:
        """Of the law."""
        return self.law.stuck_force(contacts)

    def force_at_rest(self, contacts: Contacts) -> np.ndarray:
        """Of the law."""
        return self.law.force_at_rest(contacts)

    def harmonics(
        self, contacts: Contacts, x: np.ndarray, start: SliderStart, grid: SampleGrid, omega: float
    ) -> ContactForces:
        """Of the law, beside stiffer springs."""
        found = self.law.harmonics(contacts, x, start, grid, omega)
        return found.with_springs(-self.further, x)

    def select(self, at: np.ndarray) -> "SpringsTakenOver":
        """Of some contacts."""
        return SpringsTakenOver(self.law.select(at), self.further[at])

    def default_samples(self, H: int) -> int:
        """Of the law."""
        return self.law.default_samples(H)

    def check(self, contacts: Contacts) -> None:
        """Of the law."""
        self.law.check(contacts)


def with_springs_taken_over(problem: ContactProblem) -> ContactProblem:
    """With a spring taken over at each component, as stiff as the structure is there."""
    receptance, B = problem.receptance(), problem.B
    static = receptance.factors(0.0)[0][:, 0]
    flexible = ((B @ receptance.shapes) * static * (B @ receptance.into)).sum(axis=1).real
    floor = 1e-12 * np.abs(flexible).max(initial=0.0) or 1.0
    k = 1 / np.maximum(np.abs(flexible), floor)
    further = k.reshape(len(problem.contacts), -1)
    return replace(problem, law=SpringsTakenOver(problem.law, further))
