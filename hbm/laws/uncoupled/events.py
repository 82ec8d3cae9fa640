"""Stick, slip and lift-off of every contact over a cycle, with each event located.

A slider behind a tangential spring kt, held by the friction limit mu N(t), is a play operator: a
point w that rests while it lies within the stick interval

    low(t) = u - mu N/kt  <=  w  <=  high(t) = u + mu N/kt,        N = max(0, preload + kn u_n)

and is pushed by its ends [Yang, Menq 1998; Petrov, Ewins 2003]: w rests (stick), moves with `low`
(slip forward) or with `high` (slip backward). While the contact is open the interval has no width
and w follows u, so that on re-contact the slider starts at the current position. The force is T =
kt (u - w).
"""

from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.uncoupled.breaks import (
    AT,
    BACKWARD,
    BEGIN,
    BY_N,
    BY_U,
    END,
    FORWARD,
    OPEN,
    PLACES,
    RATES,
    STICK,
    TWO_PI,
    Breaks,
    Sliders,
    break_points,
    open_pieces,
    root,
    series,
    stick_interval,
)

if TYPE_CHECKING:
    from tipdamp.hbm.laws.records import SliderStart

SWITCHES = 12  # at most, between stick and slip within one interval between samples


@njit(cache=True)
def pause(
    edge: np.ndarray, sign: float, r0: float, r1: float, gone: float, a: float, b: float
) -> float:
    """An instant in (a, b) at which an edge moves back for a while, though forward at both ends; b
    where there is none.

    r0, r1, gone : rates at the ends and way between, all of them forward; their quadratic shows a
    dip
    """
    h = b - a
    if h <= 0:
        return b
    c = 3 * (r0 + r1 - 2 * gone / h)
    slope = r1 - r0 - c
    if (
        c <= 0
        or slope >= 0
        or slope + 2 * c <= 0
        or r0 - slope * slope / (4 * c) > 0.5 * min(r0, r1)
    ):
        return b
    left, right = a, b
    x = a - h * slope / (2 * c)
    for _ in range(40):
        _, speed, turn = series(edge, x)
        if sign * speed < 0:
            return x
        if sign * turn < 0:
            left = x
        else:
            right = x
        x = 0.5 * (left + right)
    return b


@njit(cache=True)
def stick_ends(
    marks: np.ndarray, edges: np.ndarray, i: int, w: float, t: float, since: np.ndarray
) -> tuple[float, int]:
    """First instant after t in interval i at which an edge of the stick interval reaches the
    resting slider w, and the state that follows; the end of the interval and STICK where none does.

    since (2,) : instants from which on an edge may reach the slider that it has just left behind
    """
    a, b = marks[i, AT], marks[i + 1, AT]
    when, state = b, STICK
    for s in range(2):
        sign = 1.0 - 2.0 * s
        begin, end = max(t, since[s]), b
        if begin >= b:
            continue
        if sign * (marks[i + 1, PLACES + s] - w) <= 0:
            if sign * marks[i, RATES + s] <= 0 or sign * marks[i + 1, RATES + s] >= 0:
                continue
            end = root(edges[s], 0.0, True, t, b)
            if sign * (series(edges[s], end)[0] - w) <= 0:
                continue
        elif begin == a and sign * marks[i, RATES + s] < 0 and sign * marks[i + 1, RATES + s] > 0:
            # the edge leaves the slider that it touches, and returns
            begin = root(edges[s], 0.0, True, begin, b)
        first = root(edges[s], w, False, begin, end)
        if state == STICK or first < when:
            when, state = first, FORWARD + s
    return when, state


@njit(cache=True)
def slip_ends(
    marks: np.ndarray, edges: np.ndarray, i: int, s: int, t: float
) -> tuple[float, float]:
    """First instant after t in interval i at which edge s, which pushes the slider, moves back, and
    the instant up to which it does; that is -1 where it does not."""
    a, b = marks[i, AT], marks[i + 1, AT]
    rate, rate_at_end = marks[i, RATES + s], marks[i + 1, RATES + s]
    sign, back = 1.0 - 2.0 * s, b
    if sign * rate_at_end >= 0:
        gone = sign * (marks[i + 1, PLACES + s] - marks[i, PLACES + s])
        back = pause(edges[s], sign, sign * rate, sign * rate_at_end, gone, a, b)
        if not t < back < b:
            return b, -1.0
    return (root(edges[s], 0.0, True, t, back) if sign * rate > 0 or t > a else t), back


@njit(cache=True)
def periodic(
    u: np.ndarray,
    N: np.ndarray,
    ratio: float,
    breaks: Breaks,
    start: tuple[float, bool],
    space: tuple[np.ndarray, np.ndarray],
    pieces: np.ndarray,
) -> int:
    """Fill the pieces of the second of two periods of one slider, and return how many there are.

    u, N : series of the motion and of preload + kn u_n; ratio : mu/kt; start : slider at t = 0, and
    whether at u(0)
    space : first (most, 7) and past (2, m), pieces of the first period, and the state at each break
        point with the piece it belongs to
    Where both periods slip alike, or are open, the second repeats the first from there on: a moving
    slider has no memory.
    """
    marks, closed, edges = breaks.marks, breaks.closed, breaks.edges
    first, past = space
    m, n_first = len(closed), 0
    rest, since = np.zeros(3), np.zeros(2)
    w = initial_slider(u, ratio, breaks, start, rest)
    state = STICK if closed[0] else OPEN
    count, begin, into = 0, 0.0, first
    for period in range(2):
        if period == 1:
            if count == 0 and state == STICK:
                return close_piece(pieces, 0, state, 0.0, TWO_PI, w, rest)
            n_first = close_piece(first, count, state, begin, TWO_PI, w, rest)
            begin, count, into = 0.0, 0, pieces
        for i in range(m):
            t = marks[i, AT]
            new = state
            if not closed[i]:
                new = OPEN
            elif state == OPEN:
                new, w = after_contact(u, N, ratio, breaks, i, rest)
            if new != state:
                count = close_piece(into, count, state, begin, t, w, rest)
                begin, state = t, new
            if period == 0:
                past[0, i], past[1, i] = state, count
            elif state != STICK and state == past[0, i]:
                return repeated(pieces, count, first, past[1, i], n_first, begin)
            since[:] = t
            for _ in range(SWITCHES if closed[i] else 0):
                if state == STICK:
                    when, new = stick_ends(marks, edges, i, w, t, since)
                    if new == STICK:
                        break
                    count = close_piece(into, count, state, begin, when, w, rest)
                    begin, t, state = when, when, new
                    continue
                s = state - FORWARD
                stops, back = slip_ends(marks, edges, i, s, t)
                if back < 0:
                    break
                t = stops
                count = close_piece(into, count, state, begin, t, w, rest)
                w = series(edges[s], t)[0]
                rest[0], rest[1], rest[2] = t, 1.0, (2.0 * s - 1.0) * ratio
                begin, state, since[s] = t, STICK, back
    return close_piece(pieces, count, state, begin, TWO_PI, w, rest)


@njit(cache=True)
def initial_slider(
    u: np.ndarray, ratio: float, breaks: Breaks, start: tuple[float, bool], rest: np.ndarray
) -> float:
    """The slider at t = 0, pushed into the stick interval, and in `rest` how it came there."""
    w = start[0]
    if start[1]:
        w = series(u, 0.0)[0]
        rest[1] = 1.0
    for s in range(2):
        if breaks.closed[0] and (1.0 - 2.0 * s) * (breaks.marks[0, PLACES + s] - w) > 0:
            w = breaks.marks[0, PLACES + s]
            rest[1], rest[2] = 1.0, (2.0 * s - 1.0) * ratio
    return w


@njit(cache=True)
def after_contact(
    u: np.ndarray, N: np.ndarray, ratio: float, breaks: Breaks, i: int, rest: np.ndarray
) -> tuple[int, float]:
    """(state, slider) of a contact that closes at break i: pushed only where the opening interval
    overtakes it, so that at rest u' is at most mu/kt N'."""
    marks = breaks.marks
    state = STICK
    if marks[i, RATES] > 0:
        state = FORWARD
    elif marks[i, RATES + 1] < 0:
        state = BACKWARD
    w, u_rate, _ = series(u, marks[i, AT])
    if state == STICK:
        closing = series(N, marks[i, AT])[1]
        rest[0], rest[1], rest[2] = marks[i, AT], 1.0, 0.0
        if closing > 0:
            rest[2] = min(max(-u_rate / closing, -ratio), ratio)
    return state, w


@njit(cache=True)
def close_piece(
    pieces: np.ndarray, count: int, state: int, begin: float, end: float, w: float, rest: np.ndarray
) -> int:
    """Add a piece where it has a length; return how many there are."""
    if end <= begin or count >= len(pieces):
        return count
    pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3] = state, begin, end, w
    pieces[count, 4:] = rest
    return count + 1


@njit(cache=True)
def repeated(
    pieces: np.ndarray, count: int, first: np.ndarray, past: int, n_first: int, begin: float
) -> int:
    """Append the pieces of the first period from number `past` on, the first of them from `begin`;
    return the count."""
    for q in range(past, min(n_first, len(pieces) - count + past)):
        pieces[count] = first[q]
        if q == past:
            pieces[count, BEGIN] = begin
        count += 1
    return count


@njit(cache=True)
def slips(piece: np.ndarray) -> bool:
    """Whether the slider is pushed along."""
    return piece[0] == FORWARD or piece[0] == BACKWARD


@njit(cache=True)
def shared_slip(a: np.ndarray, b: np.ndarray) -> float:
    """Time in which at least one of two lists of pieces slips."""
    total = 0.0
    for one in a:
        if slips(one):
            total += one[END] - one[BEGIN]
    for other in b:
        if not slips(other):
            continue
        total += other[END] - other[BEGIN]
        for one in a:
            if slips(one):
                total -= max(0.0, min(one[END], other[END]) - max(one[BEGIN], other[BEGIN]))
    return total


@njit(cache=True)
def sticks(x: np.ndarray, law: Sliders, p: int, places: np.ndarray) -> bool:
    """Whether contact p surely sticks through the cycle, with its sliders at rest where they carry
    no force: the sum of the amplitudes of its motion x (nd, nh) is too small for slip and
    lift-off."""
    if law.count and law.mu[p] == 0:
        return False
    least = law.preload[p] - (law.kn[p] * reach(x[len(x) - 1]) if law.normal else 0.0)
    for d in range(law.count):
        if places[d] != 0 or law.kt[p] * reach(x[d]) > law.mu[p] * least:
            return False
    return least > 0


@njit(cache=True)
def reach(c: np.ndarray) -> float:
    """What the series with real coefficients c does not exceed."""
    most = abs(c[0])
    for k in range(1, len(c), 2):
        most += np.sqrt(c[k] * c[k] + c[k + 1] * c[k + 1])
    return most


@njit(cache=True)
def slider_pieces(
    u: np.ndarray,
    waves: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    law: Sliders,
    p: int,
    cut: tuple[np.ndarray, Breaks],
    begin: tuple[float, bool],
    room: tuple[tuple[np.ndarray, np.ndarray], np.ndarray],
) -> int:
    """Fill the pieces of one tangent of contact p, and return how many there are; without friction
    the slider follows throughout.

    waves : of u, its rate, u_n and its rate; cut : series of preload + kn u_n, and Breaks; begin :
    `start` of `periodic`; room : its `space` and `pieces`
    """
    (N, breaks), (space, pieces) = cut, room
    if law.mu[p] == 0:
        pieces[0, 0], pieces[0, BEGIN], pieces[0, END] = OPEN, 0.0, TWO_PI
        return 1
    ratio = law.mu[p] / law.kt[p]
    stick_interval(u, N, (ratio, law.kn[p] if law.normal else 0.0, law.preload[p]), waves, breaks)
    return periodic(u, N, ratio, breaks, begin, space, pieces)


@njit(cache=True)
def moves(pieces: np.ndarray) -> bool:
    """Whether a slider is not at a given place throughout."""
    for q in range(len(pieces)):
        if pieces[q, 0] != STICK or pieces[q, BY_U] != 0 or pieces[q, BY_N] != 0:
            return True
    return False


@njit(cache=True)
def slip_time(law: Sliders, p: int, pieces: np.ndarray, counts: np.ndarray, opened: float) -> float:
    """Time in which contact p slips; without a limit it does while it is closed."""
    if law.mu[p] > 0 and law.count:
        other = law.count - 1
        return shared_slip(pieces[0, : counts[0]], pieces[other, : counts[other]])
    return 0.0 if not law.count or law.kt[p] == 0 else TWO_PI - opened


@njit(cache=True)
def find_pieces(
    x: np.ndarray,
    samples: tuple[np.ndarray, np.ndarray, np.ndarray],
    law: Sliders,
    start: "SliderStart",
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Fill the pieces of the periodic cycle of every contact, which components are active, and the
    shares of the cycle.

    x (P, nd, nh) : harmonics of the relative motion; samples : instants (n + 1,), and the motion
    and its rate by tau (P, nd, n) at all but the last; law : Sliders; start : SliderStart
    found : pieces (P, tangents + 1, most, 7) and counts (P, tangents + 1) of the slider of each
        tangent, and last the times in which the contact is open; active (P, nd); shares (P, 3) of
        stick, slip, open. A piece is its state, begin, end, the place w of a resting slider, and
        how w came about: the instant, and the weights of u and of preload + kn u_n there.
    """
    tau, wave, rate = samples
    pieces, counts, active, shares = found
    P, nd, nh = x.shape
    size = len(tau) + 4 * nh + 7
    b = Breaks(
        np.empty((size, 5)), np.empty(size, np.int64), np.empty(size, np.bool_), np.empty((2, nh))
    )
    space = (np.empty((pieces.shape[2], 7)), np.empty((2, size), np.int64))
    N = np.empty(nh)
    counts[:], active[:] = 0, False
    last = nd - 1  # the normal, where there is one
    for p in range(P):
        if not start.from_position and sticks(x[p], law, p, start.positions[p]):
            shares[p, 0], shares[p, 1], shares[p, 2] = 1.0, 0.0, 0.0
            continue
        m = break_points(x[p], (tau, wave[p], rate[p]), law, p, N, b)
        breaks = Breaks(b.marks, b.kind, b.closed[:m], b.edges)
        opened = open_pieces(breaks, pieces[p, law.count], counts[p : p + 1, law.count])
        active[p, last] = opened > 0 and law.normal
        for d in range(law.count if law.kt[p] > 0 else 0):
            waves = wave[p, d], rate[p, d], wave[p, last], rate[p, last]
            begin = start.positions[p, d], start.from_position
            own = pieces[p, d]
            counts[p, d] = slider_pieces(x[p, d], waves, law, p, (N, breaks), begin, (space, own))
            active[p, d] = moves(own[: counts[p, d]])
        slip = slip_time(law, p, pieces[p], counts[p], opened)
        shares[p, 2] = opened / TWO_PI
        shares[p, 1] = slip / TWO_PI
        shares[p, 0] = 1.0 - shares[p, 1] - shares[p, 2]
