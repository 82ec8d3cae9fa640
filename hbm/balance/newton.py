"""The residual of the harmonic balance at one point, with Newton's linear system on the contacts
that slip or lift.

The derivative D of the contact forces g vanishes for contacts that stick through the cycle. With dg
= D du the system (I + G D) du = -R becomes (I + D G) dg = -D R, which has rows for the active
components only; those that stay open are taken out of it (`tipdamp.hbm.balance.condensation`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf as getrf
from scipy.linalg.lapack import dgetrs as getrs

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.condensation import Condensed, condensed_contacts
from tipdamp.hbm.balance.factors import BorderedSystem, solver_of
from tipdamp.hbm.balance.kernels import (
    added,
    applied,
    border_of,
    complex_rows,
    condensed,
    right_side,
    step_of,
)
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.laws.records import ContactForces
from tipdamp.hbm.memory import check_active_fit

EPS = np.finfo(float).eps


@dataclass(frozen=True)
class Linearisation:
    """Residual at one point with everything that Newton and the outputs need;
    `tipdamp.hbm.continuation.point.Linearised`.

    x, residual, by_parameter : (n,), n = P nd nh, contact by contact; by_parameter : derivative of
    the residual
    forces : of the contacts, without their derivative, which `derivative` computes and `kept`
    holds while it is needed; w : rad/s; balance : the HarmonicBalance
    modal : (m, H+1) coordinates, q_k = shapes @ modal[:, k]; factors : (m, H+1) of the receptance
    modal_rate : (m, H+1) derivative of modal by the parameter at a given motion
    """

    x: np.ndarray
    residual: np.ndarray
    by_parameter: np.ndarray
    forces: ContactForces
    modal: np.ndarray
    balance: Any
    factors: np.ndarray
    w: float
    modal_rate: np.ndarray
    derivative: Callable[[], np.ndarray]
    kept: list[np.ndarray]
    parts: list = field(default_factory=list)
    border: list = field(default_factory=list)

    def solve_held(
        self, residual: np.ndarray, tangent: tuple[np.ndarray, float] | None
    ) -> np.ndarray:
        """dx (n,) of J dx = -residual at a fixed parameter; tangent : along the branch, through the
        system that it was solved with, None where there is none."""
        if not self.border or tangent is None:
            return self.solve(np.zeros_like(residual), 1.0, 0.0, residual)[0]
        row, corner = self.border[:2]
        dx, dp = self.solve(row, corner, 0.0, residual)
        return dx - dp / tangent[1] * tangent[0]

    def further(self, compute: Callable[["Linearisation"], np.ndarray]) -> np.ndarray:
        """compute(this), which a journal keeps."""
        return compute(self)

    def moved(self, dx: np.ndarray, dp: float) -> "Linearisation":
        """This at x + dx, parameter + dp: outputs and forces are linearised, the matrices stay."""
        b = self.forces
        modal = self.modal + self.modal_rate * dp
        g = b.g
        if len(b.contacts):
            active = self._condensed().active
            dg = applied(active.D, active.places, active.contacts, dx)
            g = added(g, active.rows, dg)
            orders = self.balance.H + 1
            modal -= self._modal(complex_rows(dg, len(active.rows), orders), active.rows)
        return replace(self, x=self.x + dx, modal=modal, forces=replace(b, g=g))

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """To add to the residual where x has come `away` from a point: see
        `HarmonicBalance.regularisation`.

        One Newton step with it undoes the part of the way in a mean motion that no force restrains,
        and to the size of the regularisation nothing else.
        """
        b = self.forces
        hb = self.balance
        push = hb.regularisation(b) * away[:: hb.nh]
        rows = np.flatnonzero(push)
        if not len(rows):
            return np.zeros_like(away)
        g = np.zeros((len(rows), hb.H + 1), dtype=complex)
        g[:, 0] = push[rows]
        return self._respond(g, rows)

    def displacement(self) -> np.ndarray:
        """(r, H+1) complex q, m."""
        return self.balance.receptance.shapes @ self.modal

    def outputs(self, rows: np.ndarray) -> np.ndarray:
        """(m, H+1) complex harmonics of the outputs, rows (m, r)."""
        return (rows @ self.balance.receptance.shapes) @ self.modal

    def forget(self) -> None:
        """Drop the matrices; they come back when they are asked for."""
        self.kept.clear()
        self.parts.clear()
        self.border.clear()

    def solve(
        self, row: np.ndarray, corner: float, value: float, residual: np.ndarray | None = None
    ) -> tuple[np.ndarray, float]:
        """As that of `Linearised`, through the active rows."""
        hb = self.balance
        R = self.residual if residual is None else residual
        acting = self._condensed().acting
        R = self._without_open(R)
        if not len(acting.rows):
            Rp = self._without_open(self.by_parameter)
            dp = (value + row @ R) / (corner - row @ Rp)
            return -R - Rp * dp, dp
        solver, Rp, row_size, column_size = self._solver(row, corner)
        right = right_side((acting.D, acting.places, acting.contacts), R, row, value, row_size)
        y = solver.solve(right)
        if not np.isfinite(y[-1]):
            return np.full_like(R, np.nan), np.nan
        dp = y[-1] / column_size
        modal = self._modal_of_active(complex_rows(y, len(acting.rows), hb.H + 1))
        return step_of(R, Rp, dp, real_times(hb.shapes, modal)), dp

    def direction(self, row: np.ndarray, corner: float) -> tuple[np.ndarray, float, float]:
        """As that of `Linearised`."""
        dx, dp = self.solve(row, corner, 1.0, np.zeros_like(self.residual))
        acting, _, left, _ = self._condensed()
        if len(acting.rows):
            sign = self._solver(row, corner)[0].sign
        else:
            sign = np.sign(corner - row @ self._without_open(self.by_parameter))
        return dx, dp, sign * (left.sign if left else 1.0)

    def _solver(self, row: np.ndarray, corner: float) -> list[Any]:
        """Of the bordered system on the active rows, kept for the border it was made with; the
        derivative by the parameter without the open contacts, and the sizes of the border."""
        if self.border and self.border[0] is row and self.border[1] == corner:
            return self.border[2:]
        acting, G, left, _ = self._condensed()
        hb = self.balance
        at = hb.contact_receptance
        excited = self.factors * at.excited_by(row)
        along = real_times(at.into_of(acting.rows), excited)
        if left:
            along += left.seen_by(real_times(at.into_of(left.rows), excited))
        Rp = self._without_open(self.by_parameter)
        *border, row_size, column_size = border_of(
            (acting.D, acting.places, acting.contacts), (row, corner, Rp, along)
        )
        system = BorderedSystem(acting, G, *border)
        check_active_fit(len(acting.contacts), len(hb.problem.contacts), hb.nd, hb.H)
        self.border[:] = row, corner, solver_of(system), Rp, row_size, column_size
        return self.border[2:]

    def _without_open(self, R: np.ndarray) -> np.ndarray:
        """(n,) residual of the structure without the springs of the contacts that stay open."""
        left = self._condensed().open
        if not left:
            return R
        u = fourier.to_complex(R.reshape(-1, self.balance.nh)[left.rows])
        return R + self._respond(left.forces(u), left.rows)

    def _system(self, size: int) -> np.ndarray:
        """(size, size): I + D G on the active rows; what is beyond them is not filled."""
        acting, G = self._condensed()[:2]
        system = np.empty((size, size))
        condensed(acting.D, acting.places, G, system)
        return system

    def _condensed(self) -> Condensed:
        """The contacts of Newton's system."""
        if not self.parts:
            at = self.balance.contact_receptance
            w = self.w

            def between(to: np.ndarray, of: np.ndarray) -> np.ndarray:
                return at.between(to, of, self.factors, w)

            self.parts.append(condensed_contacts(self.whole_forces(), between))
        return self.parts[0]

    def _modal(self, g: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(m, H+1) modal coordinates under forces g (n, H+1) complex on the components `rows`."""
        return self.factors * real_times(self.balance.contact_receptance.into_of(rows).T, g)

    def _modal_of_active(self, dg: np.ndarray) -> np.ndarray:
        """(m, H+1) modal coordinates under forces dg (n, H+1) complex on the active components of
        the system, with those of the open contacts that follow them."""
        acting, _, left, _ = self._condensed()
        modal = self._modal(dg, acting.rows)
        return modal + self._modal(left.forces_by(dg), left.rows) if left else modal

    def _respond(self, g: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """G g, flat, for g (n, H+1) complex on `rows` and zero elsewhere."""
        return fourier.to_real(real_times(self.balance.shapes, self._modal(g, rows))).ravel()

    def whole_forces(self) -> ContactForces:
        """The contact forces with their derivative."""
        if not self.kept:
            self.kept.append(self.derivative())
        return replace(self.forces, D=self.kept[0])

    def contact_force(self, rest: np.ndarray) -> np.ndarray:
        """(P, nd, H+1) complex, N, of the contacts; rest (P, nd) N : their force at rest."""
        hb = self.balance
        u = self.x.reshape(len(hb.springs), hb.nd, hb.nh)
        f = self.forces.g + hb.springs[:, :, None] * u
        f[:, :, 0] += rest
        return fourier.to_complex(f)

    def smallest_motion(self) -> tuple[float, np.ndarray | None]:
        """(singular value over the largest, q (r, H+1)) of the direction in which the Jacobian is
        most nearly singular.

        By inverse iteration on one factorisation: close where that is well below the next one,
        which is what is asked."""
        hb = self.balance
        n = len(self._condensed().acting.rows) * hb.nh
        if not n:
            return 1.0, None
        A = self._system(n)
        lu, pivots, _ = getrf(A)
        # exactly singular: as good as that to rounding
        zero = np.abs(np.diag(lu)) < EPS * np.abs(lu).max()
        lu[zero, zero] = EPS * np.abs(lu).max()
        inverse, v = _longest(lambda v: getrs(lu, pivots, getrs(lu, pivots, v, trans=1)[0])[0], n)
        largest, _ = _longest(lambda v: A.T @ (A @ v), n)
        modal = self._modal_of_active(fourier.to_complex(v.reshape(-1, hb.nh)))
        return 1 / np.sqrt(inverse * largest), hb.receptance.shapes @ modal


def _longest(apply: Callable, n: int) -> tuple[float, np.ndarray]:
    """(factor, unit vector) of the direction that a symmetric positive matrix lengthens most, by
    power iteration."""
    v = np.random.default_rng(0).normal(size=n)
    size = 0.0
    for _ in range(DEFAULT.power_iterations):
        v = v / np.linalg.norm(v)
        v = apply(v)
        before, size = size, float(np.linalg.norm(v))
        if abs(size - before) <= 1e-6 * size:
            break
    return size, v / size
