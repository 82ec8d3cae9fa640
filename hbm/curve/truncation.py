"""What the orders that are left out would change: an estimate of the error of every point.

The motion of a point with the orders 0..H gives its contact forces at the orders above H, too. They
move the contacts at these orders, against the receptance and the tangents that the contacts show
there, an order at a time: what couples the orders is second to that. This changes the forces at the
orders up to H, by the derivative of the law, and the Jacobian of the point says what that does. A
law of sampled forces is evaluated with twice the samples, so that their error is in the estimate.

Krack, Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), sec. 2.3 and 4.3, for the
truncation; the correction is a step of Newton's method with more orders, by parts.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.condensation import ActiveContacts, condensed_contacts
from tipdamp.hbm.balance.equation import Equation
from tipdamp.hbm.balance.kernels import coupled_orders, order_system, orders_apart
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.outputs import ModalRows
from tipdamp.hbm.laws.records import ContactForces
from tipdamp.hbm.result import ForcedResponse
from tipdamp.hbm.stability.multipliers import SETTINGS, Stability
from tipdamp.hbm.validation import MOST_SAMPLES

FEW = 24  # components, whose systems are solved sooner in compiled code than by LAPACK
FAR = 0.1  # of the vibration: a larger correction is none of first order


class _High(NamedTuple):
    """What the higher orders H+1..H' are, k of them.

    modal : (modes, k); motion : (a, nd, 2k) m, real coefficients of the contacts that act
    """

    modal: np.ndarray
    motion: np.ndarray


class TruncationEstimate:
    """What further orders change in outputs, rows (m, r), at the points of an equation, and the
    stability of the motion with them. Made once for each point, at best while its matrices are
    there."""

    def __init__(
        self, equation: Equation, rows: np.ndarray, stability: Stability | None = None
    ) -> None:
        balance = equation.balance
        self.rows = rows
        self.equation = equation
        self.stability = stability
        self._low, self._high = ModalRows(rows), ModalRows(rows)
        self._wide = wider(balance)
        self._known: dict[int, tuple[Any, np.ndarray]] = {}

    def of(self, point: Point) -> np.ndarray:
        """(m,) m, root mean square over a cycle of the change of the vibration; NaN where the point
        failed, infinite where its Jacobian is singular."""
        return self._of(point)[: len(self.rows)]

    def multipliers(self, point: Point) -> np.ndarray:
        """(k,) complex, as `Stability.multipliers`; empty where they are not asked for."""
        real, imaginary = self._of(point)[len(self.rows) :].reshape(2, -1)
        return real + 1j * imaginary

    def _of(self, point: Point) -> np.ndarray:
        """(m + 2k,) both as one array, which a journal keeps."""
        if not point.converged:
            kept = self.stability.settings.kept if self.stability else 0
            return np.full(len(self.rows) + 2 * kept, np.nan)
        here = point.detail  # the same for a point of a part that is turned round
        if id(here) not in self._known:
            self._known[id(here)] = here, here.further(lambda real: self._both(real, point))
        return self._known[id(here)][1]

    def _both(self, here: Linearisation, point: Point) -> np.ndarray:
        with np.errstate(all="ignore"):
            change, motion = self.change(here, point)
            size = fourier.rms(change)
            size = np.where(np.isfinite(size), size, np.inf)
        if not self.stability:
            return size
        parameter = self.equation.parameter
        w = parameter.angular_frequency(self.equation.w, point.parameter)
        plain = self._wide.padded(here.x).reshape(motion.shape)
        moved = np.linalg.norm((motion - plain)[:, :, 1:])
        # larger, it is none of first order: the motion itself is nearer
        near = moved <= FAR * np.linalg.norm(plain[:, :, 1:])
        found = self.stability.multipliers(
            here,
            w,
            parameter.settings_at(here.balance.problem, point.parameter),
            motion if near else plain,
        )
        return np.r_[size, found.real, found.imag]

    def change(self, here: Linearisation, point: Point) -> tuple[np.ndarray, np.ndarray]:
        """(m, H'+1) complex, m: the estimated change of the outputs at a solved point, linearised
        `here`; and (P, nd, nh') m, the motion of the contacts with it."""
        H = here.balance.H
        P = len(here.balance.problem.contacts)
        nd = here.balance.nd
        found = np.zeros((len(self.rows), 2 * H + 2), dtype=complex)
        motion = self._wide.padded(here.x).reshape(P, nd, -1)
        if not here.forces.g.any():  # all stick: what the forces hold is the motion
            return found, motion
        wide, forces = self._more_orders(here, point, motion)
        high = _higher_orders(wide, forces, here.w, H)
        dg = forces.g[:, :, : here.balance.nh] - here.forces.g  # of the samples, if any
        _add_coupled(dg, forces, high.motion)
        low, moved = _lower_orders(here, dg, point.tangent)
        found[:, : H + 1] = real_times(self._low.of(here.balance), low)
        found[:, H + 1 :] = real_times(self._high.of(wide), high.modal)
        motion[:, :, : here.balance.nh] += moved.reshape(P, nd, -1)
        motion[forces.contacts, :, here.balance.nh :] = high.motion
        return found, motion

    def _more_orders(
        self, here: Linearisation, point: Point, motion: np.ndarray
    ) -> tuple[HarmonicBalance, ContactForces]:
        """The balance with further orders, with modes by those of the point alone, and its contact
        forces at the motion of the point."""
        own, wide = here.balance, self._wide
        if own.problem is not wide.problem:  # the parameter changes the linear system
            wide = wider(own)
        contacts = self.equation.parameter.settings_at(own.problem, point.parameter)
        forces = wide.contact_forces(
            motion, here.w, None if contacts is own.problem.contacts else contacts, here.forces
        )
        reach = own.cover[0] * wide.H / max(own.H, 1)
        return wide.covering(np.r_[reach, own.cover[1:]]), forces


def with_estimates(
    curve: ForcedResponse,
    estimate: TruncationEstimate,
    points: Sequence[Point],
    truncation: bool = True,
) -> ForcedResponse:
    """A curve with the estimated error of its points, and the multipliers where the estimate tells
    stability; truncation : whether with the error."""
    if truncation:
        curve = replace(curve, truncation=np.array([estimate.of(point) for point in points]))
    if estimate.stability:
        found = np.array([estimate.multipliers(point) for point in points])
        curve = replace(curve, multipliers=found)
    return curve


def peak_multipliers(
    equation: Equation, rows: np.ndarray, points: Sequence[Point], peaks: np.ndarray
) -> np.ndarray:
    """(n, k) complex, the leading multipliers of the points that are marked as peaks (n, m) of an
    output; NaN elsewhere."""
    estimate = TruncationEstimate(equation, rows, Stability())
    found = np.full((len(points), SETTINGS.kept), np.nan, dtype=complex)
    for i in np.flatnonzero(peaks.any(axis=1)):
        found[i] = estimate.multipliers(points[i])
    return found


def wider(balance: HarmonicBalance) -> HarmonicBalance:
    """With orders up to 2 H + 1, and twice the samples: a quarter of their error is left."""
    H = 2 * balance.H + 1
    own = balance.grid.samples
    samples = min(max(2 * own, balance.problem.law.default_samples(H)), MOST_SAMPLES)
    return HarmonicBalance(balance.problem, balance.forces, H, balance.given_start, samples)


def _higher_orders(hb: HarmonicBalance, b: ContactForces, w: float, H: int) -> _High:
    """The orders above H, each by itself: u = -G (g + D u)."""
    orders = np.arange(H + 1, hb.H + 1)
    into = hb.contact_receptance.into_of
    factors = hb.receptance.factors(w * orders)[0]
    g = fourier.to_complex(b.g[:, :, 2 * H :].reshape(b.g.shape[0] * hb.nd, -1))[:, 1:]
    rows = np.flatnonzero(g.any(axis=1))
    modal = -factors * real_times(into(rows).T, g[rows])
    if not len(b.contacts):
        return _High(modal, np.zeros((0, hb.nd, 2 * factors.shape[1])))

    def between(to: np.ndarray, at: np.ndarray) -> np.ndarray:
        return hb.contact_receptance.between(to, at, factors, w, orders)

    acting, G, left, active = condensed_contacts(b, between, H + 1)
    shapes = hb.contact_receptance.rows_of
    if left:
        u = real_times(shapes(left.rows), modal)
        modal += factors * real_times(into(left.rows).T, left.forces(u))
    u = real_times(shapes(acting.components), modal)
    push = _orders_apart(acting, G, u, H)
    modal -= factors * real_times(into(acting.rows).T, push)
    if left:
        modal -= factors * real_times(into(left.rows).T, left.forces_by(push))
        u = real_times(shapes(active.components), modal)
    return _High(modal, u.view(float).reshape(len(b.contacts), hb.nd, -1))


def _orders_apart(acting: ActiveContacts, G: np.ndarray, u: np.ndarray, H: int) -> np.ndarray:
    """As `kernels.orders_apart`, by LAPACK where the systems are large."""
    n = len(acting.rows)
    D = acting.D
    places = acting.places
    if n <= FEW:
        return orders_apart(D, places, G, u, H)
    y = np.empty((n, u.shape[1]), dtype=complex)
    system, right = np.empty((2 * n, 2 * n)), np.empty(2 * n)
    for i in range(u.shape[1]):
        order_system((D, places, G[:, :, i], u[:, i]), 2 * (H + 1 + i) - 1, system, right)
        lu, pivots, singular = dgetrf(system.T)
        y[:, i] = np.nan if singular else dgetrs(lu, pivots, right, trans=1)[0].view(complex)
        u[:, i] -= G[:, :, i] @ y[:, i]
    return y


def _add_coupled(dg: np.ndarray, b: ContactForces, motion: np.ndarray) -> None:
    """Add to dg (P, nd, nh) what the motion (a, nd, 2k) of the higher orders changes in the forces
    b of the lower ones."""
    low = dg.shape[2]
    dg[b.contacts] += coupled_orders(b.D, motion, low)


def _lower_orders(
    here: Linearisation, dg: np.ndarray, tangent: tuple[np.ndarray, float]
) -> tuple[np.ndarray, np.ndarray]:
    """The change of the orders up to H, modal (m, H+1) and of the contacts (n,), under a change of
    the contact forces (P, nd, nh), with the derivative of the law; tangent : of the point, or
    None."""
    hb = here.balance
    g = dg.reshape(-1, hb.nh)
    rows = np.flatnonzero(g.any(axis=1))
    into = hb.contact_receptance.into_of(rows)
    direct = -here.factors * real_times(into.T, fourier.to_complex(g[rows]))
    R = -fourier.to_real(real_times(hb.shapes, direct)).ravel()
    step = here.solve_held(R, tangent)
    return direct + here.moved(step, 0.0).modal - here.modal, step
