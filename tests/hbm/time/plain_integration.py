"""Plain time integration of the planar oscillator, to check `tipdamp.hbm.time` by: it shares no
code with `hbm`.

The state x = (q, q', two sliders, 1, cos w t, sin w t) obeys x' = A x with a constant A as long as
no contact changes its state, and is propagated by exp(A h). A step in which a guard is violated is
halved until the event is located to 2^-45 of a sample. Sliders are part of the state and follow by
their own equation, w' = u_t' -+ mu N'/kt.
"""

import numpy as np
from scipy.linalg import expm

STICK, FORWARD, BACKWARD, OPEN = range(4)
FINEST, MOST_EVENTS, SAMPLES = 45, 400, 1024
DIFFERENCE = 1e-8  # of the derivative of the map, relative to the motion
SMALL = 1e-11  # of the forces: rounding at a switch
# of I - J: below, a slider that rests anywhere, seen through the rounding of differences;
# one that creeps to its rest has 3e-4
RANK = 1e-5


class PlainIntegration:
    """Of a problem of `tests.hbm.oscillator` under Re(force exp(i w t)); unknowns v (2r + 2,) are
    q, q'/w, sliders."""

    def __init__(self, problem, force, w):
        c, self.r, self.w = problem.contacts, len(problem.K), w
        self.kn, self.kt, self.mu = (np.asarray(a) for a in (c.kn, c.kt, c.mu))
        self.tangent, self.normal = problem.B[[0, 3]], problem.B[[2, 5]]
        self.forces = np.column_stack(
            [-problem.K, -problem.C, np.zeros((self.r, 2)), problem.static, force.real, -force.imag]
        )
        self.M, self.load, self.steps = problem.M, np.abs(problem.static).max(), {}

    def step_matrices(self, states):
        """exp(A h) for h = a sample / 2^k, k = 0..FINEST."""
        if states not in self.steps:
            r, f = self.r, self.forces.copy()
            A = np.zeros((f.shape[1],) * 2)
            A[:r, r : 2 * r] = np.eye(r)
            for p, state in enumerate(states):
                t, n = self.tangent[p], self.normal[p]
                sign = {FORWARD: 1, BACKWARD: -1}.get(state, 0)
                if state != STICK:
                    A[2 * r + p, r : 2 * r] = t - sign * self.mu[p] * self.kn[p] / self.kt[p] * n
                if state == OPEN:
                    continue
                f[:, :r] -= self.kn[p] * np.outer(n + sign * self.mu[p] * t, n)
                if state == STICK:
                    f[:, :r] -= self.kt[p] * np.outer(t, t)
                    f[:, 2 * r + p] += self.kt[p] * t
            A[r : 2 * r] = np.linalg.solve(self.M, f)
            A[-2, -1], A[-1, -2] = -self.w, self.w
            self.steps[states] = [
                expm(A * 2 * np.pi / (self.w * SAMPLES * 2**k)) for k in range(FINEST + 1)
            ]
        return self.steps[states]

    def contact(self, x, p):
        """N, mu N, T of a contact, and the rates of mu N and of T while it sticks."""
        r, N = self.r, self.kn[p] * (self.normal[p] @ x[: self.r])
        rates = (
            self.mu[p] * self.kn[p] * (self.normal[p] @ x[r : 2 * r]),
            self.kt[p] * (self.tangent[p] @ x[r : 2 * r]),
        )
        return N, self.mu[p] * N, self.kt[p] * (self.tangent[p] @ x[:r] - x[2 * r + p]), *rates

    def following(self, x, state, p):
        """The state that a contact must take; its own where nothing is violated."""
        N, limit, T, limit_rate, rate = self.contact(x, p)
        if N < -SMALL * self.load if state != OPEN else N <= 0:
            return OPEN
        if state in (FORWARD, BACKWARD):
            sign = 1 if state == FORWARD else -1
            return state if sign * rate >= limit_rate else STICK
        reached = 0.0 if state == OPEN else limit + SMALL * max(limit, self.load)
        for sign, slip in ((1, FORWARD), (-1, BACKWARD)):
            if (state == OPEN or sign * T > reached) and sign * rate > limit_rate:
                return slip
        return STICK

    def period(self, v):
        """(unknowns after a period, samples (SAMPLES, r) of q, events)."""
        r, k = self.r, np.r_[np.ones(self.r), np.full(self.r, self.w), 1, 1]
        x = np.r_[v * k, 1.0, 1.0, 0.0]
        states, q, events = self._settled(x), np.empty((SAMPLES, r)), 0
        for i in range(SAMPLES):
            q[i], left = x[:r], 2**FINEST
            while left:
                level, coming = FINEST + 1 - left.bit_length(), states
                while True:
                    end = self.step_matrices(states)[level] @ x
                    after = tuple(self.following(end, s, p) for p, s in enumerate(states))
                    if after == states:
                        x, left = end, left - 2 ** (FINEST - level)
                    else:
                        coming = after
                    if coming == states or level == FINEST:
                        break
                    level += 1  # halved until the event, from the left
                if coming != states:
                    states, events = coming, events + 1
                    self._enter(x, states)
                    assert events < MOST_EVENTS, "the contact chatters"
        return x[:-3] / k, q, events

    def _settled(self, x):
        """States at the begin of a period; sliders outside their play interval are moved to its
        end."""
        states = []
        for p in range(2):
            N, limit, T, limit_rate, rate = self.contact(x, p)
            sign = 1 if T > 0 else -1
            slips = abs(T) >= limit * (1 - 100 * SMALL) and (
                sign * rate > limit_rate or abs(T) > limit * (1 + 1e-6)
            )
            states.append(
                OPEN if N <= 0 else (FORWARD if sign > 0 else BACKWARD) if slips else STICK
            )
        self._enter(x, states)
        return tuple(states)

    def _enter(self, x, states):
        """Sliders where a contact that slips or is open has them."""
        for p, state in enumerate(states):
            sign = {FORWARD: 1, BACKWARD: -1}.get(state, 0)
            if state != STICK:
                limit = sign * self.contact(x, p)[1] / self.kt[p]
                x[2 * self.r + p] = self.tangent[p] @ x[: self.r] - limit

    def derivative(self, v):
        """(2r+2, 2r+2) derivative of the period map by central differences."""
        h = DIFFERENCE * np.abs(v[: self.r]).max()
        return np.array(
            [
                (self.period(v + h * e)[0] - self.period(v - h * e)[0]) / (2 * h)
                for e in np.eye(len(v))
            ]
        ).T

    def orbit(self, v, closeness=1e-9, most=6):
        """(amplitude (r,) of harmonic 1, largest multiplier, change over a period) of the orbit
        beside v, by Newton.

        A multiplier of exactly 1 belongs to a slider that sticks all through and is left out.
        """
        for _ in range(most):
            after, q, _ = self.period(v)
            J = self.derivative(v)
            change = np.abs(after - v).max() / np.abs(v[: self.r]).max()
            if change <= closeness:
                break
            v = v + self._step(np.eye(len(v)) - J, after - v)
        multipliers = np.linalg.eigvals(J)
        waves = np.exp(-2j * np.pi * np.arange(SAMPLES) / SAMPLES)
        return (
            np.abs(2 / SAMPLES * waves @ q),
            np.abs(multipliers[np.abs(multipliers - 1) > 1e-6]).max(),
            change,
        )

    def _step(self, system, change):
        """Newton's, and where a slider rests anywhere what the period itself moves it by."""
        left, size, right = np.linalg.svd(system)
        neutral = size <= RANK * size[0]
        inverse = np.where(neutral, 0.0, 1 / np.where(neutral, 1.0, size))
        return right.T @ (inverse * (left.T @ change)) + right[neutral].T @ (
            right[neutral] @ change
        )
