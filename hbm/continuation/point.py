"""What the continuation works with: the linearised equations, a point, and the arc length.

`evaluate(x, parameter)` of the equations returns a `Linearised`. R need not be smooth: the sign of
the bordered determinant det [J, R_p; t'] with a tangent t stays the same along a branch through
folds and kinks alike, so that it tells forward from backward where the direction itself jumps.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np


class Linearised(Protocol):
    """R and its derivatives at one point (x, p), n unknowns.

    The bordered matrix [J, R_p; row', corner] is regular at folds, where J alone is not. A matrix
    that was factorised should be kept: it may be solved again for another residual.
    """

    @property
    def residual(self) -> np.ndarray:
        """(n,) R(x, p)."""
        ...

    def solve(
        self, row: np.ndarray, corner: float, value: float, residual: np.ndarray | None = None
    ) -> tuple[np.ndarray, float]:
        """dx (n,), dp of [J, R_p; row', corner] [dx; dp] = [-residual; value]; residual: None takes
        its own."""
        ...

    def direction(self, row: np.ndarray, corner: float) -> tuple[np.ndarray, float, float]:
        """tx (n,), tp with J tx + R_p tp = 0 and row' tx + corner tp = 1, and the sign of the
        bordered determinant."""
        ...

    def moved(self, dx: np.ndarray, dp: float) -> "Linearised":
        """The same, linearised, at x + dx and p + dp."""
        ...

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """(n,) to be added to the residual where x has come `away` (n,) from the last point: one
        Newton step then brings back what R does not determine, whose noise would spoil the
        predictor. Zeros where R determines x."""
        ...

    def forget(self) -> None:
        """Drop what is large; it is computed again where it is asked for."""
        ...


class Bordered:
    """`solve` and `direction` of what has a residual and solves its bordered system."""

    residual: np.ndarray

    def solve(
        self, row: np.ndarray, corner: float, value: float, residual: np.ndarray | None = None
    ) -> tuple[np.ndarray, float]:
        """As that of `Linearised`."""
        R = self.residual if residual is None else residual
        dx, dp, _ = self._bordered(R, row, corner, value)
        return dx, dp

    def direction(self, row: np.ndarray, corner: float) -> tuple[np.ndarray, float, float]:
        """As that of `Linearised`."""
        return self._bordered(np.zeros_like(self.residual), row, corner, 1.0)

    def _bordered(
        self, R: np.ndarray, row: np.ndarray, corner: float, value: float
    ) -> tuple[np.ndarray, float, float]:
        """dx (n,), dp of [J, R_p; row', corner] [dx; dp] = [-R; value], and the sign of the
        determinant."""
        raise NotImplementedError


Evaluate: TypeAlias = Callable[[np.ndarray, float], Linearised]


@dataclass(frozen=True, eq=False)
class Point:
    """One point of a branch; x (n,) is NaN where the corrector failed.

    iterations : evaluations of the residual
    detail : Linearised of the last evaluation; where the corrector failed, of the first
    tangent : (dx, dp) along the branch, of any length, or None
    orientation : sign of the bordered determinant with that tangent, the same all along a branch; 0
    where unknown
    jump : whether the branch does not lead here from the point before
    """

    x: np.ndarray
    parameter: float
    converged: bool
    iterations: int
    detail: Any = None
    tangent: Any = None
    orientation: float = 0.0
    jump: bool = False


OnPoint: TypeAlias = Callable[[Point, float], None]  # called with a point and the step to it


def size(v: np.ndarray) -> float:
    """Euclidean norm of v (n,); squares neither vanish nor overflow."""
    square = v @ v
    if (
        1e-280 < square < 1e280
        or not (largest := float(np.abs(v).max(initial=0.0)))
        or not math.isfinite(largest)
    ):
        return math.sqrt(square)
    v = v / largest
    return largest * math.sqrt(v @ v)


def failed(n: int, parameter: float, calls: int = 0) -> Point:
    """A point with n unknowns that was not found."""
    return Point(np.full(n, np.nan), parameter, False, calls)


class Plane(NamedTuple):
    """row' (x' - x) + corner (p' - p) = 0: the plane through (x, p) on which a point of the branch
    is sought."""

    x: np.ndarray
    parameter: float
    row: np.ndarray
    corner: float


@dataclass(frozen=True)
class Metric:
    """Arc length: |(dx, dp)|^2 = |weights dx|^2 / size^2 + (dp / length)^2.

    weights (n,) say how much each unknown counts.
    """

    weights: np.ndarray
    size: float
    length: float

    def norm(self, dx: np.ndarray, dp: float) -> float:
        """Length of a step."""
        return math.hypot(size(self.weights * dx) / self.size, dp / self.length)

    def unit(self, dx: np.ndarray, dp: float) -> tuple[np.ndarray, float]:
        """A step in that direction, of length 1."""
        length = self.norm(dx, dp)
        return dx / length, dp / length

    def inner(self, ax: np.ndarray, ap: float, bx: np.ndarray, bp: float) -> float:
        """Inner product of two steps, to which `norm` belongs."""
        ax, bx = (self.weights * x / self.size for x in (ax, bx))
        return float(ax @ bx + ap * bp / self.length**2)

    def border(self, dx: np.ndarray, dp: float) -> tuple[np.ndarray, float]:
        """Row and corner of the unit plane normal to (dx, dp)."""
        unit = 1 / self.norm(dx, dp)
        return self.weights**2 * (dx / self.size) * (unit / self.size), dp * unit / self.length**2

    def across(self, a: "Point | Plane", b: "Point | Plane") -> tuple[np.ndarray, float]:
        """Row and corner of the unit plane normal to the chord from a to b."""
        return self.border(b.x - a.x, b.parameter - a.parameter)

    def beside_chord(self, point: Point, a: Point, b: Point) -> float:
        """Distance of a point from the chord from a to b; infinite before a and beyond b."""
        dx, dp = b.x - a.x, b.parameter - a.parameter
        wx, wp = point.x - a.x, point.parameter - a.parameter
        share = self.inner(wx, wp, dx, dp) / max(self.norm(dx, dp) ** 2, 1e-300)
        return self.norm(wx - share * dx, wp - share * dp) if 0 < share <= 1 else math.inf

    def plane(self, x: np.ndarray, p: float, dx: np.ndarray, dp: float) -> Plane:
        """The plane through (x, p) normal to (dx, dp)."""
        return Plane(x, p, *self.border(dx, dp))


def distance(a: Point | Plane, b: Point | Plane, metric: Metric) -> float:
    """Length of the chord between two points."""
    return metric.norm(b.x - a.x, b.parameter - a.parameter)
