"""Named points of a curve: where it folds, loses or regains stability, and where contacts begin to
slip, lift off or part.

What tells the kind of a point changes between two neighbouring points of the curve: the side to
which the parameter runs, how many Floquet multipliers lie outside the unit circle, and in which of
stick, slip and gap a contact is during the cycle. A fold is solved as the extremum of the
parameter; every other change is enclosed by the share of the cycle or the modulus that passes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.balance.symmetry import kept_by_symmetry
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.corrector import between
from tipdamp.hbm.continuation.crossings import with_tangent
from tipdamp.hbm.continuation.enclosing import enclosed
from tipdamp.hbm.continuation.point import Metric, Point, size
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.curve.truncation import TruncationEstimate
from tipdamp.hbm.named_point import Kind, NamedPoint
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.stability.multipliers import Stability

ENCLOSED = 1e-5  # arc length: a hundredth of that, relative, in the parameter
SHARE = 1e-6  # of the cycle, above which a contact slips or is open
JUMP = 0.02  # of a multiplier at the unit circle: with more it has not passed, but jumped
SYMMETRIC = 1e-6  # of the motion, within which it has a symmetry
ITERATIONS = 30  # of the inverse iteration for the direction in which it is lost
ALIKE = 1e-4  # of a multiplier, from 1: nearer it may be missing on the other side
AWAY = 1.0  # arc length of several steps: a fold is no farther from the points beside it
AT_END = 1e-3  # arc length: nearer to an end of the curve, it is where this one leaves another
BESIDE = 1e-3  # of the way from a fold to the next point
LOOKED = 2  # points at which contacts open, at most, at which multipliers are looked at too
PASSES = 4  # of multipliers through the circle between two points of the curve, one after another
REAL = 1e-3  # imaginary part, relative, below which a multiplier is real


@dataclass(frozen=True)
class _Leading:
    """The leading multipliers (k,) of a point; none where they are not known."""

    multipliers: np.ndarray

    @property
    def known(self) -> bool:
        """Whether there are multipliers."""
        return len(self.multipliers) > 0

    @property
    def upwards(self) -> np.ndarray:
        """(k,) bool: the real positive multipliers."""
        return (np.abs(self.multipliers.imag) <= REAL) & (self.multipliers.real > 0)

    @property
    def outside(self) -> int:
        """Multipliers outside the unit circle."""
        return int((np.abs(self.multipliers) > 1).sum())

    @property
    def beside(self) -> int:
        """Those of them that are not real and positive."""
        return int((np.abs(self.multipliers[~self.upwards]) > 1).sum())


CONTACTS: dict[Kind, Callable[[np.ndarray], np.ndarray]] = {  # by their shares of the cycle (P, 3)
    "onset of slip": lambda shares: shares[:, 1],
    "lift-off": lambda shares: shares[:, 2],
    "separation": lambda shares: 1 - shares[:, 2],
}
Near = tuple[Point, Point]


def named_points(
    curve: ForcedResponse,
    problem: AnyProblem,
    parameter: Parameter | None = None,
    stability: bool = True,
    on_call: Callable[[], None] | None = None,
) -> tuple[NamedPoint, ...]:
    """The named points of a curve, in the order of the curve.

    problem : the ContactProblem that the curve was made with; parameter : as in `solutions_at`;
    stability : False leaves out what multipliers tell, which costs most; on_call : called at each
    evaluation of the equations, for progress
    What begins and ends between two neighbouring points of the curve is not seen. Raises InputError
    where the problem is another one.

    >>> blade = Problem([[1.0]], [[0.02]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 0.02)
    >>> curve = blade.follow_band((0.14, 0.24), outputs={"tip": 0})
    >>> for point in named_points(curve, blade.contact_problem):
    ...     print(f"{point.kind} at {point.frequency:.4f} Hz, {point.multiplier.real:.2f}")
    fold at 0.1952 Hz, 1.00
    fold at 0.1687 Hz, 1.00
    """
    equation, points = restored(curve, problem, parameter)
    equation.balance.on_call = on_call
    return _Along(curve, equation, points, stability).every()


class _Along:
    """A curve whose points are looked at, one interval after the other."""

    def __init__(
        self, curve: ForcedResponse, equation: Equation, points: list[Point], stability: bool
    ) -> None:
        self.curve = curve
        self.equation = equation
        self.points = points
        self.outputs = Outputs(curve.output_rows)
        self.estimate = None
        if stability:
            self.estimate = TruncationEstimate(equation, curve.output_rows, Stability())
        self._known = dict[int, tuple[Point, _Leading]]()
        self.silent = list[int]()  # places of folds at which no multiplier passes 1

    def every(self) -> tuple[NamedPoint, ...]:
        """All named points."""
        found = list[tuple[float, NamedPoint]]()
        before = None
        stored = self.curve.multipliers
        if not stored.size:
            stored = np.full((len(self.points), 1), np.nan)
        for i, point in enumerate(self.points):
            if not point.converged:
                before = None
                continue
            metric = arc.metric_at(point, self.equation.weights)
            here = with_tangent(self.equation.evaluate, self.points, i, metric)
            if self.estimate and np.isfinite(stored[i]).any():
                self._known[id(here)] = here, _Leading(stored[i][np.isfinite(stored[i])])
            if before is not None and not point.jump:
                found += self._between(before, here, i - 1, metric)
            if before is not None:
                before.detail.forget()
            before = here
        found.sort(key=lambda placed: placed[0])
        return tuple(named for _, named in found if not self._of_a_fold(named))

    def _of_a_fold(self, named: NamedPoint) -> bool:
        """Whether a multiplier passes 1 just beside a fold: the fold is that of the orders kept,
        the multiplier that of the motion with the orders above too."""
        near = (abs(named.index - index) <= 1 for index in self.silent)
        return named.kind == "branch point" and any(near)

    def _between(
        self, a: Point, b: Point, index: int, metric: Metric
    ) -> list[tuple[float, NamedPoint]]:
        """(place, named point) of all changes between two neighbouring points of the curve."""
        turn = self._fold(a, b, metric)
        # in a hairpin the arc leaves its chord: its sides are looked at one by one
        sides = [(a, b)] if turn is None else [(a, turn), (turn, b)]
        found = list[tuple[float, NamedPoint]]()
        opens = list[Point]()

        def named(
            kind: Kind,
            near: Near,
            contact: int = -1,
            multiplier: complex = complex("nan"),
            side: int = 0,
        ) -> None:
            p, q = near
            begin, end = sides[side]
            way = arc.distance(begin, q, metric) / max(arc.distance(begin, end, metric), 1e-300)
            place = index + (side + min(way, 1 - 1e-9)) / len(sides)
            within = abs(p.parameter - q.parameter)
            found.append((place, self._named(kind, q, within, index, contact, multiplier)))

        if turn is not None:
            named("fold", (turn, turn), multiplier=self._at_one(turn, (a, b), metric))
        for (kind, of), (side, (one, other)) in product(CONTACTS.items(), enumerate(sides)):
            begun, ended = (of(_shares(end)) > SHARE for end in (one, other))
            for contact in np.flatnonzero(begun != ended).tolist():
                near = self._of_contact(contact, of, one, other, metric)
                named(kind, near, contact, side=side)
                opens += [near[1]] * (kind != "onset of slip")
        if turn is not None and not self._differ(a, b):
            self.silent.append(index)
        for before, after in pairwise(self._looked_at(a, b, opens, metric)):
            self._stability(before, after, turn is not None, metric, named)
        return found

    def _looked_at(self, a: Point, b: Point, opens: list[Point], metric: Metric) -> list[Point]:
        """The points from a to b whose multipliers are looked at: where contacts open they may
        leave the unit circle and come back, so there and half way too."""
        if not 0 < len(opens) <= LOOKED or not self.estimate:
            return [a, b]
        opens.sort(key=lambda point: arc.distance(a, point, metric))
        found = [a]
        for point in (*opens, b):
            if arc.distance(found[-1], point, metric) <= ENCLOSED:  # two that open at one instant
                continue
            middle = between(self.equation.evaluate, found[-1], point, 0.5, metric.weights)
            if arc.lies_between(middle, found[-1], point, metric):
                found.append(middle)
            found.append(point)
        return [*found[:-1], b] if len(found) > 1 else [a, b]

    def _stability(
        self,
        a: Point,
        b: Point,
        folds: bool,
        metric: Metric,
        named: Callable[..., None],
        most: int = PASSES,
    ) -> None:
        """Name what multipliers tell between two points, at most so many times, beside what a fold
        itself does to them."""
        if not self._differ(a, b) or not most:
            return
        if self._leading(a).beside != self._leading(b).beside:
            near = self._enclosed(a, b, metric, lambda here: here.beside)
            ends = False
        elif not folds:
            near = self._enclosed(a, b, metric, lambda here: here.outside)
            ends = self._at_end(near[1], metric)
        else:
            return
        # a pair outside the circle that becomes two real ones there has passed nothing
        if self._differ(*near) and not ends:
            named(*self._passed(near))
        for one, other in ((a, near[0]), (near[1], b)):
            self._stability(one, other, folds, metric, named, most - 1)

    def _differ(self, a: Point, b: Point) -> bool:
        """Whether as many multipliers are not outside the unit circle at both points."""
        start, end = self._leading(a), self._leading(b)
        return start.known and end.known and start.outside != end.outside

    def _fold(self, a: Point, b: Point, metric: Metric) -> Point | None:
        """The point between at which the parameter turns back; None where it does not, or where it
        does so at an end of the curve, on another one."""
        ways = [np.sign(end.tangent[1]) for end in (a, b)]
        if ways[0] * ways[1] >= 0:
            return None

        def measure(point: Point) -> arc.MeasuredPoint:
            slope = point.tangent[1] / metric.norm(*point.tangent)
            return arc.MeasuredPoint(point, ways[0] * point.parameter, ways[0] * slope)

        ends = measure(a), measure(b)
        found = arc.maximum(self.equation.evaluate, ends, measure, metric, DEFAULT).best.point
        # where the curve turns sharply, onto a branch beside, what is found may lie anywhere
        far = max(1.2 * arc.distance(a, b, metric), AWAY)
        beside = all(arc.distance(end, found, metric) <= far for end in (a, b))
        return found if beside and not self._at_end(found, metric) else None

    def _at_end(self, point: Point, metric: Metric) -> bool:
        """Whether a point is the first or the last of a curve that is not closed."""
        first, last = self.points[0], self.points[-1]
        if first.converged and last.converged and arc.distance(first, last, metric) <= AT_END:
            return False
        ends = (end for end in (first, last) if end.converged)
        return any(arc.distance(end, point, metric) <= AT_END for end in ends)

    def _at_one(self, fold: Point, ends: Near, metric: Metric) -> complex:
        """The multiplier at a fold between points: the nearest to 1. NaN where none is near, as
        where multipliers jump across it, or more orders change the motion."""
        nearest = self._nearest_one(fold)
        if abs(nearest - 1) <= JUMP or np.isnan(nearest):
            return nearest
        end = max(ends, key=lambda end: arc.distance(fold, end, metric))
        beside = between(self.equation.evaluate, fold, end, BESIDE, metric.weights)
        # one that is 1 to rounding is taken for one of what nothing holds
        return 1 + 0j if abs(self._nearest_one(beside) - 1) <= JUMP else complex("nan")

    def _nearest_one(self, point: Point) -> complex:
        multipliers = self._leading(point).multipliers
        return _nearest(multipliers, multipliers - 1)

    def _enclosed(
        self, a: Point, b: Point, metric: Metric, of: Callable[["_Leading"], int]
    ) -> Near:
        """Two neighbouring points between which a number of multipliers outside the unit circle
        changes."""
        first = of(self._leading(a))

        def measure(point: Point) -> float:
            here = self._leading(point)
            away = np.abs(np.abs(here.multipliers) - 1).min(initial=np.inf)
            return float(away if of(here) == first else -away)

        return enclosed(self.equation.evaluate, a, b, measure, metric, ENCLOSED)

    def _of_contact(self, contact: int, of: Callable, a: Point, b: Point, metric: Metric) -> Near:
        """The same of the share of the cycle of a contact, which grows with the root of the
        distance."""

        def measure(point: Point) -> float:
            share = of(_shares(point))[contact]
            return float(share**2 if share > SHARE else -np.inf)

        return enclosed(self.equation.evaluate, a, b, measure, metric, ENCLOSED)

    def _passed(self, near: Near) -> tuple[Kind, tuple[Point, Point], int, complex]:
        """(kind, near, contact, multiplier) of what changes the stability between two points."""
        both = [self._leading(point).multipliers for point in near]
        through = [_nearest(multipliers, np.abs(multipliers) - 1) for multipliers in both]
        # on one side it may be taken for one of what nothing holds
        multiplier = min(through, key=lambda one: abs(abs(one) - 1))
        kind: Kind = "Neimark-Sacker"
        away = abs(abs(multiplier) - 1)
        a, b = (complex(one.real, abs(one.imag)) for one in through)
        if not away <= JUMP or away > ALIKE and abs(a - b) > JUMP:
            kind = "grazing"
        elif abs(multiplier.imag) <= REAL:
            kind = self._at_plus_one(near[1]) if multiplier.real > 0 else "period doubling"
        return kind, near, -1, multiplier

    def _at_plus_one(self, point: Point) -> Kind:
        """What the motion loses in the direction in which the Jacobian is singular."""
        keeps = kept_by_symmetry(*self.equation.balance_at(point.parameter), point.x, SYMMETRIC)
        if keeps is None:
            return "branch point"
        v = np.random.default_rng(0).normal(size=len(point.x))
        zero = np.zeros(len(v))
        here = self.equation.evaluate(point.x, point.parameter)
        for _ in range(ITERATIONS):
            v = here.solve(zero, 1.0, 0.0, -v)[0]
            v /= size(v)
        return "branch point" if size(keeps(v)) > 0.5 else "symmetry breaking"

    def _leading(self, point: Point) -> _Leading:
        if id(point) not in self._known:
            multipliers = np.empty(0, dtype=complex)
            if self.estimate:
                multipliers = self.estimate.multipliers(point)
            self._known[id(point)] = point, _Leading(multipliers[np.isfinite(multipliers)])
        return self._known[id(point)][1]

    def _named(
        self, kind: Kind, point: Point, within: float, index: int, contact: int, multiplier: complex
    ) -> NamedPoint:
        parameter = self.equation.parameter
        hz = self.equation.hz
        value = point.parameter / parameter.scale
        return NamedPoint(
            kind,
            float(value),
            float(parameter.frequencies(hz, np.array([value]))[0]),
            float(within / parameter.scale),
            index,
            contact,
            None if np.isnan(multiplier) else multiplier,
            tuple(self.outputs.amplitudes([point])[0][0].tolist()),
        )


def _nearest(multipliers: np.ndarray, away: np.ndarray) -> complex:
    """That of the multipliers (k,) that is least away; NaN without any."""
    return complex(multipliers[np.abs(away).argmin()]) if len(multipliers) else complex("nan")


def _shares(point: Point) -> np.ndarray:
    """(P, 3) of the cycle: stick, slip, open."""
    return point.detail.forces.shares
