"""Coulomb friction coupled in the tangential plane: the slider sample by sample, with its derivatives in closed form.

Over a sample the motion and the normal load are taken as straight; on that path everything is in closed form. A
resting slider slips where the quadratic |T0 + kt du s| = mu (N0 + dN s) has its root. In slip the angle psi from the
velocity to the force obeys L psi' = -kt |du| sin psi with L = mu N, so that

    tan(psi1/2) = tan(psi0/2) exp(-kt |du| / L_m),      L_m the logarithmic mean of L,

and slip goes on to the end of the sample. Hence second order in the samples [radial return is first order].
`law.slide` is the formula, as it is written on paper; the kernels are held to it.
Compiled code is stored per file: nothing compiled here is called from compiled code elsewhere.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np
from numba import njit

from hbm.laws.records import ContactState

STICK, SLIP, OPEN = int(ContactState.STICK), int(ContactState.FORWARD), int(ContactState.OPEN)


class CycleSettings(NamedTuple):
    """Tolerances of the periodic cycle."""

    max_periods: int = 60        # a slider that creeps longer is taken as it is then
    repeats: float = 1e-13       # of the largest motion: the slider has come back to where it was
    regular: float = 1e-7        # of det(I - A): below, what a period does to the slider is not inverted


SETTINGS = CycleSettings()
Steps = namedtuple("Steps", "M C0 C1 w state A")
Steps.__doc__ = """Samples of a cycle: slider w (n, 2), its state (n,), and dw = M dw(before) + C0 du(before) + C1 du.

A (2, 2) is dw(end)/dw(begin) of the period.
"""


@njit(cache=True)
def log_mean(a, b):
    """(b - a)/log(b/a) with its derivatives by a and b; by the series in z = (b - a)/(b + a) where they are close."""
    z = (b - a) / (b + a)
    if abs(z) < 1e-2:
        s, rate = 1 + z**2 / 3 + z**4 / 5 + z**6 / 7, 2 * z / 3 + 4 * z**3 / 5 + 6 * z**5 / 7
        common = -0.5 * (a + b) * rate / s**2 * 2 / (a + b) ** 2
        return 0.5 * (a + b) / s, 0.5 / s - common * b, 0.5 / s + common * a
    ratio = np.log(b / a)
    mean = (b - a) / ratio
    return mean, (mean / a - 1) / ratio, (1 - mean / b) / ratio


@njit(cache=True)
def leaves_rest(T1, T2, d1, d2, L0, L1):
    """Share s of the path at which slip begins, and the slope there of |T|^2 - L^2 by s; 0 where s does not move."""
    dL = L1 - L0
    a, b = d1 * d1 + d2 * d2 - dL * dL, T1 * d1 + T2 * d2 - L0 * dL
    c = T1 * T1 + T2 * T2 - L0 * L0
    if c >= -1e-12 * L0 * L0:
        return (0.0, 0.0) if b >= 0 else (-2 * b / a, -2 * b)
    root = np.sqrt(b * b - a * c)
    return (-c / (b + root) if b >= 0 else (root - b) / a), 2 * root


@njit(cache=True)
def scale_to_limit(T1, T2, L1, J):
    """Force at the end of a path of no length under another limit, and its derivatives."""
    e = np.sqrt(T1 * T1 + T2 * T2)
    n1, n2 = T1 / e, T2 / e
    J[0, 0], J[0, 1], J[1, 0], J[1, 1] = L1 / e * n2 * n2, -L1 / e * n1 * n2, -L1 / e * n1 * n2, L1 / e * n1 * n1
    J[:, 2:4] = J[:, :2]
    J[0, 5], J[1, 5] = n1, n2
    return L1 * n1, L1 * n2


@njit(cache=True)
def along_motion(d1, d2, L1, sign, J):
    """Force along the motion d, or straight against it, and its derivatives."""
    size = np.sqrt(d1 * d1 + d2 * d2)
    m1, m2 = d1 / size, d2 / size
    for k in range(2, 6):
        dd1, dd2, dL1 = 1.0 * (k == 2), 1.0 * (k == 3), 1.0 * (k == 5)
        along = m1 * dd1 + m2 * dd2
        dm1, dm2 = (dd1 - m1 * along) / size, (dd2 - m2 * along) / size
        J[0, k], J[1, k] = dL1 * sign * m1 + sign * L1 * dm1, dL1 * sign * m2 + sign * L1 * dm2
    return L1 * sign * m1, L1 * sign * m2


@njit(cache=True)
def slide(T1, T2, d1, d2, L0, L1, J):
    """Force at the end of a path d that slips, and its derivatives J (2, 6) by T1, T2, d1, d2, L0, L1."""
    size = np.sqrt(d1 * d1 + d2 * d2)
    J[:] = 0.0
    if size == 0:                                # only the limit moved
        return scale_to_limit(T1, T2, L1, J)
    s, slope = leaves_rest(T1, T2, d1, d2, L0, L1)
    m1, m2, L = d1 / size, d2 / size, L0 + s * (L1 - L0)
    if L <= 0 or L1 <= 0:
        return along_motion(d1, d2, L1, 1.0, J)
    mean, by_L, by_L1 = log_mean(L, L1)
    n1, n2 = (T1 + s * d1) / L, (T2 + s * d2) / L
    z = (1 - s) * size
    decay = np.exp(-z / mean)
    x = n1 * m1 + n2 * m2
    below = 1 + x + decay * decay * (1 - x)
    if below <= 0:
        return along_motion(d1, d2, L1, -1.0, J)
    a = 1 + x - decay * decay * (1 - x) - 2 * decay * x
    r1, r2 = (2 * decay * n1 + a * m1) / below, (2 * decay * n2 + a * m2) / below
    for k in range(6):
        dT1, dT2, dd1, dd2 = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2), 1.0 * (k == 3)
        dL0, dL1 = 1.0 * (k == 4), 1.0 * (k == 5)
        along = m1 * dd1 + m2 * dd2
        dm1, dm2 = (dd1 - m1 * along) / size, (dd2 - m2 * along) / size
        ds = 0.0
        if slope > 0:
            change = n1 * (dT1 + s * dd1) + n2 * (dT2 + s * dd2) - (1 - s) * dL0 - s * dL1
            ds = -2 * L * change / slope
        dL = (1 - s) * dL0 + s * dL1 + ds * (L1 - L0)
        dn1, dn2 = (dT1 + s * dd1 + ds * d1 - n1 * dL) / L, (dT2 + s * dd2 + ds * d2 - n2 * dL) / L
        dx = n1 * dm1 + n2 * dm2 + m1 * dn1 + m2 * dn2
        decays = -decay / mean * ((1 - s) * along - ds * size - z / mean * (by_L * dL + by_L1 * dL1))
        lower = dx * (1 - decay * decay) + 2 * decay * (1 - x) * decays
        da = dx * (1 + decay * decay - 2 * decay) - 2 * (decay * (1 - x) + x) * decays
        J[0, k] = dL1 * r1 + L1 / below * (2 * decays * n1 + 2 * decay * dn1 + da * m1 + a * dm1 - r1 * lower)
        J[1, k] = dL1 * r2 + L1 / below * (2 * decays * n2 + 2 * decay * dn2 + da * m2 + a * dm2 - r2 * lower)
    return L1 * r1, L1 * r2


@njit(cache=True)
def step(u0, u1, w, contact, by, J):
    """Slider after the motion has gone from u0 to u1, and the state.

    contact : kt, kn, mu, preload; by : M, C0, C1, filled with its derivative M dw + C0 du0 + C1 du1; J : work space
    """
    (kt, kn, mu, preload), (M, C0, C1), (w1, w2) = contact, by, w
    M[:], C0[:], C1[:] = 0.0, 0.0, 0.0
    N0, N1 = preload + kn * u0[2], preload + kn * u1[2]
    if N1 <= 0:
        C1[0, 0] = C1[1, 1] = 1.0
        return u1[0], u1[1], OPEN
    was = N0 > 0
    share = 1.0 if was else N1 / (N1 - N0)       # of the sample in contact
    d1, d2 = kt * (u1[0] - u0[0]) * share, kt * (u1[1] - u0[1]) * share
    T1, T2, L0 = kt * (u0[0] - w1), kt * (u0[1] - w2), mu * N0
    if not was:
        T1, T2, L0 = 0.0, 0.0, 0.0
    e1, e2, L1 = T1 + d1, T2 + d2, mu * N1
    state = STICK
    if e1 * e1 + e2 * e2 <= L1 * L1:
        if was:
            M[0, 0] = M[1, 1] = 1.0
            return w1, w2, STICK
        J[:] = 0.0
        J[0, 2] = J[1, 3] = 1.0
    else:
        e1, e2 = slide(T1, T2, d1, d2, L0, L1, J)
        state = SLIP
    for k in range(2):
        C1[k, k] = 1.0
        C1[k, 2] = -J[k, 5] * mu * kn / kt
        for j in range(2):
            C0[k, j] += J[k, 2 + j] * share
            C1[k, j] -= J[k, 2 + j] * share
            if was:
                M[k, j] = J[k, j]
                C0[k, j] -= J[k, j]
        if was:
            C0[k, 2] = -J[k, 4] * mu * kn / kt
        else:
            moved = (J[k, 2] * (u1[0] - u0[0]) + J[k, 3] * (u1[1] - u0[1])) * kn / (N1 - N0) ** 2
            C0[k, 2] -= moved * N1
            C1[k, 2] += moved * N0
    return u1[0] - e1 / kt, u1[1] - e2 / kt, state


@njit(cache=True)
def begin(u0, w, contact, C):
    """Slider at t = 0, pulled along where the limit does not hold it; C (2, 3): derivative by u0 of the pulled one."""
    (kt, kn, mu, preload), (w1, w2) = contact, w
    C[:] = 0.0
    N = preload + kn * u0[2]
    r1, r2 = u0[0] - w1, u0[1] - w2
    r, reach = np.sqrt(r1 * r1 + r2 * r2), mu * max(N, 0.0) / kt
    if r <= reach:
        return w1, w2
    n1, n2, back = r1 / r, r2 / r, reach / r
    C[0, 0], C[0, 1], C[1, 0], C[1, 1] = 1 - back * n2 * n2, back * n1 * n2, back * n1 * n2, 1 - back * n1 * n1
    if N > 0:
        C[0, 2], C[1, 2] = -n1 * mu * kn / kt, -n2 * mu * kn / kt
    return u0[0] - back * r1, u0[1] - back * r2


@njit(cache=True)
def one_period(u, w, contact, steps, J):
    """Slider after a period from sample 0 round to sample 0; the steps are filled."""
    n, A, M = len(u), steps.A, steps.M
    A[0, 0], A[0, 1], A[1, 0], A[1, 1] = 1.0, 0.0, 0.0, 1.0
    w1, w2 = w
    for k in range(1, n + 1):
        i = k % n
        w1, w2, steps.state[i] = step(u[k - 1], u[i], (w1, w2), contact, (M[i], steps.C0[i], steps.C1[i]), J)
        steps.w[i, 0], steps.w[i, 1] = w1, w2
        if steps.state[i] != STICK or M[i, 0, 0] != 1.0:
            for j in range(2):
                top, low = A[0, j], A[1, j]
                A[0, j], A[1, j] = M[i, 0, 0] * top + M[i, 0, 1] * low, M[i, 1, 0] * top + M[i, 1, 1] * low
    return w1, w2


@njit(cache=True)
def chain(dw, E, steps):
    """Derivatives dw (n, 2, 2 + 3 nh) along the period from those in dw[0], which is left as at its end."""
    n, nh = E.shape
    M, C0, C1 = steps.M, steps.C0, steps.C1
    for k in range(1, n + 1):
        i, before = k % n, dw[k - 1].copy()
        for r in range(2):
            for c in range(before.shape[1]):
                dw[i, r, c] = M[i, r, 0] * before[0, c] + M[i, r, 1] * before[1, c]
            for d in range(3):
                c0, c1 = C0[i, r, d], C1[i, r, d]
                if c0 != 0 or c1 != 0:
                    for m in range(nh):
                        dw[i, r, 2 + d * nh + m] += c0 * E[k - 1, m] + c1 * E[i, m]


@njit(cache=True)
def determinant(A):
    """Of I - A: zero where a period leaves the slider, or a part of it, where it was."""
    return (1 - A[0, 0]) * (1 - A[1, 1]) - A[0, 1] * A[1, 0]


@njit(cache=True)
def settle(u, w, contact, newton, steps, J):
    """Iterate the period map until the slider path is periodic; returns (periods, converged, by Newton, slipped).

    In the plane a slider only creeps to where it repeats. Newton on the map of a period takes it there.
    """
    size, C, A = np.abs(u).max() + 1e-300, np.empty((2, 3)), steps.A
    slid, jumped = False, False
    w1, w2 = w
    for periods in range(1, SETTINGS.max_periods + 1):
        a1, a2 = w1, w2
        w1, w2 = one_period(u, (a1, a2), contact, steps, J)
        e1, e2 = w1 - a1, w2 - a2
        slid = slid or (steps.state != STICK).any()
        if periods == 1:
            continue
        if max(abs(e1), abs(e2)) <= SETTINGS.repeats * size:
            return periods, True, jumped, slid
        det = determinant(A)
        if newton and abs(det) > SETTINGS.regular:
            jumped = True
            w1, w2 = a1 + ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det, a2 + (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det
            w1, w2 = begin(u[0], (w1, w2), contact, C)
    return SETTINGS.max_periods, False, jumped, slid


@njit(cache=True)
def fixed_point(by, A, dw):
    """dw (n, 2, 3 nh) of the slider that repeats; by (n, 2, 2 + 3 nh) from unit columns of the slider at t = 0."""
    det = determinant(A)
    for m in range(2, by.shape[2]):
        e1, e2 = by[0, 0, m], by[0, 1, m]            # of the end of the period, which is sample 0 again
        s1, s2 = ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det, (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det
        for i in range(len(by)):
            dw[i, 0, m - 2] = by[i, 0, m] + by[i, 0, 0] * s1 + by[i, 0, 1] * s2
            dw[i, 1, m - 2] = by[i, 1, m] + by[i, 1, 0] * s1 + by[i, 1, 1] * s2


@njit(cache=True)
def one_contact(u, E, contact, start, steps, dw):
    """Fill the steps of the periodic cycle of a contact and the derivatives dw (n, 2, 3 nh) of its slider; return
    whether these are not zero.

    The derivative is that of a fixed point of the map of a period. Where a contact has come to rest, and where it
    creeps to a rest that Newton would miss, the derivative is carried through all periods from the start.
    """
    (given, from_position), nh = start, E.shape[1]
    J, C, by = np.empty((2, 6)), np.empty((2, 3)), np.empty((len(u), 2, 2 + 3 * nh))
    w = begin(u[0], given, contact, C)
    pulled = w[0] != given[0] or w[1] != given[1]
    periods, repeats, by_newton, slid = settle(u, w, contact, True, steps, J)
    if by_newton and (not repeats or abs(determinant(steps.A)) <= SETTINGS.regular):
        periods, repeats, _, slid = settle(u, w, contact, False, steps, J)
        by_newton = False
    by[0] = 0.0
    if by_newton or np.abs(steps.A).max() < 1e-12:
        by[0, 0, 0] = by[0, 1, 1] = 1.0
        chain(by, E, steps)
        fixed_point(by, steps.A, dw)
    elif slid or pulled or from_position:
        for d in range(2):
            for j in range(3):
                value = C[d, j] if pulled else 1.0 * (from_position and d == j)
                by[0, d, 2 + j * nh:2 + (j + 1) * nh] = value * E[0]
        for _ in range(periods):
            w = one_period(u, w, contact, steps, J)
            chain(by, E, steps)
        dw[:] = by[:, :, 2:]
    return slid or pulled or from_position


@njit(cache=True)
def cycle(u, E, settings, start, found):
    """Sliders of the periodic cycle at the motion u (P, n, 3), and their derivatives by its harmonics; E (n, nh).

    settings : kt, kn, mu, preload (P,); start : SliderStart
    found : filled with the sliders w (P, n, 2), dw (P, n, 2, 3 nh), active (P, 3), shares (P, 3) of stick, slip, open
    """
    kt, kn, mu, preload = settings
    w, dw, active, shares = found
    P, n = u.shape[0], u.shape[1]
    M, C0, C1 = np.empty((n, 2, 2)), np.empty((n, 2, 3)), np.empty((n, 2, 3))
    state, A = np.empty(n, np.int64), np.empty((2, 2))
    for p in range(P):
        lift = preload[p] + kn[p] * u[p, :, 2] <= 0
        shares[p, 2] = lift.sum() / n
        active[p, 2] = lift.any() and kn[p] > 0
        shares[p, 1] = 0.0
        if kt[p] > 0:
            given = start.positions[p, 0], start.positions[p, 1]
            if start.from_position:
                given = u[p, 0, 0], u[p, 0, 1]
            steps = Steps(M, C0, C1, w[p], state, A)
            active[p, :2] = one_contact(u[p], E, (kt[p], kn[p], mu[p], preload[p]), (given, start.from_position),
                                        steps, dw[p])
            shares[p, 1] = (state == SLIP).sum() / n
        shares[p, 0] = 1 - shares[p, 1] - shares[p, 2]
