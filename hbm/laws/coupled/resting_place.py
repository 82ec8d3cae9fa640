"""Where a coupled slider rests throughout the cycle: the nearest place that the limit allows."""

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.coupled.motion import (
    LIMIT,
    LIMIT_RATE,
    P1,
    P2,
    RATE1,
    RATE2,
    SETTINGS,
    TINY,
    Contact,
    basis_rate,
    motion,
    narrowed,
    secant,
)


@njit(cache=True)
def beyond(at: np.ndarray, r: np.ndarray) -> tuple[float, float]:
    """|p - r| - L, and its rate."""
    T1, T2 = at[P1] - r[0], at[P2] - r[1]
    T = max(np.hypot(T1, T2), TINY)
    return T - at[LIMIT], (T1 * at[RATE1] + T2 * at[RATE2]) / T - at[LIMIT_RATE]


@njit(cache=True)
def furthest(contact: Contact, r: np.ndarray, e: np.ndarray, at: np.ndarray) -> tuple[float, float]:
    """(instant, |p - r| - L) at which a slider at rest is furthest beyond its limit."""
    tau, n = contact.tau, len(contact.tau) - 1
    found, most = 0.0, -np.inf
    value_a = rate_a = 0.0
    for i in range(n + 1):
        for d in range(3):
            at[d], at[3 + d] = contact.wave[d, i % n], contact.rate[d, i % n]
        value_b, rate_b = beyond(at, r)
        if value_b > most:
            found, most = tau[i], value_b
        if i and rate_a > 0 > rate_b:
            h = tau[i] - tau[i - 1]
            meet = (value_b - value_a - 2 * rate_b * h) / (rate_a - rate_b) / 2
            if value_a + 2 * rate_a * min(max(meet, 0.0), h) > most:
                top = crest(contact, r, tau[i - 1], tau[i], e, at)
                motion(contact.c, top, e, at)
                value = beyond(at, r)[0]
                if value > most:
                    found, most = top, value
        value_a, rate_a = value_b, rate_b
    return found, most


@njit(cache=True)
def crest(
    contact: Contact, r: np.ndarray, a: float, b: float, e: np.ndarray, at: np.ndarray
) -> float:
    """Where |p - r| - L is largest between two instants, between which its rate falls through 0."""
    x, side = 0.5 * (a + b), 0
    fa = fb = np.nan
    for _ in range(100):
        motion(contact.c, x, e, at)
        f = -beyond(at, r)[1]
        if f == 0 or b - a <= 4e-16 * (1 + b):
            break
        a, fa, b, fb, side = narrowed(f > 0, x, f, a, fa, b, fb, side)
        x = secant(a, fa, b, fb)
    return x


@njit(cache=True)
def nearest_common(
    first: np.ndarray, discs: np.ndarray, room: float, r: np.ndarray
) -> tuple[int, int]:
    """Fill r with the point of all discs (n, 3: centre, radius) that is nearest to `first`; returns
    the one or two discs on whose border it lies, or -1 where they have no point in common."""
    n, least, one, two = len(discs), np.inf, -1, -1
    tried = np.empty((2, 2))
    for i in range(n):
        for j in range(i, n):
            count = (
                borders(first, discs[i], discs[j], tried) if j > i else onto(first, discs[i], tried)
            )
            for k in range(count):
                away = np.hypot(tried[k, 0] - first[0], tried[k, 1] - first[1])
                if away >= least:
                    continue
                inside = True
                for m in range(n):
                    apart = np.hypot(discs[m, 0] - tried[k, 0], discs[m, 1] - tried[k, 1])
                    inside = inside and apart <= discs[m, 2] + room
                if inside:
                    least, one, two = away, i, j
                    r[0], r[1] = tried[k, 0], tried[k, 1]
    return one, two


@njit(cache=True)
def onto(first: np.ndarray, disc: np.ndarray, tried: np.ndarray) -> int:
    """Fill in the point of the border of a disc that is nearest to `first`, outside; returns 1."""
    away = max(np.hypot(first[0] - disc[0], first[1] - disc[1]), TINY)
    for d in range(2):
        tried[0, d] = disc[d] + disc[2] / away * (first[d] - disc[d])
    return 1


@njit(cache=True)
def borders(first: np.ndarray, a: np.ndarray, b: np.ndarray, tried: np.ndarray) -> int:
    """Fill in the points in which the borders of two discs meet; returns their number."""
    x, y = b[0] - a[0], b[1] - a[1]
    apart = np.hypot(x, y)
    if apart < TINY:
        return 0
    along = 0.5 * (apart + (a[2] - b[2]) * (a[2] + b[2]) / apart)
    square = (a[2] - along) * (a[2] + along)
    if square < 0:
        return 0
    aside = np.sqrt(square)
    for k in range(2):
        sign = 1.0 - 2.0 * k
        tried[k, 0] = a[0] + (along * x - sign * aside * y) / apart
        tried[k, 1] = a[1] + (along * y + sign * aside * x) / apart
    return 2


@njit(cache=True)
def carry_onto(
    contact: Contact, first: np.ndarray, t: float, start: np.ndarray, e: np.ndarray
) -> None:
    """Carry the derivative `start` (2, 3 nh) of a slider along as it is brought from `first` to the
    border of its limit at t, the instant furthest beyond it."""
    at, nh = np.empty(6), len(e)
    motion(contact.c, t, e, at)
    x, y = at[P1] - first[0], at[P2] - first[1]
    d = max(np.hypot(x, y), TINY)
    n1, n2, L = x / d, y / d, at[LIMIT]
    across = (at[RATE2] * n1 - at[RATE1] * n2) / d  # rate of the direction
    bend = d * across * across
    for m in range(1, nh):
        k = (m + 1) // 2
        bend -= k * k * e[m] * (n1 * contact.c[0, m] + n2 * contact.c[1, m] - contact.c[2, m])
    for q in range(3 * nh):
        m = q % nh
        of1, of2, of_limit = q < nh, nh <= q < 2 * nh, q >= 2 * nh
        dp1, dp2, dL = e[m] * of1, e[m] * of2, e[m] * of_limit
        changed = basis_rate(e, m) * (n1 * of1 + n2 * of2 - of_limit)
        changed += across * (n1 * (dp2 - start[1, q]) - n2 * (dp1 - start[0, q]))
        later = -changed / bend if abs(bend) > 1e-12 * contact.size else 0.0
        dp1 += at[RATE1] * later
        dp2 += at[RATE2] * later
        dL += at[LIMIT_RATE] * later
        turn = L / d * (n1 * (start[1, q] - dp2) - n2 * (start[0, q] - dp1))
        start[0, q], start[1, q] = dp1 - n1 * dL - n2 * turn, dp2 - n2 * dL + n1 * turn


@njit(cache=True)
def carry_to_corner(
    contact: Contact, r: np.ndarray, t1: float, t2: float, start: np.ndarray, e: np.ndarray
) -> bool:
    """The same to the corner of two limits, whether it is one: derivatives without `first`."""
    at, nh = np.empty(6), len(e)
    rows, n = np.empty((2, 3 * nh)), np.empty((2, 2))
    for i in range(2):
        motion(contact.c, t1 if i == 0 else t2, e, at)
        x, y = at[P1] - r[0], at[P2] - r[1]
        T = max(np.hypot(x, y), TINY)
        n[i, 0], n[i, 1] = x / T, y / T
        for m in range(nh):
            rows[i, m], rows[i, nh + m] = n[i, 0] * e[m], n[i, 1] * e[m]
            rows[i, 2 * nh + m] = -e[m]
    det = n[0, 0] * n[1, 1] - n[0, 1] * n[1, 0]
    if abs(det) < SETTINGS.corner:
        return False
    for q in range(3 * nh):
        start[0, q] = (n[1, 1] * rows[0, q] - n[0, 1] * rows[1, q]) / det
        start[1, q] = (n[0, 0] * rows[1, q] - n[1, 0] * rows[0, q]) / det
    return True


@njit(cache=True)
def with_slack(
    first: np.ndarray, discs: np.ndarray, slack: float, missed: float, room: float, r: np.ndarray
) -> tuple[float, int, int]:
    """(slack, one, two): `nearest_common` of discs that are wider by the slack, and by as much more
    up to about `missed`, but no more than they miss a common point."""
    i, j = nearest_common(first, discs, room, r)
    low = slack
    while i < 0 and slack < missed:
        low, wider = slack, max(9 * slack, room)
        slack += wider
        discs[:, 2] += wider
        i, j = nearest_common(first, discs, room, r)
    while i >= 0 and slack - low > 1e-3 * slack + room:
        less = 0.5 * (slack - low)
        discs[:, 2] -= less
        i, j = nearest_common(first, discs, room, r)
        if i >= 0:
            slack -= less
            continue
        low += less
        discs[:, 2] += less
        i, j = nearest_common(first, discs, room, r)
    return slack, i, j


@njit(cache=True)
def resting_place(
    contact: Contact, r: np.ndarray, missed: float, start: np.ndarray, e: np.ndarray
) -> bool:
    """Take the slider of a contact that never opens to the nearest place where the limit holds it
    throughout the period, or is missed by no more than that, and its derivative by the series,
    `start` (2, 3 nh), with it; returns whether there is one.

    A slider that a period drags less and less creeps towards such a place as one over the root of
    the periods. The places are common to all discs of centre p(t) and radius L(t), of which those
    are found one by one that matter [Hettich, Kortanek 1993, exchange method].
    """
    at, times = np.empty(6), np.empty(SETTINGS.discs)
    discs = np.empty((SETTINGS.discs, 3))
    room, slack = SETTINGS.on_limit * contact.scale + 1e-15 * contact.size, 0.0
    first = r.copy()
    t, value = furthest(contact, r, e, at)
    if value <= room:
        return True
    for k in range(SETTINGS.discs):
        motion(contact.c, t, e, at)
        times[k], discs[k, 0], discs[k, 1], discs[k, 2] = t, at[P1], at[P2], at[LIMIT] + slack
        slack, i, j = with_slack(first, discs[: k + 1], slack, missed, room, r)
        if i < 0:
            break
        t, value = furthest(contact, r, e, at)
        if value <= room + slack:
            if i == j:
                carry_onto(contact, first, times[i], start, e)
                return True
            if carry_to_corner(contact, r, times[i], times[j], start, e):
                return True
            break
    r[:] = first
    return False
