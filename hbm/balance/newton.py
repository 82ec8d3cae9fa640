"""The residual of the harmonic balance at one point, with Newton's linear system on the contacts
that slip or lift.

The derivative D of the contact forces g vanishes for contacts that stick through the cycle. With dg
= D du the system (I + G D) du = -R becomes (I + D G) dg = -D R, which has rows for the active
components only.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf as getrf
from scipy.linalg.lapack import dgetrs as getrs

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.kernels import (
    added,
    applied,
    bordered,
    complex_rows,
    condensed,
    right_side,
    sign_of,
    step_of,
)
from tipdamp.hbm.balance.series import real_times
from tipdamp.hbm.balance.settings import DEFAULT
from tipdamp.hbm.continuation.point import Bordered
from tipdamp.hbm.laws.records import ContactForces
from tipdamp.hbm.memory import check_active_fit

EPS = np.finfo(float).eps


@dataclass(frozen=True)
class Linearisation(Bordered):
    """Residual at one point with everything that Newton and the outputs need;
    `hbm.continuation.point.Linearised`.

    x, residual, by_parameter : (n,), n = P nd nh, contact by contact; by_parameter : derivative of
    the residual
    forces : of the contacts; w : rad/s; balance : the HarmonicBalance
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
    parts: list = field(default_factory=list)
    border: list = field(default_factory=list)

    def solve_held(
        self, residual: np.ndarray, tangent: tuple[np.ndarray, float] | None
    ) -> np.ndarray:
        """dx (n,) of J dx = -residual at a fixed parameter; tangent : along the branch, through the
        system that it was solved with, None where there is none."""
        if not self.border or tangent is None:
            return self._bordered(residual, np.zeros_like(residual), 1.0, 0.0)[0]
        row, corner = self.border[:2]
        dx, dp, _ = self._bordered(residual, row, corner, 0.0)
        return dx - dp / tangent[1] * tangent[0]

    def further(self, compute: Callable[["Linearisation"], np.ndarray]) -> np.ndarray:
        """compute(this), which a journal keeps."""
        return compute(self)

    def moved(self, dx: np.ndarray, dp: float) -> "Linearisation":
        """This at x + dx, parameter + dp: outputs and forces are linearised, the matrices stay."""
        b, modal, g = self.forces, self.modal + self.modal_rate * dp, self.forces.g
        if len(b.contacts):
            _, rows, places, columns = self._condensed()
            dg = applied(b.D, places, b.contacts, dx)
            g = added(g, rows, dg)
            modal -= self.factors * real_times(
                columns.T, complex_rows(dg, len(rows), self.balance.H + 1)
            )
        return replace(self, x=self.x + dx, modal=modal, forces=replace(b, g=g))

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """To add to the residual where x has come `away` from a point: see
        `HarmonicBalance.regularisation`.

        One Newton step with it undoes the part of the way in a mean motion that no force restrains,
        and to the size of the regularisation nothing else.
        """
        b, hb = self.forces, self.balance
        push = hb.regularisation(b) * away[:: hb.nh]
        rows = np.flatnonzero(push)
        if not len(rows):
            return np.zeros_like(away)
        g = np.zeros((len(rows), hb.nh))
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
        self.parts.clear()
        self.border.clear()

    def _bordered(
        self, R: np.ndarray, row: np.ndarray, corner: float, value: float
    ) -> tuple[np.ndarray, float, Any]:
        """dx, dp and the sign of the determinant, through the active rows."""
        Rp, hb, b = self.by_parameter, self.balance, self.forces
        G, rows, places, columns = self._condensed()
        if not len(rows):
            pivot = corner - row @ Rp
            dp = (value + row @ R) / pivot
            return -R - Rp * dp, dp, np.sign(pivot)
        lu, pivots, sign, row_size, column_size = self._factorised(row, corner)
        if not sign:
            return np.full_like(R, np.nan), np.nan, 0.0
        right = right_side((b.D, places, b.contacts, G), R, row, value, row_size)
        y = getrs(lu, pivots, right, trans=1, overwrite_b=True)[0]
        dp = y[-1] / column_size
        modal = self.factors * real_times(columns.T, complex_rows(y, len(rows), hb.H + 1))
        return step_of(R, Rp, dp, real_times(hb.shapes, modal)), dp, sign

    def _factorised(self, row: np.ndarray, corner: float) -> list[Any]:
        """LU of the bordered system on the active rows, transposed for LAPACK, kept for the border
        it was made with, and the sign of its determinant, 0 where it is singular."""
        if self.border and self.border[0] is row and self.border[1] == corner:
            return self.border[2:]
        G, rows, places, columns = self._condensed()
        b, n = self.forces, len(rows) * self.balance.nh
        along = real_times(columns, self.factors * self.balance.contact_receptance.excited_by(row))
        system = np.empty((n + 1, n + 1))
        sizes = bordered(
            (b.D, places, b.contacts, G), (row, corner, self.by_parameter, along), system
        )
        lu, pivots, _ = getrf(system.T, overwrite_a=True)
        self.border[:] = row, corner, lu, pivots, sign_of(lu, pivots), *sizes
        return self.border[2:]

    def _system(self, size: int) -> np.ndarray:
        """(size, size): I + D G on the active rows; what is beyond them is not filled."""
        G, _, places, _ = self._condensed()
        system = np.empty((size, size))
        condensed(self.forces.D, places, G, system)
        return system

    def _condensed(self) -> list[np.ndarray]:
        """G between the components of the active contacts and the active ones (a nd, n, H+1), the
        numbers of these (n,), their places in D, and their rows of the left modes (n, m)."""
        if not self.parts:
            forces, hb = self.forces, self.balance
            active = forces.active[forces.contacts]
            components = forces.contacts[:, None] * hb.nd + np.arange(hb.nd)
            rows, G = components[active], np.zeros((0, 0, hb.H + 1), dtype=complex)
            if len(rows):
                check_active_fit(len(active), len(hb.problem.contacts), hb.nd, hb.H)
                G = hb.contact_receptance.between(components.ravel(), rows, self.factors, self.w)
            self.parts.extend(
                (G, rows, np.flatnonzero(active), hb.contact_receptance.into_of(rows))
            )
        return self.parts

    def _respond(self, g: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """G g, flat, for g (n, nh) on `rows` and zero elsewhere."""
        hb = self.balance
        modal = self.factors * real_times(hb.into[rows].T, fourier.to_complex(g))
        return fourier.to_real(real_times(hb.shapes, modal)).ravel()

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
        rows = self._condensed()[1]
        n = len(rows) * hb.nh
        if not n:
            return 1.0, None
        A = self._system(n)
        lu, pivots, _ = getrf(A)
        # exactly singular: as good as that to rounding
        zero = np.abs(np.diag(lu)) < EPS * np.abs(lu).max()
        lu[zero, zero] = EPS * np.abs(lu).max()
        inverse, v = _longest(lambda v: getrs(lu, pivots, getrs(lu, pivots, v, trans=1)[0])[0], n)
        largest, _ = _longest(lambda v: A.T @ (A @ v), n)
        dg = np.zeros((hb.n_components, hb.nh))
        dg[rows] = v.reshape(-1, hb.nh)
        modal = self.factors * (hb.into.T @ fourier.to_complex(dg))
        return 1 / np.sqrt(inverse * largest), hb.receptance.shapes @ modal


def _longest(apply: Callable, n: int) -> tuple[float, np.ndarray]:
    """(factor, unit vector) of the direction that a symmetric positive matrix lengthens most, by
    power iteration."""
    v, size = np.random.default_rng(0).normal(size=n), 0.0
    for _ in range(DEFAULT.power_iterations):
        v = v / np.linalg.norm(v)
        v = apply(v)
        before, size = size, float(np.linalg.norm(v))
        if abs(size - before) <= 1e-6 * size:
            break
    return size, v / size
