"""Free periodic motions of a given amplitude, by the extended periodic motion concept.

    M q'' + (C - 2 zeta w M) q' + K q + B' f(B q) = F0,      row q_1 = a, real

An artificial damping proportional to the mass makes the motion of a damped system periodic
[Krack 2015]; its ratio zeta is that of the mode. Condensed to the relative motion at the contacts,
u = B q: the coordinates of the stuck modes follow from the contact forces g beyond the stuck
springs, but for the one of the mode followed in order 1. That one has the amplitude a, and its
equation determines w and zeta. Unknowns are the shape u/a over that of the stuck mode, w over the
stuck frequency, and zeta: where everything sticks they do not depend on a.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf as getrf
from scipy.linalg.lapack import dgetrs as getrs

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.kernels import applied, condensed, sign_of
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import Bordered
from tipdamp.hbm.laws.records import ContactForces
from tipdamp.hbm.modes.stuck_modes import StuckModalSystem, times

# of frequency and damping ratio beside the shape: a change of 0.001 there is as much as one of 0.02
WEIGHT = 20.0


@dataclass(frozen=True)
class ModeEquation:
    """R(x, a) = 0; x (nc nh + 2,) : shape, relative frequency, damping ratio; a : amplitude in m.

    balance : of the contacts, without forces
    mode : index among the stuck modes; row : (m,) that takes the amplitude out of their coordinates
    """

    balance: HarmonicBalance
    modes: StuckModalSystem
    mode: int
    row: np.ndarray

    @cached_property
    def weights(self) -> np.ndarray:
        """(n,) of the unknowns in the arc length."""
        return np.r_[self.balance.weights, WEIGHT, WEIGHT]

    @property
    def frequency(self) -> float:
        """rad/s of the stuck mode."""
        return float(self.modes.frequencies[self.mode])

    @property
    def damping_ratio(self) -> float:
        """Of the stuck mode."""
        m = self.modes
        damping = m.damping
        own = damping[self.mode] if damping.ndim == 1 else damping[self.mode, self.mode]
        return float(0.5 * own / np.sqrt(m.stiffness[self.mode] * m.mass[self.mode]))

    @cached_property
    def unit(self) -> float:
        """Motion of the contacts for an amplitude of 1 in the stuck mode."""
        u = self.modes.at_contacts[:, self.mode] / self.row[self.mode]
        return float(np.linalg.norm(u))

    @cached_property
    def static(self) -> np.ndarray:
        """(m,) N, modal, constant."""
        static = self.balance.problem.static
        return np.zeros(len(self.row)) if static is None else self.modes.shapes.T @ static

    def stuck(self) -> np.ndarray:
        """(n,) unknowns of the stuck mode."""
        u = np.zeros((self.balance.n_components, self.balance.nh))
        u[:, 1] = self.modes.at_contacts[:, self.mode] / (self.row[self.mode] * self.unit)
        return np.r_[u.ravel(), 1.0, self.damping_ratio]

    def motion(self, x: np.ndarray, a: float) -> tuple[np.ndarray, float, float]:
        """(u (P, nd, nh) m, w rad/s, zeta) of the unknowns."""
        hb = self.balance
        u = (a * self.unit) * x[:-2].reshape(len(hb.problem.contacts), hb.nd, hb.nh)
        return u, self.frequency * x[-2], float(x[-1])

    def evaluate(self, x: np.ndarray, a: float) -> "ModeLinearisation":
        """Linearisation at x (n,) and an amplitude."""
        hb = self.balance
        if hb.on_call:
            hb.on_call()
        u, w, zeta = self.motion(x, a)
        again = partial(hb.regularised_forces, u, w)
        forces = again()
        Z = self.modes.impedance(w, zeta, hb.H)
        flexibility = self.modes.flexibility(Z, self.mode)
        force = -self.modal(forces.g)
        force[0] += self.static
        Q = self.coordinates(flexibility, force, a)
        out_of_balance = self.of_mode(Z, Q) - force[1, self.mode]
        scale = abs(self.row[self.mode]) / (self.modes.stiffness[self.mode] * a)
        away = u.ravel() - self.at_contacts(Q)
        residual = np.r_[
            away / (a * self.unit),
            scale * WEIGHT * np.array([out_of_balance.real, out_of_balance.imag]),
        ]
        return ModeLinearisation(
            self,
            x,
            a,
            residual,
            replace(forces, D=np.empty((0, *forces.D.shape[1:]))),
            Q,
            Z,
            flexibility,
            scale * WEIGHT,
            lambda: again().D,
            [forces.D],
        )

    def modal(self, g: np.ndarray) -> np.ndarray:
        """(H+1, m) N of forces g (..., nh) on the contacts."""
        return fourier.to_complex(g.reshape(-1, self.balance.nh)).T @ self.modes.at_contacts

    def at_contacts(self, Q: np.ndarray) -> np.ndarray:
        """(nc nh,) motion of the contacts of coordinates (H+1, m)."""
        return fourier.to_real(self.modes.at_contacts @ Q.T).ravel()

    def coordinates(self, flexibility: np.ndarray, force: np.ndarray, a: complex) -> np.ndarray:
        """(H+1, m) under modal forces, with the amplitude a in place of the equation of the
        mode."""
        force = force.copy()
        j = self.mode
        force[1, j] = 0.0
        Q = times(flexibility, force)
        free = self.along(flexibility)
        Q[1] += (a - self.row @ Q[1]) / (self.row @ free) * free
        return Q

    def along(self, flexibility: np.ndarray) -> np.ndarray:
        """(m,) coordinates of order 1 for that of the mode alone."""
        if flexibility.ndim == 3:
            return flexibility[1, :, self.mode]
        return (np.arange(len(self.row)) == self.mode) * 1.0

    def of_mode(self, Z: np.ndarray, Q: np.ndarray) -> complex:
        """Row of the mode of Z Q in order 1."""
        j = self.mode
        return complex(Z[1, j] * Q[1, j] if Z.ndim == 2 else Z[1, j] @ Q[1])


@dataclass(frozen=True)
class ModeLinearisation(Bordered):
    """Residual of a ModeEquation at one point; `tipdamp.hbm.continuation.point.Linearised`.

    x, residual : (n,); a : amplitude, m; modal : (H+1, m) coordinates
    forces : of the contacts, without their derivative, which `derivative` computes and `kept` holds
    impedance, flexibility : of the stuck modes there; scale : of the equation of the mode
    """

    of: ModeEquation
    x: np.ndarray
    a: float
    residual: np.ndarray
    forces: ContactForces
    modal: np.ndarray
    impedance: np.ndarray
    flexibility: np.ndarray
    scale: float
    derivative: Callable[[], np.ndarray]
    kept: list[np.ndarray]
    parts: list = field(default_factory=list)

    def moved(self, dx: np.ndarray, da: float) -> "ModeLinearisation":
        """This at x + dx, amplitude + da, linearised."""
        of = self.of
        step = of.frequency * dx[-2]
        du = self.a * of.unit * dx[:-2] + of.unit * self.x[:-2] * da
        dg = np.zeros(len(du)).reshape(-1, of.balance.nh)
        dg[self._rows] = self._derivative(du).reshape(-1, of.balance.nh)
        force = -of.modal(dg) - self._by_unknowns[0] * step - self._by_unknowns[1] * dx[-1]
        Q = self.modal + of.coordinates(self.flexibility, force, da)
        return replace(self, x=self.x + dx, a=self.a + da, modal=Q)

    def restoring(self, away: np.ndarray) -> np.ndarray:
        """As `tipdamp.hbm.balance.newton.Linearisation.restoring`."""
        of = self.of
        hb = of.balance
        g = np.zeros((hb.n_components, hb.nh))
        g[:, 0] = hb.regularisation(self.forces) * away[:-2][:: hb.nh]
        if not g.any():
            return np.zeros_like(away)
        Q = np.zeros_like(self.modal)
        Q[:1] = times(self.flexibility[:1], of.modal(g)[:1])
        return np.r_[of.at_contacts(Q), 0.0, 0.0]

    def outputs(self, rows: np.ndarray) -> np.ndarray:
        """(m, H+1) complex harmonics of the outputs, rows (m, r)."""
        return (rows @ self.of.modes.shapes) @ self.modal.T

    def forget(self) -> None:
        """Drop the factorised matrix, and the derivative of the contact forces."""
        self.kept.clear()
        self.parts.clear()

    @property
    def _D(self) -> np.ndarray:
        if not self.kept:
            self.kept.append(self.derivative())
        return self.kept[0]

    @cached_property
    def _rows(self) -> np.ndarray:
        """Components whose force changes."""
        forces = self.forces
        nd = self.of.balance.nd
        components = forces.contacts[:, None] * nd + np.arange(nd)
        return components[forces.active[forces.contacts]]

    @cached_property
    def _places(self) -> np.ndarray:
        return np.flatnonzero(self.forces.active[self.forces.contacts])

    @cached_property
    def _by_unknowns(self) -> tuple[np.ndarray, np.ndarray]:
        """(H+1, m) each: derivatives of impedance times coordinates, and contact forces, by w and
        by zeta."""
        w, zeta = self.of.frequency * self.x[-2], float(self.x[-1])
        by_w, by_zeta = self.of.modes.impedance_rates(w, zeta, self.modal)
        if self.forces.by_omega is not None:
            by_w = by_w + self.of.modal(self.forces.by_omega)
        return by_w, by_zeta

    def _derivative(self, du: np.ndarray) -> np.ndarray:
        return applied(self._D, self._places, self.forces.contacts, du)

    def _factorised(self) -> list[Any]:
        """LU of I + D G on the active rows, pivots, sign, and the response to w, zeta and a: motion
        of the contacts (nc nh, 3) and force on the mode (2, 3)."""
        if self.parts:
            return self.parts
        of = self.of
        hb = of.balance
        n = len(self._rows) * hb.nh
        system = np.empty((n, n))
        if n:
            components = (self.forces.contacts[:, None] * hb.nd + np.arange(hb.nd)).ravel()
            G = self._receptance(components, self._rows)
            condensed(self._D, self._places, G, system)
            lu, pivots, _ = getrf(system)
            self.parts.extend((lu, pivots, sign_of(lu, pivots)))
        else:
            self.parts.extend((system, np.empty(0, dtype=int), 1.0))
        zero = np.zeros_like(self.modal)
        sources = [(-part, 0.0) for part in self._by_unknowns] + [(zero, 1.0)]
        found = []
        for force, a in sources:
            Q = of.coordinates(self.flexibility, force, a)
            start = of.at_contacts(Q)
            if a:
                start = start + of.unit * self.residual[:-2]
            du, mode = self._response(start, Q)
            mode -= force[1, of.mode]
            found.append((du, mode))
        self.parts.extend((np.array([du for du, _ in found]).T, np.array([p for _, p in found])))
        return self.parts

    def _receptance(self, to: np.ndarray, at: np.ndarray) -> np.ndarray:
        """(len(to), len(at), H+1) complex between components, the amplitude kept."""
        of = self.of
        A = self.flexibility
        left, right = of.modes.at_contacts[to], of.modes.at_contacts[at]
        if A.ndim == 2:
            G = (left[None] * A[:, None]) @ right.T
            first = A[1][:, None] * right.T
        else:
            G = left @ (A @ right.T)
            first = A[1] @ right.T
        free = of.along(A)
        own = first.copy()
        # the force on the mode itself does not enter its coordinate
        own -= np.outer(free, right[:, of.mode])
        own -= np.outer(free, of.row @ own) / (of.row @ free)
        G[1] = left @ own
        return np.ascontiguousarray(G.transpose(1, 2, 0))

    def _response(self, start: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, complex]:
        """(motion of the contacts (nc nh,), force on the mode) where forces follow a motion `start`
        (nc nh,), coordinates Q of which are given."""
        of = self.of
        lu, pivots = self.parts[:2]
        mode = of.of_mode(self.impedance, Q)
        if not len(self._rows):
            return start, mode
        dg = np.zeros((of.balance.n_components, of.balance.nh))
        dg[self._rows] = getrs(lu, pivots, self._derivative(start))[0].reshape(-1, of.balance.nh)
        force = -of.modal(dg)
        more = of.coordinates(self.flexibility, force, 0.0)
        mode += of.of_mode(self.impedance, more) - force[1, of.mode]
        return start + of.at_contacts(more), mode

    def _bordered(
        self, R: np.ndarray, row: np.ndarray, corner: float, value: float
    ) -> tuple[np.ndarray, float, float]:
        of = self.of
        a = self.a
        size = a * of.unit
        _, _, sign, columns, by_mode = self._factorised()
        if not sign:
            return np.full_like(R, np.nan), np.nan, 0.0
        du, mode = self._response(-size * R[:-2], np.zeros_like(self.modal))
        # in units of the unknowns
        columns = np.column_stack([of.frequency * columns[:, 0], columns[:, 1], columns[:, 2]])
        by_mode = np.r_[of.frequency * by_mode[0], by_mode[1], by_mode[2]]
        columns = columns / size
        columns[:, 2] -= self.x[:-2] / a
        y = du / size
        matrix = np.empty((3, 3))
        matrix[0], matrix[1] = self.scale * by_mode.real, self.scale * by_mode.imag
        matrix[:2, 2] -= self.residual[-2:] / a
        matrix[2] = row[:-2] @ columns + np.r_[row[-2:], corner]
        right = np.r_[-R[-2:] - self.scale * np.array([mode.real, mode.imag]), value - row[:-2] @ y]
        d, way = _solved(matrix, right)
        if not way:  # under full slip no frequency is determined
            return np.full_like(R, np.nan), np.nan, 0.0
        dx = np.r_[y + columns @ d, d[:2]]
        return dx, float(d[2]), sign * way


def _solved(matrix: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, float]:
    """(x of matrix x = right, sign of its determinant), rows and columns in units of their largest
    entries; 0 and no solution where it is singular."""
    sizes = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
    wide = np.maximum(np.abs(matrix / sizes[:, None]).max(axis=0), 1e-300)
    scaled = matrix / sizes[:, None] / wide
    way = np.sign(np.linalg.det(scaled))
    if not way:
        return right, way
    return np.linalg.solve(scaled, right / sizes) / wide, way
