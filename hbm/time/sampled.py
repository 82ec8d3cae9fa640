"""Time integration of the laws that are known by their step alone: coupled friction, cubic spring, a user's own law.

The poles of the stuck system are propagated exactly, as in `march`. A law without memory is integrated to fourth order
where it is smooth; one with a state to second order through its transitions, which it locates inside its own step.
"""

from dataclasses import dataclass

import numpy as np

from hbm import fourier
from hbm.laws.records import Motion
from hbm.time import events as integrator
from hbm.time.exact import MASSLESS, March

STEPS = 1024             # per period
NEWTON = 40
SETTLED = 1e-13          # change of the motion at which Newton ends
SAME_MOTION = 30         # periods in which the state of a law settles on a motion of the balance


@dataclass(frozen=True)
class SampledState:
    """z (2n,) of the poles; law (P, ns) state of the law; force (P, nd) that it gives, for laws with a state."""

    z: np.ndarray
    slider: np.ndarray
    force: np.ndarray


class SampledMarch(March):
    """Time integration of the problem of a HarmonicBalance at angular frequency w, in equal steps."""

    def __init__(self, balance, w, steps: int = STEPS, massless_above: float = MASSLESS):
        super().__init__(balance, w, 0.0, steps, massless_above)
        problem = balance.problem
        self.steps, self.h = steps, self.tables[0][0]
        self.pairs, self.contact = problem.pairs, problem.law
        self.stiffness = problem.law.stuck_stiffness(problem.pairs)
        self.constant = problem.law.stuck_force(problem.pairs)
        W = self.tables[2][0]
        integrator.fill_weights(self.system.s, self.h, W)
        if self.contact.states:                  # the force is straight over a step
            W[1] -= W[2] / self.h
            W[3] += W[2] / self.h
            W[2] = W[4] = 0.0
        self.W, self.D = W, integrator.direct_flexibility(self.system, W[3])
        self.known = np.array([integrator.stuck_motion(self.system, i * self.h) for i in range(steps + 1)])
        self.spectrum = np.exp(-1j * self.w * self.h * np.outer(np.arange(steps), np.arange(balance.H + 1))) \
            * (self.h * self.w / np.pi)

    def at_rest(self) -> SampledState:
        u = self.known[0, 0].reshape(self.stiffness.shape)
        state = self.contact.initial_state(u, self.balance.start, self.pairs)
        return self.state(np.zeros(2 * len(self.system.s)), state)

    def on_orbit(self, point) -> SampledState:
        b = self.balance
        z = self.poles_of(point)
        tau = np.linspace(0, 2 * np.pi, self.steps + 1)
        x = point.x.reshape(len(self.pairs), b.nd, b.nh)
        u, v = x @ fourier.basis(tau, b.H).T, self.w * x @ fourier.basis_rate(tau, b.H).T
        state = self.contact.initial_state(u[:, :, 0], b.start, self.pairs)
        for _ in range(SAME_MOTION if self.contact.states else 0):
            before = state
            for i in range(1, self.steps + 1):
                _, state = self.contact.step(Motion(u[:, :, i], v[:, :, i], self.h), state, self.pairs)
            if np.abs(state - before).max() <= 1e-10 * np.abs(u).max():
                break
        return self.state(z, state)

    def state(self, z, slider) -> SampledState:
        """The state at the poles z and the state of the law; the force that belongs to it is found by no motion."""
        z, slider = np.array(z, dtype=float), np.array(slider, dtype=float).reshape(len(self.pairs), -1)
        known = self.known[0, 0] + self.system.out @ z
        _, _, force, _ = self.solve(known, self.system.static, slider, known)
        return SampledState(z, slider, force)

    def vector(self, state: SampledState) -> np.ndarray:
        """z and the state of the law."""
        return np.r_[state.z * self.weight, state.slider.ravel()]

    def from_vector(self, v: np.ndarray) -> SampledState:
        n = len(self.weight)
        z, state = v[:n] / self.weight, v[n:].reshape(len(self.pairs), -1)
        u = (self.known[0, 0] + self.system.out @ z).reshape(self.stiffness.shape)
        return self.state(z, self.contact.consistent_state(u, state, self.pairs))

    def solve(self, known, D, state, guess):
        """(u, state, g, dg/du) of u + D g = known after a step of the law: Newton, halved where it does not help."""
        shape = self.stiffness.shape
        u, error, share = guess.copy(), np.inf, 1.0
        move = np.zeros_like(u)
        size = max(np.abs(known).max(), self.size[0])
        for _ in range(NEWTON):
            here = (u + share * move).reshape(shape)
            force, new, t = self.contact.tangents(Motion(here, 0 * here, self.h), state, self.pairs)
            g = force - self.constant - self.stiffness * here
            R = known - (u + share * move) - D @ g.ravel()
            now = np.abs(R).max()
            if now > error and share > 1e-3:
                share *= 0.5
                continue
            u, error, share = u + share * move, now, 1.0
            J = t.force_u.copy()
            J[:, np.arange(shape[1]), np.arange(shape[1])] -= self.stiffness
            if error <= SETTLED * size:
                break
            DJ = np.einsum("cpd,pde->cpe", D.reshape(len(D), *shape), J).reshape(len(D), -1)
            move = np.linalg.solve(np.eye(len(D)) + DJ, R)
        return u, new, g, J

    def periods(self, state: SampledState, n: int = 1) -> SampledState:
        z, law, g = state.z.copy(), state.slider, state.force
        for _ in range(n):
            self.G[:] = 0.0
            z, law, g = self._period(z, law, g)
        return SampledState(z, law, g)

    def _period(self, z, law, g):
        system, smooth = self.system, not self.contact.states
        u = self.known[0, 0] + system.out @ z - system.static @ g.ravel()
        push, rate = system.into @ g.ravel(), np.zeros_like(u)
        if smooth:
            rate = self._rate(0, z, push, self.solve(u + system.static @ g.ravel(), system.static, law, u)[3])
        self.work[:] = 0.0
        for i in range(1, self.steps + 1):
            z1 = integrator.times(self.W[0], z) - integrator.times(self.W[1], push) \
                - integrator.times(self.W[2], system.into @ rate)
            before, g_before = u, g
            known = self.known[i, 0] + system.out @ z1
            u, law, g, J = self.solve(known, self.D, law, u)
            push = system.into @ g.ravel()
            z = z1 - integrator.times(self.W[3], push)
            if smooth:
                new = self._rate(i, z, push, J)
                defect = new - (2 / self.h * (g - g_before).ravel() - rate)
                z -= integrator.times(self.W[4], system.into @ defect)
                rate = new
            self.G += np.outer(g.ravel(), self.spectrum[i % self.steps])
            mean = 0.5 * (g + g_before) + 0.5 * self.stiffness * (u + before).reshape(g.shape)
            self.work += (mean * (u - before).reshape(g.shape)).sum(axis=1)
        return z, law, g

    def _rate(self, i, z, push, J):
        """g' (nc,) at sample i."""
        system = self.system
        known = self.known[i, 1] + system.out @ (integrator.times(system.s, z) - push)
        DJ = np.einsum("cpd,pde->cpe", system.static.reshape(len(known), *J.shape[:2]), J).reshape(len(known), -1)
        rate = np.linalg.solve(np.eye(len(known)) + DJ, known).reshape(J.shape[:2])
        return np.einsum("pde,pe->pd", J, rate).ravel()

    def modal(self):
        b = self.balance
        G = self.G.copy()
        G[:, 0] /= 2
        return self._factors(b.H) * (b.force_at(1.0) - b.shapes.T @ G)
