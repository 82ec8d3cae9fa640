"""Damping ratios of modes, and on demand friction and stiffness of the contacts, by least squares
on measured responses.

The contacts are in the model: what friction takes is not counted as damping again, as half-power
does on a curve on which contacts slip. Gauss and Newton's method in the logarithms of the unknowns;
at a measured frequency the motion follows an unknown s by J dx/ds = -R_s, with the factorised
Jacobian of the balance.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.contact_setting import ContactSetting
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.problem import AnyProblem, ContactProblem, contact_problem_of
from tipdamp.hbm.balance.receptance import ratios
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.curve.watched import Progress, watched
from tipdamp.hbm.errors import Doubt, InputError
from tipdamp.hbm.fitting.result import DampingFit, MeasuredResponse
from tipdamp.hbm.modes.derivatives import by_factor
from tipdamp.hbm.response import follow_band
from tipdamp.hbm.validation import check_settings, check_whole, in_hz

STEPS, HALVINGS = 40, 8
LONGEST = 0.7  # step in the logarithm of an unknown
SMALL = 1e-7  # step at which it ends
CALLS = 25  # of Newton's method from a predicted motion, before the curve is followed anew
BESIDE = (
    0.02  # of the frequencies, by which a curve begins before the first and ends after the last
)
BLIND = 1e-6  # influence of an unknown, or of a combination, relative to the largest
VAGUE = np.log(10.0)  # half width of an interval: a factor of ten either way
WEAK = np.log(2.0)  # half width of an interval of a factor on the contacts, which is told
CONFIDENCE = 0.95
ELSEWHERE = 0.5  # of the largest measured amplitude: a point farther off is on another branch
LESS_DAMPING = (1.0, 0.5, 0.25, 0.125)  # of the values to start from, while one is
STIFFNESS = ("kn", "kt")
LOOKED = np.log(3.0) * np.linspace(-1, 1, 7)  # where a factor is looked for, logarithms of it
BY = 0.1  # of these from the fit: no nearer are other values of it looked at
COMPARABLE = 10.0  # times the sum of squares of the fit, up to which another minimum is gone down
# unknowns, solution, steps, whether the last is small
Fit = tuple[np.ndarray, "_Solved", int, bool]


@dataclass(frozen=True)
class _Unknown:
    """settings - of the contacts, or modes - whose ratio it is; or of - which of amplitude and
    frequency of the measured curve it is a factor on, by its place."""

    name: str
    start: float
    settings: tuple[str, ...] = ()
    modes: tuple[int, ...] = ()
    of: str = ""
    curve: int = -1


@dataclass(frozen=True)
class _Solved:
    """At some unknowns: of each measured curve the equation, points (n,), computed response (n,),
    and its change (n, p), with that of the motions (n, p, x)."""

    equations: list[Equation]
    points: list[list[Point]]
    computed: list[np.ndarray]
    changes: list[np.ndarray]
    motions: list[np.ndarray]


def fit_damping(
    problem: AnyProblem,
    force: "ArrayLike",
    measured: Sequence[MeasuredResponse],
    *,
    modes: Sequence[int] | None = None,
    mu: bool = False,
    stiffness: bool = False,
    scatter: bool = False,
    band: tuple[float, float] | None = None,
    omega: tuple[float, float] | None = None,
    harmonics: int = 5,
    start: str | np.ndarray = "zero_slider",
    samples: int | None = None,
    progress: Callable[[float, float, int], None] | bool | None = None,
) -> DampingFit:
    """Damping ratios with which a problem, its contacts included, responds as was measured.

    problem : with the values to start from; its damping_ratio says which are unknown: one for all
        modes, or one for each of the first, the last for all others
    force : (r,) N - of the level 1
    modes : of the stuck system, 1 the lowest, whose ratios alone are unknown
    mu, stiffness : whether a factor on mu, or on kn and kt, of all contacts is unknown, too; each
        is looked for from a third to three times what it starts from, as one fit may end at a
        minimum that is not the least: 7 more solutions of all measured points, and at most two
        more fits
    scatter : whether each measured curve has a factor of its own on its amplitudes and, where the
        stiffness is known, on its frequencies, as from one mounting to the next
    band : Hz, or omega : rad/s, of the measured points that count; default: all
    harmonics, start, samples : as in CurveOptions
    progress : function (hz, step, calls), called at each point of the curves that are followed and
        at each measured one; without one a terminal or a notebook shows a line, and False shows
        nothing

    Raises InputError where no measured point lies in the band, there are not more values than
    unknowns, or the curves do not tell an unknown, which is named.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
    >>> damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=4.0)
    >>> curve = damped.force(0, 5.0).follow_band((600, 1000), outputs={"tip": 0})
    >>> run = MeasuredResponse(curve.frequency, abs(curve.harmonics[:, 0, 1]), [1.0], level=5.0)
    >>> from dataclasses import replace
    >>> guess = replace(damped.contact_problem, damping_ratio=0.02)
    >>> print(fit_damping(guess, [1.0], [run], mu=True).values.round(4))
    [0.01 1.  ]
    """
    given = contact_problem_of(problem)
    given.check_plain("fit_damping")
    if given.damping_ratio is None:
        raise InputError("fit_damping: finds damping ratios, the problem has a matrix C")
    if omega is not None:
        band = in_hz("band", band, omega)
    inside = [one if band is None else one.within(*band) for one in measured]
    options = {"harmonics": harmonics, "start": start, "samples": samples}
    unknowns = _unknowns(given, modes, mu, stiffness)
    if scatter:
        unknowns += _scattering(len(inside), () if stiffness else ("frequency",))
    fit = _Residuals(given, np.asarray(force), inside, unknowns, options)
    values = sum(one.values for one in inside)
    if values <= len(fit.unknowns):
        raise InputError(
            f"fit_damping: {values} measured values for {len(fit.unknowns)} unknowns "
            f"({', '.join(fit.names)}): more values than unknowns are needed"
        )
    check_settings(None, progress)
    hz = np.concatenate([one.hz for one in inside])
    with watched(progress, hz.min(), hz.max(), " Hz") as told:
        fit.progress = told or False
        (theta, solved, iterations, converged), others = fit.searched()
    half = fit.half_widths(solved)
    low, high = theta - half, theta + half
    ends = [(min(values, default=np.inf), max(values, default=-np.inf)) for values in others]
    least, most = np.transpose(ends)
    wide = (half > WEAK) & [bool(one.settings) for one in fit.unknowns]
    weak = (least < low) | (most > high) | wide
    first = np.array([one.start for one in fit.unknowns])
    found = first * np.exp(theta)
    result = DampingFit(
        names=fit.names,
        values=found,
        low=first * np.exp(np.minimum(low, least)),
        high=first * np.exp(np.maximum(high, most)),
        start=first,
        measured=tuple(inside),
        computed=tuple(solved.computed),
        misfit=tuple(
            _misfit(one, computed) for one, computed in zip(inside, solved.computed, strict=True)
        ),
        iterations=iterations,
        converged=converged,
        problem=fit.problem_at(theta),
        weak=tuple(name for name, one in zip(fit.names, weak, strict=True) if one),
    )
    for doubt in result.doubts:
        warnings.warn(f"fit_damping: {doubt}", Doubt, stacklevel=2)
    return result


def _misfit(one: MeasuredResponse, computed: np.ndarray) -> float:
    """Root mean square of the difference, weighted as in the fit, over the largest amplitude."""
    weights = np.asarray(one.deviation, dtype=float) ** -2.0
    squared = np.average(np.abs(computed - one.response) ** 2, weights=weights)
    return float(np.sqrt(squared) / np.abs(one.response).max())


def _unknowns(
    problem: ContactProblem, modes: Sequence[int] | None, mu: bool, stiffness: bool
) -> list[_Unknown]:
    given = np.atleast_1d(np.asarray(problem.damping_ratio))
    count = len(problem.receptance().ratio)
    every, last = ratios(given, count), len(given) - 1
    for mode in modes or ():
        if check_whole("modes", mode, 1) > count:
            raise InputError(f"modes = {mode}: the stuck system has {count}, the lowest is 1")
    single = [mode - 1 for mode in modes] if modes is not None else range(last)
    groups: dict[str, tuple[int, ...]] = {f"damping ratio of mode {k + 1}": (k,) for k in single}
    if modes is None:
        name = f"damping ratio of modes {last + 1} and up" if last else "damping ratio"
        groups[name] = tuple(range(last, count))
    found = [_Unknown(name, float(every[at[0]]), modes=at) for name, at in groups.items()]
    for one in found:
        if not one.start > 0:
            raise InputError(f"fit_damping: {one.name} starts at {one.start:g}, must be above 0")
    found += [_Unknown("mu", 1.0, ("mu",))] * mu
    found += [_Unknown("stiffness", 1.0, STIFFNESS)] * stiffness
    if not found:
        raise InputError("fit_damping: nothing is unknown: give modes, mu or stiffness")
    return found


def _scattering(curves: int, further: Sequence[str]) -> list[_Unknown]:
    """Factors on the amplitude of each measured curve, and on what else scatters."""
    return [
        _Unknown(f"{of} of measured curve {k + 1}", 1.0, of=of, curve=k)
        for of in ("amplitude", *further)
        for k in range(curves)
    ]


class _Residuals:
    """Of the measured responses, over the unknowns."""

    def __init__(
        self,
        start: ContactProblem,
        force: np.ndarray,
        measured: list[MeasuredResponse],
        unknowns: list[_Unknown],
        options: Any,
    ) -> None:
        self.start, self.force, self.measured = start, force, measured
        self.unknowns, self.options = unknowns, options
        self.names = tuple(one.name for one in unknowns)
        self.progress: Progress | Literal[False] = False

    def problem_at(self, theta: np.ndarray) -> ContactProblem:
        """With the unknowns at exp(theta) of what they start from."""
        found, zeta = (
            self.start,
            ratios(self.start.damping_ratio, len(self.start.receptance().ratio)),
        )
        for one, factor in zip(self.unknowns, np.exp(theta), strict=True):
            zeta[list(one.modes)] *= factor
            for setting in one.settings:
                found = found.with_contacts(ContactSetting(setting).scaled(found, factor))
        if not (zeta < 1).all():
            raise InputError("fit_damping: a damping ratio grows beyond 1: the model does not fit")
        found = replace(found, damping_ratio=zeta)
        found.receptance()  # modes that hold for every contact
        return found

    def searched(self) -> tuple[Fit, list[list[float]]]:
        """(the best fit, of each unknown the logarithms of values that fit as well within the
        scatter); factors on the contacts are looked for along `profile`."""
        fits = [self.best()]
        others: dict[int, list[tuple[float, float]]] = {}
        for j in (j for j, one in enumerate(self.unknowns) if one.settings):
            best = min(fits, key=self._squares)
            line = self.profile(j, best)
            others[j] = [(theta[j], squares) for theta, squares in line]
            for theta in self._starts(j, best, line):
                try:
                    fits.append(self.run(theta))
                except InputError:  # the model does not respond from there
                    continue
        best = min(fits, key=self._squares)
        most = self.as_good(self._squares(best))
        for j, values in others.items():
            values += [(one[0][j], self._squares(one)) for one in fits]
        return best, [
            [v for v, squares in others.get(j, []) if squares <= most and abs(v - at) > BY]
            for j, at in enumerate(best[0])
        ]

    def profile(self, j: int, fit: Fit) -> list[tuple[np.ndarray, float]]:
        """(unknowns, sum of squares) at values of unknown j about a fit, ascending: the others
        follow it by the derivatives, and the sum is the least that they tell."""
        found, rest = [], np.arange(len(self.unknowns)) != j
        above = [value for value in LOOKED if value > fit[0][j] + BY]
        below = [value for value in LOOKED[::-1] if value < fit[0][j] - BY]
        for values in (above, below):
            theta, solved = fit[:2]
            for value in values:
                r, J, way = self.residual(solved), self.jacobian(solved), np.zeros(len(theta))
                way[j] = value - theta[j]
                way[rest] = np.linalg.lstsq(J[:, rest], -r - J[:, j] * way[j], rcond=BLIND)[0]
                way[rest] = np.clip(way[rest], -LONGEST, LONGEST)
                try:
                    solved = self.solved(theta + way, solved, way)
                except InputError:  # the model does not respond from here on
                    break
                theta, r, J = theta + way, self.residual(solved), self.jacobian(solved)[:, rest]
                left = r - J @ np.linalg.lstsq(J, r, rcond=BLIND)[0]
                found.append((theta, float(left @ left)))
        return sorted(found, key=lambda one: one[0][j])

    def _starts(
        self, j: int, fit: Fit, line: list[tuple[np.ndarray, float]]
    ) -> Iterator[np.ndarray]:
        """Unknowns of a profile from which another fit may end lower: where the fit is not
        among the least within the scatter, of these the one nearest to what was given; and the
        least place beyond a ridge that may lie beside a deeper one."""
        size = self._squares(fit)
        if not line:
            return
        most = self.as_good(min(squares for _, squares in line))
        if size > most:
            yield min((one for one, s in line if s <= most), key=lambda one: abs(one[j]))
        every = sorted([*line, (fit[0], size)], key=lambda one: one[0][j])
        s = np.array([np.inf, *(one[1] for one in every), np.inf])
        lowest = (s[1:-1] < s[:-2]) & (s[1:-1] < s[2:]) & (s[1:-1] > max(most, size))
        lowest &= s[1:-1] < COMPARABLE * size
        if lowest.any():
            yield every[int(np.where(lowest, s[1:-1], np.inf).argmin())][0]

    def as_good(self, squares: float) -> float:
        """The largest sum of squares that is one within the scatter: of a 95 % interval."""
        free = sum(one.values for one in self.measured) - len(self.unknowns)
        return squares * (1 + stdtrit(free, 0.5 + CONFIDENCE / 2) ** 2 / free)

    def _squares(self, fit: Fit) -> float:
        """The sum of them, of the differences by their deviations."""
        return float(np.linalg.norm(self.residual(fit[1])) ** 2)

    def best(self) -> Fit:
        """The result of `run` that is nearest to the measurement. Too much damping to start from
        ends a resonance that folds before the measured one ends; no small step leads back."""
        damped = np.array([bool(one.modes) for one in self.unknowns])
        found = []
        for factor in LESS_DAMPING if damped.any() else (1.0,):
            found.append(self.run(np.where(damped, np.log(factor), 0.0)))
            if not self._elsewhere(found[-1][1]):
                break
        return min(found, key=self._squares)

    def _elsewhere(self, solved: _Solved) -> bool:
        """Whether a point is on another branch than the measured one."""
        return any(
            np.abs(computed - one.response).max() > ELSEWHERE * np.abs(one.response).max()
            for computed, one in zip(solved.computed, self.measured, strict=True)
        )

    def run(self, theta: np.ndarray) -> Fit:
        """A fit from some unknowns on."""
        solved = self.solved(theta)
        for step in range(1, STEPS + 1):
            r, J = self.residual(solved), self.jacobian(solved)
            way = np.linalg.lstsq(J, -r, rcond=BLIND)[0]
            way *= min(1.0, LONGEST / max(np.abs(way).max(), 1e-300))
            for _ in range(HALVINGS):
                new = self.solved(theta + way, solved, way)
                if np.linalg.norm(self.residual(new)) <= np.linalg.norm(r):
                    break
                way = 0.5 * way
            else:  # no better: as near as the solutions are exact, or a minimum of another kind
                return theta, solved, step, bool(np.abs(way).max() * 2**HALVINGS <= 1e3 * SMALL)
            theta, solved = theta + way, new
            if np.abs(way).max() <= SMALL:
                return theta, solved, step, True
        return theta, solved, STEPS, False

    def solved(
        self, theta: np.ndarray, before: _Solved | None = None, way: np.ndarray | None = None
    ) -> _Solved:
        """At unknowns, from what is known a step before."""
        problem, parts = self.problem_at(theta), []
        for k, one in enumerate(self.measured):
            hz, points = self._factor(theta, "frequency", k) * one.hz, None
            if before is not None:
                guesses = [
                    p.x + m.T @ way
                    for p, m in zip(before.points[k], before.motions[k], strict=True)
                ]
                forces = {1: one.level * self.force}
                old = before.equations[k]
                equation = replace(old, balance=old.balance.rebuilt(problem, forces))
                points = _from_guesses(equation, hz, guesses, self.progress)
            if points is None:
                equation, points = self._followed(problem, one, hz)
            gain = self._factor(theta, "amplitude", k)
            parts.append((equation, points, *self._responses(equation, points, k, gain)))
        return _Solved(*map(list, zip(*parts, strict=True)))

    def _factor(self, theta: np.ndarray, of: str, curve: int) -> float:
        """On amplitude or frequency of a measured curve; 1 where it is not unknown."""
        return float(
            np.exp(theta[[(one.of, one.curve) == (of, curve) for one in self.unknowns]].sum())
        )

    def _followed(
        self, problem: ContactProblem, one: MeasuredResponse, hz: np.ndarray
    ) -> tuple[Equation, list[Point]]:
        """The points at frequencies, those measured or beside them, of a curve that is followed;
        where it folds, those nearest to what was measured."""
        low, high = hz[0] * (1 - BESIDE), hz[-1] * (1 + BESIDE)
        rows = {f"measured {i + 1}": row for i, row in enumerate(one.output)}
        curve = follow_band(
            problem,
            one.level * self.force,
            (low, high),
            **{**self.options, "outputs": rows, "at": hz, "truncation": False, "peaks": []},
            progress=self.progress,
        )
        equation, points = restored(curve, problem)
        found = []
        for value, wanted in zip(hz, one.response, strict=True):
            here = np.flatnonzero(curve.converged & np.isclose(curve.frequency, value, 1e-12, 0.0))
            there = [
                solve_fixed(equation.evaluate, p.x, p.parameter, equation.weights)
                for p in (points[i] for i in here)
            ]
            there = [p for p in there if p.converged]
            if not there:
                raise InputError(f"fit_damping: no solution at {value:g} Hz; {curve.ended}")
            far = [abs(_measure(_outputs(p.detail, one.output), wanted)[0] - wanted) for p in there]
            found.append(there[int(np.argmin(far))])
        return equation, found

    def _responses(
        self, equation: Equation, points: Sequence[Point], curve: int, gain: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(computed (n,), changes (n, p), motions (n, p, x)) of a measured curve."""
        one, computed, changes, motions = self.measured[curve], [], [], []
        outputs = Outputs(one.output)
        moving = [
            (j, each, by_factor(equation.balance, each.settings))
            for j, each in enumerate(self.unknowns)
            if not each.of or (each.of, each.curve) == ("frequency", curve)
        ]
        for point, wanted in zip(points, one.response, strict=True):
            here, X = point.detail, outputs.at(point.detail)
            value, slope = _measure(X[:, 1], wanted)
            change = np.zeros(len(self.unknowns), dtype=np.result_type(value))
            motion = np.zeros((len(self.unknowns), len(point.x)))
            for j, unknown, rate in moving:
                other, modal, motion[j] = self._change(here, unknown, rate, point.parameter)
                dX = outputs.at(replace(other, modal=other.modal + modal)) - X
                change[j] = slope(dX[:, 1])
            for j, unknown in enumerate(self.unknowns):
                if (unknown.of, unknown.curve) == ("amplitude", curve):
                    change[j] = value
            computed.append(gain * value)
            changes.append(gain * change)
            motions.append(motion)
        return np.array(computed), np.array(changes), np.array(motions)

    def _change(
        self,
        here: Linearisation,
        unknown: _Unknown,
        rate: Callable[[Linearisation], np.ndarray],
        parameter: float,
    ) -> tuple[Linearisation, np.ndarray, np.ndarray]:
        """(linearisation moved, change of the modal q beside it, change of x) by a relative change
        of an unknown; rate : by its settings, `by_factor`; parameter : of the point."""
        if unknown.of:
            still = np.zeros(len(here.x))
            dx, dp = here.solve(still, 1.0, parameter, still)
            return here.moved(dx, dp), np.zeros_like(here.modal), dx
        if unknown.settings:
            modal = rate(here)
        else:
            damping, at = np.zeros(len(here.modal)), list(unknown.modes)
            damping[at] = here.balance.damping[at]
            orders = here.w * np.arange(here.modal.shape[1])
            modal = -here.factors * (1j * orders * (damping[:, None] * here.modal))
        R = -fourier.to_real(real_times(here.balance.shapes, modal)).ravel()
        dx, dp = here.solve(np.zeros(len(here.x)), 1.0, 0.0, R)
        return here.moved(dx, dp), modal, dx

    def residual(self, solved: _Solved) -> np.ndarray:
        """(values,) differences by their deviations."""
        pairs = zip(solved.computed, self.measured, strict=True)
        return _joined([(a - one.response) / one.deviation for a, one in pairs])

    def jacobian(self, solved: _Solved) -> np.ndarray:
        """(values, p)."""
        pairs = list(zip(solved.changes, self.measured, strict=True))
        columns = [
            _joined([change[:, j] / one.deviation for change, one in pairs])
            for j in range(len(self.unknowns))
        ]
        return np.column_stack(columns)

    def half_widths(self, solved: _Solved) -> np.ndarray:
        """(p,) of the intervals, in the logarithm; InputError for what the curves do not tell."""
        J, r = self.jacobian(solved), self.residual(solved)
        size = np.linalg.norm(J, axis=0)
        blind = size <= BLIND * max(size.max(), 1e-300)
        if blind.any():
            raise self._untold(blind, "does not change the measured curves")
        values, ways = np.linalg.svd(J / size, full_matrices=False)[1:]
        if values[-1] <= BLIND:
            raise self._untold(np.abs(ways[-1]) > 0.1, "are not told apart by the measured curves")
        free = len(r) - len(size)
        each = np.sqrt((ways.T**2 / values**2).sum(axis=1)) / size
        half = stdtrit(free, 0.5 + CONFIDENCE / 2) * np.linalg.norm(r) / np.sqrt(free) * each
        if (half > VAGUE).any():
            raise self._untold(half > VAGUE, "is told to no better than a factor of ten")
        return half

    def _untold(self, which: np.ndarray, why: str) -> InputError:
        those = [one for one, mine in zip(self.unknowns, which, strict=True) if mine]
        remedies = dict.fromkeys(_remedy(one) for one in those)
        names = ", ".join(one.name for one in those)
        return InputError(f"fit_damping: {names} {why}; {'; '.join(remedies)}")


def _remedy(unknown: _Unknown) -> str:
    """Of one that the measured curves do not tell."""
    if unknown.of:
        return "give the measured curves no factors of their own (scatter = false)"
    if unknown.modes:
        return "name other modes to be fitted, or measure where this mode responds"
    return f"take {unknown.name} as known ({unknown.name} = false), or measure where contacts slip"


def _from_guesses(
    equation: Equation,
    hz: np.ndarray,
    guesses: Sequence[np.ndarray],
    progress: Progress | Literal[False],
) -> list[Point] | None:
    found = []
    for value, x in zip(hz, guesses, strict=True):
        p = equation.parameter.scale * value
        point = solve_fixed(equation.evaluate, x, p, equation.weights, max_calls=CALLS)
        if not point.converged:
            return None
        if progress:
            progress(float(value), 1.0, point.iterations)
        found.append(point)
    return found


def _outputs(here: Linearisation, rows: np.ndarray) -> np.ndarray:
    return Outputs(rows).at(here)[:, 1]


def _measure(X: np.ndarray, wanted: complex) -> tuple[Any, Callable[[np.ndarray], Any]]:
    """(what is compared with a measured value, its change by a change of X (m,)): with a phase the
    response itself, else the largest amplitude."""
    if isinstance(wanted, complex):
        return X[0], lambda dX: dX[0]
    k = int(np.abs(X).argmax())
    value = abs(X[k])
    return value, lambda dX: (X[k].conj() * dX[k]).real / max(value, 1e-300)


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Real numbers of real and complex parts in a row."""
    return np.concatenate(
        [np.r_[part.real, part.imag] if np.iscomplexobj(part) else part for part in parts]
    )
