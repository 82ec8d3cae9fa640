"""Peaks: local maxima of the outputs along a curve, each solved."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tipdamp.hbm.amplitude import KINDS, RIPPLE, local_maxima, orders_of
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.crossings import with_tangent
from tipdamp.hbm.continuation.point import Metric, Point
from tipdamp.hbm.continuation.ripples import TooManyRipples, resolve
from tipdamp.hbm.continuation.settings import DEFAULT, Settings
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.errors import Doubt
from tipdamp.hbm.result import ForcedResponse


def refine_largest(
    equation: Equation,
    branch: Branch,
    outputs: Outputs,
    groups: Sequence[Sequence[int]],
    settings: Settings,
) -> np.ndarray:
    """Insert the solved maxima that were asked for, of half peak to peak, and say which points
    these are.

    groups : columns of outputs: of each group the largest and the smallest of their largest maxima
    are solved
    Returns (n, m) bool, for the branch as it is afterwards.
    """
    output = Output(equation, branch, outputs, settings)
    least = outputs.noise(branch.points)
    found: dict[int, tuple[arc.MeasuredPoint, bool]] = {}
    seen = np.nanmax(outputs.amplitudes(branch.points)[0], axis=0, initial=0.0) > least
    for group in groups:
        _solve_extremes(output, [j for j in group if seen[j]], found)
    place = {id(point): i for i, point in enumerate(branch.points)}
    marks = np.zeros((len(branch.points), len(outputs.rows)), dtype=bool)
    for j, (top, solved) in found.items():
        if solved:
            marks[place[id(top.point)], j] = True
    return marks


def _beside(points: Sequence[Point], heights: np.ndarray, high: np.ndarray) -> list[int]:
    """Places of the pieces of the branch with a `high` point at an end, both ends solved."""
    return [
        i
        for i in range(len(points) - 1)
        if (high[i] or high[i + 1])
        and np.isfinite(heights[i : i + 2]).all()
        and not points[i + 1].jump
    ]


def _solve_extremes(
    output: "Output", group: Sequence[int], found: dict[int, tuple[arc.MeasuredPoint, bool]]
) -> None:
    """Add the highest and the lowest of the largest maxima of a group of outputs to `found`,
    {output: (it, whether it is solved)}.

    An output that can be neither is left alone: its maximum lies between its highest point and a
    bound beside that."""
    for choose, guess in ((max, output.at_most), (min, lambda j, value: output.at_least(j))):
        first = choose(group, key=output.at_least, default=None)
        while first is not None and first not in found:
            found[first] = output.top(first)
            value = found[first][0].value
            known = {j: found[j][0].value if j in found else guess(j, value) for j in group}
            first = choose(known, key=known.__getitem__)


SAME = 1e-7  # of value and height: two maxima are one


def find_peaks(
    curve: ForcedResponse,
    problem: AnyProblem,
    name: str,
    kind: str = "half_peak_to_peak",
    parameter: Parameter | None = None,
    order: int | None = None,
) -> np.ndarray:
    """(k, 2) Hz and m of every local maximum of an output inside the band, the largest first;
    heights solved to 1e-8, where they lie to about the root of it.

    problem : the ContactProblem that the curve was made with; kind, order : as in
    ForcedResponse.amplitude
    parameter : as given to `follow_parameter`, where that was no name; then its values stand in
    place of Hz
    Ripples are left out: what is less than a thousandth of its height above the saddles beside it.
    Where a maximum could not be solved the highest point found stands for it, and of an incomplete
    curve the maxima between solved points are given, each with a warning. Raises InputError for an
    unknown output, kind or order, and where the problem does not fit the curve.

    >>> blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    >>> problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
    >>> curve = follow_band(problem, np.array([5.0]), (600, 1000), outputs={"tip": [1.0]})
    >>> hz, height = find_peaks(curve, problem, "tip", "rms")[0]
    >>> print(f"{hz:.1f} Hz, {1e6 * height:.1f} um")
    858.6 Hz, 33.1 um
    """
    j = curve.column(name)
    if not curve.complete:
        warnings.warn(
            f"maxima of '{name}': the curve is incomplete, others may be missing: {curve.ended}",
            Doubt,
            stacklevel=2,
        )
    heights = curve.amplitude(kind, order)[:, j]
    orders = orders_of(kind, order, curve.H, curve.force_orders)
    equation, points = restored(curve, problem, parameter)
    row = curve.output_rows[[j]]
    output = Output(equation, Branch(list(points)), Outputs(row, kind, orders), DEFAULT)
    if not np.nanmax(heights, initial=0.0) > _noise_of(curve, equation, points, row):
        return np.empty((0, 2))
    found = []
    known = curve.peak_points[:, j] if kind == KINDS[0] and curve.peak_points.size else heights < 0
    for i in local_maxima(heights, curve.jumps):
        if known[i]:
            found.append((curve.parameter[i], heights[i]))
            continue
        top, solved = output.largest(0, heights, beside(heights, i), points)
        value = top.point.parameter / equation.parameter.scale
        found.append((value, top.value))
        if not solved:
            warnings.warn(
                f"the maximum of '{name}' near {equation.parameter.named(value)} is not solved: "
                "the highest point found stands for it",
                Doubt,
                stacklevel=2,
            )
    table = np.reshape(found, (-1, 2))
    table = table[np.argsort(-table[:, 1], kind="stable")]
    return table[[not _among(one, table[:i]) for i, one in enumerate(table)]]


def _among(one: np.ndarray, others: np.ndarray) -> bool:
    """Whether a maximum is one of the others: two points beside it may lead to the same."""
    return bool((np.abs(others - one) <= SAME * np.abs(one)).all(axis=1).any())


def beside(heights: np.ndarray, i: int) -> np.ndarray:
    """(n,) bool: the points beside a local maximum i that may lie on ripples of the same peak."""
    low = ~(heights >= (1 - 2 * RIPPLE) * heights[i])
    first = np.flatnonzero(np.r_[True, low[:i]])[-1]
    last = i + np.flatnonzero(np.r_[low[i:], True])[0]
    return (np.arange(len(heights)) >= first) & (np.arange(len(heights)) < last)


@dataclass(frozen=True)
class Output:
    """The outputs along a branch. Points that are solved enter the branch."""

    equation: Equation
    branch: Branch
    outputs: Outputs
    settings: Settings

    def top(self, j: int) -> tuple[arc.MeasuredPoint, bool]:
        """(the largest maximum of output j along the branch, whether it is solved)."""
        heights = self._heights(j)
        return self.largest(j, heights, self._high(heights))

    def at_least(self, j: int) -> float:
        """The largest amplitude of output j at the points of the branch."""
        return float(np.nanmax(self._heights(j)))

    def at_most(self, j: int, value: float) -> float:
        """What the largest maximum of output j does not exceed, where it is concave about its
        highest points; its highest point, where that is well below a value."""
        heights = self._heights(j)
        points = self.branch.points
        high = self._high(heights)
        top = points[int(np.nanargmax(heights))]
        least = self.at_least(j)
        if least < (1 - self.settings.peak_window) * value:
            return least
        if self._sampled(top):
            return (1 + RIPPLE) * least
        near = _beside(points, heights, high)
        if any(point.tangent is None for i in near for point in points[i : i + 2]):
            return np.inf
        metric = arc.metric_at(top, self.equation.weights)
        ends = [self._measured(points[i : i + 2], j, metric) for i in near]
        bounds = [arc.bound(a, b, metric) for a, b in ends if _rises_and_falls(a, b)]
        return max(bounds, default=least)

    def _heights(self, j: int) -> np.ndarray:
        return self.outputs.amplitudes(self.branch.points)[0][:, j]

    def _high(self, heights: np.ndarray) -> np.ndarray:
        return heights >= (1 - self.settings.peak_window) * np.nanmax(heights)

    def _sampled(self, point: Point) -> bool:
        balance, w = self.equation.balance_at(point.parameter)
        return balance.sampled(point.x, w)

    def largest(
        self, j: int, heights: np.ndarray, high: np.ndarray, points: list[Point] | None = None
    ) -> tuple[arc.MeasuredPoint, bool]:
        """(the highest maximum of output j, whether it is solved): every bracket beside a `high`
        point is closed that may hold it.

        heights, high : (n,) at the points; these are the branch's, where they are not given
        """
        points = list(self.branch.points if points is None else points)
        top = int(np.nanargmax(np.where(high, heights, -np.inf)))
        metric = arc.metric_at(points[top], self.equation.weights)

        def measured(these: Sequence[Point]) -> list[arc.MeasuredPoint]:
            return self._measured(these, j, metric)

        def measure(point: Point) -> arc.MeasuredPoint:
            return measured([point])[0]

        def solved_in(search: Callable, ends: Sequence[arc.MeasuredPoint]) -> arc.Maximum:
            return self._enter(search(self.equation.evaluate, ends, measure, metric, self.settings))

        chains, resolved = self._chains(points, heights, high, measured, metric)
        chain = max(chains, key=lambda chain: max(end.value for end in chain))
        highest = best = max(chain, key=lambda end: end.value)
        rising = (ends for chain in chains for ends in pairwise(chain) if _rises_and_falls(*ends))
        brackets = [(arc.bound(*ends, metric), ends) for ends in rising]
        solved = False
        for bound, ends in sorted(brackets, key=lambda bracket: -bracket[0]):
            if bound >= best.value:
                found = solved_in(arc.maximum, ends)
                if found.best.value >= best.value:
                    best, solved = found.best, found.solved
        at = chain.index(highest)
        if best is highest and 0 < at < len(chain) - 1:
            found = solved_in(arc.maximum_by_value, chain[at - 1 : at + 2])
            best, solved = found.best, found.solved
        return best, solved and resolved

    def _chains(
        self,
        points: Sequence[Point],
        heights: np.ndarray,
        high: np.ndarray,
        measured: Callable,
        metric: Metric,
    ) -> tuple[list[list[arc.MeasuredPoint]], bool]:
        """([measured points, one after the other along the branch], whether their ripples are told
        apart): all that lie beside a `high` point."""
        near = _beside(points, heights, high)
        wanted = sorted(
            {int(np.nanargmax(np.where(high, heights, -np.inf))), *near, *(i + 1 for i in near)}
        )
        runs = np.split(wanted, [k for k in range(1, len(wanted)) if wanted[k - 1] not in near])
        chains = [measured([self._with_tangent(points, i, metric) for i in run]) for run in runs]
        highest = max((end for chain in chains for end in chain), key=lambda end: end.value).point
        if not self._sampled(highest):
            return chains, True
        try:
            return [self._resolved(chain, measured, metric) for chain in chains], True
        except TooManyRipples as many:
            self.branch.calls += many.calls
            return chains, False

    def _with_tangent(self, points: Sequence[Point], i: int, metric: Metric) -> Point:
        """Point i with its tangent, which the branch then has too."""
        found = with_tangent(self.equation.evaluate, points, i, metric)
        if i < len(self.branch.points) and self.branch.points[i] is points[i]:
            self.branch.points[i] = found
        return found

    def _resolved(
        self, chain: list[arc.MeasuredPoint], measured: Callable, metric: Metric
    ) -> list[arc.MeasuredPoint]:
        found, calls = resolve(
            self.equation.evaluate,
            chain,
            lambda point: measured([point])[0],
            metric,
            self.settings,
        )
        self._enter(arc.Maximum(found[0], False, [end.point for end in found], calls))
        return found

    def _measured(self, points: Sequence[Point], j: int, metric: Metric) -> list[arc.MeasuredPoint]:
        """Amplitude of output j and its slope at solved points with their tangents."""
        values, slopes = self.outputs.amplitudes(points)[:, :, j]
        for point in points:
            point.detail.forget()
        return [
            arc.MeasuredPoint(point, float(value), float(slope) / metric.norm(*point.tangent))
            for point, value, slope in zip(points, values, slopes, strict=True)
        ]

    def _enter(self, found: arc.Maximum) -> arc.Maximum:
        """Put the solved points of a maximum into the branch, where its ends still stand there."""
        points = self.branch.points
        ends = found.points[0], found.points[-1]
        places = [i for i, point in enumerate(points) if any(point is end for end in ends)]
        if len(places) == 2:
            points[places[0] : places[1] + 1] = found.points
        self.branch.calls += found.calls
        return found


def _rises_and_falls(a: arc.MeasuredPoint, b: arc.MeasuredPoint) -> bool:
    """Whether a maximum lies between."""
    return a.slope > 0 >= b.slope


def _noise_of(
    curve: ForcedResponse, equation: Equation, points: Sequence[Point], rows: np.ndarray
) -> float:
    """The same for a curve: at the point whose contacts move most."""
    i = int(np.nanargmax(np.linalg.norm(curve.unknowns, axis=1)))
    detail = equation.evaluate(points[i].x, points[i].parameter)
    return (
        DEFAULT.peak_noise
        * np.linalg.norm(rows, axis=1)[0]
        * np.linalg.norm(detail.displacement()[:, 1:])
    )
