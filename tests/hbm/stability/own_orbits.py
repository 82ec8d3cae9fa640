"""Periodic motions and their multipliers by an integration that shares nothing with the product:
Runge and Kutta in equal steps, shorter ones up to each event, shooting, and a period map by
differences.

A contact has up to two tangents, each with its own limit or with one limit for both, and a normal
or a constant load; a cubic spring is one whose tangents have none.
"""

from typing import NamedTuple

import numba
import numpy as np

STICK, FORWARD, BACKWARD, OPEN = range(4)


class Own(NamedTuple):
    """M x'' + C x' + K x + sum B' f = Re(F exp(i w t)).

    B (P, 3, r) : t1, t2, n; sliders (P,) : 0, 1 or 2; coupled, normal (P,) bool
    settings (P, 5) : kt, kn, mu, preload, and the cubic of n
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    F: np.ndarray
    w: float
    B: np.ndarray
    sliders: np.ndarray
    coupled: np.ndarray
    normal: np.ndarray
    settings: np.ndarray


@numba.njit(cache=True)
def load(own, p, x, v):
    """(limit, its rate, normal force) of a contact as if it were closed."""
    kn, mu, preload = own.settings[p, 1:4]
    N, rate = preload, 0.0
    if own.normal[p]:
        N, rate = preload + kn * (own.B[p, 2] @ x), kn * (own.B[p, 2] @ v)
    return mu * N, mu * rate, N


@numba.njit(cache=True)
def force(own, p, x, v, slider, mode):
    """(3,) force of a contact and the rate (2,) of its sliders."""
    kt, f, moves = own.settings[p, 0], np.zeros(3), np.zeros(2)
    L, rise, N = load(own, p, x, v)
    if own.settings[p, 4] != 0.0:
        f[2] = own.settings[p, 4] * (own.B[p, 2] @ x) ** 3
        return f, moves
    if mode[0] == OPEN:
        for d in range(own.sliders[p]):
            moves[d] = own.B[p, d] @ v
        f[2] = -max(own.settings[p, 3], 0.0)
        return f, moves
    if own.normal[p]:
        f[2] = N - max(own.settings[p, 3], 0.0)
    T = np.array([kt * (own.B[p, d] @ x - slider[d]) for d in range(2)])
    if own.coupled[p] and mode[0] == FORWARD:
        n = T / max(np.hypot(T[0], T[1]), 1e-300)
        along = kt * (own.B[p, 0] @ v * n[0] + own.B[p, 1] @ v * n[1]) - rise
        for d in range(2):
            f[d] = L * n[d]
            moves[d] = along * n[d] / kt if mode[1] == FORWARD else 0.0
        return f, moves
    for d in range(own.sliders[p]):
        sign = 1.0 if mode[d] == FORWARD else -1.0
        f[d] = T[d] if mode[d] == STICK else sign * L
        moves[d] = own.B[p, d] @ v - sign * rise / kt if mode[d] != STICK else 0.0
    return f, moves


@numba.njit(cache=True)
def rate(own, inverse, t, y, modes):
    r, P = len(own.F), len(own.B)
    x, v, dy = y[:r], y[r : 2 * r], np.empty_like(y)
    push = (own.F * np.exp(1j * own.w * t)).real - own.C @ v - own.K @ x
    for p in range(P):
        at = 2 * r + 2 * p
        f, dy[at : at + 2] = force(own, p, x, v, y[at : at + 2], modes[p])
        for d in range(3):
            push -= own.B[p, d] * f[d]
    dy[:r], dy[r : 2 * r] = v, inverse @ push
    return dy


@numba.njit(cache=True)
def stepped(own, inverse, t, h, y, modes):
    """A step of Runge and Kutta; sliders that slip or are open are put to their place after it."""
    k1 = rate(own, inverse, t, y, modes)
    k2 = rate(own, inverse, t + h / 2, y + h / 2 * k1, modes)
    k3 = rate(own, inverse, t + h / 2, y + h / 2 * k2, modes)
    k4 = rate(own, inverse, t + h, y + h * k3, modes)
    new = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    for p in range(len(own.B)):
        put(own, p, new, modes[p])
    return new


@numba.njit(cache=True)
def put(own, p, y, mode):
    r = len(own.F)
    x, v, slider, kt = y[:r], y[r : 2 * r], y[2 * r + 2 * p :][:2], own.settings[p, 0]
    L, _, _ = load(own, p, x, v)
    u = np.array([own.B[p, d] @ x for d in range(2)])
    if own.coupled[p] and mode[0] == FORWARD:
        T = u - slider
        slider[:] = u - L / kt * T / max(np.hypot(T[0], T[1]), 1e-300)
        return
    for d in range(own.sliders[p]):
        if mode[0] == OPEN:
            slider[d] = u[d]
        elif mode[d] != STICK:
            slider[d] = u[d] - (L if mode[d] == FORWARD else -L) / kt


@numba.njit(cache=True)
def guard(own, p, d, y, modes):
    """Positive where the mode of a tangent, or of a contact (d = 2), is another."""
    r, kt = len(own.F), own.settings[p, 0]
    x, v, slider, mode = y[:r], y[r : 2 * r], y[2 * r + 2 * p :][:2], modes[p]
    L, rise, N = load(own, p, x, v)
    if d == 2:
        if not own.normal[p]:
            return -1.0
        return N if mode[0] == OPEN else -N
    if mode[0] == OPEN or d >= own.sliders[p] or (own.coupled[p] and d == 1):
        return -1.0
    if own.coupled[p]:
        T = np.array([kt * (own.B[p, i] @ x - slider[i]) for i in range(2)])
        size = np.hypot(T[0], T[1])
        if mode[0] == STICK:
            return size - L
        return rise - kt * (T[0] * (own.B[p, 0] @ v) + T[1] * (own.B[p, 1] @ v)) / size
    if mode[d] == STICK:
        return abs(kt * (own.B[p, d] @ x - slider[d])) - L
    return rise - kt * (own.B[p, d] @ v) * (1.0 if mode[d] == FORWARD else -1.0)


@numba.njit(cache=True)
def switched(own, p, d, y, modes):
    """Put the mode that follows."""
    r, kt, mode = len(own.F), own.settings[p, 0], modes[p]
    x, v, slider = y[:r], y[r : 2 * r], y[2 * r + 2 * p :][:2]
    _, rise, _ = load(own, p, x, v)
    pull = np.array([kt * (own.B[p, i] @ v) for i in range(2)])
    if d == 2:
        if mode[0] != OPEN:
            mode[:] = OPEN
            return
        mode[:] = STICK
        if own.coupled[p]:
            size = np.hypot(pull[0], pull[1])
            if size > rise:
                mode[0] = FORWARD
                slider[:] -= 1e-14 * pull / size
            return
        for i in range(own.sliders[p]):
            if abs(pull[i]) > rise:
                mode[i] = FORWARD if pull[i] > 0 else BACKWARD
    elif mode[d] != STICK:
        put(own, p, y, mode)
        for i in range(2):  # a little inside, or rounding makes it slip at once
            slider[i] += 1e-12 * (own.B[p, i] @ x - slider[i])
        mode[d] = STICK
    elif own.coupled[p]:
        mode[0] = FORWARD
    else:
        mode[d] = FORWARD if own.B[p, d] @ x > slider[d] else BACKWARD


@numba.njit(cache=True)
def begin(own, y, modes):
    """Modes at t = 0, and sliders that the limit holds."""
    r = len(own.F)
    x, v = y[:r], y[r : 2 * r]
    for p in range(len(own.B)):
        kt, slider = own.settings[p, 0], y[2 * r + 2 * p :][:2]
        L, rise, N = load(own, p, x, v)
        modes[p] = STICK
        if own.normal[p] and N <= 0:
            modes[p] = OPEN
            put(own, p, y, modes[p])
            continue
        T = np.array([kt * (own.B[p, i] @ x - slider[i]) for i in range(2)])
        pull = np.array([kt * (own.B[p, i] @ v) for i in range(2)])
        if own.coupled[p]:
            size = np.hypot(T[0], T[1])
            if size >= (1 - 1e-12) * L:
                modes[p, 0] = FORWARD
                put(own, p, y, modes[p])
                if T @ pull <= size * rise:
                    modes[p, 0] = STICK
            continue
        for d in range(own.sliders[p]):
            if abs(T[d]) >= (1 - 1e-12) * L:
                modes[p, d] = FORWARD if T[d] > 0 else BACKWARD
                put(own, p, y, modes[p])
                if (pull[d] if T[d] > 0 else -pull[d]) <= rise:
                    modes[p, d] = STICK


@numba.njit(cache=True)
def slack(own, p, y, h):
    """Whether the direction of slip turns faster than a step: it then follows the step."""
    r = len(own.F)
    L, _, _ = load(own, p, y[:r], y[r : 2 * r])
    v = y[r : 2 * r]
    pull = own.settings[p, 0] * np.hypot(own.B[p, 0] @ v, own.B[p, 1] @ v)
    return h * pull > 0.5 * L


@numba.njit(cache=True)
def period(own, inverse, y, n):
    """The state after a period, in n steps and more up to events; NaN where these are many."""
    y, modes = y.copy(), np.zeros((len(own.B), 2), np.int64)
    begin(own, y, modes)
    T = 2 * np.pi / own.w
    t, events = 0.0, 0
    while t < T:
        # whole steps from each event on: what a step errs must not hang on where the event is
        h = min(T / n, T - t)
        for p in range(len(own.B)):
            if own.coupled[p] and modes[p, 0] != OPEN:
                turns = modes[p, 0] == FORWARD and not slack(own, p, y, h)
                modes[p, 1] = FORWARD if turns else STICK
        new = stepped(own, inverse, t, h, y, modes)
        if not crossed(own, new, modes):
            y, t = new, (T if h < T / n else t + h)
            continue
        low, high = 0.0, 1.0
        while high - low > 1e-15:
            middle = 0.5 * (low + high)
            if crossed(own, stepped(own, inverse, t, middle * h, y, modes), modes):
                high = middle
            else:
                low = middle
        y = stepped(own, inverse, t, high * h, y, modes)
        t += high * h
        events += 1
        if events > 2000:
            return y * np.nan
        before = modes.copy()
        for p in range(len(own.B)):
            for d in (2, 0, 1):
                if guard(own, p, d, y, before) > 0 and (d == 2 or modes[p, 0] != OPEN):
                    switched(own, p, d, y, modes)
    return y


@numba.njit(cache=True)
def crossed(own, y, modes):
    for p in range(len(own.B)):
        for d in range(3):
            if guard(own, p, d, y, modes) > 0:
                return True
    return False


def ends(own, y, n=2000):
    return period(own, np.linalg.inv(own.M), y, n)


def derivatives(own, y, h, n=2000):
    """(2, m, m) of the map of a period, by differences forwards and backwards."""
    here = ends(own, y, n)
    columns = [
        ((ends(own, y + h * e, n) - here) / h, (here - ends(own, y - h * e, n)) / h)
        for e in np.eye(len(y))
    ]
    return np.array(columns).transpose(1, 2, 0)


def orbit(own, y, n=2000, tolerance=1e-9):
    """The state at t = 0 by Newton's method from one nearby; None where it finds none."""
    size = np.abs(y[: 2 * len(own.F)]).max()
    y = ends(own, y, n)
    for _ in range(12):
        error = ends(own, y, n) - y
        if np.abs(error).max() <= tolerance * size:
            return y
        J = derivatives(own, y, 1e-6 * size, n).mean(axis=0)
        if not (np.isfinite(error).all() and np.isfinite(J).all()):
            return None
        y = y + np.linalg.lstsq(np.eye(len(y)) - J, error, rcond=1e-9)[0]
    return None


def multipliers(J):
    """All, the largest first, but those of sliders that rest and of none."""
    every = np.linalg.eigvals(J)
    every = every[np.abs(every - 1) > 1e-6]
    return every[np.lexsort((-every.imag, -np.abs(every)))]


def on_motion(own, X, n=4096, periods=3):
    """State at t = 0 of a motion with harmonics X (r, H+1), the sliders pulled along from zero."""
    turning = 1j * own.w * np.arange(X.shape[1])
    instants = 2 * np.pi / own.w * np.arange(n * periods + 1) / n
    waves = np.exp(np.outer(instants, turning))
    u = np.einsum("pdr,rh,th->tpd", own.B, X, waves).real
    kt, kn, mu, preload = own.settings[:, :4].T
    sliders = np.zeros((len(own.B), 2))
    for x in u:
        N = preload + kn * x[:, 2] if own.normal.any() else preload
        L = np.maximum(mu * N, 0.0)
        T = kt[:, None] * (x[:, :2] - sliders)
        both = np.hypot(T[:, 0], T[:, 1])[:, None]
        size = np.where(own.coupled[:, None], both, np.abs(T))
        share = np.minimum(1, L[:, None] / np.maximum(size, 1e-300))
        sliders = x[:, :2] - T * share / np.where(kt > 0, kt, 1)[:, None]
    return np.r_[X.sum(axis=1).real, (X @ turning).real, sliders.ravel()]
