"""Laws that advance from sample to sample, with tangents by the complex step: your own law goes here.

A law of your own is one class in your own file: derive from `SampledLaw`, name its `components`, and write `advance`.

    @dataclass(frozen=True)
    class Quintic(SampledLaw):
        name: str = "Quintic"
        components: tuple = ("n",)

        def advance(self, u, state, pairs):
            return pairs.kn[:, None] * u**5, state

`advance` must be analytic where it is smooth (write sqrt(a*a + b*b), not abs; compare real parts), because its
derivatives are taken by complex steps, exact to rounding.
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from numba import njit

from hbm.laws import PairSettings, Tangents

STEP = 1e-30
MOST_PERIODS = 30


@dataclass(frozen=True)
class SampledLaw:
    """A law known by its step over one sample; the harmonics are as good as the samples.

    components : of the relative motion, in the order of u; tangents : leading entries of the state that are sliders
    states : length of the state of a pair
    """

    name: str = "SampledLaw"
    components: tuple = ("t1", "t2", "n")
    tangents: int = 0
    states: int = 0
    has_normal: bool = False
    corridor: bool = False

    def stuck_stiffness(self, pairs: PairSettings) -> np.ndarray:
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
        many = SimpleNamespace(**{k: np.tile(getattr(pairs, k), m) for k in ("kn", "kt", "mu", "preload")})
        force, new = self.advance(moved[:, :nd], moved[:, nd:], many)
        by_force = (np.imag(force) / STEP).reshape(m, P, nd).transpose(1, 2, 0)
        by_state = (np.imag(new) / STEP).reshape(m, P, ns).transpose(1, 2, 0)
        t = Tangents(by_force[:, :, :nd], by_force[:, :, nd:], by_state[:, :, :nd], by_state[:, :, nd:])
        return force[:P].real, new[:P].real, t


@dataclass(frozen=True)
class CubicSpring(SampledLaw):
    """f = kn u^3 (kn in N/m^3), for verification. Exact with more than 4 H samples."""

    name: str = "CubicSpring"
    components: tuple = ("n",)

    def advance(self, u, state, pairs):
        return pairs.kn[:, None] * u**3, state


@dataclass(frozen=True)
class IsotropicFriction(SampledLaw):
    """Coulomb friction coupled in the tangential plane, |T| <= mu N, under N = max(0, preload + kn u_n).

    Over a sample the motion and the normal load are taken as straight; on that path everything is in closed form. A
    resting slider slips where the quadratic |T0 + kt du s| = mu (N0 + dN s) has its root. In slip the angle psi from
    the velocity to the force obeys L psi' = -kt |du| sin psi with L = mu N, so that

        tan(psi1/2) = tan(psi0/2) exp(-kt |du| / L_m),      L_m the logarithmic mean of L,

    and slip goes on to the end of the sample. Hence second order in the samples [radial return is first order].
    The state is the slider (2), and the motion before (3).
    """

    name: str = "IsotropicFriction"
    components: tuple = ("t1", "t2", "n")
    tangents: int = 2
    states: int = 5
    has_normal: bool = True

    def stuck_stiffness(self, pairs):
        return np.stack([pairs.kt, pairs.kt, pairs.kn], axis=1)

    def begin(self, u, sliders, from_position, pairs):
        state = np.concatenate([u[:, :2] if from_position else sliders + 0 * u[:, :2], u], axis=1)
        N = np.where((pairs.preload + pairs.kn * u[:, 2]).real > 0, pairs.preload + pairs.kn * u[:, 2], 0)
        T = pairs.kt[:, None] * (u[:, :2] - state[:, :2])
        size, limit = _length(T), pairs.mu * N
        over = size.real > limit.real
        back = np.where(over, limit / np.where(over, size, 1), 1)
        state[:, :2] = u[:, :2] - back[:, None] * (u[:, :2] - state[:, :2])
        return state

    def advance(self, u, state, pairs):
        force, new = np.empty(u.shape, dtype=u.dtype), np.empty(state.shape, dtype=u.dtype)
        _isotropic(np.ascontiguousarray(u), np.ascontiguousarray(state), pairs.kt, pairs.kn, pairs.mu, pairs.preload,
                   force, new)
        return force, new


@njit(cache=True)
def _isotropic(u, state, kt, kn, mu, preload, force, new):
    """One step of every pair, real or complex (complex for the derivatives)."""
    for p in range(len(u)):
        N0, N1 = preload[p] + kn[p] * state[p, 4], preload[p] + kn[p] * u[p, 2]
        was, now = N0.real > 0, N1.real > 0
        T1, T2 = 0 * N1, 0 * N1
        if now and kt[p] > 0:
            begin = 0 * N0 if was else N0 / (N0 - N1)              # contact inside the sample
            d1 = kt[p] * (u[p, 0] - state[p, 2]) * (1 - begin)
            d2 = kt[p] * (u[p, 1] - state[p, 3]) * (1 - begin)
            if was:
                T1, T2 = kt[p] * (state[p, 2] - state[p, 0]), kt[p] * (state[p, 3] - state[p, 1])
            L0 = mu[p] * N0 if was else 0 * N0
            T1, T2 = _slide(T1, T2, d1, d2, L0, mu[p] * N1)
        force[p, 0], force[p, 1], force[p, 2] = T1, T2, N1 if now else 0 * N1
        stiff = kt[p] if kt[p] > 0 else 1.0
        new[p, 0], new[p, 1] = u[p, 0] - T1 / stiff, u[p, 1] - T2 / stiff
        new[p, 2], new[p, 3], new[p, 4] = u[p, 0], u[p, 1], u[p, 2]


@njit(cache=True)
def _slide(T1, T2, d1, d2, L0, L1):
    """Force at the end of a straight elastic path d under a limit from L0 to L1: rest up to the limit, then slip."""
    e1, e2 = T1 + d1, T2 + d2
    if (e1 * e1 + e2 * e2 - L1 * L1).real <= 0:
        return e1, e2
    dL = L1 - L0
    a, b = d1 * d1 + d2 * d2 - dL * dL, T1 * d1 + T2 * d2 - L0 * dL
    c = T1 * T1 + T2 * T2 - L0 * L0
    s = 0 * a
    at_limit = c.real >= -1e-12 * (L0 * L0).real
    if not (at_limit and b.real >= 0):
        if at_limit:
            s = -2 * b / a                      # leaves the limit and comes back to it
        else:
            root = np.sqrt(b * b - a * c)
            s = -c / (b + root) if b.real >= 0 else (root - b) / a
        if not 0 <= s.real <= 1:
            s = 0 * a
    m1, m2 = (1 - s) * d1, (1 - s) * d2
    square = m1 * m1 + m2 * m2
    L = L0 + s * dL
    if square.real <= 0:
        scale = L1 / np.sqrt(e1 * e1 + e2 * e2)
        return scale * e1, scale * e2
    size = np.sqrt(square)
    m1, m2 = m1 / size, m2 / size
    if L.real <= 0 or L1.real <= 0:              # from no load the force lies along the motion
        return L1 * m1, L1 * m2
    n1, n2 = (T1 + s * d1) / L, (T2 + s * d2) / L
    decay = np.exp(-size / _log_mean(L, L1))
    x, y = n1 * m1 + n2 * m2, n2 * m1 - n1 * m2
    below = (1 + x) + decay * decay * (1 - x)
    if below.real <= 0:
        return -L1 * m1, -L1 * m2                # straight against the motion
    cosine, sine = ((1 + x) - decay * decay * (1 - x)) / below, 2 * decay * y / below
    return L1 * (cosine * m1 - sine * m2), L1 * (cosine * m2 + sine * m1)


@njit(cache=True)
def _log_mean(a, b):
    """(b - a)/log(b/a), by its series where they are close."""
    z = (b - a) / (b + a)
    if abs(z) < 1e-3:
        return 0.5 * (a + b) / (1 + z * z / 3 + z * z * z * z / 5)
    return (b - a) / np.log(b / a)


def _length(a):
    square = a[:, 0] ** 2 + a[:, 1] ** 2
    return np.where(square.real > 0, np.sqrt(np.where(square.real > 0, square, 1)), 0)


def harmonics(law, pairs: PairSettings, x, start, grid):
    """g, D, gp, moves, shares as `located.brackets` fills them, by marching over the samples.

    At least two periods, and until the state repeats: a slider in the plane creeps towards its orbit.
    """
    P, nd, nh = x.shape
    tau, E, _ = grid
    n = len(E)
    u = x @ E.T
    sliders, from_position = start
    state = law.begin(u[:, :, 0], sliders, from_position, pairs)
    dstate = np.zeros((P, law.states, nd, nh))
    for k in range(nd if law.states else 0):
        moved = u[:, :, 0].astype(complex)
        moved[:, k] += 1j * STEP
        by = np.imag(law.begin(moved, sliders, from_position, pairs)) / STEP
        dstate[:, :, k, :] = by[:, :, None] * E[0]
    force, dforce = np.empty((P, nd, n)), np.empty((n, P, nd, nd, nh))
    size = np.abs(u).max() + 1e-300
    for period in range(MOST_PERIODS):
        slips, opens, begin = np.zeros(P), np.zeros(P), state
        for i in list(range(1, n)) + [0]:
            f, new, t = law.step(u[:, :, i], state, pairs)
            dforce[i] = t.force_u[:, :, :, None] * E[i]
            if law.states:
                dforce[i] += np.matmul(t.force_slider, dstate.reshape(P, law.states, -1)).reshape(P, nd, nd, nh)
                dstate = np.matmul(t.slider_slider, dstate.reshape(P, law.states, -1)).reshape(dstate.shape)
                dstate += t.slider_u[:, :, :, None] * E[i]
            force[:, :, i] = f
            is_open = f[:, -1] <= 0 if law.has_normal else np.zeros(P, bool)
            moved = np.abs(new[:, :law.tangents] - state[:, :law.tangents]).max(axis=1, initial=0.0)
            opens += is_open
            slips += ~is_open & (moved > 1e-12 * size)
            state = new
        if period and np.abs(state - begin).max(initial=0.0) <= 1e-12 * size:
            break
    project = E * (2 / n)
    project[:, 0] /= 2
    g = force @ project
    D = np.einsum("npikm,nj->pijkm", dforce, project, optimize=True)
    stiffness = law.stuck_stiffness(pairs)
    g -= stiffness[:, :, None] * x
    if law.has_normal:
        g[:, -1, 0] -= pairs.preload
    for d in range(nd):
        D[:, d, np.arange(nh), d, np.arange(nh)] -= stiffness[:, d, None]
    size = np.maximum(np.abs(dforce).max(axis=(0, 2, 3, 4)), 1e-300)
    moves = np.abs(D).max(axis=(2, 3, 4)) > 1e-12 * size[:, None]
    noise = 1e-13 * (np.abs(force).max(axis=2) + (stiffness * np.abs(u).max(axis=2)) + np.abs(pairs.preload)[:, None])
    g[(np.abs(g).max(axis=2) <= noise) & ~moves] = 0.0
    shares = np.stack([n - slips - opens, slips, opens], axis=1) / n
    return g, D, np.zeros_like(g), moves, shares
