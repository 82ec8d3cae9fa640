"""One branch of extrema: from one of them over the parameter, until it reaches a value, meets an
extremum of the other kind, or is lost."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import nnls

from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.corrector import reverse, solve_fixed
from tipdamp.hbm.continuation.crossings import insert_crossings
from tipdamp.hbm.continuation.follow import Budget, BudgetExceeded, follow
from tipdamp.hbm.continuation.point import Metric, Point, size
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.curve.trace import unrestrained
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.following.case import Case, Extreme
from tipdamp.hbm.following.extremum import NEAR as NEAR_DERIVATIVES
from tipdamp.hbm.following.extremum import Extremum, ExtremumLinearisation, metric_at

NEAR = 0.1  # arc length up to which a place belongs to the branch before
# of a chord: what two tangents at its ends do not explain, with a kink between them; more is a jump
ASIDE = 0.5
SHORT = 1e-4  # arc length of a chord that is rounding beside the tangents
FIRST = 40  # evaluations within which a top is solved, or not at all
LOWER = 1e-3  # of a height: by more a solution is a smooth maximum beside a top that is a kink
SECANTS = 8  # to the border of the band
AT_BORDER = 1e-6  # of the frequency of that border
CRAWLS = 20  # steps in a row as short as that: a kink ends the branch
LEAST = 1e-4  # arc length of a step over a peak: where none is that long it stands at a kink
MET = {
    "peak": "the peak meets a minimum of the curve, and is none beyond",
    "fold": "two folds meet, and the curve does not turn back there beyond",
}


class Met(BudgetExceeded):
    """A maximum has met a minimum: what follows is the minimum."""


class Crawled(BudgetExceeded):
    """The steps stay short: a kink that Newton's method hardly passes."""


class Left(BudgetExceeded):
    """The peak has left the band."""


class Refused(BudgetExceeded):
    """The parameter makes no problem any more."""


class Found(BudgetExceeded):
    """What was looked for is found."""


@dataclass(frozen=True)
class Run:
    """A branch of extrema of one output.

    points : solved, in their order; column : of the output; calls : of the residual
    why : it ends short of the value, in words; empty where it reaches it
    enough : whether it ends as what was looked for is found
    refused : whether it ends where the parameter makes no problem any more
    drift : the end of `why` where nothing restrains a mean motion there; else empty
    fitted : whether the points are maxima of pieces of a curve, not solutions of the equation
    kink : whether it ends at a kink, beyond which the peak may go on
    """

    equation: Extremum
    points: list[Point]
    column: int
    calls: int
    why: str = ""
    enough: bool = False
    refused: bool = False
    drift: str = ""
    fitted: bool = False
    kink: bool = False

    @property
    def values(self) -> np.ndarray:
        """(n,) of the parameter, in units of the branch."""
        return np.array([p.parameter for p in self.points])

    def heights(self, case: Case) -> np.ndarray:
        """(n,) m of its output."""
        return np.array([case.heights(p.detail.found)[self.column] for p in self.points])

    def backwards(self) -> "Run":
        """From its end to its begin."""
        return replace(self, points=[reverse(p) if p.tangent else p for p in self.points[::-1]])

    def at(self, value: float) -> bool:
        """Solve it at a value between two of its points; whether it is."""
        if value in self.values:
            return True
        if self.fitted or len(self.points) < 2:
            return False
        branch = Branch(self.points)
        settings = self.equation.settings
        insert_crossings(self._near, branch, np.array([value]), self.equation.weights, settings)
        return value in self.values

    def _near(self, y: np.ndarray, p: float) -> ExtremumLinearisation:
        """The equation that looks forward as the nearest point of the branch does: the way of the
        last one may be backwards there."""
        equation = self.equation
        apart = [equation.apart(q.x - y, q.parameter - p, q.detail) for q in self.points]
        equation.look_along(self.points[int(np.argmin(apart))].detail.tangent)
        return equation.evaluate(y, p)


def equation_of(case: Case, top: Extreme) -> Extremum:
    """The equation of an extremum, around a top."""
    balance = case.balance()
    metric = metric_at(balance.weights, top.x, top.w)
    forward = np.zeros(len(top.x)), 1.0
    if case.what == "fold":  # there the frequency is no way forward
        forward = metric.border(top.x / metric.size, 0.0)
    slope = case.slope(top.column)
    grows = case.what == "peak"
    return Extremum(
        balance, case.parameter, slope, metric, top.w, forward, case.settings, grows=grows
    )


def run_from(
    case: Case,
    top: Extreme,
    ends: tuple[float, float],
    found: Callable[[Point], bool] = lambda point: False,
) -> Run | None:
    """The branch from a top at the first of two values (units of the branch) towards the second;
    None where the equation of an extremum is not solved there, as at a kink.

    found(point) : of each new point, whether it is the last one
    """
    # a gap would be bridged to whatever is found: here it is an end; derivatives of the extremum
    # are taken again now and then only, so that Newton is linear and the last step is evaluated
    settings = replace(case.settings, max_gaps=0, places_ahead=1, last_step=0.0)
    if case.what == "peak":
        settings = replace(settings, smallest_step=LEAST)
    equation, begin = begin_at(case, top, ends[0])
    if begin is None:
        return None
    watch = _Watch(case, equation, begin, found, settings)
    equation.balance.on_call = watch.budget.call
    branch = follow(watch.evaluate, begin, ends[1], equation.weights, settings, watch.report)
    equation.balance.on_call = None
    branch.points = [p for p in branch.points if p.converged]
    met = watch.is_other(branch.points[-1])
    if met:
        _to_the_meeting(equation, branch, np.sign(ends[1] - ends[0]), settings)
    left = watch.is_outside(branch.points[-1])
    if left:
        _to_the_border(case, equation, branch)
    last = branch.points[-1]
    whole = len(branch.points)
    branch.points = branch.points[: _first_jump(equation, branch.points)]
    cut = len(branch.points) < whole or watch.short == CRAWLS
    enough = not (met or cut or left or branch.complete) and len(branch.points) > 1 and found(last)
    run = Run(equation, branch.points, top.column, branch.calls)
    if enough:
        why = f"at {case.named(last.parameter)} another output has the larger peak"
        return replace(run, why=why, enough=True, refused=bool(watch.refused))
    return _ended(run, branch, watch, left=left, met=met, cut=cut)


def _ended(run: Run, branch: Branch, watch: "_Watch", *, left: bool, met: bool, cut: bool) -> Run:
    """With the words on why it ends short of the value; left : it left the band; met : an extremum
    of the other kind; cut : where it jumps or crawls."""
    case = watch.case
    last = branch.points[-1]
    place = case.named(last.parameter)
    if left:
        return replace(run, why=f"at {place} the peak leaves the band")
    if watch.refused:
        return replace(run, why=f"stopped at {place}: {watch.refused}", refused=True)
    if branch.complete and not cut:
        return run
    drift = unrestrained(replace(last, detail=last.detail.found), case.problem)
    if drift:
        return replace(run, why=f"stopped at {place}{drift}", drift=drift)
    if met:
        return replace(run, why=f"at {place} {MET[case.what]}")
    if cut or branch.end in ("lost", "no point"):
        why = f"at {place} a kink of the curve ends the branch of {case.what}s"
        return replace(run, why=why, kink=True)
    return replace(run, why=branch.sentence(case.named))


class _Watch:
    """Ends a branch of extrema where it is none any more, or found(point) is true.

    short : steps in a row that were short; refused : why the parameter makes no problem any more,
    in words
    """

    def __init__(
        self,
        case: Case,
        equation: Extremum,
        begin: Point,
        found: Callable[[Point], bool],
        settings: Settings,
    ) -> None:
        self.case = case
        self.equation = equation
        self.found = found
        first = begin.parameter / case.parameter.scale
        self.budget = Budget(settings, case.progress, first, len(equation.weights))
        self.sign = np.sign(begin.detail.curvature)
        self.short = 0
        self.refused = ""

    def evaluate(self, y: np.ndarray, p: float) -> ExtremumLinearisation:
        """As that of the equation."""
        try:
            return self.equation.evaluate(y, p)
        except InputError as error:
            named = self.case.named(p)
            self.refused = self.refused or f"{named}: {str(error).removeprefix(f'{named}: ')}"
            raise Refused from None

    def report(self, point: Point, step: float) -> None:
        """Of each new point."""
        self.short = self.short + 1 if step < SHORT else 0
        self.budget.point(point.parameter / self.case.parameter.scale, step, point.iterations)
        if point.detail is None or not point.converged:
            return
        self.equation.look_along(point.detail.tangent)
        if self.is_other(point):
            raise Met
        if self.is_outside(point):
            raise Left
        if self.found(point):
            raise Found
        if self.short == CRAWLS:
            raise Crawled

    def is_other(self, point: Point) -> bool:
        """Whether it is an extremum of the other kind."""
        return bool(np.sign(point.detail.curvature) != self.sign)

    def is_outside(self, point: Point) -> bool:
        """Whether it is a peak outside the band."""
        return self.case.what == "peak" and not self.case.inside(point.detail.found.w)


def begin_at(case: Case, top: Extreme, p: float) -> tuple[Extremum, Point | None]:
    """(equation, its solution at a top), None where it has none that near; of a fold the nearest
    point of a curve is known only."""
    equation = equation_of(case, top)
    y = equation.unknowns(top.x, top.w)
    begin = solve_fixed(equation.evaluate, y, p, equation.weights, case.settings, FIRST)
    if not begin.converged:  # once more with derivatives of every place, where they change fast
        equation.near = 0.0
        equation.recent = None
        begin = solve_fixed(equation.evaluate, y, p, equation.weights, case.settings, FIRST)
        equation.near = NEAR_DERIVATIVES
    if not begin.converged or case.what == "fold":
        return equation, begin if begin.converged else None
    high = case.heights(begin.detail.found)[top.column] > (1 - LOWER) * height_of(case, top, p)
    return equation, begin if equation.near_top(begin, y) and high else None


def height_of(case: Case, top: Extreme, p: float) -> float:
    """m, of a top at a value."""
    found = case.parameter.held(case.balance(), top.x, top.w, p)
    return float(case.heights(found)[top.column])


def near(found: Linearisation, x: np.ndarray, w: float) -> bool:
    """Whether x (n,) and w lie near a point of a curve: on the same branch of peaks."""
    metric = metric_at(found.balance.weights, found.x, found.w)
    return metric.norm(found.x - x, found.w - w) < NEAR


def _to_the_meeting(equation: Extremum, branch: Branch, sense: float, settings: Settings) -> None:
    """End the branch where the parameter turns back: there maximum and minimum are one."""
    a, b = branch.points[-2:]
    equation.near = 0.0
    equation.recent = None
    metric = arc.metric_at(a, equation.weights)

    def measure(point: Point) -> arc.MeasuredPoint:
        return arc.MeasuredPoint(
            point, sense * point.parameter, sense * point.tangent[1] / metric.norm(*point.tangent)
        )

    ends = measure(a), measure(b)
    if not ends[0].slope > 0 > ends[1].slope:
        branch.points.pop()
        return
    top = arc.maximum(equation.evaluate, ends, measure, metric, settings).best
    branch.points[-1:] = [] if top.point is a else [top.point]


def _to_the_border(case: Case, equation: Extremum, branch: Branch) -> None:
    """End the branch where its frequency leaves the band, by regula falsi: at a place inside, which
    a way from outside alone would never reach."""
    upper = branch.points[-1].detail.found.w > 2 * np.pi * case.band[1]
    border = 2 * np.pi * case.band[upper]
    within = 0.5 * AT_BORDER * border
    aim = border - within if upper else border + within
    run = Run(equation, branch.points[-2:], 0, 0)
    for _ in range(SECANTS):
        a, b = run.points
        w = [q.detail.found.w - aim for q in (a, b)]
        p = a.parameter - w[0] * (b.parameter - a.parameter) / (w[1] - w[0])
        if p in run.values or not run.at(p):
            break
        middle = run.points[1]
        inside = case.inside(middle.detail.found.w)
        run = replace(run, points=[middle, b] if inside else [a, middle])
        if abs(middle.detail.found.w - aim) < within:
            break
    branch.points[-1:] = [] if run.points[0] is branch.points[-2] else [run.points[0]]


def _first_jump(equation: Extremum, points: Sequence[Point]) -> int:
    """Number of points up to a chord that the tangents at its ends do not explain."""
    for i, (a, b) in enumerate(pairwise(points), 1):
        motion = size(equation.balance.weights * a.x[:-1])
        metric = Metric(equation.weights, motion, 0.1 * max(abs(a.parameter), 1e-300))
        if a.tangent is None or b.tangent is None:
            continue
        chord = _vector(metric, b.x - a.x, b.parameter - a.parameter)
        long = np.linalg.norm(chord)
        if long <= SHORT:
            continue
        ways = np.column_stack([_unit(_vector(metric, *q.tangent)) for q in (a, b)])
        if nnls(ways, chord / long)[1] > ASIDE:
            return i
    return len(points)


def _vector(metric: Metric, dx: np.ndarray, dp: float) -> np.ndarray:
    return np.r_[metric.weights * dx / metric.size, dp / metric.length]


def _unit(v: np.ndarray) -> np.ndarray:
    return v / max(np.linalg.norm(v), 1e-300)
