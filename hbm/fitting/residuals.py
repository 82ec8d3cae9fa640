"""Differences between computed and measured responses over the unknowns of a fit, with their
derivatives.

At a measured frequency the motion follows an unknown s by J dx/ds = -R_s, with the factorised
Jacobian of the balance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from scipy.special import stdtrit

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.contact_setting import ContactSetting
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.balance.receptance import ratios
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.curve.watched import Progress
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.fitting.result import MeasuredResponse
from tipdamp.hbm.modes.derivatives import by_factor
from tipdamp.hbm.response import follow_band

CALLS = 25  # of Newton's method from a predicted motion, before the curve is followed anew
BESIDE = 0.02  # of the frequencies: a curve begins so far before the first, ends after the last
BLIND = 1e-6  # influence of an unknown, or of a combination, relative to the largest
VAGUE = np.log(10.0)  # half width of an interval: a factor of ten either way
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Unknown:
    """settings - of the contacts, or modes - whose ratio it is; or of - which of amplitude and
    frequency of the measured curve it is a factor on, by its place."""

    name: str
    start: float
    settings: tuple[str, ...] = ()
    modes: tuple[int, ...] = ()
    of: str = ""
    curve: int = -1


@dataclass(frozen=True)
class Solved:
    """At some unknowns: of each measured curve the equation, points (n,), computed response (n,),
    and its change (n, p), with that of the motions (n, p, x)."""

    equations: list[Equation]
    points: list[list[Point]]
    computed: list[np.ndarray]
    changes: list[np.ndarray]
    motions: list[np.ndarray]


class Residuals:
    """Of the measured responses, over the unknowns."""

    def __init__(
        self,
        start: ContactProblem,
        force: np.ndarray,
        measured: list[MeasuredResponse],
        unknowns: list[Unknown],
        options: Any,
    ) -> None:
        self.start, self.force, self.measured = start, force, measured
        self.unknowns, self.options = unknowns, options
        self.names = tuple(one.name for one in unknowns)
        self.progress: Progress | Literal[False] = False

    def problem_at(self, theta: np.ndarray) -> ContactProblem:
        """With the unknowns at exp(theta) of what they start from."""
        found = self.start
        zeta = ratios(found.damping_ratio, len(found.receptance().ratio))
        for one, factor in zip(self.unknowns, np.exp(theta), strict=True):
            zeta[list(one.modes)] *= factor
            for setting in one.settings:
                found = found.with_contacts(ContactSetting(setting).scaled(found, factor))
        if not (zeta < 1).all():
            raise InputError("fit_damping: a damping ratio grows beyond 1: the model does not fit")
        found = replace(found, damping_ratio=zeta)
        found.receptance()  # modes that hold for every contact
        return found

    def solved(
        self, theta: np.ndarray, before: Solved | None = None, way: np.ndarray | None = None
    ) -> Solved:
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
        return Solved(*map(list, zip(*parts, strict=True)))

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
        (equation, points), outputs, found = restored(curve, problem), Outputs(one.output), []
        for value, wanted in zip(hz, one.response, strict=True):
            here = np.flatnonzero(curve.converged & np.isclose(curve.frequency, value, 1e-12, 0.0))
            there = [
                solve_fixed(equation.evaluate, p.x, p.parameter, equation.weights)
                for p in (points[i] for i in here)
            ]
            there = [p for p in there if p.converged]
            if not there:
                raise InputError(f"fit_damping: no solution at {value:g} Hz; {curve.ended}")
            each = (outputs.at(p.detail)[:, 1] for p in there)
            far = [abs(_measure(X, wanted)[0] - wanted) for X in each]
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
        unknown: Unknown,
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

    def residual(self, solved: Solved) -> np.ndarray:
        """(values,) differences by their deviations."""
        pairs = zip(solved.computed, self.measured, strict=True)
        return _joined([(a - one.response) / one.deviation for a, one in pairs])

    def jacobian(self, solved: Solved) -> np.ndarray:
        """(values, p)."""
        pairs = list(zip(solved.changes, self.measured, strict=True))
        columns = [
            _joined([change[:, j] / one.deviation for change, one in pairs])
            for j in range(len(self.unknowns))
        ]
        return np.column_stack(columns)

    def half_widths(self, solved: Solved) -> np.ndarray:
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

    def squares(self, solved: Solved) -> float:
        """The sum of them, of the differences by their deviations."""
        return float(np.linalg.norm(self.residual(solved)) ** 2)

    def as_good(self, squares: float) -> float:
        """The largest sum of squares that is one within the scatter: of a 95 % interval."""
        free = sum(one.values for one in self.measured) - len(self.unknowns)
        return squares * (1 + stdtrit(free, 0.5 + CONFIDENCE / 2) ** 2 / free)


def _remedy(unknown: Unknown) -> str:
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
