"""Linear side of the time integration: the stuck system under its external forces, driven by the
nonlinear force.

The motion at the contacts is the steady response of the stuck system, known in closed form, plus
what the nonlinear force g adds to it through the poles (see `poles`): u = known(t) + out z - S g.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.laws.base import ContactLaw, Contacts
from tipdamp.hbm.time.events import System, times
from tipdamp.hbm.time.poles import split
from tipdamp.hbm.time.settings import IntegrationSettings


@dataclass(frozen=True)
class StuckSystem:
    """The stuck system of a balance at angular frequency w, rad/s.

    system : its matrices for the kernels (`events.System`); motion (m), force (N) : size of its
    vibration
    weight : (2n,) m, poles counted by the motion that they make
    """

    balance: HarmonicBalance
    w: float
    system: System
    motion: float
    force: float
    weight: np.ndarray

    @property
    def law(self) -> ContactLaw:
        """Of the problem of the balance."""
        return self.balance.problem.law

    @property
    def contacts(self) -> Contacts:
        """Of the problem of the balance."""
        return self.balance.problem.contacts

    @property
    def shape(self) -> tuple[int, int]:
        """(P, nd)."""
        return len(self.contacts), self.balance.nd

    def known(self, t: np.ndarray) -> np.ndarray:
        """(3, nt, P nd) motion of the stuck system under the external forces, rate and acceleration
        at nt instants."""
        s = self.system
        turning = 1j * s.w * s.orders
        waves = np.exp(np.outer(t, turning))
        return np.stack([((waves * turning**d) @ s.stuck.T).real for d in range(3)])

    def resting(self) -> np.ndarray:
        """(2n,) poles where no nonlinear force has acted."""
        return np.zeros(2 * len(self.system.s))

    def on_orbit(self, point: Point) -> np.ndarray:
        """z (2n,) of a solution of the harmonic balance at t = 0."""
        s, n = self.system.s, len(self.system.s)
        into = self.system.into[:n] + 1j * self.system.into[n:]
        g = fourier.to_complex(point.detail.forces.g.reshape(-1, self.balance.nh))
        push, back = into @ g, into @ g.conj()
        k = 1j * self.w * np.arange(self.balance.H + 1)
        y = -0.5 * np.sum(push / (k - s[:, None]) + back / (-k - s[:, None]), axis=1)
        return np.r_[y.real, y.imag]

    def rate(self, z: np.ndarray, push: np.ndarray) -> np.ndarray:
        """z' (2n,) under push = b' g."""
        return times(self.system.s, z) - push

    def modal(self, force: np.ndarray) -> np.ndarray:
        """(m, H+1) complex modal response to the external and to the nonlinear force, harmonics (P
        nd, H+1)."""
        b = self.balance
        factors = b.receptance.factors(self.w * np.arange(force.shape[1]))[0]
        return factors * (b.force_at(1.0) - b.into.T @ force)

    def harmonics(self, rows: np.ndarray, force: np.ndarray) -> np.ndarray:
        """(m, H+1) complex harmonics of the outputs rows (m, r)."""
        return np.asarray(rows) @ (self.balance.receptance.shapes @ self.modal(force))

    def relative_motion(self, force: np.ndarray) -> np.ndarray:
        """(P nd, H+1) complex harmonics of the motion at the contacts."""
        return self.balance.shapes @ self.modal(force)


class OnStuckSystem:
    """What integrators of any kind do alike with their states of poles z and memory."""

    stuck: StuckSystem

    def vector(self, state: Any) -> np.ndarray:
        """As in `Integrator`."""
        return np.r_[state.z * self.stuck.weight, state.memory.ravel()]

    def change(self, before: Any, cycle: Any) -> float:
        """As in `Integrator`."""
        after, stuck = cycle.state, self.stuck
        motion = stuck.relative_motion(cycle.force)[:, 1:]
        size = np.abs(motion).sum(axis=1).max(initial=0.0) + 1e-300
        moved = np.abs(stuck.system.out @ (after.z - before.z)).max(initial=0.0)
        changed = np.abs(after.memory - before.memory).max(initial=0.0)
        return float(max(moved, changed) / size)


def stuck_system(balance: HarmonicBalance, w: float, settings: IntegrationSettings) -> StuckSystem:
    """The stuck system of a balance; modes far above w follow statically (`massless_above`),
    springs hold what only the mean of is held."""
    held = balance.problem.with_springs_alone()
    balance = balance if held is balance.problem else balance.rebuilt(held, balance.forces)
    problem, B, w = balance.problem, balance.problem.B, float(w)
    stiffness = problem.law.stuck_stiffness(problem.contacts).ravel()
    P = split(balance.receptance, B, stiffness, settings.massless_above * w, settings.foreign_share)
    out, into = B @ P.out, (B @ P.into).T
    factors = balance.receptance.factors(w * np.arange(balance.H + 1))[0]
    stuck = balance.shapes @ (factors * balance.force_at(1.0))
    orders = np.flatnonzero(np.any(balance.force_at(1.0) != 0, axis=0))
    system = System(
        P.s,
        np.ascontiguousarray(np.hstack([out.real, -out.imag])),
        np.ascontiguousarray(np.vstack([into.real, into.imag])),
        P.flexibility(B),
        orders,
        np.ascontiguousarray(stuck[:, orders].astype(complex)),
        w,
    )
    largest = np.abs(stuck).sum(axis=1)
    return StuckSystem(
        balance,
        w,
        system,
        largest.max() + 1e-300,
        (stiffness * largest).max() + 1e-300,
        np.tile(np.abs(out).max(axis=0) + 1e-300, 2),
    )
