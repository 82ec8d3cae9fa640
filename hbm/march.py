"""Time integration with the same contact laws: the second opinion on a periodic solution.

The motion is split into the steady response of the stuck system, known in closed form, and what the bracket
g = f - K_c u adds to it through the poles s of the stuck system,

    y' = s y - b' g,        u(t) = u_stuck(t) + Re(A y).

The poles are propagated exactly and g is linear within a step (exponential trapezoidal rule), so the stuck motion is
exact, stiff modes do no harm, and since g is continuous the error falls as the square of the step through stick, slip,
lift-off and contact alike. The implicit force of a step is found by iteration. Contact nodes with little mass chatter
on re-contact: their poles need damping (the ratio of the stuck modes does that) or steps that follow them.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from hbm import fourier
from hbm.linear import Receptance
from hbm.residual import HarmonicBalance

STEPS = 2048             # per period
REPEATS = 1e-8           # relative change of the state over one period that counts as periodic


@dataclass(frozen=True)
class Poles:
    """q = Re(out y), y' = s y + into' f: s (n,), out and into (r, n) complex."""

    s: np.ndarray
    out: np.ndarray
    into: np.ndarray


@dataclass(frozen=True)
class Steady:
    """Steady state by time integration.

    harmonics : (m, H+1) complex of the outputs; period_change : relative change of the state over the last period
    periodic : whether that is below the tolerance; periods : how many were marched; work : (P,) J per cycle by friction
    """

    harmonics: np.ndarray
    period_change: float
    periodic: bool
    periods: int
    work: np.ndarray


def poles(receptance: Receptance) -> Poles:
    """First-order form of a receptance. Massless modes follow statically: they get a very fast pole."""
    if receptance.poles is not None:
        return Poles(receptance.poles, receptance.shapes, receptance.shapes)
    mass = np.maximum(receptance.mass, 1e-14 * receptance.mass.max())
    w = np.sqrt(receptance.stiffness / mass)
    damped = w * np.sqrt(1 - receptance.ratio**2)
    s = -receptance.ratio * w + 1j * damped
    return Poles(s, receptance.shapes / (1j * mass * damped), receptance.shapes.astype(complex))


@njit(cache=True)
def corridor_bracket(u, slider, new, g, tangents, has_normal, kt, kn, mu, preload):
    """Bracket of one step of a corridor law: g (P, nd) and the sliders after it. The plain form is `laws.step`."""
    P, nd = u.shape
    for p in range(P):
        N = preload[p] + (kn[p] * u[p, nd - 1] if has_normal else 0.0)
        if has_normal:
            g[p, nd - 1] = max(0.0, -N)
        reach = mu[p] * max(N, 0.0)
        for d in range(tangents):
            half = reach / kt[p] if kt[p] > 0 else 0.0
            w = min(max(slider[p, d], u[p, d] - half), u[p, d] + half)
            new[p, d] = w
            g[p, d] = -kt[p] * w


@njit(cache=True)
def run(y, slider, g, E, now, then, out, into, direct, u_stuck, periods, tangents, has_normal, kt, kn, mu, preload,
        history, sliders):
    """March whole periods; y (n,) complex, slider and g are left at the end, the last period in history (steps, P, nd).

    E, now, then : (n,) propagator and weights of g at begin and end of a step; direct (nc, nc) = Re(out then into').
    u_stuck : (steps + 1, nc). Returns the largest number of iterations of a step.
    """
    steps = len(u_stuck) - 1
    P, nd = g.shape
    nc = P * nd
    new, trial, u = slider.copy(), g.copy(), np.empty((P, nd))
    worst = 0
    for period in range(periods):
        for i in range(steps):
            for j in range(len(y)):
                push = 0j
                for c in range(nc):
                    push += into[c, j] * g[c // nd, c % nd]
                y[j] = E[j] * y[j] - now[j] * push
            known = u_stuck[i + 1].copy()
            for c in range(nc):
                value = 0.0
                for j in range(len(y)):
                    value += (out[c, j] * y[j]).real
                known[c] += value
            trial[:] = g
            for k in range(200):
                worst = max(worst, k)
                largest, change = 0.0, 0.0
                for c in range(nc):
                    value = known[c]
                    for d in range(nc):
                        value -= direct[c, d] * trial[d // nd, d % nd]
                    u[c // nd, c % nd] = value
                corridor_bracket(u, slider, new, g, tangents, has_normal, kt, kn, mu, preload)
                for p in range(P):
                    for d in range(nd):
                        change = max(change, abs(g[p, d] - trial[p, d]))
                        largest = max(largest, abs(g[p, d]))
                        trial[p, d] = g[p, d]
                if change <= 1e-14 * largest:
                    break
            slider[:] = new
            for j in range(len(y)):
                push = 0j
                for c in range(nc):
                    push += into[c, j] * g[c // nd, c % nd]
                y[j] -= then[j] * push
            if period == periods - 1:
                history[i] = u
                sliders[i] = slider
    return worst


class March:
    """Time integration of the problem of a HarmonicBalance at angular frequency w, `steps` per period."""

    def __init__(self, balance: HarmonicBalance, w: float, steps: int = STEPS):
        self.balance, self.w, self.steps = balance, w, steps
        problem, P = balance.problem, poles(balance.receptance)
        B = problem.B
        self.s, self.out, self.into = P.s, np.ascontiguousarray(B @ P.out), np.ascontiguousarray(B @ P.into)
        self.recover = P.out
        h = 2 * np.pi / (w * steps)
        x = P.s * h
        self.E = np.exp(x)
        with np.errstate(divide="ignore", invalid="ignore"):
            one = np.where(np.abs(x) < 1e-4, 1 + x / 2 + x * x / 6, np.expm1(x) / x)
            two = np.where(np.abs(x) < 1e-4, 0.5 + x / 6 + x * x / 24, (one - 1) / x)
        self.now, self.then = h * (one - two), h * two
        self.direct = (self.out * self.then @ self.into.T).real.copy()
        stuck = fourier.to_real(balance.shapes @ (balance.receptance.factors(w * np.arange(balance.H + 1))[0]
                                                  * balance.force_at(1.0)))
        tau = np.arange(steps + 1) * (2 * np.pi / steps)
        self.tau, self.u_stuck = tau, np.ascontiguousarray((stuck @ fourier.basis(tau, balance.H).T).T)
        self.history = np.empty((steps, len(problem.pairs), balance.nd))
        self.sliders = np.empty((steps, len(problem.pairs), problem.law.tangents))

    def at_rest(self):
        """State (y, slider, g) of the steady stuck motion with the sliders where the start of the balance puts them."""
        pairs, tangents = self.balance.problem.pairs, self.balance.problem.law.tangents
        w, from_position = self.balance.start
        u = self.u_stuck[0].reshape(len(pairs), -1)
        slider = u[:, :tangents].copy() if from_position else w[:, :tangents].copy()
        return self._with_bracket(np.zeros(len(self.s), complex), slider, u)

    def on_orbit(self, point):
        """State of a solution of the harmonic balance at t = 0: displacement, velocity and sliders."""
        b, problem = self.balance, self.balance.problem
        g = fourier.to_complex(point.detail.bracket.g.reshape(-1, b.nh))
        push = self.into.T @ g
        back = self.into.T @ g.conj()
        k = 1j * self.w * np.arange(b.H + 1)
        y = -0.5 * np.sum(push / (k - self.s[:, None]) + back / (-k - self.s[:, None]), axis=1)
        u = point.x.reshape(len(problem.pairs), b.nd, b.nh) @ fourier.basis(self.tau, b.H).T
        w, from_position = b.start
        slider = u[:, :problem.law.tangents, 0].copy() if from_position else w[:, :problem.law.tangents].copy()
        new, g0 = slider.copy(), np.zeros(u.shape[:2])
        for i in range(self.steps + 1):
            corridor_bracket(np.ascontiguousarray(u[:, :, i]), slider, new, g0, *self._law())
            slider = new.copy()
        return y, slider, g0

    def _with_bracket(self, y, slider, u):
        new, g = slider.copy(), np.zeros(u.shape)
        corridor_bracket(np.ascontiguousarray(u), slider, new, g, *self._law())
        return y, new, g

    def _law(self):
        p = self.balance.problem
        return (p.law.tangents, p.law.has_normal, p.pairs.kt, p.pairs.kn, p.pairs.mu, p.pairs.preload)

    def periods(self, state, n=1):
        """State after n periods; the last one is left in `history` and `sliders`."""
        y, slider, g = (np.array(a) for a in state)
        run(y, slider, g, self.E, self.now, self.then, self.out, self.into, self.direct, self.u_stuck, n, *self._law(),
            self.history, self.sliders)
        return y, slider, g

    def harmonics_of_motion(self) -> np.ndarray:
        """x (P nd nh,) of the last period marched: a guess for the balance."""
        H = self.balance.H
        U = np.fft.rfft(self.history.reshape(self.steps, -1), axis=0)[:H + 1].T * (2 / self.steps)
        U[:, 0] /= 2
        return fourier.to_real(U * np.exp(-1j * np.arange(H + 1) * self.tau[1])).ravel()

    def steady(self, state, rows, H=None, tolerance=REPEATS, most_periods=2000) -> Steady:
        """Marching until the period map repeats; rows (m, r) are the outputs, in harmonics 0..H."""
        state, change, n = self._until_it_repeats(state, tolerance, most_periods)
        return self._result(state, rows, H or self.balance.H, change, change <= tolerance, n)

    def shoot(self, state, rows, H=None, tolerance=REPEATS, most_steps=30) -> Steady:
        """Newton on the period map of motion and sliders, by differences. For small systems: a period per unknown."""
        used, v = 0, _flat(state)
        for _ in range(most_steps):
            base = self._map(v)
            used += 1
            change = self._change(self._state(v), self._state(base))
            if change <= tolerance:
                break
            J = np.empty((len(v), len(v)))
            for c in range(len(v)):
                moved = v.copy()
                moved[c] += 1e-7 * self._size(v)[c]
                J[:, c] = (self._map(moved) - base) / (1e-7 * self._size(v)[c])
            used += len(v)
            step = np.linalg.lstsq(np.eye(len(v)) - J, base - v, rcond=1e-10)[0]
            v = self._better(v, step, base)
        state, change, n = self._until_it_repeats(self._state(v), tolerance, 20)
        return self._result(state, rows, H or self.balance.H, change, change <= tolerance, used + n)

    def _better(self, v, step, base):
        """Newton's step, shortened until the map moves the state less; the plain map where none does."""
        size = self._size(v)
        error = np.linalg.norm((base - v) / size)
        for share in (1.0, 0.5, 0.2, 0.05):
            new = v + share * step
            if np.linalg.norm((self._map(new) - new) / size) < error:
                return new
        return base

    def _map(self, v):
        return _flat(self.periods(self._state(v), 1))

    def _state(self, v):
        n, P = len(self.s), len(self.balance.problem.pairs)
        y, slider = v[:n] + 1j * v[n:2 * n], v[2 * n:].reshape(P, -1)
        return self._with_bracket(y, slider, (self.u_stuck[0] + self.recover_pairs(y)).reshape(P, -1))

    def _size(self, v):
        n = len(self.s)
        return np.r_[np.full(2 * n, np.abs(v[:2 * n]).max() + 1e-300),
                     np.full(len(v) - 2 * n, np.abs(self.u_stuck).max() + 1e-300)]

    def _until_it_repeats(self, state, tolerance, most_periods):
        n, change = 0, np.inf
        while n < most_periods:
            n += 1
            after = self.periods(state, 1)
            change = self._change(state, after)
            state = after
            if change <= tolerance:
                break
        return state, change, n

    def _change(self, before, after):
        """Relative change of motion and sliders over a period."""
        moved = self.recover_pairs(after[0] - before[0])
        size = np.abs(self.history - self.history.mean(axis=0)).max() + 1e-300
        slid = np.abs(after[1] - before[1]).max(initial=0.0)
        return float(max(np.abs(moved).max(initial=0.0), slid) / size)

    def recover_pairs(self, y):
        return (self.out @ y).real

    def _result(self, state, rows, H, change, periodic, n):
        """Harmonics of the outputs over one more period: those of the bracket go through the receptance."""
        b = self.balance
        problem = b.problem
        self.periods(state, 1)
        u, tangents = self.history, problem.law.tangents
        g = np.empty_like(u)
        p = problem.pairs
        g[:, :, :tangents] = -p.kt[:, None] * self.sliders
        if problem.law.has_normal:
            g[:, :, -1] = np.maximum(0.0, -(p.preload + p.kn * u[:, :, -1]))
        G = np.fft.rfft(g.reshape(self.steps, -1), axis=0)[:H + 1].T * (2 / self.steps)
        G[:, 0] /= 2
        G *= np.exp(-1j * np.arange(H + 1) * self.tau[1])       # history begins one step after t = 0
        modal = np.zeros((b.shapes.shape[1], H + 1), complex)
        modal[:, :min(H, b.H) + 1] = b.force_at(1.0)[:, :min(H, b.H) + 1]
        modal = (modal - b.shapes.T @ G) * b.receptance.factors(self.w * np.arange(H + 1))[0]
        ends = np.concatenate([u[-1:], u])[:, :, :tangents]
        T = np.concatenate([g[-1:], g])[:, :, :tangents] + p.kt[:, None] * ends
        work = np.sum(0.5 * (T[1:] + T[:-1]) * np.diff(ends, axis=0), axis=(0, 2))
        return Steady(np.asarray(rows) @ (b.receptance.shapes @ modal), change, periodic, n, work)


def compare(balance: HarmonicBalance, point, rows, steps: int = STEPS, most_periods: int = 2000):
    """(Steady, relative difference of harmonic 1) of a point of a curve and the integration started on its orbit.

    The difference is of the largest output, relative to it.
    """
    march = March(balance, point.parameter, steps)
    steady = march.steady(march.on_orbit(point), rows, most_periods=most_periods)
    X = np.asarray(rows) @ (balance.receptance.shapes @ point.detail.modal)
    largest = np.abs(X[:, 1]).max()
    return steady, float(np.abs(np.abs(steady.harmonics[:, 1]) - np.abs(X[:, 1])).max() / largest)


def _flat(state):
    return np.r_[state[0].real, state[0].imag, state[1].ravel()]
