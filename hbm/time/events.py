"""Time integration of the corridor laws, with every transition located: the compiled part of `march`.

Between transitions the bracket g = f - K_c u (see `transitions`) of every pair is linear in the motion,
g = a + Gamma u, and the poles of the stuck system (see `poles`) are propagated exactly under

    g(tau) = g0 + g0' tau + (g1 - g0 - g0' h) (tau/h)^2 + d (tau^3 - h tau^2)/h^2        over a step h,

where d is the defect of the quadratic in the rate at the end. The quadratic is solved implicitly, the cubic term is
added afterwards, and the motion is of fourth order in h; the integrals are the phi functions of exponential integrators
[Hochbruck, Ostermann 2010]. A step ends where the next transition is: the instant at which a signal, negative while the
state lasts, comes to zero - the normal load, the distance of the slider from a side of its corridor, or the rate of
that side. Nothing is interpolated there: the step is taken again until the signal at its end vanishes.

One file, because compiled code is stored per file.
"""

from collections import namedtuple

import numpy as np
from numba import njit

System = namedtuple("System", "s out into static orders stuck w")
System.__doc__ = """What the kernels need of the linear side; z = [Re y, Im y].

s : (n,) complex poles; out : (nc, 2n) real, u = out z; into : (2n, nc) real, b' g
static : (nc, nc) flexibility S of the poles that follow statically
orders : (m,) harmonics of the outer force; stuck : (nc, m) complex response of the stuck system; w : rad/s
"""

Law = namedtuple("Law", "nd tangents has_normal kt kn mu preload")
Law.__doc__ = "Number of components and of tangents, whether there is a normal, and the settings (P,) of the pairs."

STICK, FORWARD, BACKWARD, OPEN = 0, 1, 2, 3
BEND = 0.02            # of the motion: cubic part that a step may hold, so that no transition hides in it
OPENS, CLOSES, SLIPS_FORWARD, SLIPS_BACKWARD, STOPS_FORWARD, STOPS_BACKWARD = range(6)
NEVER = 2.0


@njit(cache=True)
def frozen(law, mode, closed, slider, gamma, a):
    """Fill gamma (nc, nd) and a (nc,): g = a + gamma u of the pair, in the present states."""
    nd = law.nd
    gamma[:] = 0.0
    a[:] = 0.0
    for p in range(len(law.kt)):
        normal = p * nd + nd - 1
        if law.has_normal and not closed[p]:
            gamma[normal, nd - 1] = -law.kn[p]
            a[normal] = -law.preload[p]
        for d in range(law.tangents):
            c = p * nd + d
            if mode[p, d] == STICK:
                a[c] = -law.kt[p] * slider[p, d]
                continue
            gamma[c, d] = -law.kt[p]
            if mode[p, d] != OPEN:
                sign = 1.0 if mode[p, d] == FORWARD else -1.0
                a[c] = sign * law.mu[p] * law.preload[p]
                if law.has_normal:
                    gamma[c, nd - 1] = sign * law.mu[p] * law.kn[p]


@njit(cache=True)
def side(law, u, p, d, sign):
    """Low (sign -1) or high (+1) side of the corridor of a tangent, of the motion or of its rate (without preload)."""
    nd = law.nd
    c = p * nd + d
    if law.kt[p] == 0:
        return u[c]
    N = law.kn[p] * u[p * nd + nd - 1] if law.has_normal else 0.0
    return u[c] + sign * law.mu[p] * N / law.kt[p]


@njit(cache=True)
def signal(law, kind, p, d, u, rate, slider):
    """(value, rate) in m and m/s of what ends the state; for a stop its value is the slider, whose rate is watched."""
    nd = law.nd
    if kind == OPENS or kind == CLOSES:
        c = p * nd + nd - 1
        sign = -1.0 if kind == OPENS else 1.0
        return sign * (law.preload[p] / law.kn[p] + u[c]), sign * rate[c]
    forward = kind == SLIPS_FORWARD or kind == STOPS_FORWARD
    sign = -1.0 if forward else 1.0
    reach = law.mu[p] * law.preload[p] / law.kt[p]
    value = side(law, u, p, d, sign) + sign * reach
    speed = side(law, rate, p, d, sign)
    if kind == SLIPS_FORWARD:
        return value - slider[p, d], speed
    if kind == SLIPS_BACKWARD:
        return slider[p, d] - value, -speed
    return (value, speed) if forward else (-value, -speed)


@njit(cache=True)
def cubic(c0, r0, c1, r1, x):
    """Value at x of the cubic with values c and rates r at 0 and 1."""
    return c0 + x * (r0 + x * (3 * (c1 - c0) - 2 * r0 - r1 + x * (r0 + r1 - 2 * (c1 - c0))))


@njit(cache=True)
def crossing(c0, r0, c1, r1, tiny):
    """First place in [0, 1] where the cubic with values c and rates r at its ends exceeds `tiny`; NEVER if nowhere."""
    if c0 > tiny:
        return 0.0
    A, B = 3 * (c1 - c0) - 2 * r0 - r1, r0 + r1 - 2 * (c1 - c0)
    left, right = 0.0, 1.0
    top = quadratic_top(r0, 2 * A, 3 * B)
    if 0 < top < 1:
        if c0 + top * (r0 + top * (A + top * B)) > tiny:
            right = top
        elif c1 > tiny:
            left = top
    if right == 1.0 and c1 <= tiny:
        return NEVER
    for _ in range(50):
        x = 0.5 * (left + right)
        if c0 + x * (r0 + x * (A + x * B)) > 0:
            right = x
        else:
            left = x
    return right


@njit(cache=True)
def quadratic_top(r, b, c):
    """Root of r + b x + c x^2 at which it falls through zero: the maximum of its integral; NEVER if there is none."""
    inside = b * b - 4 * c * r
    if inside <= 0:
        return NEVER
    root = np.sqrt(inside)
    half = -0.5 * (b + root) if b > 0 else 0.5 * (root - b)
    for x in (half / c if c != 0 else NEVER, r / half if half != 0 else NEVER):
        if b + 2 * c * x < 0:
            return x
    return NEVER


@njit(cache=True)
def stop(c0, r0, c1, r1, tiny, noise):
    """First place in [0, 1] where the rate of that cubic falls below -tiny; NEVER if nowhere.

    noise : of the values, so that none is seen inside a very short step
    """
    if r0 < -tiny:
        return 0.0
    A, B = 3 * (c1 - c0) - 2 * r0 - r1, r0 + r1 - 2 * (c1 - c0)
    right = 1.0
    if r1 >= -tiny:
        turn = -A / (3 * B) if B != 0 else NEVER
        if not (B > 0 and 0 < turn < 1 and r0 + turn * (2 * A + turn * 3 * B) < -tiny - noise):
            return NEVER
        right = turn
    left = 0.0
    for _ in range(50):
        x = 0.5 * (left + right)
        if r0 + x * (2 * A + x * 3 * B) < 0:
            right = x
        else:
            left = x
    return right


@njit(cache=True)
def watched(law, mode, closed, p, d):
    """The kinds of transition that may end the state of a tangent d, or of the normal (d = -1); -1 for none."""
    if d < 0:
        if not law.has_normal or law.kn[p] == 0:
            return -1, -1
        return (OPENS, -1) if closed[p] else (CLOSES, -1)
    if not closed[p] or law.kt[p] == 0 or law.mu[p] == 0:
        return -1, -1
    if mode[p, d] == STICK:
        return SLIPS_FORWARD, SLIPS_BACKWARD
    return (STOPS_FORWARD, -1) if mode[p, d] == FORWARD else (STOPS_BACKWARD, -1)


@njit(cache=True)
def next_transition(law, mode, closed, slider, h, u0, rate0, u1, rate1, tiny, tiny_rate):
    """(place in [0, 1] of the step or NEVER, kind, pair, tangent) of the first transition in a step."""
    first, kind, pair, tangent = NEVER, -1, -1, -1
    for p in range(len(law.kt)):
        for d in range(-1, law.tangents):
            for k in watched(law, mode, closed, p, d):
                if k < 0:
                    continue
                c0, r0 = signal(law, k, p, d, u0, rate0, slider)
                c1, r1 = signal(law, k, p, d, u1, rate1, slider)
                if k >= STOPS_FORWARD:
                    at = stop(c0, r0 * h, c1, r1 * h, tiny_rate * h, 0.1 * tiny)
                else:
                    at = crossing(c0, r0 * h, c1, r1 * h, tiny)
                if at < first:
                    first, kind, pair, tangent = at, k, p, d
    if (kind == SLIPS_FORWARD or kind == SLIPS_BACKWARD) and law.has_normal and law.kn[pair] > 0:
        # the corridor closes up where the pair opens: a slip from that instant on is the opening
        c0, r0 = signal(law, OPENS, pair, -1, u0, rate0, slider)
        c1, r1 = signal(law, OPENS, pair, -1, u1, rate1, slider)
        if cubic(c0, r0 * h, c1, r1 * h, first) > -tiny:
            return first, OPENS, pair, -1
    return first, kind, pair, tangent


@njit(cache=True)
def switch(law, mode, closed, slider, kind, p, d, u, rate):
    """Put the pair into the state that follows a transition; the motion and the force go on continuously."""
    if kind == OPENS:
        closed[p] = False
        mode[p] = OPEN
    elif kind == CLOSES:
        closed[p] = True
        for e in range(law.tangents):
            mode[p, e] = OPEN
            if law.mu[p] > 0 and law.kt[p] > 0:
                # pushed only where the opening corridor overtakes the slider
                mode[p, e] = STICK
                if side(law, rate, p, e, -1.0) > 0:
                    mode[p, e] = FORWARD
                elif side(law, rate, p, e, 1.0) < 0:
                    mode[p, e] = BACKWARD
    elif kind == SLIPS_FORWARD:
        mode[p, d] = FORWARD
    elif kind == SLIPS_BACKWARD:
        mode[p, d] = BACKWARD
    else:
        value = signal(law, kind, p, d, u, rate, slider)[0]
        slider[p, d] = value if kind == STOPS_FORWARD else -value
        mode[p, d] = STICK


@njit(cache=True)
def follow_sliders(law, mode, slider, u):
    """Sliders of the pairs that slip or are open, which the motion carries along."""
    for p in range(len(law.kt)):
        for d in range(law.tangents):
            if mode[p, d] == OPEN:
                slider[p, d] = u[p * law.nd + d]
            elif mode[p, d] != STICK:
                sign = -1.0 if mode[p, d] == FORWARD else 1.0
                reach = law.mu[p] * law.preload[p] / law.kt[p]
                slider[p, d] = side(law, u, p, d, sign) + sign * reach


@njit(cache=True)
def fill_weights(s, h, W):
    """W (5, n): exp(s h), and the weights of g0, g0', g1 and of the defect d over a step h."""
    for j in range(len(s)):
        x = s[j] * h
        if abs(x) < 1.0:
            term, f4 = (1.0 + 0j) / 24, 0j
            for k in range(18):
                f4 += term
                term *= x / (k + 5)
            f3 = 1 / 6 + x * f4
            f2 = 0.5 + x * f3
            f1 = 1 + x * f2
            E = 1 + x * f1
        else:
            E = np.exp(x)
            f1 = (E - 1) / x
            f2 = (f1 - 1) / x
            f3 = (f2 - 0.5) / x
            f4 = (f3 - 1 / 6) / x
        W[0, j] = E
        W[1, j] = h * (f1 - 2 * f3)
        W[2, j] = h * h * (f2 - 2 * f3)
        W[3, j] = 2 * h * f3
        W[4, j] = h * h * (6 * f4 - 2 * f3)


@njit(cache=True)
def times(weight, z):
    """Complex weights (n,) on z = [Re, Im] (2n,)."""
    n = len(weight)
    result = np.empty(2 * n)
    for j in range(n):
        a, b = weight[j].real, weight[j].imag
        result[j] = a * z[j] - b * z[n + j]
        result[n + j] = a * z[n + j] + b * z[j]
    return result


@njit(cache=True)
def direct_flexibility(system, weight):
    """(nc, nc) effect of g1 on u1 within a step, static poles included."""
    n = len(weight)
    left = np.empty_like(system.out)
    for c in range(len(left)):
        for j in range(n):
            a, b = weight[j].real, weight[j].imag
            left[c, j] = system.out[c, j] * a + system.out[c, n + j] * b
            left[c, n + j] = system.out[c, n + j] * a - system.out[c, j] * b
    return np.dot(left, system.into) + system.static


@njit(cache=True)
def stuck_motion(system, t):
    """(u, u') (nc,) of the stuck system under the outer forces."""
    nc = len(system.stuck)
    u, rate = np.zeros(nc), np.zeros(nc)
    for k in range(len(system.orders)):
        w = system.w * system.orders[k]
        turn = np.exp(1j * w * t)
        for c in range(nc):
            value = system.stuck[c, k] * turn
            u[c] += value.real
            rate[c] -= w * value.imag
    return u, rate


@njit(cache=True)
def settle(law, D, gamma, a, known, u, g):
    """Fill u and g (nc,) with the solution of u + D g = known, g = a + gamma u; whether any component moves with u."""
    nd, nc = law.nd, len(known)
    active = np.empty(nc, np.int64)
    m = 0
    for i in range(nc):
        for d in range(nd):
            if gamma[i - i % nd + d, i % nd] != 0:
                active[m] = i
                m += 1
                break
    g[:] = a
    if m:
        right = known - np.dot(D, a)
        M, v = np.zeros((m, m)), np.empty(m)
        for j in range(m):
            e, first = active[j] % nd, active[j] - active[j] % nd
            for i in range(m):
                for d in range(nd):
                    M[i, j] += D[active[i], first + d] * gamma[first + d, e]
            M[j, j] += 1.0
            v[j] = right[active[j]]
        v = np.linalg.solve(M, v)
        for j in range(m):
            e, first = active[j] % nd, active[j] - active[j] % nd
            for d in range(nd):
                g[first + d] += gamma[first + d, e] * v[j]
    u[:] = known - np.dot(D, g)
    return m > 0


@njit(cache=True)
def instant(system, law, gamma, a, t, z, motion):
    """Fill motion (4, nc) = u, u', g, g' at the poles z; returns b' g."""
    known, rate = stuck_motion(system, t)
    settle(law, system.static, gamma, a, known + np.dot(system.out, z), motion[0], motion[2])
    push = np.dot(system.into, motion[2])
    rate += np.dot(system.out, times(system.s, z) - push)
    settle(law, system.static, gamma, 0 * a, rate, motion[1], motion[3])
    return push


@njit(cache=True)
def step(system, law, W, D, gamma, a, t1, h, z, motion, push):
    """(poles at the end, largest error of g in the step) after a step h in frozen states that ends at t1."""
    z1 = times(W[0], z) - times(W[1], push)
    if not gamma.any():
        return z1 - times(W[3], push), 0.0
    z1 -= times(W[2], np.dot(system.into, motion[3]))
    known, rate = stuck_motion(system, t1)
    u, g, g_rate = np.empty_like(known), np.empty_like(known), np.empty_like(known)
    settle(law, D, gamma, a, known + np.dot(system.out, z1), u, g)
    push1 = np.dot(system.into, g)
    z1 -= times(W[3], push1)
    rate += np.dot(system.out, times(system.s, z1) - push1)
    settle(law, system.static, gamma, 0 * a, rate, u, g_rate)
    defect = g_rate - (2 / h * (g - motion[2]) - motion[3])
    z1 -= times(W[4], np.dot(system.into, defect))
    return z1, 4 / 27 * h * np.abs(defect).max()


@njit(cache=True)
def bend(h, before, after):
    """Largest coefficient of the cubic that the motion makes in a step, m."""
    largest = 0.0
    for c in range(before.shape[1]):
        B = h * (before[1, c] + after[1, c]) - 2 * (after[0, c] - before[0, c])
        largest = max(largest, abs(B))
    return largest


@njit(cache=True)
def located_step(system, law, tables, states, gamma, a, t, left, level, z, motion, push, tiny, tolerance, size):
    """One step to the next transition or of its full length. Returns (h, level, slot, z, motion, push, transition).

    The step is halved until the errors of g and the bend of the motion are small against `size`.
    """
    mode, closed, slider = states
    lengths, ready, W, D = tables[0], tables[1], tables[2], tables[3]
    scratch = len(lengths)
    after = np.empty_like(motion)
    target, kind, p, d, slot = -1, -1, -1, -1, level
    low, high, c_low, c_high = 0.0, 0.0, 0.0, 0.0
    h = min(lengths[level], left)
    for attempt in range(60):
        slot = level if h == lengths[level] else scratch
        if slot == scratch or not ready[slot]:
            fill_weights(system.s, h, W[slot])
            D[slot] = direct_flexibility(system, W[slot, 3])
            ready[slot] = True
        z1, error = step(system, law, W[slot], D[slot], gamma, a, t + h, h, z, motion, push)
        push1 = instant(system, law, gamma, a, t + h, z1, after)
        rough = tolerance > 0 and (error > tolerance * size[1] or bend(h, motion, after) > BEND * size[0])
        if target < 0 and rough and level < scratch - 1:
            level += 1
            h = min(lengths[level], left)
            continue
        place, k, q, e = next_transition(law, mode, closed, slider, h, motion[0], motion[1], after[0], after[1], tiny,
                                         tiny * system.w)
        if place == 0.0:
            return 0.0, level, slot, z, motion, push, (k, q, e)
        if place <= 1.0:
            target, kind, p, d, high = 1, k, q, e, h
            c_high = ended(law, kind, p, d, after, slider)
            if high - low <= 1e-15 * lengths[0] or attempt > 50:
                break
            h = max(place * h, low + 0.5 * (high - low)) if place * h <= low else place * h
            continue
        if target < 0:
            break
        c_low, low = ended(law, kind, p, d, after, slider), h
        if c_low >= -tiny * (system.w if kind >= STOPS_FORWARD else 1.0) or high - low <= 1e-15 * lengths[0]:
            break
        h = low - c_low * (high - low) / (c_high - c_low) if c_high > c_low else low
        if not low < h < high or attempt % 8 == 7:
            h = 0.5 * (low + high)
    else:
        kind = kind if target > 0 else -1
    if target < 0 and tolerance > 0 and level and error < tolerance * size[1] / 40 and slot == level \
            and bend(h, motion, after) < BEND * size[0] / 10:
        level -= 1
    return h, level, slot, z1, after, push1, (kind, p, d)


@njit(cache=True)
def ended(law, kind, p, d, motion, slider):
    """What has come to zero when a transition is reached: its signal, or for a stop minus its rate."""
    value, rate = signal(law, kind, p, d, motion[0], motion[1], slider)
    return -rate if kind >= STOPS_FORWARD else value


@njit(cache=True)
def add_harmonics(system, h, before, after, weights, G):
    """G (nc, H+1) += integral of exp(i k w (t1 - t)) g(t) over a step that ends at t1, G carried along before."""
    H = G.shape[1] - 1
    fill_weights(1j * system.w * np.arange(H + 1), h, weights)
    for c in range(len(G)):
        g0, r0, g1 = before[2, c], before[3, c], after[2, c]
        defect = after[3, c] - (2 / h * (g1 - g0) - r0)
        for k in range(H + 1):
            G[c, k] = (weights[0, k] * G[c, k] + weights[1, k] * g0 + weights[2, k] * r0 + weights[3, k] * g1
                       + weights[4, k] * defect)


@njit(cache=True)
def add_work(law, before, after, slid, slider, work):
    """work (P,) += mean tangential force times what the slider has moved."""
    for p in range(len(work)):
        for d in range(law.tangents):
            c = p * law.nd + d
            T = 0.5 * (before[2, c] + after[2, c] + law.kt[p] * (before[0, c] + after[0, c]))
            work[p] += T * (slider[p, d] - slid[p, d])


@njit(cache=True)
def run(system, law, tables, states, z, periods, tolerance, tiny, size, most, G, work, count):
    """March whole periods; z, states = (mode, closed, slider) and size = (largest u, largest g) are left at the end.

    G (nc, H+1) and work (P,) are those of the last period, count = (steps, transitions) of all.
    Returns whether no period took more than `most` steps.
    """
    mode, closed, slider = states
    nc, T = len(system.stuck), 2 * np.pi / system.w
    gamma, a, motion = np.zeros((nc, law.nd)), np.zeros(nc), np.zeros((4, nc))
    weights = np.empty((5, G.shape[1]), np.complex128)
    level, stalled = 0, 0
    frozen(law, mode, closed, slider, gamma, a)
    push = instant(system, law, gamma, a, 0.0, z, motion)
    for period in range(periods):
        t, used = 0.0, 0
        G[:], work[:] = 0.0, 0.0
        while t < T * (1 - 1e-14):
            used += 1
            if used > most:
                return False
            reach = np.inf if stalled > 20 + 4 * nc else tiny * size[0]
            h, level, slot, z1, after, push1, turn = located_step(
                system, law, tables, states, gamma, a, t, T - t, level, z, motion, push, reach, tolerance, size)
            if h > 0:
                before = slider.copy()
                follow_sliders(law, mode, slider, after[0])
                if period == periods - 1:
                    add_harmonics(system, h, motion, after, weights, G)
                    add_work(law, motion, after, before, slider, work)
                t += h
                z[:] = z1
                motion, push = after, push1
                size[0] = max(size[0], np.abs(motion[0]).max())
                size[1] = max(size[1], np.abs(motion[2]).max())
                stalled = 0
            if turn[0] >= 0:
                stalled += h <= 0
                count[1] += 1
                switch(law, mode, closed, slider, turn[0], turn[1], turn[2], motion[0], motion[1])
                frozen(law, mode, closed, slider, gamma, a)
                push = instant(system, law, gamma, a, t, z, motion)
        count[0] += used
    return True
