"""Other branches through a named point of a curve: where its symmetry breaks, and where its period
doubles.

At such a point the Jacobian of the harmonic balance has a null vector beside the tangent of the
curve; where the period doubles, that of the balance over two periods has, among the orders between
those of the curve. A step along it, and Newton's method on the plane across, lead to the other
branch [Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. 2010, sec. 5.6].
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.problem import AnyProblem
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.symmetry import Kept, kept_by_symmetry
from tipdamp.hbm.continuation import arc
from tipdamp.hbm.continuation.branch import Branch
from tipdamp.hbm.continuation.closed import follow_away
from tipdamp.hbm.continuation.corrector import damped, leaving, solve_fixed
from tipdamp.hbm.continuation.crossings import crossings
from tipdamp.hbm.continuation.point import Plane, Point, size
from tipdamp.hbm.continuation.settings import DEFAULT
from tipdamp.hbm.curve.folds_and_transitions import NamedPoint
from tipdamp.hbm.curve.guess import with_periods
from tipdamp.hbm.curve.outputs import Outputs
from tipdamp.hbm.curve.solutions import restored
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.search.curves import as_curve
from tipdamp.hbm.validation import check_kind

LEADS_ON = ("symmetry breaking", "branch point", "period doubling")
NO_BRANCH = "from which no other branch of periodic motions begins"
GRAZING = (
    "beside which a motion of two periods may begin, which `follow_band` follows with `periods=2` "
    "and one as `guess`"
)


@dataclass(frozen=True)
class BranchSettings:
    """How the other branch is reached.

    steps : along the null vector, of the size of the motion, tried in this order; calls : of the
    residual for each; stray : times the step, within which a point found belongs to the other
    branch
    symmetric : of the motion, within which it has a symmetry
    iterations : of the inverse iteration; null : eigenvalue of the Jacobian, whose largest are near
    1, up to which a second one counts as zero; directions : tried in the plane of two null vectors
    place : of the amplitude, within which a point is where the curve has it; between : times the
    distance of its neighbours, the most from it to either
    nearer, left, beside : how often the meeting of two branches is told again from a point nearer
        to it, what share that leaves of what is lost there, and of the motion, below which it is
        near enough
    points : most of a branch, each way; same : distance, of the motion, below which points are one
    """

    steps: tuple = (0.05, 0.1, 0.02, 0.2, 0.4)
    calls: int = 60
    stray: float = 4.0
    symmetric: float = 1e-6
    iterations: int = 30
    null: float = 1e-2
    directions: int = 12
    place: float = 1e-3
    between: float = 1.2
    nearer: int = 3
    left: float = 0.1
    beside: float = 1e-3
    points: int = 1000
    same: float = 1e-3


SETTINGS = BranchSettings()
NOT_ITS_OWN = "give one of the named points of this very curve, unchanged"


def branch_from(
    curve: ForcedResponse,
    problem: AnyProblem,
    point: NamedPoint,
    parameter: Parameter | None = None,
) -> tuple[ForcedResponse, ...]:
    """The other curves through a point of a curve at which a symmetry breaks, through another
    branch point or a period doubling, over its band.

    point : of `named_points`; problem : the ContactProblem that the curve was made with; parameter
    : as in `solutions_at`
    Each begins at the point, and ends where it meets the first curve again, or at the end of the
    band. A branch point has two, one each way: where a symmetry breaks, they are images of each
    other. From a period doubling begins one of twice the period, with twice as many orders
    (`ForcedResponse.periods`). They have the estimate, the multipliers and the named points of any
    other curve. Raises InputError for points of other kinds, where the problem is
    another one, and where Newton's method leads to no other branch.

    >>> duffing = Problem([[1.0]], [[0.1]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 2.0)
    >>> curve = duffing.follow_band((0.12, 0.16), outputs={"x": 0}, harmonics=7)
    >>> point = named_points(curve, duffing.contact_problem)[0]
    >>> one, other = branch_from(curve, duffing.contact_problem, point)
    >>> for branch in (curve, one, other):  # what it moves more to one side than to the other
    ...     print(f"{np.abs(branch.harmonics[:, 0, 0]).max():.2f} m")
    0.00 m
    0.19 m
    0.19 m
    """
    check_kind("point", point, NamedPoint, "named_points, one of curve.named_points")
    if point.kind not in LEADS_ON:
        raise InputError(
            f"branch_from: the point is a {point.kind}, "
            f"{GRAZING if point.kind == 'grazing' else NO_BRANCH}; "
            f"must be a {' or a '.join(LEADS_ON)}"
        )
    equation, points = restored(curve, problem, parameter)
    ends = points[point.index : point.index + 2] if point.index >= 0 else []
    if len(ends) < 2:
        raise InputError(
            f"branch_from: the point lies after point {point.index} of a curve with {len(points)} "
            f"points; {NOT_ITS_OWN}"
        )
    doubled = point.kind == "period doubling"
    if doubled:
        equation, ends = _over_two_periods(equation, ends)
    p = equation.parameter.scale * point.parameter
    root = _at(equation, ends, p)
    _check_place(point, equation, (root, *ends), curve.output_rows)
    there = equation.balance_at(p)
    keeps = (
        _kept_by_time(equation) if doubled else kept_by_symmetry(*there, root.x, SETTINGS.symmetric)
    )
    band = tuple(equation.parameter.scale * end for end in _ends(curve))
    found = list[Branch]()
    for start in _Through(equation, root, ends, keeps).beside():
        if any(_holds(equation, branch, start) for branch in found):
            continue
        found.append(_followed(equation, (root, start), band, keeps))
        if doubled:
            break  # the other way is the same, a period later
    if not found:
        raise InputError(
            f"branch_from: no other branch was found at the {point.kind} at "
            f"{equation.parameter.named(point.parameter)}; try more harmonics"
        )
    names = curve.output_names.tolist()
    return tuple(
        as_curve(branch, equation, (names, curve.output_rows), (problem, parameter))
        for branch in found
    )


def _check_place(
    point: NamedPoint, equation: Equation, found: tuple[Point, ...], rows: np.ndarray
) -> None:
    """InputError where a point is not where its index says; found : it and the points around it."""
    root, a, b = found
    known = root.detail is not None
    if known:
        metric = arc.metric_at(root, equation.weights)
        apart = SETTINGS.between * arc.distance(a, b, metric)
        known = max(arc.distance(end, root, metric) for end in (a, b)) <= apart
        there = Outputs(rows).amplitudes([root])[0][0]
        known &= np.abs(there - point.amplitudes).max() <= SETTINGS.place * np.abs(there).max()
    if not known:
        value = equation.parameter.named(point.parameter)
        raise InputError(
            f"branch_from: the curve does not have the point at {value} after its point "
            f"{point.index}; {NOT_ITS_OWN}"
        )


class _Through:
    """A point of a curve, and the solutions beside it that are not of the curve.

    ends : points of the curve around it; keeps : of a motion, the part that the curve has; None
    where that is all
    """

    def __init__(
        self, equation: Equation, point: Point, ends: list[Point], keeps: Kept | None
    ) -> None:
        self.equation, self.point, self.weights = equation, point, equation.weights
        self.metric = arc.metric_at(point, self.weights)
        self.along = ends[1].x - ends[0].x, ends[1].parameter - ends[0].parameter
        self.keeps = keeps or np.zeros_like

    def beside(self) -> Iterator[Point]:
        """Of each direction of the null vectors, both ways, where one is found."""
        for direction in self._directions():
            for way in (1, -1):
                found = self._step(way * direction)
                if found is not None:
                    yield found

    def _directions(self) -> Iterator[np.ndarray]:
        """(n,) each, at right angles to the curve and of the size of the motion."""
        vectors = self._null_vectors()
        if vectors.shape[1] == 1:
            yield self._across(vectors[:, 0])
            return
        for angle in np.pi * np.arange(SETTINGS.directions) / SETTINGS.directions:
            yield self._across(vectors @ [np.cos(angle), np.sin(angle)])

    def _null_vectors(self) -> np.ndarray:
        """(n, 1 or 2) eigenvectors of the Jacobian to its smallest eigenvalues."""
        n, random = len(self.point.x), np.random.default_rng(0)
        v = np.linalg.qr(self._lost(random.normal(size=(n, 2))))[0]
        zero, here = np.zeros(n), self.equation.evaluate(self.point.x, self.point.parameter)
        for _ in range(SETTINGS.iterations):
            inverse = np.array([here.solve(zero, 1.0, 0.0, -one)[0] for one in v.T]).T
            inverse = self._lost(inverse)
            small = v.T @ inverse
            v = np.linalg.qr(inverse)[0]
        values, mixed = np.linalg.eig(small)
        order = np.argsort(-np.abs(values))
        least = 1 / np.abs(values[order])
        if least[1] <= SETTINGS.null:
            return v
        return (v @ mixed[:, order[:1]]).real

    def _lost(self, vectors: np.ndarray) -> np.ndarray:
        """Of vectors (n, k), the part that the curve has not."""
        return vectors - np.array([self.keeps(one) for one in vectors.T]).T

    def _across(self, vector: np.ndarray) -> np.ndarray:
        """The vector less what of it runs along the curve, of the size of the motion."""
        dx, dp = self.along
        share = self.metric.inner(vector, 0.0, dx, dp) / self.metric.inner(dx, dp, dx, dp)
        vector = vector - share * dx
        return vector * (size(self.point.x) / size(vector))

    def _step(self, direction: np.ndarray) -> Point | None:
        """The solution a step along a direction away, or None."""
        x, p = self.point.x, self.point.parameter
        row, corner = self.metric.border(direction, 0.0)
        for step in SETTINGS.steps:
            plane = Plane(x + step * direction, p, row, corner)
            found = damped(self.equation.evaluate, plane, self.weights, DEFAULT, SETTINGS.calls)
            if found.converged and size(found.x - x) < SETTINGS.stray * step * size(x):
                return found
        return None


def _kept_by_time(equation: Equation) -> Kept:
    """Of a motion over two periods, the part that repeats after one."""
    orders = np.r_[0, np.repeat(np.arange(1, equation.balance.H + 1), 2)]
    even = np.tile(orders % 2 == 0, equation.balance.n_components)
    return lambda x: np.where(even, x, 0.0)


def _over_two_periods(equation: Equation, points: Sequence[Point]) -> tuple[Equation, list[Point]]:
    """(equation, points) of the same motions seen over twice the period, with twice the orders."""
    balance, parameter, periods = equation.balance, equation.parameter, 2 * equation.periods
    forces = {2 * k: F for k, F in balance.forces.items()}
    samples = 2 * balance.grid.samples
    doubled = HarmonicBalance(balance.problem, forces, 2 * balance.H, balance.given_start, samples)
    over = Equation(doubled, parameter.over(periods), equation.hz, periods)
    share = over.parameter.scale / parameter.scale
    seen = [
        Point(with_periods(point.x, balance, 2), share * point.parameter, True, 0)
        for point in points
    ]
    return over, seen


def _at(equation: Equation, ends: Sequence[Point], p: float) -> Point:
    """The point of the curve between two of its points, at a value of the parameter."""
    a, b = ends
    apart = b.parameter - a.parameter
    share = np.clip((p - a.parameter) / apart, 0, 1) if apart else 0.5
    guess = a.x + share * (b.x - a.x)
    point = solve_fixed(equation.evaluate, guess, p, equation.weights)
    return point if point.converged else Point(guess, p, True, 0)


def _ends(curve: ForcedResponse) -> tuple[float, float]:
    return float(curve.parameter.min()), float(curve.parameter.max())


def _holds(equation: Equation, branch: Branch, start: Point) -> bool:
    """Whether a branch runs through a solution."""
    weights = equation.weights
    found = crossings(equation.evaluate, branch.points, start.parameter, weights, DEFAULT)
    there = [point for point, _, _ in found]
    there += [point for point in branch.points if point.parameter == start.parameter]
    near = SETTINGS.same * size(weights * start.x)
    return any(size(weights * (point.x - start.x)) <= near for point in there)


def _followed(
    equation: Equation, ends: tuple[Point, Point], band: tuple, keeps: Kept | None
) -> Branch:
    """The branch from the root over its first solution, up to where it meets the curve again: what
    the curve does not have of its motion changes its sign there."""

    def meets(before: Point, new: Point) -> Point | None:
        if keeps is None:
            return None
        lost, gained = (point.x - keeps(point.x) for point in (before, new))
        gone = size(gained) <= SETTINGS.symmetric * size(new.x)  # it has gone over to the curve
        if lost @ gained >= 0 and not gone:
            return None
        before_nearer = gone or size(lost) < size(gained)
        near = before if before_nearer else new
        for _ in range(SETTINGS.nearer):
            lost = near.x - keeps(near.x)
            if size(lost) <= SETTINGS.beside * size(near.x):
                break
            x, p = _meeting(near, keeps)
            row, corner = arc.metric_at(near, equation.weights).border(lost, 0.0)
            plane = Plane(x + SETTINGS.left * lost, p, row, corner)
            beside = damped(equation.evaluate, plane, equation.weights, DEFAULT, SETTINGS.calls)
            if not beside.converged:
                break
            near = leaving(beside, row, corner)
        return solve_fixed(equation.evaluate, *_meeting(near, keeps), equation.weights)

    return follow_away(
        equation.evaluate, ends, band, equation.weights, DEFAULT, SETTINGS.points, meets
    )


def _meeting(near: Point, keeps: Kept) -> tuple[np.ndarray, float]:
    """x (n,) and parameter where a branch meets the curve that it leaves, from a point beside it:
    what is kept, and the parameter, change with the square of what is lost."""
    (dx, dp), rest = near.tangent, near.x - keeps(near.x)
    back = 0.5 * (rest @ rest) / (rest @ dx)
    return keeps(near.x - back * dx), near.parameter - back * dp
