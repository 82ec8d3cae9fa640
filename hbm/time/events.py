"""Event-driven time integration of piecewise-linear contact laws: the compiled part of `exact`.

Between events the nonlinear force g = f - K_c u - f_rest of every contact is linear in the motion,
g = a + Gamma u, and the poles of the stuck system (see `poles`) are propagated exactly under

    g(tau) = g0 + g0' tau + (g1 - g0 - g0' h) (tau/h)^2 + d (tau^3 - h tau^2)/h^2        over a step
    h,

where d is the defect of the quadratic in the rate at the end. The quadratic is solved implicitly,
the cubic term is added afterwards, and the motion is of fourth order in h; the integrals are the
phi functions of exponential integrators [Hochbruck, Ostermann 2010]. A step ends at the next event:
the instant at which a guard of the present state of a contact rises through zero (see
`tipdamp.hbm.laws.piecewise`). The step is repeated until the guard vanishes at its end.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.time.guards import Present, Table, excess, follow, freeze, next_event, switch

System = namedtuple("System", "s out into static orders stuck w")
System.__doc__ = """What the kernels need of the linear side; z = [Re y, Im y].

s : (n,) complex poles; out : (nc, 2n) real, u = out z; into : (2n, nc) real, b' g
static : (nc, nc) flexibility S of the poles that follow statically
orders : (m,) harmonics of the external force; stuck : (nc, m) complex response of the stuck system;
w : rad/s """

Steps = namedtuple("Steps", "lengths ready W D")
Steps.__doc__ = """Lengths (L,) of steps, s, each half the one before, and once `ready` weights W
(L+1, 5, n) and effect D (L+1, nc, nc) of the force at the end on the motion there. The last place
is for steps of any other length."""

Control = namedtuple("Control", "tolerance curvature tiny max_steps size")
Control.__doc__ = (
    """Settings as in IntegrationSettings; size : (2,) largest motion and nonlinear force so far."""
)

Record = namedtuple("Record", "G dissipated count")
Record.__doc__ = """Of the last period: G (nc, H+1), dissipated (P,) J; of all periods: count (2,)
steps and events."""

Going = namedtuple("Going", "motion push level stalled recorded")
Going.__doc__ = """What one period leaves to the next, as in Instant; stalled : changes of state
since the last step of some length; recorded : whether G and dissipated are those of the period that
begins."""

Instant = namedtuple("Instant", "t motion push level tiny")
Instant.__doc__ = """Begin of a step: t s; motion (4, nc) = u, u', g, g'; push = b' g; level of its
length; tiny m."""


@njit(cache=True)
def fill_weights(s: np.ndarray, h: float, W: np.ndarray) -> None:
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
def times(weight: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Complex weights (n,) on z = [Re, Im] (2n,)."""
    n = len(weight)
    result = np.empty(2 * n)
    for j in range(n):
        a, b = weight[j].real, weight[j].imag
        result[j] = a * z[j] - b * z[n + j]
        result[n + j] = a * z[n + j] + b * z[j]
    return result


@njit(cache=True)
def direct_flexibility(system: System, weight: np.ndarray) -> np.ndarray:
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
def stuck_motion(system: System, t: float) -> tuple[np.ndarray, np.ndarray]:
    """(u, u') (nc,) of the stuck system under the external forces."""
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
def settle(
    D: np.ndarray, gamma: np.ndarray, a: np.ndarray, known: np.ndarray, u: np.ndarray, g: np.ndarray
) -> bool:
    """Fill u and g (nc,) with the solution of u + D g = known, g = a + gamma u; whether any
    component moves with u."""
    nd, nc = gamma.shape[1], len(known)
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
def instant(
    system: System, present: Present, t: float, z: np.ndarray, motion: np.ndarray
) -> np.ndarray:
    """Fill motion (4, nc) = u, u', g, g' at the poles z; returns b' g."""
    known, rate = stuck_motion(system, t)
    gamma, a = present.gamma, present.a
    settle(system.static, gamma, a, known + np.dot(system.out, z), motion[0], motion[2])
    push = np.dot(system.into, motion[2])
    rate += np.dot(system.out, times(system.s, z) - push)
    settle(system.static, gamma, 0 * a, rate, motion[1], motion[3])
    return push


@njit(cache=True)
def step(
    system: System, present: Present, steps: Steps, begin: Instant, h: float, level: int
) -> tuple[int, np.ndarray, float]:
    """(slot of the weights, poles z at the end, largest error of g) of a step h in the present
    states."""
    slot = level if h == steps.lengths[level] else len(steps.lengths)
    if slot == len(steps.lengths) or not steps.ready[slot]:
        fill_weights(system.s, h, steps.W[slot])
        steps.D[slot] = direct_flexibility(system, steps.W[slot, 3])
        steps.ready[slot] = True
    W, gamma = steps.W[slot], present.gamma
    z = times(W[0], present.z) - times(W[1], begin.push)
    if not gamma.any():
        return slot, z - times(W[3], begin.push), 0.0
    z -= times(W[2], np.dot(system.into, begin.motion[3]))
    known, rate = stuck_motion(system, begin.t + h)
    u, g, g_rate = np.empty_like(known), np.empty_like(known), np.empty_like(known)
    settle(steps.D[slot], gamma, present.a, known + np.dot(system.out, z), u, g)
    push = np.dot(system.into, g)
    z -= times(W[3], push)
    rate += np.dot(system.out, times(system.s, z) - push)
    settle(system.static, gamma, 0 * present.a, rate, u, g_rate)
    defect = g_rate - (2 / h * (g - begin.motion[2]) - begin.motion[3])
    z -= times(W[4], np.dot(system.into, defect))
    return slot, z, 4 / 27 * h * np.abs(defect).max()


@njit(cache=True)
def cubic_part(h: float, before: np.ndarray, after: np.ndarray) -> float:
    """Largest coefficient of the cubic that the motion makes in a step, m."""
    largest = 0.0
    for c in range(before.shape[1]):
        B = h * (before[1, c] + after[1, c]) - 2 * (after[0, c] - before[0, c])
        largest = max(largest, abs(B))
    return largest


@njit(cache=True)
def step_to_event(
    system: System, table: Table, present: Present, steps: Steps, begin: Instant, control: Control
) -> tuple[float, np.ndarray, Instant, int, int]:
    """One step to the next event or of its full length: (h, z, Instant after it, contact, guard),
    guard -1 for none.

    The step is halved until the errors of g and the cubic part of the motion are small against
    `control.size`."""
    left = 2 * np.pi / system.w - begin.t
    level = begin.level
    last = len(steps.lengths) - 1
    fine, after = control.tolerance * control.size[1], np.empty_like(begin.motion)
    while True:
        h = min(steps.lengths[level], left)
        slot, z, error = step(system, present, steps, begin, h, level)
        push = instant(system, present, begin.t + h, z, after)
        bent = cubic_part(h, begin.motion, after) / control.size[0]
        if fine == 0 or level == last or error <= fine and bent <= control.curvature:
            break
        level += 1
    place, p, guard = next_event(
        table, present, (h, begin.motion, after), begin.tiny, begin.tiny * system.w
    )
    if place == 0:
        return (
            0.0,
            present.z,
            Instant(begin.t, begin.motion, begin.push, level, begin.tiny),
            p,
            guard,
        )
    if place <= 1:
        begin = Instant(begin.t, begin.motion, begin.push, level, begin.tiny)
        return locate(system, table, present, steps, begin, (h, z, after, push), (place, p, guard))
    if level and slot == level and error < fine / 40 and bent < control.curvature / 10:
        level -= 1
    return h, z, Instant(begin.t + h, after, push, level, begin.tiny), -1, -1


@njit(cache=True)
def locate(
    system: System,
    table: Table,
    present: Present,
    steps: Steps,
    begin: Instant,
    end: tuple[float, np.ndarray, np.ndarray, np.ndarray],
    event: tuple[float, int, int],
) -> tuple[float, np.ndarray, Instant, int, int]:
    """As `step_to_event`, the step repeated until its end is the event: inside a bracket, by cubics
    and secants."""
    h, z, after, push = end
    place, p, guard = event
    low = 0.0
    high = h
    c_low = 0.0
    c_high = 0.0
    for attempt in range(60):
        if place <= 1:
            high, p, guard = h, event[1], event[2]
            c_high, new = excess(table, present.memory, p, guard, after), place * h
        else:
            low, c_low = h, excess(table, present.memory, p, guard, after)
            if c_low >= -begin.tiny * (system.w if table.of_rate[guard] else 1.0):
                break
            new = low - c_low * (high - low) / (c_high - c_low) if c_high > c_low else low
        if high - low <= 1e-15 * steps.lengths[0] or place <= 1 and attempt > 50:
            break
        if not low < new < high or place > 1 and attempt % 8 == 7:
            new = 0.5 * (low + high)
        h = new
        z = step(system, present, steps, begin, h, begin.level)[1]
        push = instant(system, present, begin.t + h, z, after)
        event = next_event(
            table, present, (h, begin.motion, after), begin.tiny, begin.tiny * system.w
        )
        place = event[0]
    return h, z, Instant(begin.t + h, after, push, begin.level, begin.tiny), p, guard


@njit(cache=True)
def add_harmonics(
    system: System,
    h: float,
    before: np.ndarray,
    after: np.ndarray,
    weights: np.ndarray,
    G: np.ndarray,
) -> None:
    """G (nc, H+1) += integral of exp(i k w (t1 - t)) g(t) over a step that ends at t1, G brought
    there before."""
    H = G.shape[1] - 1
    fill_weights(1j * system.w * np.arange(H + 1), h, weights)
    for c in range(len(G)):
        g0, r0, g1 = before[2, c], before[3, c], after[2, c]
        defect = after[3, c] - (2 / h * (g1 - g0) - r0)
        for k in range(H + 1):
            G[c, k] = (
                weights[0, k] * G[c, k]
                + weights[1, k] * g0
                + weights[2, k] * r0
                + weights[3, k] * g1
                + weights[4, k] * defect
            )


@njit(cache=True)
def add_dissipated(
    nd: int, h: float, before: np.ndarray, after: np.ndarray, dissipated: np.ndarray
) -> None:
    """dissipated (P,) += integral of g du over a step, g and u as cubics; over a period that of f
    du."""
    for c in range(before.shape[1]):
        change, slope = after[0, c] - before[0, c], h * (before[3, c] - after[3, c])
        dissipated[c // nd] += (
            0.5 * (before[2, c] + after[2, c]) * change
            + 0.1 * slope * change
            + 0.1 * h * (before[2, c] - after[2, c]) * (before[1, c] - after[1, c])
            + h * h / 60 * (after[3, c] * before[1, c] - before[3, c] * after[1, c])
        )


@njit(cache=True)
def run(
    system: System,
    table: Table,
    steps: Steps,
    control: Control,
    present: Present,
    record: Record,
    going: Going,
) -> Going | None:
    """Integrate a period that `going` begins; `present`, `going` and `control.size` are left at the
    end.

    Returns where the next one begins, None where this one took more than `control.max_steps`. One
    call a period, so that an interrupt is heard between them.
    """
    (nc, nd), T = present.gamma.shape, 2 * np.pi / system.w
    weights = np.empty((5, record.G.shape[1]), np.complex128)
    motion = going.motion
    push = going.push
    level = going.level
    stalled = going.stalled
    t, used = 0.0, 0
    record.G[:], record.dissipated[:] = 0.0, 0.0
    while t < T * (1 - 1e-14):
        used += 1
        if used > control.max_steps:
            return None
        tiny = np.inf if stalled > 20 + 4 * nc else control.tiny * control.size[0]
        h, z, end, p, guard = step_to_event(
            system, table, present, steps, Instant(t, motion, push, level, tiny), control
        )
        level = end.level
        if h > 0:
            for q in range(len(present.state)):
                follow(table, present, q, end.motion[0])
            if going.recorded:
                add_harmonics(system, h, motion, end.motion, weights, record.G)
                add_dissipated(nd, h, motion, end.motion, record.dissipated)
            t = end.t
            motion = end.motion
            push = end.push
            stalled = 0
            present.z[:] = z
            control.size[0] = max(control.size[0], np.abs(motion[0]).max())
            control.size[1] = max(control.size[1], np.abs(motion[2]).max())
        if guard >= 0:
            stalled += h <= 0
            record.count[1] += 1
            switch(table, present, p, guard, motion, control.tiny * control.size[0])
            freeze(table, present)
            push = instant(system, present, t, present.z, motion)
    record.count[0] += used
    return Going(motion, push, level, stalled, going.recorded)


@njit(cache=True)
def begin(system: System, table: Table, present: Present) -> Going:
    """Going at the begin of a period; makes `present.gamma` and `a` those of its states."""
    freeze(table, present)
    motion = np.zeros((4, len(present.a)))
    push = instant(system, present, 0.0, present.z, motion)
    return Going(motion, push, 0, 0, False)
