"""Where a quantity has an extremum along a branch over the frequency, as an equation.

    R(x, w, p) = 0,      e = (dh/ds) / h = 0

s is the arc length of the branch at a fixed p, h an amplitude of an output; at a fold h is the
frequency itself. The derivatives of e along a direction are differences of tangents: the law's own
tangents leave a first derivative, not a second. Every direction that Newton's method needs is one
solution with the factorised Jacobian of the branch.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import Parameter
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation.point import Bordered, Metric, Point, size
from tipdamp.hbm.continuation.settings import DEFAULT, Settings

ROUNDING = 4 * np.finfo(float).eps  # of a frequency
STEP = 1e-6  # arc length of the differences of tangents
NEARBY = 0.01  # of the frequency: a unit of arc length along a curve
BESIDE = 0.05  # arc length within which a solution is that of a top
NEAR = 0.02  # arc length within which their result is taken again by Newton's method
# (linearisation by the frequency, tangent (dx, dw), arc length of that) -> relative slope
Slope = Callable[[Linearisation, tuple[np.ndarray, float], float], float]


@dataclass
class Extremum:
    """R and e over a parameter; unknowns (n + 1,) : x, and the way of w from `w` in units of
    `by_w`.

    metric : arc length of the curve at `w`
    grows : whether e is the slope in the arc length of its place, as a motion may grow by decades,
        not in that
    along : (row, corner) of a plane across the branch; it says which way is forward, and is taken
        from the last point
    settings : of the continuation
    near : arc length within which derivatives of e are taken again
    recent : place at which these were found last, with that plane, and what they were
    """

    balance: HarmonicBalance
    parameter: Parameter
    slope: Slope
    metric: Metric
    w: float
    along: tuple[np.ndarray, float]
    settings: Settings = DEFAULT
    near: float = NEAR
    grows: bool = True
    recent: tuple | None = None

    @property
    def by_w(self) -> float:
        """Units of the unknowns in one rad/s."""
        return self.metric.size / self.metric.length

    @cached_property
    def weights(self) -> np.ndarray:
        """(n + 1,) of the unknowns in the arc length over the parameter."""
        return np.r_[self.balance.weights, 1.0]

    def unknowns(self, x: np.ndarray, w: float) -> np.ndarray:
        """(n + 1,) of x (n,) and w rad/s."""
        return np.r_[x, (w - self.w) * self.by_w]

    def frequency(self, y: np.ndarray) -> float:
        """rad/s."""
        return float(self.w + y[-1] / self.by_w)

    def slope_at(self, y: np.ndarray, p: float, near: "ExtremumLinearisation") -> float:
        """The last residual alone, at a place so near to another that one correction with the
        factorised matrix of that one gives the tangent."""
        there = self.parameter.held(self.balance, y[:-1], self.frequency(y), p)
        tx, tw = near.tangent
        change = there.moved(tx, tw).modal - there.modal
        out = tx - fourier.to_real(real_times(there.balance.shapes, change)).ravel()
        dx, dw = near.found.solve(*self.along, 0.0, out)
        tangent = tx + dx, tw + dw
        return near.scale * self.slope(there, tangent, near.metric.norm(*tangent))

    def apart(self, dy: np.ndarray, dp: float, at: "ExtremumLinearisation") -> float:
        """Length of a way from a place, that of the parameter relative to it."""
        way = at.metric.norm(dy[:-1], dy[-1] / self.by_w)
        return way + abs(dp) / max(abs(at.p), 1e-300)

    def evaluate(self, y: np.ndarray, p: float) -> "ExtremumLinearisation":
        """Linearisation at y (n + 1,) and p, in units of the parameter's branch."""
        w = self.frequency(y)
        by_parameter = self.parameter.evaluate(self.balance, y[:-1], w, p)
        found = by_frequency(by_parameter)
        tangent, sign = self.tangent(found)
        metric = self.metric
        if self.grows:
            metric = metric_at(found.balance.weights, found.x, found.w)
        e = self.slope(found, tangent, metric.norm(*tangent))
        residual = np.r_[found.residual, metric.size * e]
        there = ExtremumLinearisation(
            self, y, p, residual, found, by_parameter, tangent, sign, metric, metric.size
        )
        return there.scaled(self._share(there)) if self.grows else there

    def _share(self, there: "ExtremumLinearisation") -> float:
        """Of e that counts beside R: less than all of it where rounding of the frequency alone
        moves it by more than the tolerance, as at a resonance of next to no damping."""
        rounding = ROUNDING * there.found.w
        tolerance = self.settings.tolerance
        way = there.metric.norm(*there.tangent) / max(abs(there.tangent[1]), 1e-300)
        if rounding * way <= tolerance:  # along the branch it does not, and no more across it
            return 1.0
        moved = abs(there.change(np.r_[0 * there.y[:-1], rounding * self.by_w], 0.0))
        return min(1.0, tolerance * there.scale / max(moved, 1e-300))

    def tangent(self, found: Linearisation) -> tuple[tuple[np.ndarray, float], float]:
        """((dx, dw), sign of the bordered determinant) of the branch, forward."""
        tx, tw, sign = found.direction(*self.along)
        return (tx, tw), sign

    def near_top(self, point: Point, y: np.ndarray) -> bool:
        """Whether a solution is that of a top y (n + 1,), not one beside it."""
        away = point.x - y
        return self.metric.norm(away[:-1], away[-1] / self.by_w) < BESIDE

    def look_along(self, tangent: tuple[np.ndarray, float]) -> None:
        """Take a tangent for the way forward."""
        self.along = self.metric.border(*tangent)
        self.recent = None


@dataclass(frozen=True)
class ExtremumLinearisation(Bordered):
    """Of an Extremum at one point; `tipdamp.hbm.continuation.point.Linearised`.

    found : Linearisation of the branch by the frequency; by_parameter : the same by the parameter
    tangent : of the branch, sign : of its bordered determinant; metric : arc length there
    scale : of e in the residual, m
    """

    of: Extremum
    y: np.ndarray
    p: float
    residual: np.ndarray
    found: Linearisation
    by_parameter: Linearisation
    tangent: tuple[np.ndarray, float]
    sign: float
    metric: Metric
    scale: float
    kept: list = field(default_factory=list)

    def moved(self, dy: np.ndarray, dp: float) -> "ExtremumLinearisation":
        """This at y + dy, p + dp, linearised; the directions stay, as a difference from a residual
        that is not evaluated again would be noise."""
        self._directions()
        there = self.found.moved(dy[:-1], dy[-1] / self.of.by_w)
        there = replace(there, modal=there.modal + self.by_parameter.modal_rate * dp)
        return replace(self, y=self.y + dy, p=self.p + dp, found=there, residual=0 * self.residual)

    def scaled(self, share: float) -> "ExtremumLinearisation":
        """With a share of e in the residual."""
        residual = np.r_[self.residual[:-1], share * self.residual[-1]]
        return replace(self, residual=residual, scale=share * self.scale)

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """As that of the branch."""
        return np.r_[self.found.restoring(away[:-1]), 0.0]

    def forget(self) -> None:
        """Drop the matrices."""
        self.found.forget()
        self.by_parameter.forget()

    @property
    def curvature(self) -> float:
        """Derivative of e by the arc length: negative at a maximum."""
        return self._directions()[1] / (self.scale * self.metric.norm(*self.tangent))

    def _directions(self) -> list[Any]:
        """(dy, change of the last residual) of the tangent, and of the parameter at a fixed place
        on the plane across it."""
        if not self.kept:
            of = self.of
            tx, tw = self.tangent
            vx, vw = self.found.solve(*of.along, 0.0, self.by_parameter.by_parameter)
            t, v = np.r_[tx, tw * of.by_w], np.r_[vx, vw * of.by_w]
            known = of.recent
            if known is None or of.apart(self.y - known[0], self.p - known[1], self) > of.near:
                known = self.y, self.p, self.change(t, 0.0), self.change(v, 1.0)
                of.recent = known
            self.kept.extend((t, known[2], v, known[3]))
        return self.kept

    def change(self, dy: np.ndarray, dp: float) -> float:
        """Derivative of the last residual along (dy, dp), by a difference."""
        of = self.of
        long = of.apart(dy, dp, self)
        if not long:
            return 0.0
        h = STEP / long
        return (of.slope_at(self.y + h * dy, self.p + h * dp, self) - self.residual[-1]) / h

    def _bordered(
        self, R: np.ndarray, row: np.ndarray, corner: float, value: float
    ) -> tuple[np.ndarray, float, float]:
        of = self.of
        t, et, v, ev = self._directions()
        dx, dw = self.found.solve(*of.along, 0.0, R[:-1])
        d = np.r_[dx, dw * of.by_w]
        matrix = np.array([[et, ev], [row @ t, row @ v + corner]])
        right = np.array([-R[-1] - self.change(d, 0.0), value - row @ d])
        sizes = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        matrix = matrix / sizes[:, None]
        sign = self.sign * np.sign(np.linalg.det(matrix))
        if not sign or not np.isfinite(matrix).all():
            return np.full_like(self.y, np.nan), np.nan, 0.0
        a, b = np.linalg.solve(matrix, right / sizes)
        return d + a * t + b * v, float(b), sign


def metric_at(weights: np.ndarray, x: np.ndarray, w: float) -> Metric:
    """Arc length of a curve around a place of it."""
    return Metric(weights, max(size(weights * x), 1e-300), NEARBY * w)


def by_frequency(found: Linearisation) -> Linearisation:
    """The same point with the derivative by the frequency in place of that by a parameter."""
    hb = found.balance
    orders = np.arange(found.factors.shape[1])
    rates = hb.receptance.factors(found.w * orders)[1]
    known = np.where(found.factors == 0, 1.0, found.factors)
    rate = orders * rates * (found.modal / known)
    if found.forces.by_omega is not None:
        g = found.forces.by_omega.reshape(-1, hb.nh)
        rate = rate - found.factors * real_times(hb.into.T, fourier.to_complex(g))
    by_w = -fourier.to_real(real_times(hb.shapes, rate)).ravel()
    return replace(found, by_parameter=by_w, modal_rate=rate, border=[])
