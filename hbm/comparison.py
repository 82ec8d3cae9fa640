"""A solution of a curve compared with time integration that starts on its orbit."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tipdamp.hbm import fourier, tables
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.solutions import point_of, points_at
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.result import ForcedResponse, along
from tipdamp.hbm.time import period_map, shooting
from tipdamp.hbm.time.base import Integrator
from tipdamp.hbm.time.exact import ExactIntegrator
from tipdamp.hbm.time.sampled import SampledIntegrator
from tipdamp.hbm.time.settings import IntegrationSettings
from tipdamp.hbm.validation import MOST_SAMPLES

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Comparison:
    """A periodic solution of the harmonic balance beside the integration from its orbit.

    difference : of the amplitude of the largest harmonic, the largest over the outputs and relative
    to the largest output
    steady : Steady state of the integration; left : whether that is another orbit, told by where
        the balance leads from it
    multiplier : largest modulus of the Floquet multipliers of the orbit of the solution, not of
        another one to which the integration left (see `period_map`); NaN where a period of the
        integration does not finish
    stable : whether it is at most 1, within `settings.marginal`; None where it is NaN
    said : one sentence; hz : frequency; H : harmonics of the balance; origin, start : as in
    ForcedResponse
    method : 'event-driven' or 'sampled', as in Steady
    harmonics : (m, H+1) complex, m, of the outputs of the solution

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
    >>> curve = damped.follow_band((600, 1000), outputs={"tip": 0})
    >>> found = compare(curve, damped, 700.0)
    >>> isinstance(found, Comparison), found.agrees, found.method
    (True, True, 'event-driven')
    """

    difference: float
    steady: shooting.Steady
    left: bool
    multiplier: float
    stable: bool | None
    said: str
    hz: float
    H: int
    origin: str
    start: str
    method: str
    harmonics: np.ndarray

    def __repr__(self) -> str:
        return f"<Comparison at {self.hz:.6g} Hz, H = {self.H}: {self.said}>"

    def plot(self, output: int = 0, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw the motion of an output over a period: the balance as a line, the steady state of
        the integration dashed.

        output : its number, from 0; unit : 'm', 'mm' or 'um'; ax : axes of matplotlib to draw on;
            new ones without
        Returns the axes. Raises InputError where matplotlib is not installed or the output is none.
        """
        if not 0 <= output < len(self.harmonics):
            raise InputError(f"output = {output}: must be 0 to {len(self.harmonics) - 1}")
        motions = {
            "harmonic balance": self.harmonics[output],
            "time integration": self.steady.harmonics[output],
        }
        return pictures.period(1 / self.hz, motions, unit, ("solid", "dash"), ax)

    @property
    def agrees(self) -> bool:
        """Whether the integration is periodic and stayed on the orbit: then `difference` is an
        error."""
        return self.steady.periodic and not self.left

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each output and order: the magnitude of its coefficient in m, by the balance
        and by the integration. Raises InputError where pandas is not installed."""
        output, order = np.indices(self.harmonics.shape).reshape(2, -1)
        columns = {"output": output, "order": order}
        columns["balance"] = np.abs(self.harmonics).ravel()
        columns["integration"] = np.abs(self.steady.harmonics)[:, : self.H + 1].ravel()
        return tables.frame(columns, "row")

    def _repr_html_(self) -> str:
        rows = {
            "difference": f"{self.difference:.2e} of the amplitude",
            "agrees": str(self.agrees),
            "stable": "not known" if self.stable is None else str(self.stable),
            "said": self.said,
        }
        return tables.notebook_table(f"Time integration at {self.hz:.6g} Hz", rows)


def compare(
    curve: ForcedResponse,
    problem: AnyProblem,
    value: float | None = None,
    which: int | None = None,
    settings: IntegrationSettings | None = None,
    parameter: Parameter | None = None,
    *,
    point: int | None = None,
    omega: float | None = None,
) -> Comparison:
    """A solution of a curve compared with time integration that starts on its orbit.

        problem, _ = contact_problem(model, pairs, law, damping_ratio=0.01)
        print(compare(curve, problem, 1250.0).said)

    problem : that the curve was made with; value, omega, parameter : as in
    `tipdamp.hbm.curve.solutions.solutions_at`
    which : the place there, needed where the curve has several solutions
    point : instead of value, the number of a point of the curve, as of `curve[point]`
    The integration starts at displacement, velocity and sliders of the solution and runs until the
    period map repeats. Where the transient dies slowly, Newton on the period map finds where it
    leads; where Newton fails, up to `settings.max_periods` are integrated. The largest Floquet
    multiplier tells stability: at the periodic orbit, or on the motion of the balance where none is
    found beside it. Raises InputError where there is no such solution.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> found = compare(curve, problem, 700.0)
    >>> compare(curve, problem, point=3).hz == curve[3].frequency
    True
    >>> found.agrees, bool(found.stable), bool(found.difference < 0.01)
    (True, True, True)
    """
    if (value is None and omega is None) == (point is None):
        raise InputError("compare: give either a value or a point of the curve")
    if point is not None:
        balance, there = point_of(curve, problem, point, parameter)
        return compare_point(balance, there, curve.output_rows, settings)
    value = along(curve, value, omega)
    balance, points = points_at(curve, problem, value, parameter)
    if which is None and len(points) > 1:
        sizes = ", ".join(
            f"{np.abs(p.detail.outputs(curve.output_rows)[:, 1]).max():.3g}" for p in points
        )
        raise InputError(
            f"compare: the curve has {len(points)} solutions at {value:g}, whose first harmonic is "
            f"{sizes} m; say which = 0 to {len(points) - 1}"
        )
    if not 0 <= (which or 0) < len(points) or not points[which or 0].converged:
        raise InputError(
            f"compare: which = {which}: {len(points)} solutions of the curve are known at {value:g}"
        )
    return compare_point(balance, points[which or 0], curve.output_rows, settings)


def compare_point(
    balance: HarmonicBalance,
    point: Point,
    rows: np.ndarray,
    settings: IntegrationSettings | None = None,
) -> Comparison:
    """As `compare`, of a point of a balance, for outputs rows (m, r).

    Errors of the steps may keep a barely damped motion from repeating: what almost repeats is
    integrated once more, at a hundredth of the tolerance.
    """
    settings = settings or IntegrationSettings()
    found = _compared(balance, point, rows, settings)
    refinable = found.method == "event-driven" and settings.tolerance > 0
    if found.steady.periodic or not refinable or found.steady.period_change > settings.almost:
        return found
    finer = _compared(balance, point, rows, replace(settings, tolerance=settings.tolerance / 100))
    return finer if finer.steady.periodic else found


def _compared(
    balance: HarmonicBalance, point: Point, rows: np.ndarray, settings: IntegrationSettings
) -> Comparison:
    integrator = integrator_of(balance, point.parameter, settings)
    begin = integrator.on_orbit(point)
    found, near = _integrated(balance, integrator, (point, begin), rows)
    steady, difference, left = found.steady, found.difference, found.left
    multiplier, _ = period_map.largest_multiplier(
        integrator, near.steady.state if near.on_orbit else begin
    )
    stable = None if np.isnan(multiplier) else multiplier <= 1 + settings.marginal
    said = _said(found, multiplier, stable)
    if found.on_orbit and difference > settings.small:
        said += _advice(balance, point, rows, found, settings)
    if steady.method == "sampled":
        said += (
            f"; integrated with {settings.samples} steps per period, as law "
            f"{balance.problem.law.name} is not piecewise linear"
        )
    return Comparison(
        difference,
        steady,
        left,
        multiplier,
        stable,
        said,
        float(point.parameter) / (2 * np.pi),
        balance.H,
        steady.origin,
        steady.start,
        steady.method,
        point.detail.outputs(np.asarray(rows)),
    )


@dataclass(frozen=True)
class _Judged:
    """steady : state of an integration; difference, left : as of the Comparison."""

    steady: shooting.Steady
    difference: float
    left: bool

    @property
    def on_orbit(self) -> bool:
        """Whether it is that of the solution."""
        return self.steady.periodic and not self.left


def _integrated(
    balance: HarmonicBalance, integrator: Integrator, on: tuple[Point, Any], rows: np.ndarray
) -> tuple[_Judged, _Judged]:
    """(where the integration leads, what lies nearest to the orbit: the same, or what Newton's
    method finds on the period map); on : the orbit, its point and its state at t = 0."""
    settings, (point, begin) = integrator.settings, on

    def judged(steady: shooting.Steady) -> _Judged:
        difference = _difference(point, rows, steady)
        left = steady.periodic and left_orbit(balance, point, steady.motion, difference, settings)
        return _Judged(steady, difference, left)

    few = min(settings.patience, settings.max_periods)
    found = judged(shooting.integrate(integrator, begin, rows, few))
    if not found.steady.finished or found.on_orbit:
        return found, found
    near = judged(shooting.shoot(integrator, begin, rows))
    if found.steady.periodic or settings.max_periods <= settings.patience:
        return found, near
    if near.on_orbit:
        return near, near
    more = settings.max_periods - found.steady.periods
    return judged(shooting.integrate(integrator, begin, rows, more)), near


def integrator_of(
    balance: HarmonicBalance, w: float, settings: IntegrationSettings | None = None
) -> Integrator:
    """The event-driven integrator where every law of the balance is piecewise linear, else the
    sampled one."""
    piecewise = balance.problem.law.piecewise_linear(balance.problem.contacts)
    return (SampledIntegrator if piecewise is None else ExactIntegrator)(balance, w, settings)


def _difference(point: Point, rows: np.ndarray, steady: shooting.Steady) -> float:
    X, Y = np.abs(point.detail.outputs(np.asarray(rows))), np.abs(steady.harmonics)
    k = 1 + int(X[:, 1:].max(axis=0).argmax())  # of a subharmonic motion not the first
    return float(np.abs(Y[:, k] - X[:, k]).max() / X[:, k].max())


def left_orbit(
    balance: HarmonicBalance,
    point: Point,
    motion: np.ndarray,
    difference: float,
    settings: IntegrationSettings,
) -> bool:
    """Whether an integration with harmonics motion (P nd, H+1) is on another orbit than the point.

    With 2H + 1 harmonics (the next odd ones too, where even ones vanish) the balance is solved from
    the point and from the orbit of the integration. Where both lead to one solution they are one
    orbit, and their difference is what H harmonics leave out; where they lead to two, they are two
    orbits. A threshold alone cannot tell: at H = 1 an orbit is missed by some per cent, and near a
    fold two orbits are closer than that.
    """
    if difference > settings.elsewhere:
        return True
    try:
        finer = _finer(balance)
        ends = [
            solve_fixed(finer.evaluate, finer.padded(x), point.parameter, finer.weights)
            for x in (point.x, fourier.to_real(motion).ravel())
        ]
    except InputError:  # so many harmonics do not fit into the memory
        return bool(difference > settings.unsolved)
    if not all(end.converged for end in ends):
        return bool(difference > settings.unsolved)
    # without the mean: where every contact slides it may be anything on the same orbit
    swings = [
        (finer.weights * x).reshape(finer.n_components, -1)[:, 1:]
        for x in (ends[1].x - ends[0].x, ends[0].x)
    ]
    return bool(np.linalg.norm(swings[0]) > settings.same * np.linalg.norm(swings[1]))


def _finer(balance: HarmonicBalance) -> HarmonicBalance:
    """The balance with 2H + 1 harmonics."""
    H = 2 * balance.H + 1
    samples = max(balance.grid.samples, balance.problem.law.default_samples(H))
    return HarmonicBalance(balance.problem, balance.forces, H, balance.given_start, samples)


def _said(found: _Judged, multiplier: float, stable: bool | None) -> str:
    steady, difference, left = found.steady, found.difference, found.left
    verdict = f"{'stable' if stable else 'unstable'} (Floquet multiplier {multiplier:.4f})"
    if not steady.finished:
        said = "the integration did not finish a period: events follow each other faster and faster"
    elif not steady.periodic:
        said = (
            f"the integration is not periodic after {steady.periods} periods (change "
            f"{steady.period_change:.1e})"
        )
    elif left:
        said = f"the integration left for another orbit, {difference:.1%} of the amplitude away"
    elif stable is False:
        said = (
            f"the orbit exists, {difference:.2e} of the amplitude away, but it is {verdict}: any "
            "disturbance makes the integration leave it"
        )
    else:
        said = f"the integration stays on the orbit, {difference:.2e} of the amplitude away"
        said += "" if stable is None else f", which is {verdict}"
    if stable is not None and (left or not steady.periodic):
        said += f"; the orbit of the solution is {verdict}"
    if stable is None:
        said += "; its stability is not known, as a disturbed period did not finish"
    return said


def _advice(
    balance: HarmonicBalance,
    point: Point,
    rows: np.ndarray,
    found: _Judged,
    settings: IntegrationSettings,
) -> str:
    """Whether samples or harmonics lack: twice the samples, where they matter, take most of the
    difference away."""
    samples = balance.grid.samples
    if found.steady.method == "sampled" and 2 * samples <= MOST_SAMPLES:
        finer = HarmonicBalance(
            balance.problem, balance.forces, balance.H, balance.given_start, 2 * samples
        )
        again = solve_fixed(finer.evaluate, point.x, point.parameter, finer.weights)
        enough = settings.fewer * found.difference
        if again.converged and _difference(again, rows, found.steady) < enough:
            return f"; more samples than {samples} bring it closer"
    return f"; more harmonics than H = {balance.H} bring it closer"
