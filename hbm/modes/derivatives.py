"""How a peak, a point of a curve or a stuck frequency changes with the settings of each contact,
with the damping, and with parameters of one's own in the matrices.

At a given place along the branch the unknowns follow a setting s by J dx/ds = -R_s, with the
factorised Jacobian of the point. At a peak the amplitude does not change along the branch: its
height follows the setting as at a place that is held, and the place moves by -A_sz / A_zz of the
amplitude A(z, s). These second derivatives are those of the first ones at four points beside the
peak, by differences of fourth order.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg as la

from tipdamp.hbm import fourier
from tipdamp.hbm.amplitude import KINDS, amplitude_along, orders_of
from tipdamp.hbm.balance.contact_setting import SETTINGS, ContactSetting
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import ModelParameter
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.residual import HarmonicBalance, Terms
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.corrector import damped, solve_fixed
from tipdamp.hbm.continuation.point import Plane, Point
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.solutions import points_of, restored
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.influence import Derivatives
from tipdamp.hbm.modes.matrix_rates import SLOPES, STENCIL, rates_of
from tipdamp.hbm.result import ForcedResponse, along
from tipdamp.hbm.validation import check_whole

# of the half width of the peak, by the curvature of its top: distance of the points beside it
BESIDE = 0.005
# arc lengths from the top: aside of it for its curvature, where that is not made anew, where it is
# reached
ASIDE = 1e-3
CLOSE = 1e-5
ON_TOP = 1e-10
TOP_STEPS = 20  # at most, of the secant to the top
COMMON = ("damping", "level")  # to all contacts
EVERY = (*SETTINGS, *COMMON)


def peak_derivatives(
    curve: ForcedResponse,
    problem: AnyProblem,
    name: str,
    kind: str = KINDS[0],
    order: int | None = None,
    *,
    parameters: Sequence[ModelParameter] = (),
) -> Derivatives:
    """Of the highest peak of an output: its height and frequency.

    problem : the Problem or ContactProblem that the curve was made with; kind, order : as in
    ForcedResponse.amplitude
    parameters : of one's own, factors on something in M, C or K: the value 1 is the problem itself
    Settings are those of `EVERY` there: the preload is left out of a problem with the unloaded
    origin. Where a contact changes its way of moving at the peak itself, the frequency has no
    derivative there and what is given belongs to a mean of both sides. Raises InputError where the
    curve has no peak inside the band, or runs over another parameter.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> curve = damped.follow_band((600, 1000), outputs={"tip": 0})
    >>> by = peak_derivatives(curve, damped, "tip")
    >>> hz, height = by.total("mu")
    >>> bool(hz > 0 > height)  # more friction: stiffer, and lower
    True
    """
    at = _At(curve, problem, name, (kind, order), parameters)
    top = int(np.nanargmax(at.heights))
    inside = 0 < top < len(at.points) - 1
    if not inside:
        raise InputError(f"peak of '{name}': the largest amplitude lies at the border of the band")
    metric = arc.metric_at(at.points[top], at.equation.weights)
    return at.of_peak(_AlongBranch(at, at.points[top], metric))


def with_derivatives(
    curve: ForcedResponse, problem: AnyProblem, names: Sequence[str]
) -> ForcedResponse:
    """A curve with the derivatives of the highest peaks of outputs; warns of one that has none."""
    found = {}
    for name in names:
        try:
            found[name] = peak_derivatives(curve, problem, name)
        except InputError as error:
            warnings.warn(f"derivatives of '{name}': {error}", Doubt, stacklevel=2)
    return replace(curve, derivatives=found)


def point_derivatives(
    curve: ForcedResponse,
    problem: AnyProblem,
    name: str,
    value: float | None = None,
    which: int = 0,
    kind: str = KINDS[0],
    order: int | None = None,
    *,
    omega: float | None = None,
    parameters: Sequence[ModelParameter] = (),
) -> Derivatives:
    """Of an output at a frequency in Hz, or omega in rad/s, that is held.

    which : place in `solutions_at`; parameters : as in `peak_derivatives`

    Raises InputError as `peak_derivatives`, and where there is no such solution.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> curve = damped.follow_band((600, 1000), outputs={"tip": 0})
    >>> by = point_derivatives(curve, damped, "tip", 700.0)
    >>> print(by.frequency, bool(by.amplitude_by["level"][0] > 0))
    700.0 True
    """
    value = along(curve, value, omega)
    at = _At(curve, problem, name, (kind, order), parameters)
    found = points_of(curve, at.equation, at.points, value)
    if not 0 <= check_whole("which", which, 0) < len(found):
        raise InputError(
            f"which = {which}: the curve has {len(found)} solutions at {value:g} Hz, from 0"
        )
    evaluate = at.equation.evaluate
    p = at.equation.parameter.scale * value
    point = solve_fixed(evaluate, found[which].x, p, at.equation.weights)
    held = np.zeros(len(point.x)), 1.0
    by = {name: np.array([one[0] for one in at.by(point, held, name)]) for name in at.settings}
    none = {name: np.zeros_like(one) for name, one in by.items()}
    height = float(at.outputs.amplitudes([replace(point, tangent=None)])[0][0, 0])
    return Derivatives(float(value), height, by, none)


def stuck_frequency_derivatives(
    problem: AnyProblem, mode: int, *, parameters: Sequence[ModelParameter] = ()
) -> Derivatives:
    """Of the undamped frequency of a mode of the stuck system, 1 for the lowest; its amplitude is
    NaN, and friction, preload, damping and level do not change it.

    parameters : as in `peak_derivatives`
    Raises InputError where the problem has no real modes, or the mode does not exist.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> by = stuck_frequency_derivatives(damped, 1)
    >>> print(f"{by.frequency:.1f} Hz, {by.frequency_by['kt'][0] / by.frequency:.4f}")  # 1/6
    871.7 Hz, 0.1667
    """
    problem = contact_problem_of(problem)
    problem.check_plain("stuck_frequency_derivatives")
    period2, shape = _stuck_mode(problem, mode)
    hz = float(1 / (2 * np.pi * np.sqrt(period2)))
    at = np.asarray(problem.B @ shape).reshape(len(problem.contacts), -1)
    settings = _settings(problem)
    by = {name: np.zeros(1 if name in COMMON else len(at)) for name in settings}
    for name in ("kn", "kt"):
        by[name] = 0.5 * hz * (springs_by(problem, name) * at**2).sum(axis=1)
    for name, rate in rates_of(problem, parameters, EVERY).items():
        by[name] = np.array([0.5 * hz * (shape @ (rate.K - rate.M / period2) @ shape)])
    none = {name: np.full_like(one, np.nan) for name, one in by.items()}
    return Derivatives(hz, np.nan, none, by)


def _stuck_mode(problem: ContactProblem, mode: int) -> tuple[float, np.ndarray]:
    """(1 / w^2, shape (r,) of stiffness 1) of a mode, 1 for the lowest."""
    mass, shapes = la.eigh(problem.M, problem.stuck_stiffness)
    mass, shapes = mass[::-1], shapes[:, ::-1]
    most = int((mass > 1e-12 * mass[0]).sum())
    if check_whole("mode", mode, 1) > most:
        raise InputError(f"mode = {mode}: the stuck system has {most}, the lowest is 1")
    return mass[mode - 1], shapes[:, mode - 1]


def _settings(problem: ContactProblem) -> list[str]:
    """Of `EVERY` those that the problem has."""
    return [name for name in EVERY if problem.preloaded or name != "preload"]


def springs_by(problem: ContactProblem, setting: str) -> np.ndarray:
    """(P, nd) N/m of the stuck springs by a relative change of a setting, in which they are
    linear."""
    stiffness = problem.law.stuck_stiffness
    none = ContactSetting(setting).scaled(problem, 0.0)
    return stiffness(problem.contacts) - stiffness(none)


class _AlongBranch:
    """Points of the branch on planes across it, at places z from a point of it."""

    def __init__(self, at: "_At", point: Point, metric: arc.Metric) -> None:
        self.at = at
        evaluate = at.equation.evaluate
        here = evaluate(point.x, point.parameter)
        along = here.direction(*metric.border(np.zeros(len(point.x)), 1.0))[:2]
        if point.tangent is not None:
            along = point.tangent
        unit = metric.norm(*along)
        self.point = point
        self.along = (along[0] / unit, along[1] / unit)
        self.across = metric.border(*self.along)

    def solved(self, z: float) -> Point:
        """The point at z, with its tangent there."""
        dx, dp = self.along
        row, corner = self.across
        evaluate = self.at.equation.evaluate
        weights = self.at.equation.weights
        plane = Plane(self.point.x + z * dx, self.point.parameter + z * dp, row, corner)
        strict = replace(DEFAULT, tolerance=1e-3 * DEFAULT.tolerance)
        found = damped(evaluate, plane, weights, strict, 30)
        if not found.converged:
            found = damped(evaluate, plane, weights, DEFAULT, 100)
        if not found.converged:
            raise InputError("derivatives of a peak: a point beside it could not be solved")
        return replace(found, tangent=found.detail.direction(row, corner)[:2])

    def slope(self, point: Point) -> tuple[float, float]:
        """(amplitude, its derivative by z)."""
        value, slope = self.at.outputs.amplitudes([point])
        return float(value[0, 0]), float(slope[0, 0])

    def top(self) -> tuple[float, float, float]:
        """(z, amplitude, curvature) where the amplitude has its maximum along the branch."""
        z = 0.0
        after, before = (self.slope(self.solved(s * ASIDE))[1] for s in (1, -1))
        curvature = (after - before) / (2 * ASIDE)
        for _ in range(TOP_STEPS):
            if not curvature < 0:
                break
            value, slope = self.slope(self.solved(z))
            step = -slope / curvature
            if abs(step) <= ON_TOP:
                return z, value, curvature
            further = self.slope(self.solved(z + step))[1]
            if abs(step) > CLOSE:
                curvature = (further - slope) / step
            z = z + step
        raise InputError(
            "derivatives of a peak: the curve has a kink at its top, or no maximum there; "
            "`point_derivatives` beside it has none"
        )


class _At:
    """A curve over the frequency and one of its outputs."""

    def __init__(
        self,
        curve: ForcedResponse,
        problem: AnyProblem,
        name: str,
        measure: tuple[str, int | None],
        parameters: Sequence[ModelParameter],
    ) -> None:
        problem = contact_problem_of(problem)
        kind, order = measure
        if problem.reducible:
            problem.receptance()  # modes that hold for every contact
        self.equation, self.points = restored(curve, problem)
        if curve.parameter_name != "frequency":
            raise InputError(
                f"derivatives: the curve runs over {curve.parameter_name}, must run over the "
                "frequency"
            )
        j = curve.column(name)
        orders = orders_of(kind, order, curve.H, curve.force_orders)
        self.heights = np.where(curve.converged, curve.amplitude(kind, order)[:, j], np.nan)
        self.outputs = Outputs(curve.output_rows[[j]], kind, orders)
        self.rates = rates_of(problem, parameters, EVERY)
        self.settings = [*_settings(problem), *self.rates]

    def of_peak(self, line: _AlongBranch) -> Derivatives:
        """At the top of the branch along a line."""
        z, height, curvature = line.top()
        h = BESIDE * np.sqrt(abs(height / curvature))
        top = line.solved(z)
        points = [line.solved(z + h * s) for s in STENCIL]
        bend = SLOPES @ [line.slope(one)[1] for one in points] / h
        scale = self.equation.parameter.scale
        _, dp = top.tangent
        amplitude_by, frequency_by = {}, {}
        for name in self.settings:
            here = np.array(list(self.by(top, line.across, name))).reshape(-1, 2)
            beside = [np.array([a for a, _ in self.by(one, line.across, name)]) for one in points]
            moves = -(SLOPES @ beside) / h / bend
            amplitude_by[name] = here[:, 0]
            frequency_by[name] = (here[:, 1] + dp * moves) / scale
        return Derivatives(top.parameter / scale, height, amplitude_by, frequency_by)

    def by(
        self, point: Point, across: tuple[np.ndarray, float], name: str
    ) -> Iterator[tuple[float, float]]:
        """(amplitude, parameter) by a relative change of a setting, of one contact after the other,
        on a plane across the branch or at the parameter held."""
        here = point.detail
        outputs = self.outputs
        X = outputs.at(here)
        own = self.rates.get(name)
        for modal in by_setting(here, name) if own is None else [-here.factors * own.push(here)]:
            if not modal.any():
                yield 0.0, 0.0
                continue
            R = -fourier.to_real(real_times(here.balance.shapes, modal)).ravel()
            dx, dp = here.solve(*across, 0.0, R)
            moved = here.moved(dx, dp)
            dX = outputs.at(replace(moved, modal=moved.modal + modal)) - X
            slope = amplitude_along(X, dX, outputs.kind, outputs.orders)[1]
            yield float(slope[0]), dp


def by_setting(here: Linearisation, name: str) -> Iterator[np.ndarray]:
    """(m, H+1) derivative of the modal q at given motion of the contacts, by a relative change of a
    setting of one contact after the other; one of damping and level."""
    balance = here.balance
    if name == "level":
        yield here.factors * balance.force
    elif name == "damping":
        yield -here.factors * balance.damping_push(here.modal, here.w)
    else:
        yield from _by_contacts(here, name)


def by_factor(
    balance: HarmonicBalance, names: tuple[str, ...]
) -> Callable[[Linearisation], np.ndarray]:
    """Derivative (m, H+1) of the modal q at given motion by a common factor on settings of all
    contacts, as a function of the point, which a balance with all its modes has evaluated: the sum
    of `by_setting`, in which the damping that follows is one matrix."""
    springs = sum(_springs(balance, name) for name in names)
    shares = None
    if np.any(springs):
        modes = _normal_modes(balance)
        shares = balance.receptance.damping_shares * (
            modes.T @ (np.ravel(springs)[:, None] * modes)
        )

    def of(here: Linearisation) -> np.ndarray:
        terms = _terms(here)
        rates = sum(ContactSetting(name).force_rate(balance, terms, 1.0) for name in names)
        modal = -balance.modal_response(terms, np.asarray(rates))
        if shares is not None:
            push = 1j * here.w * np.arange(balance.H + 1) * (shares @ here.modal[: len(shares)])
            modal[: len(shares)] -= here.factors[: len(shares)] * push
        return modal

    return of


def _by_contacts(here: Linearisation, name: str) -> Iterator[np.ndarray]:
    balance = here.balance
    P = len(balance.problem.contacts)
    nd = balance.nd
    rates = ContactSetting(name).force_rate(balance, _terms(here), 1.0)
    springs = _springs(balance, name)
    further = _ratios_follow(here, springs) if springs.any() else None
    for c in range(P):
        push = balance.into[c * nd + np.arange(nd)].T @ fourier.to_complex(rates[c])
        yield -here.factors * (push if further is None else push + further[c])


def _terms(here: Linearisation) -> Terms:
    balance = here.balance
    none = np.zeros_like(here.modal)
    u = here.x.reshape(-1, balance.nd, balance.nh)
    return Terms(u, here.w, here.whole_forces(), none, here.factors, none)


def _springs(balance: HarmonicBalance, name: str) -> np.ndarray:
    """(P, nd) N/m of the stuck springs by a factor on a setting, where damping ratios follow
    them."""
    problem = balance.problem
    if problem.damping_ratio is None or name not in ("kn", "kt"):
        return np.zeros((len(problem.contacts), balance.nd))
    return springs_by(problem, name)


def _normal_modes(balance: HarmonicBalance) -> np.ndarray:
    """(nc, m) at the components, of modal mass 1."""
    of = balance.receptance
    w = np.sqrt(of.stiffness / np.maximum(of.mass, 1e-28 * of.mass.max()))
    return balance.shapes[:, : len(w)] / np.sqrt(of.mass * w**2 / of.stiffness)


def _ratios_follow(here: Linearisation, springs: np.ndarray) -> np.ndarray:
    """(P, m, H+1) modal force of the damping that damping ratios of the stuck modes give more,
    where springs (P, nd) N/m of one contact or another change these modes.

    A function of a matrix changes by its divided differences [Daleckii, Krein 1965]:
    `Receptance.damping_shares`."""
    balance = here.balance
    K = balance.H + 1
    at = np.flatnonzero(springs)
    P = _normal_modes(balance)[at]
    m = P.shape[1]
    moved = (P.T[:, :, None] * here.modal[:m, None, :]).reshape(m, -1)
    pulled = real_times(balance.receptance.damping_shares, moved).reshape(m, len(at), K)
    push = np.zeros((len(springs), len(here.modal), K), dtype=complex)
    for i, c in enumerate(at // springs.shape[1]):
        push[c, :m] += springs.ravel()[at[i]] * P[i][:, None] * pulled[:, i]
    return 1j * here.w * np.arange(K) * push
