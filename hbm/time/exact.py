"""Time integration with the same contact laws: the second opinion on a periodic solution.

The motion is split into the steady response of the stuck system, known in closed form, and what the bracket
g = f - K_c u adds to it through the poles of the stuck system, which are propagated exactly (`poles`, `integrator`).
Stick, slip, lift-off and contact are located, so that the integration is of fourth order through all of them.
`shooting` finds steady states with it, `comparison` holds a point of a curve against it.
"""

from dataclasses import dataclass

import numpy as np

from hbm import fourier
from hbm.balance.residual import HarmonicBalance
from hbm.laws import compilation
from hbm.laws.records import Motion
from hbm.time import events as integrator
from hbm.time.events import OPEN, STICK, Law, System
from hbm.time.poles import split

TOLERANCE = 1e-7         # of the contact force within a step, relative to the largest
STEPS = 64               # the longest step, as a part of the period
HALVINGS = 16
MASSLESS = 50.0          # modes above this many times the excitation follow statically
TINY = 1e-12             # of the motion: how closely a transition is located
MOST_STEPS = 200000      # per period


@dataclass(frozen=True)
class State:
    """Where an integration stands at the begin of a period.

    z : (2n,) [Re y, Im y] of the poles; mode, slider : (P, nt); closed : (P,) bool
    """

    z: np.ndarray
    mode: np.ndarray
    closed: np.ndarray
    slider: np.ndarray

    def copy(self) -> "State":
        return State(self.z.copy(), self.mode.copy(), self.closed.copy(), self.slider.copy())


class March:
    """Time integration of the problem of a HarmonicBalance (corridor laws) at angular frequency w.

    tolerance : of the contact force within a step; 0 takes equal steps, `steps` a period (and those to transitions)
    massless_above : modes above this many times w follow statically (see `poles`); inf keeps every mass
    """

    def __init__(self, balance: HarmonicBalance, w: float, tolerance: float = TOLERANCE, steps: int = STEPS,
                 massless_above: float = MASSLESS):
        self.balance, self.w, self.tolerance = balance, float(w), float(tolerance)
        law, pairs = balance.problem.law, balance.problem.pairs
        compilation.announce(integrator.run)         # before anything compiled is called
        self.law = Law(len(law.components), law.sliders, "n" in law.components, pairs.kt, pairs.kn, pairs.mu,
                       pairs.preload)
        stiffness = law.stuck_stiffness(pairs).ravel()
        B = balance.problem.B
        P = split(balance.receptance, B, stiffness, massless_above * self.w)
        out, into = B @ P.out, (B @ P.into).T
        stuck = balance.shapes @ (self._factors(balance.H) * balance.force_at(1.0))
        orders = np.flatnonzero(np.any(balance.force_at(1.0) != 0, axis=0))
        self.system = System(P.s, np.ascontiguousarray(np.hstack([out.real, -out.imag])),
                             np.ascontiguousarray(np.vstack([into.real, into.imag])), P.flexibility(B), orders,
                             np.ascontiguousarray(stuck[:, orders].astype(complex)), self.w)
        self.largest = np.abs(stuck).sum(axis=1)
        self.size = np.array([self.largest.max() + 1e-300, (stiffness * self.largest).max() + 1e-300])
        n, nc = len(P.s), len(stuck)
        levels = HALVINGS if tolerance > 0 else 1
        self.tables = (2 * np.pi / (w * steps) / 2.0 ** np.arange(levels), np.zeros(levels + 1, bool),
                       np.empty((levels + 1, 5, n), complex), np.empty((levels + 1, nc, nc)))
        self.G, self.work = np.zeros((nc, balance.H + 1), complex), np.zeros(len(pairs))
        self.count, self.finished = np.zeros(2, int), True
        # poles counted by the motion that they make
        self.weight = np.tile(np.abs(out).max(axis=0) + 1e-300, 2)

    def _factors(self, H):
        return self.balance.receptance.factors(self.w * np.arange(H + 1))[0]

    def at_rest(self) -> State:
        """The steady stuck motion with the sliders where the start of the balance puts them."""
        w, from_position = self.balance.start
        known = integrator.stuck_motion(self.system, 0.0)[0].reshape(len(self.law.kt), -1)
        nt = self.law.tangents
        return self.state(np.zeros(2 * len(self.system.s)), known[:, :nt] if from_position else w[:, :nt])

    def on_orbit(self, point) -> State:
        """A solution of the harmonic balance at t = 0: displacement, velocity and sliders."""
        b = self.balance
        u = point.x.reshape(len(self.law.kt), b.nd, b.nh) @ fourier.basis(np.linspace(0, 4 * np.pi, 1025), b.H).T
        law, contacts = b.problem.law, b.problem.pairs
        state = law.initial_state(u[:, :, 0], b.start, contacts)
        for i in range(u.shape[2] if law.states else 0):
            _, state = law.step(Motion(u[:, :, i], 0 * u[:, :, i], 1.0), state, contacts)
        return self.state(self.poles_of(point), state[:, :law.sliders])

    def poles_of(self, point) -> np.ndarray:
        """z (2n,) of a solution of the harmonic balance at t = 0."""
        b, s = self.balance, self.system.s
        into = self.system.into[:len(s)] + 1j * self.system.into[len(s):]
        g = fourier.to_complex(point.detail.forces.g.reshape(-1, b.nh))
        push, back = into @ g, into @ g.conj()
        k = 1j * self.w * np.arange(b.H + 1)
        y = -0.5 * np.sum(push / (k - s[:, None]) + back / (-k - s[:, None]), axis=1)
        return np.r_[y.real, y.imag]

    def state(self, z, slider) -> State:
        """The state at the poles z with sliders (P, nt), pushed where the motion pushes them."""
        P, nt = len(self.law.kt), self.law.tangents
        slider = np.array(slider, dtype=float).reshape(P, nt)
        found = State(np.array(z, dtype=float), np.full((P, nt), STICK), np.full(P, True), slider)
        for _ in range(60):
            motion = self.motion(found)
            N = self.law.preload + (self.law.kn * motion[0, self.law.nd - 1::self.law.nd] if self.law.has_normal else 0)
            closed = N > 0
            mode, pushed = np.full((P, nt), OPEN), slider.copy()
            for d in range(nt):
                u = motion[0, d::self.law.nd]
                reach = np.divide(self.law.mu * np.maximum(N, 0), self.law.kt, out=np.zeros(P), where=self.law.kt > 0)
                pushed[:, d] = np.clip(slider[:, d], u - reach, u + reach)
                mode[closed & (self.law.mu > 0), d] = STICK
            same = np.array_equal(closed, found.closed) and np.array_equal(mode, found.mode) \
                and np.abs(pushed - found.slider).max(initial=0.0) <= TINY * self.size[0]
            found = State(found.z, mode, closed, pushed)
            if same or not self.system.static.any():
                break
        return found

    def motion(self, state):
        """(4, nc) relative motion, its rate, bracket and its rate, at the begin of a period."""
        nc = len(self.largest)
        gamma, a, motion = np.zeros((nc, self.law.nd)), np.zeros(nc), np.zeros((4, nc))
        integrator.frozen(self.law, state.mode, state.closed, state.slider, gamma, a)
        integrator.instant(self.system, self.law, gamma, a, 0.0, state.z, motion)
        return motion

    def periods(self, state: State, n: int = 1) -> State:
        """State after n periods. Harmonics and work of the last one are kept; `finished` is False where steps ran out.

        That happens where the motion chatters faster and faster.
        """
        state = state.copy()
        self.finished = integrator.run(
            self.system, self.law, self.tables, (state.mode, state.closed, state.slider), state.z, n, self.tolerance,
            TINY, self.size, MOST_STEPS, self.G, self.work, self.count)
        return state

    def vector(self, state: State) -> np.ndarray:
        """(2n + P nt,) the state as numbers in m, for `shooting`."""
        return np.r_[state.z * self.weight, state.slider.ravel()]

    def from_vector(self, v: np.ndarray) -> State:
        n = len(self.weight)
        return self.state(v[:n] / self.weight, v[n:])

    def change(self, before: State, after: State) -> float:
        """Change of the relative motion and of the sliders, relative to the vibration of the last period marched."""
        X = fourier.to_complex(self.harmonics_of_motion().reshape(len(self.G), -1))
        size = np.abs(X[:, 1:]).sum(axis=1).max(initial=0.0) + 1e-300
        moved = np.abs(self.system.out @ (after.z - before.z)).max(initial=0.0)
        return float(max(moved, np.abs(after.slider - before.slider).max(initial=0.0)) / size)

    def modal(self, H=None) -> np.ndarray:
        """(m, H+1) complex modal response over the last period marched: its bracket goes through the receptance."""
        b = self.balance
        G = self.G * (self.w / np.pi)
        G[:, 0] /= 2
        return self._factors(b.H) * (b.force_at(1.0) - b.shapes.T @ G)

    def harmonics(self, rows) -> np.ndarray:
        """(m, H+1) complex harmonics of the outputs rows (m, r) over the last period marched."""
        return np.asarray(rows) @ (self.balance.receptance.shapes @ self.modal())

    def harmonics_of_motion(self) -> np.ndarray:
        """x (P nd nh,) of the last period marched: a guess for the balance."""
        return fourier.to_real(self.balance.shapes @ self.modal()).ravel()
