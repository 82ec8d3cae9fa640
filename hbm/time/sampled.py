"""Time integration in equal steps, of laws known by their `step`: coupled friction, rate-dependent
laws, a user's own.

The poles of the stuck system are propagated exactly, as in `exact`. A law without state is
integrated to fourth order where it is smooth; one with a state to second order through its events,
which it locates inside its own step if at all.

Newton's method solves many steps together: a law of Python is asked for all of them in one call,
and what follows between two calls is compiled (`equal_steps`). Where it does not converge they are
fewer, down to one by one."""

from dataclasses import dataclass

import numpy as np

from tipdamp.hbm import fourier
from tipdamp.hbm.balance.residual import HarmonicBalance
from tipdamp.hbm.continuation.point import Point
from tipdamp.hbm.laws.records import Motion
from tipdamp.hbm.time import events
from tipdamp.hbm.time.base import IntegratedCycle
from tipdamp.hbm.time.equal_steps import EqualSteps, Lines, Path, follow_lines
from tipdamp.hbm.time.settings import IntegrationSettings
from tipdamp.hbm.time.stuck_system import OnStuckSystem, stuck_system


@dataclass(frozen=True)
class SampledState:
    """z (2n,) of the poles; memory (P, ns), state of the law; u (P nd,) m; g, rate (P nd,) N and
    N/s of the nonlinear force, whose rate is zero for laws with a state."""

    z: np.ndarray
    memory: np.ndarray
    u: np.ndarray
    g: np.ndarray
    rate: np.ndarray


@dataclass(frozen=True)
class _StepEnd:
    """Motion at the end of a step dt under the nonlinear force g (P nd,) there: u = u0 - D g, v =
    v0 - Dv g."""

    u0: np.ndarray
    D: np.ndarray
    v0: np.ndarray
    Dv: np.ndarray
    dt: float


class SampledIntegrator(OnStuckSystem):
    """Integration of the problem of a HarmonicBalance at angular frequency w by samples (see
    `base.Integrator`)."""

    method = "sampled"

    def __init__(
        self, balance: HarmonicBalance, w: float, settings: IntegrationSettings | None = None
    ) -> None:
        self.settings = settings = settings or IntegrationSettings()
        self.stuck = stuck_system(balance, w, settings)
        law = self.stuck.law
        system = self.stuck.system
        n = settings.samples
        self.size, self.smooth, self.h = self.stuck.motion, law.states == 0, 2 * np.pi / (w * n)
        self.stiffness, self.constant = self.stuck.balance.springs, self.stuck.balance.own.rest
        self.W = _weights(system.s, self.h, self.smooth)
        # massless modes feel the rate of the force at the end of the step: slope g - (slope g +
        # rate at its begin)
        self.slope = (2 if self.smooth else 1) / self.h
        self.D = events.direct_flexibility(system, self.W[3])
        self.Dv = (
            events.direct_flexibility(system, 1 + system.s * self.W[3])
            + (self.slope - 1) * system.static
        )
        self.steps = EqualSteps(self.h, self.W, self.D, self.Dv, self.slope, self.smooth)
        self.known = self.stuck.known(self.h * np.arange(n + 1))
        self._laws: dict[int, tuple] = {}  # of so many samples, and their contacts
        self.waves = np.exp(
            -1j * self.stuck.w * self.h * np.outer(np.arange(1, n + 1), np.arange(balance.H + 1))
        )

    def at_rest(self) -> SampledState:
        """As in `Integrator`."""
        stuck = self.stuck
        u = self.known[0, 0].reshape(stuck.shape)
        memory = stuck.law.initial_state(u, stuck.balance.start, stuck.contacts)
        return self._begin(stuck.resting(), memory)

    def on_orbit(self, point: Point) -> SampledState:
        """The state of the law settles on the motion of the point over some periods."""
        b, n = self.stuck.balance, self.settings.samples
        law, contacts = self.stuck.law, self.stuck.contacts
        tau = np.linspace(0, 2 * np.pi, n + 1)
        x = point.x.reshape(*self.stuck.shape, -1)
        u = x @ fourier.basis(tau, b.H).T
        v = self.stuck.w * x @ fourier.basis_rate(tau, b.H).T
        forces = point.detail.forces
        mean_force = forces.g[:, :, 0] + b.springs * x[:, :, 0]
        start = law.start_at_rest(
            forces.shares[:, 0] == 1, x[:, :, 0], mean_force, b.start, contacts
        )
        memory = law.initial_state(u[:, :, 0], start, contacts)
        for _ in range(0 if self.smooth else self.settings.settling_periods):
            before = memory
            for i in range(1, n + 1):
                memory = law.step(Motion(u[:, :, i], v[:, :, i], self.h), memory, contacts)[1]
            if np.abs(memory - before).max() <= 1e-10 * np.abs(u).max():
                break
        return self._begin(self.stuck.on_orbit(point), memory)

    def _begin(self, z: np.ndarray, memory: np.ndarray) -> SampledState:
        """The state at the poles z with a memory (P, ns); the force is that of a step without
        length."""
        system, z = self.stuck.system, np.array(z, dtype=float)
        u0 = self.known[0, 0] + system.out @ z
        v0 = self.known[1, 0] + system.out @ self.stuck.rate(z, 0 * z)
        end = _StepEnd(u0, system.static, v0, 0 * system.static, self.settings.short * self.h)
        u, g, _, *slopes = self._solved(end, memory, 0 * u0)
        return SampledState(z, memory, u, g, self._rate(0, z, g, *slopes))

    def from_vector(self, v: np.ndarray) -> SampledState:
        """As in `Integrator`."""
        n, stuck = len(self.stuck.weight), self.stuck
        z, memory = v[:n] / stuck.weight, v[n:].reshape(stuck.shape[0], -1)
        u = (self.known[0, 0] + stuck.system.out @ z).reshape(stuck.shape)
        return self._begin(z, stuck.law.state_at(u, memory, stuck.contacts))

    def periods(self, state: SampledState, n: int = 1) -> IntegratedCycle:
        """As in `Integrator`."""
        samples = self.settings.samples
        for _ in range(n):
            u = np.empty((samples + 1, len(state.u)))
            g = np.empty((samples + 1, len(state.u)))
            u[0], g[0] = state.u, state.g
            most = min(self.settings.together, self.stuck.law.steps_together)
            i, together = 0, most
            while i < samples:
                together = min(together, samples - i)
                solved = self._steps(i + 1, together, state)
                if solved is None:
                    together //= 2
                    continue
                state, u[i + 1 : i + 1 + together], g[i + 1 : i + 1 + together] = solved
                i, together = i + together, min(2 * together, most)
            self.size = max(self.size, np.abs(u).max())
        force = (2 / samples) * g[1:].T @ self.waves
        force[:, 0] /= 2
        work = (0.5 * (g[1:] + g[:-1]) * np.diff(u, axis=0)).sum(axis=0)
        return IntegratedCycle(
            state, force, work.reshape(self.stuck.shape).sum(axis=1), True, n * samples, 0
        )

    def _steps(
        self, first: int, k: int, begin: SampledState
    ) -> tuple[SampledState, np.ndarray, np.ndarray] | None:
        """(state, u, g (k, P nd)) of the k steps that end at samples from `first` on; None where
        Newton's method does not find them."""
        if k == 1:
            state = self._step(first, begin)
            return state, state.u, state.g
        (P, nd), ns = self.stuck.shape, begin.memory.shape[1]
        memory = np.tile(begin.memory.ravel(), (k, 1))
        u, v, g = np.zeros((3, k, P * nd))
        path = Path(u, v, g, np.zeros_like(memory))
        start = (begin.z, begin.g, begin.rate, begin.memory.ravel())
        flat = [np.zeros((k, P, i, j)) for i in (nd, ns) for j in (nd, nd, ns)]
        lines = Lines(path.u, path.v, memory, np.tile(begin.g, (k, 1)), memory, *flat)
        for trial in range(self.settings.newton_together + 1):
            try:
                z, rate = follow_lines(
                    self.stuck.system, self.steps, self.known, first, lines, start, path
                )
            except np.linalg.LinAlgError:
                return None
            if not np.isfinite(z).all():
                return None
            before = np.vstack([memory[:1], path.memory[:-1]])
            if trial and self._close(lines, path, before):
                end = SampledState(z, path.memory[-1].reshape(P, ns), path.u[-1], path.g[-1], rate)
                return end, path.u, path.g
            lines = self._lines(path.u, path.v, before)
            if not all(np.isfinite(one).all() for one in lines):
                return None
        return None

    def _close(self, lines: Lines, path: Path, before: np.ndarray) -> bool:
        """Whether a path is that about which the lines are: motion, and memory before each step."""
        settings, shape = self.settings, (len(before), self.stuck.shape[0], self.stuck.law.states)
        moved = np.abs(path.u - lines.u).max()
        changed = np.abs(before - lines.memory).reshape(shape).max(axis=(0, 1))
        size = np.abs(before).reshape(shape).max(axis=(0, 1))
        return moved <= settings.newton_residual * max(np.abs(path.u).max(), self.size) and bool(
            np.all(changed <= settings.same_memory * size)
        )

    def _lines(self, u: np.ndarray, v: np.ndarray, memory: np.ndarray) -> Lines:
        """The law about the motion u, v (k, P nd) with the memory (k, P ns) before each step."""
        (P, nd), k = self.stuck.shape, len(u)
        if k not in self._laws:
            every = np.tile(np.arange(P), k)
            self._laws[k] = self.stuck.law.select(every), self.stuck.contacts.select(every)
        law, contacts = self._laws[k]
        motion = Motion(u.reshape(-1, nd), v.reshape(-1, nd), self.h)
        with np.errstate(over="ignore", invalid="ignore"):  # a trial may lie far away
            force, state, t = law.tangents(motion, memory.reshape(k * P, law.states), contacts)
        t = t.reshaped(k, P)
        g = np.reshape(force, (k, P, nd)) - self.constant - self.stiffness * u.reshape(k, P, nd)
        by = (
            t.force_u - self.stiffness[:, :, None] * np.eye(nd),
            t.force_v,
            t.force_state,
            t.state_u,
            t.state_v,
            t.state_state,
        )
        values = (u.copy(), v.copy(), memory, g.reshape(k, -1), np.reshape(state, (k, -1)), *by)
        return Lines(*(np.ascontiguousarray(one, dtype=float) for one in values))

    def _step(self, i: int, begin: SampledState) -> SampledState:
        """The step that ends at sample i."""
        system, W = self.stuck.system, self.W
        z = (
            events.times(W[0], begin.z)
            - events.times(W[1], system.into @ begin.g)
            - events.times(W[2], system.into @ begin.rate)
        )
        v0 = (
            self.known[1, i]
            + system.out @ events.times(system.s, z)
            + system.static @ (self.slope * begin.g + begin.rate)
        )
        end = _StepEnd(self.known[0, i] + system.out @ z, self.D, v0, self.Dv, self.h)
        u, g, memory, *slopes = self._solved(end, begin.memory, begin.g)
        z = z - events.times(W[3], system.into @ g)
        rate = self._rate(i, z, g, *slopes)
        if self.smooth:
            defect = rate - (2 / self.h * (g - begin.g) - begin.rate)
            z -= events.times(W[4], system.into @ defect)
        return SampledState(z, memory, u, g, rate)

    def _solved(self, end: _StepEnd, memory: np.ndarray, guess: np.ndarray) -> tuple:
        """(u, g, memory, dg/du, dg/dv) at the end of a step: Newton on the force g, halved where it
        does not help."""
        g = guess
        move = 0 * guess
        share = 1.0
        error = np.inf
        shape, law, stiffness = self.stuck.shape, self.stuck.law, self.stiffness.ravel()
        enough = self.settings.newton_residual * max(np.abs(end.u0).max(), self.size)
        for _ in range(self.settings.newton_steps):
            trial = g + share * move
            u, v = end.u0 - end.D @ trial, end.v0 - end.Dv @ trial
            motion = Motion(u.reshape(shape), v.reshape(shape), end.dt)
            force, new, t = law.tangents(motion, memory, self.stuck.contacts)
            of_law = (force - self.constant).ravel() - stiffness * u
            now = np.abs(end.D @ (of_law - trial)).max()
            if now > error and share > 1e-3:
                share *= 0.5
                continue
            g, error, share = trial, now, 1.0
            by_u = t.force_u - self.stiffness[:, :, None] * np.eye(shape[1])
            if error <= enough:
                break
            slope = np.eye(len(g)) + _product(by_u, end.D) + _product(t.force_v, end.Dv)
            move = np.linalg.solve(slope, of_law - g)
        return u, of_law, new, by_u, t.force_v

    def _rate(
        self, i: int, z: np.ndarray, g: np.ndarray, by_u: np.ndarray, by_v: np.ndarray
    ) -> np.ndarray:
        """g' (P nd,) at sample i; zero for a law with a state."""
        if not self.smooth:
            return 0 * g
        system = self.stuck.system
        z_rate = self.stuck.rate(z, system.into @ g)
        v = self.known[1, i] + system.out @ z_rate  # less static g'
        a = self.known[2, i] + system.out @ events.times(system.s, z_rate)
        matrix = np.eye(len(g)) + _product(by_u, system.static)
        return np.linalg.solve(matrix, _product(by_u, v) + _product(by_v, a))


def _weights(s: np.ndarray, h: float, smooth: bool) -> np.ndarray:
    """(5, n) as of `events.fill_weights`; the force is straight over a step where it is not
    smooth."""
    W = np.empty((5, len(s)), complex)
    events.fill_weights(s, h, W)
    if not smooth:
        W[1] -= W[2] / h
        W[3] += W[2] / h
        W[2] = W[4] = 0.0
    return W


def _product(blocks: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Blocks (P, nd, nd) along the diagonal times x (P nd, ...)."""
    P, nd = blocks.shape[:2]
    return (blocks @ x.reshape(P, nd, -1)).reshape(x.shape)
