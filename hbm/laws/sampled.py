"""Laws that advance from sample to sample, with tangents by the complex step: your own law goes here.

A law of your own is one class in your own file: derive from `SampledLaw`, name its `components`, and write `advance`.

    @dataclass(frozen=True)
    class Quintic(SampledLaw):
        name: str = "Quintic"
        components: tuple = ("n",)

        def advance(self, u, state, pairs):
            return pairs.kn[:, None] * u**5, state

`advance` must be analytic where it is smooth (write sqrt(a*a + b*b), not abs; compare real parts), because its
derivatives are taken by complex steps, exact to rounding. It is called with many rows at once, all samples of all
pairs: write it over rows, not over pairs.
"""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
from numba import njit

from hbm import fourier
from hbm.laws import Contacts, Tangents

STEP = 1e-30
MOST_PERIODS = 30
REPEATS = 1e-12          # of the largest motion: the period repeats
LOSS = 1e-4              # of |force| |motion|, from which on a law without sliders is said to slip
REGULAR = 1e-6           # of det(I - A): below, the map of a period is not inverted


@dataclass(frozen=True)
class SampledLaw:
    """A law known by its step over one sample; the harmonics are as good as the samples.

    components : of the relative motion, in the order of u; tangents : leading entries of the state that are sliders,
        from whose motion the shares of the cycle in stick and slip are told; 0 for none: then a pair that loses energy
        slips throughout
    states : length of the state of a pair
    """

    name: str = "SampledLaw"
    components: tuple = ("t1", "t2", "n")
    tangents: int = 0
    states: int = 0
    has_normal: bool = False
    corridor: bool = False
    kernel: ClassVar = None          # what numba has to compile, to be announced

    def stuck_stiffness(self, pairs: Contacts) -> np.ndarray:
        """(P, nd) constant stiffness that is taken over by the linear system."""
        return np.zeros((len(pairs), len(self.components)))

    def begin(self, u, sliders, from_position, pairs):
        """State (P, states) at t = 0, where the motion is u (P, nd)."""
        return np.zeros((len(pairs), self.states), dtype=u.dtype)

    def advance(self, u, state, pairs):
        """Force (P, nd) and state (P, states) after the motion has gone on to u (P, nd)."""
        raise NotImplementedError

    def step(self, u, state, pairs):
        """Force, state and tangents of one step; the complex steps of all columns go through `advance` together."""
        P, nd, ns = len(u), u.shape[1], self.states
        m = nd + ns
        moved = np.tile(np.concatenate([u, state], axis=1).astype(complex), (m, 1)).reshape(m, P, m)
        moved[np.arange(m), :, np.arange(m)] += 1j * STEP
        moved = moved.reshape(m * P, m)
        force, new = self.advance(moved[:, :nd], moved[:, nd:], _repeated(pairs, m))
        by_force = (np.imag(force) / STEP).reshape(m, P, nd).transpose(1, 2, 0)
        by_state = (np.imag(new) / STEP).reshape(m, P, ns).transpose(1, 2, 0)
        t = Tangents(by_force[:, :, :nd], by_force[:, :, nd:], by_state[:, :, :nd], by_state[:, :, nd:])
        return force[:P].real, new[:P].real, t

    def harmonics(self, pairs: Contacts, x, start, grid):
        """g, D, moves, shares (as in `aft.Bracket`, for all pairs) at the relative motion x (P, nd, nh)."""
        return march(self, pairs, x, start, grid)


@dataclass(frozen=True)
class CubicSpring(SampledLaw):
    """f = kn u^3 (kn in N/m^3), for verification. Exact with more than 4 H samples."""

    name: str = "CubicSpring"
    components: tuple = ("n",)

    def advance(self, u, state, pairs):
        return pairs.kn[:, None] * u**3, state


def projector(E) -> np.ndarray:
    """(n, nh) weights that take samples to harmonics; E (n, nh) is the basis at the samples."""
    weights = E * (2 / len(E))
    weights[:, 0] /= 2
    return weights


def _repeated(pairs, m):
    return SimpleNamespace(**{k: np.tile(getattr(pairs, k), m) for k in ("kn", "kt", "mu", "preload")})


def march(law, pairs, x, start, grid, leap=True):
    """Harmonics of any sampled law: the states sample by sample, then the tangents of all samples in one call.

    At least two periods, and until the state repeats. A state that creeps there is taken there by Newton on the map
    of the period (`leap`), unless that leads to a pair at rest, where it is not the only one that repeats.
    """
    P, nd, nh = x.shape
    E, ns = grid[1], law.states
    n, project = len(E), projector(E)
    u = np.ascontiguousarray((x @ E.T).transpose(2, 0, 1))                     # (n, P, nd)
    size = np.abs(u).max(initial=0.0) + 1e-300
    state, dstate = _begin(law, u[0], *start, pairs, E[0])
    order, every = np.r_[1:n, 0], _repeated(pairs, n)
    dforce, leapt, repeats = np.zeros((n, P, nd, nd, nh)), np.zeros(P, dtype=bool), np.ones(P, dtype=bool)
    for period in range(MOST_PERIODS if ns else 1):
        before, first = np.empty((n, P, ns)), state
        for i in order if ns else ():
            before[i] = state
            state = law.advance(u[i], state, pairs)[1]
        force, after, t = law.step(u.reshape(n * P, nd), before.reshape(n * P, ns), every)
        t = [a.reshape(n, P, *a.shape[1:]) for a in (t.force_u, t.force_slider, t.slider_u, t.slider_slider)]
        chain(order, E, *t, dstate, dforce)
        repeats = np.abs(state - first).max(axis=1, initial=0.0) <= REPEATS * size
        if period and repeats.all():
            break
        if period and leap:
            state, now = _leap(first, state, _map(order, t[3]), ~repeats)
            leapt |= now
    if leapt.any():
        A = _map(order, t[3])[leapt]
        if not repeats.all() or not _regular(A).all():
            return march(law, pairs, x, start, grid, leap=False)
        t, part = [np.ascontiguousarray(a[:, leapt]) for a in t], np.zeros((n, leapt.sum(), nd, nd, nh))
        fixed = np.zeros_like(dstate[leapt])
        chain(order, E, *t, fixed, part)
        fixed = np.linalg.solve(np.eye(ns) - A, fixed.reshape(len(A), ns, nd * nh)).reshape(fixed.shape)
        chain(order, E, *t, fixed, part)
        dforce[:, leapt] = part
    force, moved = force.reshape(n, P, nd), np.abs(after.reshape(n, P, ns) - before)[:, :, :law.tangents]
    opens = force[:, :, -1] <= 0 if law.has_normal else np.zeros((n, P), dtype=bool)
    slips = ~opens & (moved.max(axis=2, initial=0.0) > 1e-12 * size)
    g = np.tensordot(force, project, (0, 0))
    D = (project.T @ dforce.reshape(n, -1)).reshape(nh, P, nd, nd, nh).transpose(1, 2, 0, 3, 4)
    if ns and not law.tangents:
        slips = ~opens & _loses(g, x)
    shares = np.stack([~slips & ~opens, slips, opens], axis=2).sum(axis=0) / n
    return *_bracket(law, pairs, x, g, np.ascontiguousarray(D), np.abs(dforce).max(axis=(0, 3, 4)),
                     np.abs(force).max(axis=0)), shares


def _loses(g, x):
    """(P,) bool: pairs that take energy out of the motion, beyond what sampling makes up."""
    size = np.linalg.norm(g[:, :, 1:], axis=(1, 2)) * np.linalg.norm(x[:, :, 1:], axis=(1, 2))
    return fourier.work(g, x) > LOSS * size


def _map(order, state_state):
    """(P, ns, ns) derivative of the state after a period by the state before it."""
    A = np.eye(state_state.shape[2])
    for i in order:
        A = state_state[i] @ A
    return A


def _regular(A):
    return np.abs(np.linalg.det(np.eye(A.shape[1]) - A)) > REGULAR


def _leap(first, state, A, wanted):
    """(states, mask of those moved): Newton's step to the state that repeats, where the map allows it."""
    now = wanted & _regular(A)
    new = state.copy()
    e = (state - first)[now, :, None]
    new[now] = first[now] + np.linalg.solve(np.eye(A.shape[1]) - A[now], e)[:, :, 0]
    return new, now


def _begin(law, u, sliders, from_position, pairs, e):
    """State at t = 0 and its derivative (P, ns, nd, nh) by the harmonics of the motion."""
    state = law.begin(u, sliders, from_position, pairs)
    dstate = np.zeros((*state.shape, u.shape[1], len(e)))
    for k in range(u.shape[1] if law.states else 0):
        moved = u.astype(complex)
        moved[:, k] += 1j * STEP
        dstate[:, :, k] = (np.imag(law.begin(moved, sliders, from_position, pairs)) / STEP)[:, :, None] * e
    return state, dstate


@njit(cache=True)
def chain(order, E, force_u, force_state, state_u, state_state, dstate, dforce):
    """Carry dstate (P, ns, nd, nh) through a period, and fill dforce (n, P, nd, nd, nh), by the chain rule."""
    n, P, nd, ns = force_state.shape
    nh = E.shape[1]
    new = np.empty((ns, nd, nh))
    for i in order:
        for p in range(P):
            old = dstate[p]
            for r in range(nd):
                for k in range(nd):
                    for m in range(nh):
                        value = force_u[i, p, r, k] * E[i, m]
                        for s in range(ns):
                            value += force_state[i, p, r, s] * old[s, k, m]
                        dforce[i, p, r, k, m] = value
            for r in range(ns):
                for k in range(nd):
                    for m in range(nh):
                        value = state_u[i, p, r, k] * E[i, m]
                        for s in range(ns):
                            value += state_state[i, p, r, s] * old[s, k, m]
                        new[r, k, m] = value
            dstate[p] = new


def _bracket(law, pairs, x, g, D, slope, top):
    """g, D and moves once the stuck springs and the preload are taken off; what is only rounding is zero."""
    nd, nh = x.shape[1:]
    stiffness = law.stuck_stiffness(pairs)
    g = g - stiffness[:, :, None] * x
    if law.has_normal:
        g[:, -1, 0] -= pairs.preload
    for d in range(nd):
        D[:, d, np.arange(nh), d, np.arange(nh)] -= stiffness[:, d, None]
    moves = np.abs(D).max(axis=(2, 3, 4)) > 1e-12 * np.maximum(slope, 1e-300)
    noise = 1e-13 * (top + stiffness * np.abs(x).sum(axis=2) + np.abs(pairs.preload)[:, None])
    g[(np.abs(g).max(axis=2) <= noise) & ~moves] = 0.0
    return g, D, moves
