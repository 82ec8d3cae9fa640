"""The events of piecewise-linear contact laws within a step: which guard of the present state of a
contact rises through zero first, and what comes after it (see `tipdamp.hbm.laws.piecewise`).

The motion in a step is taken for the cubic with its values and rates at both ends.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit

Table = namedtuple(
    "Table",
    "gamma a by_memory follows follow_u follow_0 first next_state of_rate entry guard_u "
    "guard_memory guard_0 watched",
)
Table.__doc__ = """PiecewiseLinear less the force of the stuck springs, its guards in the order of
their states.

gamma : (P, S, nd, nd), a : (P, S, nd), by_memory : (P, S, nd, m) - g = gamma u + by_memory m + a
first : (S+1,) first guard of each state; the others as in PiecewiseLinear
"""

Present = namedtuple("Present", "z state memory gamma a")
Present.__doc__ = """What the integration changes in place.

z : (2n,) poles; state : (P,) and memory : (P, m) of the contacts; gamma : (nc, nd), a : (nc,) of
the present states """

NEVER = 2.0


@njit(cache=True)
def freeze(table: Table, present: Present) -> None:
    """Fill gamma and a of the present states."""
    nd, m = table.a.shape[2], table.by_memory.shape[3]
    for p in range(len(present.state)):
        s = present.state[p]
        for i in range(nd):
            present.a[p * nd + i] = table.a[p, s, i]
            for k in range(m):
                present.a[p * nd + i] += table.by_memory[p, s, i, k] * present.memory[p, k]
            for j in range(nd):
                present.gamma[p * nd + i, j] = table.gamma[p, s, i, j]


@njit(cache=True)
def follow(table: Table, present: Present, p: int, u: np.ndarray) -> None:
    """Memory of a contact where the motion u carries it along."""
    nd, m = table.a.shape[2], table.by_memory.shape[3]
    s = present.state[p]
    for k in range(m):
        if table.follows[s, k]:
            present.memory[p, k] = table.follow_0[p, s, k]
            for i in range(nd):
                present.memory[p, k] += table.follow_u[p, s, k, i] * u[p * nd + i]


@njit(cache=True)
def signal(
    table: Table, memory: np.ndarray, p: int, g: int, motion: np.ndarray
) -> tuple[float, float]:
    """Value (m) and rate (m/s) of a guard."""
    nd, m = table.a.shape[2], table.by_memory.shape[3]
    value, rate = table.guard_0[p, g], 0.0
    for i in range(nd):
        value += table.guard_u[p, g, i] * motion[0, p * nd + i]
        rate += table.guard_u[p, g, i] * motion[1, p * nd + i]
    for k in range(m):
        value += table.guard_memory[p, g, k] * memory[p, k]
    return value, rate


@njit(cache=True)
def excess(table: Table, memory: np.ndarray, p: int, g: int, motion: np.ndarray) -> float:
    """What comes to zero at an event: value of the guard, or its rate."""
    value, rate = signal(table, memory, p, g, motion)
    return rate if table.of_rate[g] else value


@njit(cache=True)
def cubic(c0: float, r0: float, c1: float, r1: float) -> tuple[float, float]:
    """Coefficients (A, B) of the cubic c0 + r0 x + A x^2 + B x^3 with values c and rates r at 0 and
    1."""
    return 3 * (c1 - c0) - 2 * r0 - r1, r0 + r1 - 2 * (c1 - c0)


@njit(cache=True)
def crossing(c0: float, r0: float, c1: float, r1: float, tiny: float) -> float:
    """First place in [0, 1] where the cubic with values c and rates r at its ends exceeds `tiny`;
    NEVER if nowhere."""
    if c0 > tiny:
        return 0.0
    A, B = cubic(c0, r0, c1, r1)
    left, right = 0.0, 1.0
    peak = falling_root(r0, 2 * A, 3 * B)
    if 0 < peak < 1:
        if c0 + peak * (r0 + peak * (A + peak * B)) > tiny:
            right = peak
        elif c1 > tiny:
            left = peak
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
def falling_root(r: float, b: float, c: float) -> float:
    """Root of r + b x + c x^2 at which it falls through zero: the maximum of its integral; NEVER if
    there is none."""
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
def turning(c0: float, r0: float, c1: float, r1: float, tiny: float, noise: float) -> float:
    """First place in [0, 1] where the rate of that cubic rises above tiny; NEVER if nowhere.

    noise : of the values, so that none is seen inside a very short step
    """
    if r0 > tiny:
        return 0.0
    A, B = cubic(c0, r0, c1, r1)
    right = 1.0
    if r1 <= tiny:
        turn = -A / (3 * B) if B != 0 else NEVER
        if not (B < 0 and 0 < turn < 1 and r0 + turn * (2 * A + turn * 3 * B) > tiny + noise):
            return NEVER
        right = turn
    left = 0.0
    for _ in range(50):
        x = 0.5 * (left + right)
        if r0 + x * (2 * A + x * 3 * B) > 0:
            right = x
        else:
            left = x
    return right


@njit(cache=True)
def next_event(
    table: Table,
    present: Present,
    span: tuple[float, np.ndarray, np.ndarray],
    tiny: float,
    tiny_rate: float,
) -> tuple[float, int, int]:
    """(place in [0, 1] of the step or NEVER, contact, guard) of the first event in span = (h,
    motion before, after)."""
    h, before, after = span
    place, contact, guard = NEVER, -1, -1
    for p in range(len(present.state)):
        s = present.state[p]
        for g in range(table.first[s], table.first[s + 1]):
            if not table.watched[p, g]:
                continue
            c0, r0 = signal(table, present.memory, p, g, before)
            c1, r1 = signal(table, present.memory, p, g, after)
            if table.of_rate[g]:
                at = turning(c0, r0 * h, c1, r1 * h, tiny_rate * h, 0.1 * tiny)
            else:
                at = crossing(c0, r0 * h, c1, r1 * h, tiny)
            if at < place:
                place, contact, guard = at, p, g
    if guard >= 0:
        guard = first_of_equal(table, present, contact, guard, place, span, tiny)
    return place, contact, guard


@njit(cache=True)
def first_of_equal(
    table: Table,
    present: Present,
    p: int,
    guard: int,
    place: float,
    span: tuple[float, np.ndarray, np.ndarray],
    tiny: float,
) -> int:
    """The first guard in the list that reaches zero together with `guard`: where a contact opens,
    it also slips."""
    h, before, after = span
    for g in range(table.first[present.state[p]], guard):
        if table.watched[p, g] and not table.of_rate[g]:
            c0, r0 = signal(table, present.memory, p, g, before)
            c1, r1 = signal(table, present.memory, p, g, after)
            A, B = cubic(c0, r0 * h, c1, r1 * h)
            if (
                c0 + place * (r0 * h + place * (A + place * B)) > -tiny
                and r0 * h + place * (2 * A + place * 3 * B) > 0
            ):
                return g
    return guard


@njit(cache=True)
def switch(
    table: Table, present: Present, p: int, guard: int, motion: np.ndarray, tiny: float
) -> None:
    """Put the contact into the state that follows an event; the motion and the force go on
    continuously."""
    left = present.state[p]
    present.state[p] = table.next_state[guard]
    follow(table, present, p, motion[0])
    if not table.entry[guard]:
        return
    g = table.first[present.state[p]]
    end = table.first[present.state[p] + 1]
    changes = 0
    while g < end and changes < len(table.first):
        if table.watched[p, g] and not table.of_rate[g] and table.next_state[g] != left:
            value, rate = signal(table, present.memory, p, g, motion)
            if value > -tiny and rate > 0:
                present.state[p] = table.next_state[g]
                follow(table, present, p, motion[0])
                g, end, changes = (
                    table.first[present.state[p]] - 1,
                    table.first[present.state[p] + 1],
                    changes + 1,
                )
        g += 1
