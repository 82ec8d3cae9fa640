"""Curves beside a curve: detached resonances and other branches of its band."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from tipdamp.hbm import tables
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.closed import follow_both_ways
from tipdamp.hbm.continuation.corrector import solve_fixed
from tipdamp.hbm.continuation.crossings import crossings
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.drawn import refine_drawn
from tipdamp.hbm.curve.equilibrium import settle, with_residuals
from tipdamp.hbm.curve.folds_and_transitions import named_points
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.peaks import refine_largest
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.curve.trace import record
from tipdamp.hbm.curve.truncation import TruncationEstimate, with_estimates
from tipdamp.hbm.curve.watched import Progress, watched
from tipdamp.hbm.drawing import pictures
from tipdamp.hbm.errors import InputError, library
from tipdamp.hbm.result import SEARCH_STOPPED, ForcedResponse
from tipdamp.hbm.search.beside import Beside, Search
from tipdamp.hbm.search.levels import AtLevel, places
from tipdamp.hbm.stability.multipliers import Stability

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

# the cheapest way everywhere, before the others: the effort may not last
WAYS: tuple[Callable[[Beside], Iterator[np.ndarray]], ...] = (
    Beside.above_level,
    Beside.over_level,
    Beside.from_starts,
)


@dataclass(frozen=True)
class CurvesBeside:
    """What was found beside a curve.

    curve : the first one, which holds what was looked for (`ForcedResponse.searched`)
    curves : a ForcedResponse each, over the band of the first curve; closed ones begin and end at
        their lowest frequency
    places, solutions : (k,) values of the parameter at which was looked, and the number of all
        solutions known there afterwards: those of the first curve, of which a fold makes several,
        and the further ones that were found, also beyond the last curve that is followed

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> found: CurvesBeside = curves_beside(curve, problem, Search(frequencies=2, starts=5))
    >>> found.curve.searched.partition(": ")[2]
    'no further curve found'
    """

    curve: ForcedResponse
    curves: tuple[ForcedResponse, ...]
    places: tuple[float, ...]
    solutions: tuple[int, ...]

    def plot(self, *names: str, unit: str = "m", ax: "Axes | None" = None) -> "Axes":
        """Draw the first curve, and thin in the same colours what was found beside it.

        Arguments, return value and errors as in `ForcedResponse.plot`.
        """
        drawn = names or tuple(self.curve.output_names.tolist())
        colors = [pictures.free_color(ax, k) for k in range(len(drawn))]
        on = self.curve.plot(*drawn, unit=unit, ax=ax)
        for other in self.curves:
            for name, color in zip(drawn, colors, strict=True):
                other.plot(name, unit=unit, label="", color=color, width=0.9, ax=on)
        return on

    def to_pandas(self, kind: str = "half_peak_to_peak") -> "pandas.DataFrame":
        """The rows of `ForcedResponse.to_pandas` of all curves, by the number of the curve, 0 for
        the first one. Raises InputError where pandas is not installed."""
        frames = [one.to_pandas(kind) for one in (self.curve, *self.curves)]
        keys = range(len(frames))
        return library("pandas", "to_pandas").concat(frames, keys=keys, names=["curve"])

    def _repr_html_(self) -> str:
        rows = {"searched": self.curve.searched}
        for name in self.curve.output_names.tolist():
            for k, one in enumerate((self.curve, *self.curves)):
                at, height = one.at_least(name)
                rows[f"largest of {name}, curve {k}"] = f"{height:.4g} m at {at:.6g}"
        return tables.notebook_table(f"{len(self.curves)} curves beside the first", rows)


class _LimitReached(Exception):
    """The search has made as many residual calls, or taken as long, as it may."""


def curves_beside(
    curve: ForcedResponse,
    problem: AnyProblem,
    search: Search | None = None,
    parameter: Parameter | None = None,
    progress: Callable[[int, int], None] | Literal[False] | None = None,
    crossed: Sequence[AtLevel] = (),
) -> CurvesBeside:
    """Look for solutions beside a complete curve at some frequencies of its band, and follow each
    both ways: once round where its curve is closed, else to the ends of the band.

    problem : the ContactProblem that the curve was made with; search : how far is looked, None for
    the default; parameter : as in `solutions_at`; progress : function (values looked at, curves
    found), called before each value; without one a terminal or a notebook shows a line, and False
    shows nothing; crossed : what branches over the level have crossed (`over_levels`): their values
    take the place of those of the search, which goes on from there
    None found is no proof that there is none. Raises InputError where the curve is incomplete or
    the problem is another one.

    >>> M, C = np.diag([1, 0.05]), np.array([[0.01, -0.005], [-0.005, 0.005]])
    >>> K = [[1.015, -0.015], [-0.015, 0.015]]
    >>> driven = Problem(M, C, K).add(CubicSpring(0.2 / 3), (0, 1)).force(0, 0.0311)
    >>> curve = driven.follow_band((0.0955, 0.2546), outputs={"x": 0}, harmonics=1, samples=16)
    >>> beside = curves_beside(curve, driven.contact_problem, Search(frequencies=3, starts=4))
    >>> (detached,) = beside.curves
    >>> print(f"{curve.peak('x')[1]:.1f} m, but detached {detached.peak('x')[1]:.1f} m")
    0.3 m, but detached 5.8 m
    """
    search = search or Search()
    if not curve.complete:
        raise InputError(f"curves_beside: the curve is incomplete, {curve.ended}")
    equation, points = restored(curve, problem, parameter)
    total = len(WAYS) * (len(crossed) or search.frequencies)
    shown = False if callable(progress) else progress
    with watched(shown, 0.0, total, f" of {total} searches") as line:
        told = progress or None, line
        looked = _Looked(curve, equation, points, search, told, crossed)
        looked.everywhere()
    outputs, of = (curve.output_names.tolist(), curve.output_rows), (problem, parameter)
    found = tuple(as_curve(branch, equation, outputs, of) for branch in looked.found)
    searched = replace(curve, searched=looked.words())
    places = {value: one for value, one in looked.besides.items() if value in looked.looked}
    counts = (len(beside.known) for beside in places.values())
    return CurvesBeside(searched, found, tuple(places), tuple(counts))


class _Looked:
    """State of a search: the branches known, those of them that were found, and what was done."""

    def __init__(
        self,
        curve: ForcedResponse,
        equation: Equation,
        points: list[Point],
        search: Search,
        told: tuple[Callable[[int, int], None] | None, Progress | None],
        crossed: Sequence[AtLevel],
    ) -> None:
        self.curve, self.equation, self.search, self.on_branches = curve, equation, search, crossed
        self.branches, self.found, self.stopped = [Branch(points)], list[Branch](), ""
        self.most = max(search.effort * curve.residual_calls, search.least_calls)
        self.until = time.monotonic() + search.seconds
        self.calls, self.tried, self.by_start = 0, 0, 0
        self.progress, self.line, self.searches = *told, 0
        self.besides, self.crossed = dict[float, Beside](), dict[float, int]()
        self.looked = set[float]()

    def everywhere(self) -> None:
        """Look at all places of the band of the curve."""
        scale, parameter = self.equation.parameter.scale, self.curve.parameter
        band = scale * float(parameter.min()), scale * float(parameter.max())
        try:
            if self.on_branches:
                values, ways = self._on_branches(band), WAYS[1:]
            else:
                values, ways = places(self.curve, self.equation, self.search.frequencies), WAYS
            for way in ways:
                for i, value in enumerate(values):
                    if self.progress:
                        self.progress(i, len(self.found))
                    self._check()
                    self._at(value, way, band)
                    self.looked.add(value)
                    self.searches += 1
        except _LimitReached as limit:
            if not self.on_branches:  # which have looked at their values
                self.stopped = f"{SEARCH_STOPPED} {limit}"
        finally:
            self.equation.balance.on_call = None
        if self.on_branches and len(self.looked) < self.search.frequencies and not self.stopped:
            calls = self.calls + sum(one.calls for one in self.on_branches)
            self.stopped = f"{SEARCH_STOPPED} {calls} evaluations of the residual"

    def _on_branches(self, band: tuple[float, float]) -> list[float]:
        """Follow what the branches over the level have crossed; the values where they reached the
        level of the curve."""
        here = [one for one in self.on_branches if one.reached]
        for one in here:
            if one.further:
                self._at(one.value, partial(Beside.on_branch, crossed=one.further), band)
            self.looked.add(one.value)
            self.searches += 1
        return [one.value for one in here]

    def words(self) -> str:
        """What was looked for and found."""
        n = len(self.found)
        found = f"{n} further curve{'s' * (n != 1)}" if n else "no further curve"
        stopped = f"; {self.stopped}, more may exist" if self.stopped else ""
        if self.by_start and not stopped:
            stopped = "; random starts led to some of them, more may exist"
        return (
            f"looked for further solutions at {len(self.looked)} of {self.search.frequencies} "
            f"values, over the level of the force{self._reach()} and from {self.tried} starts: "
            f"{found} found{stopped}"
        )

    def _reach(self) -> str:
        reach = min((one.reach for one in self.on_branches if one.reached), default=0.0)
        return f" up to {reach:.3g} times" * (reach > 0.0)

    def _beside(self, value: float) -> Beside:
        """The Beside of a value, which knows what the branches known hold there."""
        equation, p = self.equation, self.equation.parameter.scale * value
        if value not in self.besides:
            balance, w = equation.balance_at(p)
            self.besides[value], self.crossed[value] = (
                Beside(balance, w, [], self.search, DEFAULT),
                0,
            )
        beside, equation.balance.on_call = self.besides[value], self._call
        for branch in self.branches[self.crossed[value] :]:
            beside.add(self._crossing(branch, p))
            self.crossed[value] += 1
        equation.balance.on_call = None
        return beside

    def _at(self, value: float, way: Callable, band: tuple[float, float]) -> None:
        beside, p = self._beside(value), self.equation.parameter.scale * value
        known, balance = list(beside.known), beside.balance
        tried, by_start = beside.tried, beside.by_start
        try:
            balance.on_call = self._call
            for x in way(beside):
                if any(beside.same(x, other) for other in known):
                    continue
                if len(self.found) == self.search.curves:
                    self.stopped = f"stopped after {len(self.found)} further curves"
                    continue
                balance.on_call = None
                self._follow(x, p, band)
                here = self._crossing(self.branches[-1], p)
                beside.add(here)
                known += [x, *here]
                self.crossed[value] = len(self.branches)
                balance.on_call = self._call
        finally:
            balance.on_call = None
            self.tried += beside.tried - tried
            self.by_start += beside.by_start - by_start

    def _call(self) -> None:
        self.calls += 1
        self._show(0.0, self.calls)
        self._check()

    def _check(self) -> None:
        if self.calls > self.most or not self.most:
            raise _LimitReached(f"{self.most:.0f} evaluations of the residual")
        if time.monotonic() > self.until:
            raise _LimitReached(f"{self.search.seconds:g} s")

    def _show(self, step: float, calls: int) -> None:
        if self.line:
            self.line(self.searches, step, calls)

    def _crossing(self, branch: Branch, p: float) -> list[np.ndarray]:
        equation = self.equation
        found = crossings(equation.evaluate, branch.points, p, equation.weights, DEFAULT)
        there = [q.x for q in branch.points if q.converged and q.parameter == p]
        return there + [point.x for point, _, _ in found if point.converged]

    def _follow(self, x: np.ndarray, p: float, band: tuple[float, float]) -> None:
        equation = self.equation
        start = solve_fixed(equation.evaluate, x, p, equation.weights, DEFAULT)
        if not start.converged:
            return
        branch = follow_both_ways(
            equation.evaluate,
            start,
            band,
            equation.weights,
            DEFAULT,
            self.search.points,
            lambda point, step: self._show(step, point.iterations),
        )
        self.branches.append(branch)
        self.found.append(branch)


def as_curve(
    branch: Branch,
    equation: Equation,
    outputs: tuple[list[str], np.ndarray],
    of: tuple[AnyProblem, Parameter | None],
) -> ForcedResponse:
    """ForcedResponse of a branch, with its peaks solved, the estimate and the multipliers of every
    point, and its named points; outputs : (names, rows (m, r)); of : (problem, parameter) as given
    to `solutions_at`."""
    names, rows = outputs
    taken, marks = Outputs(rows), np.zeros((len(branch.points), len(rows)), dtype=bool)
    if len(branch.points) > 2:
        marks = refine_largest(equation, branch, taken, [[j] for j in range(len(rows))], DEFAULT)
        marks = refine_drawn(equation, branch, taken, marks, DEFAULT)
    ends = branch.points[0].parameter, branch.points[-1].parameter
    settled = settle(equation, branch.points, ends)
    held = marks, (0.0, 0.0)
    curve = record(branch, equation, (names, taken), False, held, 0.0)
    estimate = TruncationEstimate(equation, rows, Stability())
    curve = with_estimates(curve, estimate, branch.points)
    curve = with_residuals(curve, settled, equation, branch.points)
    return replace(curve, named_points=named_points(curve, *of))
