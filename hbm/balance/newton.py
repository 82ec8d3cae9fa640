"""The residual of the harmonic balance at one point, with Newton's linear system on the contacts that slip or lift.

The derivative D of the contact forces g vanishes for contacts that stick through the cycle. With dg = D du the system
(I + G D) du = -R becomes (I + D G) dg = -D R, which has rows for the active components only.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf as getrf
from scipy.linalg.lapack import dgetrs as getrs

from hbm import fourier
from hbm.balance.memory import check_active_fit
from hbm.balance.settings import DEFAULT
from hbm.laws.records import ContactForces

EPS = np.finfo(float).eps


@dataclass(frozen=True)
class Linearisation:
    """Residual at one point with everything that Newton and the outputs need; `hbm.continuation.point.Linearised`.

    x, residual, by_parameter : (n,), n = P nd nh, contact by contact; by_parameter : derivative of the residual
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

    def solve(self, row: np.ndarray, corner: float, value: float,
              residual: np.ndarray | None = None) -> tuple[np.ndarray, float]:
        """dx, dp of [J, R_p; row', corner] [dx; dp] = [-R; value], with this residual R or with another."""
        return self._bordered(self.residual if residual is None else residual, row, corner, value)[:2]

    def direction(self, row: np.ndarray, corner: float) -> tuple[np.ndarray, float, float]:
        """tx, tp, sign: the tangent with row' tx + corner tp = 1, and the sign of the bordered determinant."""
        return self._bordered(np.zeros_like(self.residual), row, corner, 1.0)

    def moved(self, dx: np.ndarray, dp: float) -> "Linearisation":
        """This at x + dx, parameter + dp: outputs and forces are linearised, the matrices stay."""
        hb, b = self.balance, self.forces
        modal, g = self.modal + self.modal_rate * dp, b.g
        if len(b.contacts):
            size = hb.nd * hb.nh
            dg = np.matmul(b.D.reshape(-1, size, size), dx.reshape(-1, size)[b.contacts][:, :, None])
            g = g.copy()
            g[b.contacts] += dg.reshape(-1, hb.nd, hb.nh)
            columns = hb.shapes.reshape(-1, hb.nd, hb.shapes.shape[1])[b.contacts].reshape(-1, hb.shapes.shape[1])
            modal = modal - self.factors * real_times(columns.T, fourier.to_complex(dg.reshape(-1, hb.nh)))
        return replace(self, x=self.x + dx, modal=modal, forces=replace(b, g=g))

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """To add to the residual where x has come `away` from a point: see `HarmonicBalance.regularisation`.

        One Newton step with it undoes the part of the way in a mean motion that no force restrains, and to the size of
        the regularisation nothing else.
        """
        b, hb = self.forces, self.balance
        push = np.zeros((hb.n_components, hb.nh))
        push[:, 0] = hb.regularisation(b) * away.reshape(-1, hb.nh)[:, 0]
        rows = np.flatnonzero(push[:, 0])
        return self._respond(push, rows) if len(rows) else np.zeros_like(away)

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

    def _bordered(self, R, row, corner, value):
        """dx, dp and the sign of the determinant, through the active rows."""
        Rp, hb = self.by_parameter, self.balance
        _, rows, local = self._condensed()
        n = len(rows) * hb.nh
        if not n:
            pivot = corner - row @ Rp
            dp = (value + row @ R) / pivot
            return -R - Rp * dp, dp, np.sign(pivot)
        lu, pivots, sign, row_size, column_size = self._factorised(row, corner)
        if not sign:
            return np.full_like(R, np.nan), np.nan, 0.0
        y = getrs(lu, pivots, np.r_[-self._apply(local, R), (value + row @ R) / row_size])[0]
        dp = y[n] / column_size
        dg = np.zeros((hb.n_components, hb.nh))
        dg[rows] = y[:n].reshape(-1, hb.nh)
        return -R - Rp * dp - self._respond(dg, rows), dp, sign

    def _factorised(self, row, corner):
        """LU of the bordered system on the active rows, kept for the border it was made with; sign 0 where singular."""
        if self.border and self.border[0] is row and self.border[1] == corner:
            return self.border[2:]
        DG, rows, local = self._condensed()
        n = len(rows) * self.balance.nh
        system = np.empty((n + 1, n + 1), order="F")
        system[:n, :n] = DG
        system[np.arange(n), np.arange(n)] += 1.0
        system[:n, n] = self._apply(local, self.by_parameter)
        system[n, :n] = -self._respond_transposed(row, rows) if row.any() else 0.0
        system[n, n] = corner - row @ self.by_parameter
        row_size = max(np.abs(system[n]).max(), 1e-300)          # the border in the units of the rest
        system[n] /= row_size
        column_size = max(np.abs(system[:, n]).max(), 1e-300)
        system[:, n] /= column_size
        lu, pivots, info = getrf(system, overwrite_a=True)
        swaps = np.count_nonzero(pivots != np.arange(n + 1))
        sign = 0.0 if info or not np.isfinite(lu[-1, -1]) else np.prod(np.sign(np.diag(lu))) * (-1) ** swaps
        self.border[:] = row, corner, lu, pivots, sign, row_size, column_size
        return self.border[2:]

    def _condensed(self):
        if not self.parts:
            self.parts.extend(self._condense())
        return self.parts

    def _condense(self):
        """D G on the active rows (flat n x n), the rows (component numbers), and their places in D."""
        forces, hb = self.forces, self.balance
        nd, nh, H = hb.nd, hb.nh, hb.H
        a = len(forces.contacts)
        active = forces.active[forces.contacts]
        local = np.flatnonzero(active.ravel())
        rows = (forces.contacts[:, None] * nd + np.arange(nd))[active]
        n = len(rows)
        if not n:
            return np.zeros((0, 0)), rows, local
        check_active_fit(a, len(hb.problem.contacts), nd, H)
        columns = (forces.contacts[:, None] * nd + np.arange(nd)).ravel()
        left = forces.D[active] if n < a * nd else forces.D.reshape(n, nh, nd, nh)
        owner = np.repeat(np.arange(a), active.sum(axis=1))
        G = hb.contact_receptance.between(columns, rows, self.factors, self.w)
        DG = np.empty((n, nh, n, nh))
        for k in range(H + 1):
            Gk = G[k].reshape(a, nd, n)[owner]
            if k == 0:
                DG[:, :, :, 0] = np.matmul(np.ascontiguousarray(left[:, :, :, 0]), Gk.real)
                continue
            Z = np.matmul(left[:, :, :, 2 * k - 1] - 1j * left[:, :, :, 2 * k], Gk)
            DG[:, :, :, 2 * k - 1], DG[:, :, :, 2 * k] = Z.real, -Z.imag
        return DG.reshape(n * nh, n * nh), rows, local

    def _apply(self, local, x):
        """D x on the active rows, flat."""
        b, hb = self.forces, self.balance
        nd, nh = hb.nd, hb.nh
        X = x.reshape(-1, nd * nh)[b.contacts]
        y = np.matmul(b.D.reshape(len(b.contacts), nd * nh, nd * nh), X[:, :, None])[:, :, 0]
        return y.reshape(-1, nh)[local].ravel()

    def _respond(self, g, rows) -> np.ndarray:
        """G g, flat, for g (nc, nh) that is nonzero on `rows` only."""
        hb = self.balance
        modal = self.factors * real_times(hb.shapes[rows].T, fourier.to_complex(g[rows]))
        return fourier.to_real(real_times(hb.shapes, modal)).ravel()

    def _respond_transposed(self, row, rows) -> np.ndarray:
        """row' G restricted to the columns `rows`, flat: G is symmetric."""
        hb = self.balance
        c = np.conj(fourier.to_complex(row.reshape(hb.n_components, hb.nh)))
        z = real_times(hb.shapes[rows], self.factors * real_times(hb.shapes.T, c))
        return fourier.to_real(np.conj(z)).ravel()

    def contact_force(self, rest: np.ndarray) -> np.ndarray:
        """(P, nd, H+1) complex, N, of the contacts; rest (P, nd) N : their force at rest."""
        hb, problem = self.balance, self.balance.problem
        u = self.x.reshape(len(problem.contacts), hb.nd, hb.nh)
        f = self.forces.g + problem.law.stuck_stiffness(problem.contacts)[:, :, None] * u
        f[:, :, 0] += rest
        return fourier.to_complex(f)

    def smallest_motion(self) -> tuple[float, np.ndarray | None]:
        """(singular value over the largest, q (r, H+1)) of the direction in which the Jacobian is most nearly singular.

        By inverse iteration on one factorisation: close where that is well below the next one, which is what is asked.
        """
        hb = self.balance
        DG, rows, _ = self._condensed()
        n = len(rows) * hb.nh
        if not n:
            return 1.0, None
        A = DG + np.eye(n)
        lu, pivots, _ = getrf(A)
        zero = np.abs(np.diag(lu)) < EPS * np.abs(lu).max()      # exactly singular: as good as that to rounding
        lu[zero, zero] = EPS * np.abs(lu).max()
        inverse, v = _longest(lambda v: getrs(lu, pivots, getrs(lu, pivots, v, trans=1)[0])[0], n)
        largest, _ = _longest(lambda v: A.T @ (A @ v), n)
        dg = np.zeros((hb.n_components, hb.nh))
        dg[rows] = v.reshape(-1, hb.nh)
        modal = self.factors * (hb.shapes.T @ fourier.to_complex(dg))
        return 1 / np.sqrt(inverse * largest), hb.receptance.shapes @ modal


def _longest(apply, n):
    """(factor, unit vector) of the direction that a symmetric positive matrix lengthens most, by power iteration."""
    v, size = np.random.default_rng(0).normal(size=n), 0.0
    for _ in range(DEFAULT.power_iterations):
        v = v / np.linalg.norm(v)
        v = apply(v)
        before, size = size, np.linalg.norm(v)
        if abs(size - before) <= 1e-6 * size:
            break
    return size, v / size


def real_times(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A @ B for complex B; a real A is not turned into a complex one."""
    if np.iscomplexobj(A) or not np.iscomplexobj(B):
        return A @ B
    B = np.ascontiguousarray(B)
    return np.ascontiguousarray(A @ B.view(float)).view(complex)
