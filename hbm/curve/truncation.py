"""What the orders that are left out would change: an estimate of the error of every point.

The motion of a point with the orders 0..H gives its contact forces at the orders above H, too. They
move the contacts at these orders, against the receptance and the tangents that the contacts show
there, an order at a time: what couples the orders is second to that. This changes the forces at the
orders up to H, by the derivative of the law, and the Jacobian of the point says what that does. A
law of sampled forces is evaluated with the samples of the higher orders, so that the error of the
samples is in the estimate.

Krack, Gross, Harmonic Balance for Nonlinear Vibration Problems (2019), sec. 2.3 and 4.3, for the
truncation; the correction is a step of Newton's method with more orders, by parts.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.kernels import order_system
from tipdamp.hbm.balance.newton import Linearisation
from tipdamp.hbm.balance.parameter import Equation
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.curve.outputs import ModalRows
from tipdamp.hbm.stability.monodromy import SETTINGS, Stability

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

    def __init__(self, equation: Equation, rows: np.ndarray, stability: Stability | None = None):
        balance = equation.balance
        self.rows, self.equation, self.stability = rows, equation, stability
        self._low, self._high = ModalRows(rows), ModalRows(rows)
        self._wide = replace(equation, balance=_wider(balance))
        self._known: dict[int, tuple[Point, np.ndarray]] = {}

    def of(self, point: Point) -> np.ndarray:
        """(m,) m, root mean square over a cycle of the change of the vibration; NaN where the point
        failed, infinite where its Jacobian is singular."""
        return self._of(point)[: len(self.rows)]

    def multipliers(self, point: Point) -> np.ndarray:
        """(k,) complex, as `Stability.multipliers`; empty where they are not asked for."""
        real, imaginary = self._of(point)[len(self.rows) :].reshape(2, -1)
        return real + 1j * imaginary

    def _of(self, point):
        """(m + 2k,) both as one array, which a journal keeps."""
        if not point.converged:
            kept = self.stability.settings.kept if self.stability else 0
            return np.full(len(self.rows) + 2 * kept, np.nan)
        if id(point) not in self._known:
            found = point.detail.further(lambda here: self._both(here, point))
            self._known[id(point)] = point, found
        return self._known[id(point)][1]

    def _both(self, here: Linearisation, point: Point) -> np.ndarray:
        with np.errstate(all="ignore"):
            change, motion = self.change(here, point)
            size = np.sqrt(0.5 * (np.abs(change[:, 1:]) ** 2).sum(axis=1))
            size = np.where(np.isfinite(size), size, np.inf)
        if not self.stability:
            return size
        parameter, H = self.equation.parameter, here.balance.H
        w = parameter.angular_frequency(self.equation.w, point.parameter)
        plain = _padded(here.x, here.balance, H).reshape(motion.shape)
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
        H, P, nd = here.balance.H, len(here.balance.problem.contacts), here.balance.nd
        found = np.zeros((len(self.rows), 2 * H + 2), dtype=complex)
        motion = _padded(here.x, here.balance, H).reshape(P, nd, -1)
        if not here.forces.g.any():  # all stick: what the forces hold is the motion
            return found, motion
        more = self._wide.evaluate(motion.ravel(), point.parameter)
        high = _higher_orders(more, H)
        dg = _of_samples(more, here)
        _add_coupled(dg, more, high.motion)
        low, moved = _lower_orders(here, dg, point.tangent)
        found[:, : H + 1] = real_times(self._low.of(here.balance), low)
        found[:, H + 1 :] = real_times(self._high.of(more.balance), high.modal)
        motion[:, :, : here.balance.nh] += moved.reshape(P, nd, -1)
        motion[more.forces.contacts, :, here.balance.nh :] = high.motion
        return found, motion


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


def _wider(balance: HarmonicBalance) -> HarmonicBalance:
    """With orders up to 2 H + 1."""
    return HarmonicBalance(
        balance.problem, balance.forces, 2 * balance.H + 1, balance.given_start, None
    )


def _padded(x, balance, H):
    """x with zeros at the orders up to 2 H + 1."""
    found = np.zeros((balance.n_components, fourier.n_real(2 * H + 1)))
    found[:, : balance.nh] = x.reshape(-1, balance.nh)
    return found.ravel()


def _higher_orders(more: Linearisation, H: int) -> _High:
    """The orders above H, each by itself: u = -G (g + D u)."""
    hb, b = more.balance, more.forces
    shapes, factors = hb.contact_receptance.rows_of, more.factors[:, H + 1 :]
    g = fourier.to_complex(b.g.reshape(-1, hb.nh))[:, H + 1 :]
    rows = np.flatnonzero(g.any(axis=1))
    modal = -factors * real_times(shapes(rows).T, g[rows])
    if not len(b.contacts):
        return _High(modal, np.zeros((0, hb.nd, 2 * factors.shape[1])))
    components = (b.contacts[:, None] * hb.nd + np.arange(hb.nd)).ravel()
    active = np.flatnonzero(b.active[b.contacts].ravel())
    G = hb.contact_receptance.between(
        components, components[active], more.factors, more.w, np.arange(H + 1, hb.H + 1)
    )
    u = real_times(shapes(components), modal)
    push = np.empty((len(active), factors.shape[1]), dtype=complex)
    for i, k in enumerate(range(H + 1, hb.H + 1)):
        own = np.ascontiguousarray(G[:, :, i])
        try:
            parts = np.linalg.solve(*order_system(b.D, active, own, u[:, i].copy(), k))
        except np.linalg.LinAlgError:  # the estimate is infinite
            parts = np.full(2 * len(active), np.nan)
        push[:, i] = parts[::2] + 1j * parts[1::2]
        u[:, i] -= own @ push[:, i]
    modal -= factors * real_times(shapes(components[active]).T, push)
    real = np.stack([u.real, u.imag], axis=2).reshape(len(b.contacts), hb.nd, -1)
    return _High(modal, real)


def _add_coupled(dg, more, motion):
    """Add to dg (P, nd, nh') what the motion (a, nd, 2k) of the higher orders changes in the forces
    of the lower ones."""
    b, low = more.forces, more.balance.nh - motion.shape[2]
    dg[b.contacts, :, :low] += np.einsum("adjek,aek->adj", b.D[:, :, :low, :, low:], motion)


def _lower_orders(here: Linearisation, dg: np.ndarray, tangent) -> tuple[np.ndarray, np.ndarray]:
    """The change of the orders up to H, modal (m, H+1) and of the contacts (n,), under a change of
    the contact forces (P, nd, nh'), with the derivative of the law; tangent : of the point, or
    None."""
    hb = here.balance
    g = dg.reshape(-1, dg.shape[2])[:, : hb.nh]
    rows = np.flatnonzero(g.any(axis=1))
    shapes = hb.contact_receptance.rows_of(rows)
    direct = -here.factors * real_times(shapes.T, fourier.to_complex(g[rows]))
    R = -fourier.to_real(real_times(hb.shapes, direct)).ravel()
    step = here.solve_held(R, tangent)
    return direct + here.moved(step, 0.0).modal - here.modal, step


def _of_samples(more, here):
    """(P, nd, nh') N: what the samples of the higher orders change in the forces up to H: nothing
    for a law whose events are located."""
    change = np.zeros_like(more.forces.g)
    low = slice(here.balance.nh)
    change[:, :, low] = more.forces.g[:, :, low] - here.forces.g
    return change
