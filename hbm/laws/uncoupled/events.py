"""Stick, slip and lift-off of every contact over a cycle, with each event located.

A slider behind a tangential spring kt, held by the friction limit mu N(t), is a play operator: a
point w that rests while it lies within the stick interval

    low(t) = u - mu N/kt  <=  w  <=  high(t) = u + mu N/kt,        N = max(0, preload + kn u_n)

and is pushed by its ends [Yang, Menq 1998; Petrov, Ewins 2003]: w rests (stick), moves with `low`
(slip forward) or with `high` (slip backward). While the contact is open the interval has no width
and w follows u, so that on re-contact the slider starts at the current position. The force is T =
kt (u - w).

The samples only separate the events: the result does not depend on how many there are.
Compiled code is stored per file: nothing compiled here is called from compiled code elsewhere.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.records import ContactState

STICK, FORWARD, BACKWARD, OPEN = (int(state) for state in ContactState)
TWO_PI = 2 * np.pi
BEGIN, END, PLACE, INSTANT, BY_U, BY_N = range(1, 7)  # columns of a piece after its state
ROUNDING = 1e-9  # of the value at one end of a bracket: one that small at the other has no sign
SWITCHES = 12  # at most, between stick and slip within one interval between samples

Sliders = namedtuple("Sliders", "count normal kt kn mu preload")
Sliders.__doc__ = (
    "Number of tangents, whether there is a normal component (the last), and the settings (P,)."
)

Breaks = namedtuple("Breaks", "marks kind closed edges")
Breaks.__doc__ = """The cycle of a contact cut at its samples and at the instants of contact and
lift-off.

edges (2, nh) : series of low, which pushes forward, and high, which pushes backward
marks (., 5) : the instants, the values of both edges there (PLACES) and their rates (RATES)
kind : number of the sample, or -1; closed : of each interval between the instants
"""
AT, PLACES, RATES = 0, 1, 3  # columns of marks; of two, that of the edge follows


@njit(cache=True)
def series(c, tau):
    """Value, rate and second derivative at tau of the series with real coefficients c."""
    H = (len(c) - 1) // 2
    value, rate, curvature = c[0], 0.0, 0.0
    c1, s1 = np.cos(tau), np.sin(tau)
    ck, sk = 1.0, 0.0
    for k in range(1, H + 1):
        ck, sk = ck * c1 - sk * s1, sk * c1 + ck * s1
        wave = c[2 * k - 1] * ck - c[2 * k] * sk
        value += wave
        rate -= k * (c[2 * k - 1] * sk + c[2 * k] * ck)
        curvature -= k * k * wave
    return value, rate, curvature


@njit(cache=True)
def root(c, level, of_rate, a, b):
    """Where the series (less level), or its rate, changes sign in [a, b]: Newton inside a shrinking
    bracket."""
    v, d, dd = series(c, a)
    at_a = d if of_rate else v - level
    v, d, dd = series(c, b)
    at_b = d if of_rate else v - level
    rising = at_b > 0
    # at b itself, whose sample had the other sign
    if at_a * at_b >= 0 and abs(at_b) < ROUNDING * abs(at_a):
        rising = at_a < 0
    x = a + (b - a) * at_a / (at_a - at_b) if at_a * at_b < 0 else 0.5 * (a + b)
    for _ in range(80):
        v, d, dd = series(c, x)
        f = d if of_rate else v - level
        slope = dd if of_rate else d
        if (f > 0) == rising:
            b = x
        else:
            a = x
        new = x - f / slope if slope != 0 else a
        inside = a < new < b
        if not inside:
            new = 0.5 * (a + b)
        # Newton squares the error once more
        if abs(new - x) <= (1e-9 if inside else 4e-16 * (1 + abs(x))):
            return new
        x = new
    return x


@njit(cache=True)
def contact_instants(N, n_wave, n_rate, tau, breaks):
    """Fill `at`, `kind` and `closed` of the break points, and return how many intervals there are.

    N are the coefficients of preload + kn u_n; an excursion that begins and ends between two
    samples is found by its extremum.
    """
    at, kind, closed = breaks.marks[:, AT], breaks.kind, breaks.closed
    n = len(n_wave)
    m = 0
    is_closed = n_wave[0] > 0
    crossings = np.empty(2)
    for i in range(n):
        j = (i + 1) % n
        a, b = tau[i], tau[i + 1]
        count = 0
        if (n_wave[i] > 0) != (n_wave[j] > 0):
            crossings[0] = root(N, 0.0, False, a, b)
            count = 1
        else:
            sign = 1.0 if n_wave[i] > 0 else -1.0
            if sign * n_rate[i] < 0 and sign * n_rate[j] > 0:
                turn = root(N, 0.0, True, a, b)
                if sign * series(N, turn)[0] < 0:
                    crossings[0] = root(N, 0.0, False, a, turn)
                    crossings[1] = root(N, 0.0, False, turn, b)
                    count = 2
        is_closed = n_wave[i] > 0
        at[m], kind[m], closed[m] = a, i, is_closed
        m += 1
        for q in range(count):
            is_closed = not is_closed
            at[m], kind[m], closed[m] = crossings[q], -1, is_closed
            m += 1
    at[m], kind[m] = tau[n], 0
    return m


@njit(cache=True)
def pause(edge, sign, r0, r1, gone, a, b):
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
def stick_ends(marks, edges, i, w, t, since):
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
def slip_ends(marks, edges, i, s, t):
    """First instant after t in interval i at which edge s, which pushes the slider, moves back, and
    the instant up to which it does; that is -1 where it does not."""
    a = marks[i, AT]
    b = marks[i + 1, AT]
    rate = marks[i, RATES + s]
    rate_at_end = marks[i + 1, RATES + s]
    sign, back = 1.0 - 2.0 * s, b
    if sign * rate_at_end >= 0:
        back = pause(
            edges[s],
            sign,
            sign * rate,
            sign * rate_at_end,
            sign * (marks[i + 1, PLACES + s] - marks[i, PLACES + s]),
            a,
            b,
        )
        if not t < back < b:
            return b, -1.0
    return (root(edges[s], 0.0, True, t, back) if sign * rate > 0 or t > a else t), back


@njit(cache=True)
def periodic(u, N, ratio, breaks, start, space, pieces):
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
def initial_slider(u, ratio, breaks, start, rest):
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
def after_contact(u, N, ratio, breaks, i, rest):
    """(state, slider) of a contact that closes at break i: pushed only where the opening interval
    overtakes it, so that at rest u' is at most mu/kt N'."""
    marks = breaks.marks
    state = FORWARD if marks[i, RATES] > 0 else (BACKWARD if marks[i, RATES + 1] < 0 else STICK)
    w, u_rate, _ = series(u, marks[i, AT])
    if state == STICK:
        closing = series(N, marks[i, AT])[1]
        rest[0], rest[1], rest[2] = marks[i, AT], 1.0, 0.0
        if closing > 0:
            rest[2] = min(max(-u_rate / closing, -ratio), ratio)
    return state, w


@njit(cache=True)
def close_piece(pieces, count, state, begin, end, w, rest):
    """Add a piece where it has a length; return how many there are."""
    if end <= begin or count >= len(pieces):
        return count
    pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3] = state, begin, end, w
    pieces[count, 4:] = rest
    return count + 1


@njit(cache=True)
def repeated(pieces, count, first, past, n_first, begin):
    """Append the pieces of the first period from number `past` on, the first of them from `begin`;
    return the count."""
    for q in range(past, min(n_first, len(pieces) - count + past)):
        pieces[count] = first[q]
        if q == past:
            pieces[count, BEGIN] = begin
        count += 1
    return count


@njit(cache=True)
def shared_slip(a, b):
    """Time in which at least one of two lists of pieces slips."""
    total = 0.0
    for i in range(len(a)):
        if a[i, 0] == FORWARD or a[i, 0] == BACKWARD:
            total += a[i, 2] - a[i, 1]
    for j in range(len(b)):
        if b[j, 0] != FORWARD and b[j, 0] != BACKWARD:
            continue
        total += b[j, 2] - b[j, 1]
        for i in range(len(a)):
            if a[i, 0] == FORWARD or a[i, 0] == BACKWARD:
                total -= max(0.0, min(a[i, 2], b[j, 2]) - max(a[i, 1], b[j, 1]))
    return total


@njit(cache=True)
def break_points(x, samples, law, p, N, breaks):
    """Fill N, the instants and which intervals are closed for contact p; return how many intervals
    there are."""
    tau, wave, rate = samples
    n, last = wave.shape[1], len(x) - 1
    N[:] = 0.0
    if law.normal:
        N[:] = law.kn[p] * x[last]
    N[0] += law.preload[p]
    if law.normal and law.kn[p] > 0:
        return contact_instants(
            N, law.preload[p] + law.kn[p] * wave[last], law.kn[p] * rate[last], tau, breaks
        )
    breaks.marks[: n + 1, AT] = tau
    breaks.kind[:n] = np.arange(n)
    breaks.kind[n] = 0
    breaks.closed[:n] = law.preload[p] > 0
    return n


@njit(cache=True)
def stick_interval(u, N, contact, samples, breaks):
    """Fill the edges of the stick interval of a tangent; contact: mu/kt, kn (0 without a normal)
    and preload.

    samples : of u, its rate, u_n and its rate
    """
    ratio, kn, preload = contact
    u_wave, u_rate, n_wave, n_rate = samples
    edges, marks = breaks.edges, breaks.marks
    edges[0], edges[1] = u - ratio * N, u + ratio * N
    for i in range(len(breaks.closed) + 1):
        s = breaks.kind[i]
        if s >= 0:
            limit = ratio * preload + ratio * kn * n_wave[s]
            limit_rate = ratio * kn * n_rate[s]
            marks[i, PLACES], marks[i, PLACES + 1] = u_wave[s] - limit, u_wave[s] + limit
            marks[i, RATES], marks[i, RATES + 1] = u_rate[s] - limit_rate, u_rate[s] + limit_rate
        else:
            for e in range(2):
                marks[i, PLACES + e], marks[i, RATES + e], _ = series(edges[e], marks[i, AT])


@njit(cache=True)
def sticks(x, law, p, places):
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
def reach(c):
    """What the series with real coefficients c does not exceed."""
    most = abs(c[0])
    for k in range(1, len(c), 2):
        most += np.sqrt(c[k] * c[k] + c[k + 1] * c[k + 1])
    return most


@njit(cache=True)
def find_pieces(x, samples, law, start, found):
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
            if law.mu[p] == 0:
                pieces[p, d, 0, 0], pieces[p, d, 0, 1], pieces[p, d, 0, 2], counts[p, d] = (
                    OPEN,
                    0.0,
                    TWO_PI,
                    1,
                )
            else:
                ratio = law.mu[p] / law.kt[p]
                contact = ratio, law.kn[p] if law.normal else 0.0, law.preload[p]
                stick_interval(
                    x[p, d],
                    N,
                    contact,
                    (wave[p, d], rate[p, d], wave[p, last], rate[p, last]),
                    breaks,
                )
                begin = start.positions[p, d], start.from_position
                counts[p, d] = periodic(x[p, d], N, ratio, breaks, begin, space, pieces[p, d])
            for q in range(counts[p, d]):
                piece = pieces[p, d, q]
                active[p, d] |= piece[0] != STICK or piece[BY_U] != 0 or piece[BY_N] != 0
        slip = TWO_PI - opened
        if law.mu[p] > 0 and law.count:
            other = law.count - 1
            slip = shared_slip(pieces[p, 0, : counts[p, 0]], pieces[p, other, : counts[p, other]])
        elif not law.count or law.kt[p] == 0:
            slip = 0.0
        shares[p, 2] = opened / TWO_PI
        shares[p, 1] = slip / TWO_PI
        shares[p, 0] = 1.0 - shares[p, 1] - shares[p, 2]


@njit(cache=True)
def open_pieces(breaks, pieces, count):
    """List the intervals in which the contact is open, and return their total."""
    at, opened, k = breaks.marks[:, AT], 0.0, 0
    for i in range(len(breaks.closed)):
        if breaks.closed[i]:
            continue
        opened += at[i + 1] - at[i]
        if k > 0 and pieces[k - 1, END] == at[i]:
            pieces[k - 1, END] = at[i + 1]
        else:
            pieces[k, 0], pieces[k, BEGIN], pieces[k, END] = OPEN, at[i], at[i + 1]
            k += 1
    count[0] = k
    return opened
