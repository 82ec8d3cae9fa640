"""Stick, slip and lift-off of every pair over a cycle, with each transition located.

A slider behind a tangential spring kt, held by the friction limit mu N(t), is a point w that rests until the corridor

    low(t) = u - mu N/kt  <=  w  <=  high(t) = u + mu N/kt,        N = max(0, preload + kn u_n)

pushes it [Yang, Menq 1998; Petrov, Ewins 2003]: w rests (stick), rides on `low` (slip forward) or on `high` (slip
backward), and where the pair is open the corridor has no width and w follows u, so that on re-contact the slider
starts at the current position. The force is T = kt (u - w).

The samples serve to find the pieces and nothing else, so the result does not depend on how many there are.
Compiled code is stored per file: nothing compiled here is called from compiled code elsewhere.
"""

import numpy as np
from numba import njit

STICK, FORWARD, BACKWARD, OPEN = 0, 1, 2, 3
TWO_PI = 2 * np.pi
BEGIN, END, PLACE, INSTANT, BY_U, BY_N = range(1, 7)     # columns of a piece after its state


@njit(cache=True)
def series(c, tau):
    """Value, rate and second derivative at tau of the series with real coefficients c."""
    H = (len(c) - 1) // 2
    value, rate, bend = c[0], 0.0, 0.0
    c1, s1 = np.cos(tau), np.sin(tau)
    ck, sk = 1.0, 0.0
    for k in range(1, H + 1):
        ck, sk = ck * c1 - sk * s1, sk * c1 + ck * s1
        wave = c[2 * k - 1] * ck - c[2 * k] * sk
        value += wave
        rate -= k * (c[2 * k - 1] * sk + c[2 * k] * ck)
        bend -= k * k * wave
    return value, rate, bend


@njit(cache=True)
def root(c, level, of_rate, a, b):
    """Where the series (less level), or its rate, changes sign in [a, b]: Newton inside a shrinking bracket."""
    v, d, dd = series(c, a)
    at_a = d if of_rate else v - level
    v, d, dd = series(c, b)
    at_b = d if of_rate else v - level
    rising = at_b > 0
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
        if abs(new - x) <= (1e-9 if inside else 4e-16 * (1 + abs(x))):      # Newton squares the error once more
            return new
        x = new
    return x


@njit(cache=True)
def contact_instants(N, n_wave, n_rate, tau, at, kind, closed):
    """Fill the break points `at` (instants), `kind` (sample number or -1) and `closed` (per interval); return how many.

    N are the coefficients of preload + kn u_n; an excursion that begins and ends inside a sample is found by its
    extremum.
    """
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
    """An instant in (a, b) at which an edge goes back for a while, though forward at both ends; b where there is none.

    r0, r1, gone : rates at the ends and way between, all of them forward; the quadratic that they make up shows a dip
    """
    h = b - a
    bend = 3 * (r0 + r1 - 2 * gone / h)
    slope = r1 - r0 - bend
    if bend <= 0 or slope >= 0 or slope + 2 * bend <= 0 or r0 - slope * slope / (4 * bend) > 0.5 * min(r0, r1):
        return b
    left, right = a, b
    x = a - h * slope / (2 * bend)
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
def stick_ends(edges, w, t, at, b, place, rate, i, since):
    """First instant in (t, b] at which an edge of the corridor reaches a resting slider, and the state that follows.

    place, rate (2, m + 1) are those of the edges at the break points; `at` and b are number i and i + 1.
    since (2,) : instants from which on an edge may reach the slider that it has just left behind
    """
    when, state = b, STICK
    for s in range(2):
        sign = 1.0 - 2.0 * s
        begin, end = max(t, since[s]), b
        if begin >= b:
            continue
        if sign * (place[s, i + 1] - w) <= 0:
            if sign * rate[s, i] <= 0 or sign * rate[s, i + 1] >= 0:
                continue
            end = root(edges[s], 0.0, True, t, b)
            if sign * (series(edges[s], end)[0] - w) <= 0:
                continue
        elif begin == at and sign * rate[s, i] < 0 and sign * rate[s, i + 1] > 0:
            begin = root(edges[s], 0.0, True, begin, b)      # it leaves a slider that it touches, and comes back
        first = root(edges[s], w, False, begin, end)
        if state == STICK or first < when:
            when, state = first, FORWARD + s
    return when, state


@njit(cache=True)
def march(u, edges, N, ratio, at, closed, m, place, rate, w_start, from_position, first, past, pieces):
    """March the slider over two periods; fill `pieces` of the second and return how many there are.

    edges (2, nh) : low, which pushes forward, and high, which pushes backward; place, rate (2, m + 1) : of these at
    the break points. first (most, 7), past (2, m) : work space for the pieces of the first period, and for the state at
    each break point and the piece it belongs to. Where both periods slip alike, or are open, the second repeats the
    first from there on: a slider that moves remembers nothing.
    """
    rest, since = np.zeros(3), np.zeros(2)
    w = w_start
    if from_position:
        w = series(u, 0.0)[0]
        rest[1] = 1.0
    state = STICK if closed[0] else OPEN
    for s in range(2):
        if closed[0] and (1.0 - 2.0 * s) * (place[s, 0] - w) > 0:
            w = place[s, 0]
            rest[1], rest[2] = 1.0, (2.0 * s - 1.0) * ratio
    count = 0
    begin = 0.0
    into = first
    for period in range(2):
        if period == 1:
            if count == 0 and state == STICK:
                return close_piece(pieces, 0, state, 0.0, TWO_PI, w, rest)
            n_first = close_piece(first, count, state, begin, TWO_PI, w, rest)
            begin, count, into = 0.0, 0, pieces
        for i in range(m):
            a, b = at[i], at[i + 1]
            t = a
            new = state
            if not closed[i]:
                new = OPEN
            elif state == OPEN:          # the slider is pushed only where the opening corridor overtakes it
                new = FORWARD if rate[0, i] > 0 else (BACKWARD if rate[1, i] < 0 else STICK)
                w, u_rate, _ = series(u, a)
                if new == STICK:
                    rest[0], rest[1], rest[2] = a, 1.0, -u_rate / series(N, a)[1]
            if new != state:
                count = close_piece(into, count, state, begin, a, w, rest)
                begin, state = a, new
            if period == 0:
                past[0, i], past[1, i] = state, count
            elif state != STICK and state == past[0, i]:
                for q in range(past[1, i], min(n_first, len(pieces) - count + past[1, i])):
                    pieces[count] = first[q]
                    if q == past[1, i]:
                        pieces[count, BEGIN] = begin
                    count += 1
                return count
            if not closed[i]:
                continue
            since[:] = a
            for _ in range(12):
                if state == STICK:
                    when, new = stick_ends(edges, w, t, a, b, place, rate, i, since)
                    if new == STICK:
                        break
                    count = close_piece(into, count, state, begin, when, w, rest)
                    begin, t, state = when, when, new
                    continue
                s = state - FORWARD
                sign = 1.0 - 2.0 * s
                back = b
                if sign * rate[s, i + 1] >= 0:
                    back = pause(edges[s], sign, sign * rate[s, i], sign * rate[s, i + 1],
                                 sign * (place[s, i + 1] - place[s, i]), a, b)
                    if not t < back < b:
                        break
                if sign * rate[s, i] > 0 or t > a:
                    t = root(edges[s], 0.0, True, t, back)
                count = close_piece(into, count, state, begin, t, w, rest)
                w = series(edges[s], t)[0]
                rest[0], rest[1], rest[2] = t, 1.0, -sign * ratio
                begin, state, since[s] = t, STICK, back
    return close_piece(pieces, count, state, begin, TWO_PI, w, rest)


@njit(cache=True)
def close_piece(pieces, count, state, begin, end, w, rest):
    if end <= begin or count >= len(pieces):
        return count
    pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3] = state, begin, end, w
    pieces[count, 4:] = rest
    return count + 1


@njit(cache=True)
def shared_slip(a, na, b, nb):
    """Time in which at least one of two lists of pieces slips."""
    total = 0.0
    for i in range(na):
        if a[i, 0] == FORWARD or a[i, 0] == BACKWARD:
            total += a[i, 2] - a[i, 1]
    for j in range(nb):
        if b[j, 0] != FORWARD and b[j, 0] != BACKWARD:
            continue
        total += b[j, 2] - b[j, 1]
        for i in range(na):
            if a[i, 0] == FORWARD or a[i, 0] == BACKWARD:
                total -= max(0.0, min(a[i, 2], b[j, 2]) - max(a[i, 1], b[j, 1]))
    return total


@njit(cache=True)
def find_pieces(x, wave, rate, tau, tangents, has_normal, kt, kn, mu, preload, w_start, from_position,
                pieces, counts, moves, shares):
    """Fill the pieces of the second of two marched periods, moves (P, nd) and shares (P, 3: stick, slip, open).

    x (P, nd, nh) are the harmonics of the relative motion; wave, rate (P, nd, n) its samples at tau[:n].
    pieces (P, tangents + 1, most, 7), counts (P, tangents + 1) : of the slider of each tangent, and last the times in
    which the pair is open. A piece is its state, begin, end, the place w of a resting slider, and how w came about:
    the instant, and the weights of u and of preload + kn u_n there.
    moves : whether the bracket of a component has a derivative
    """
    P, nd, nh = x.shape
    n = wave.shape[2]
    size = n + 4 * nh + 8
    at, kind, closed = np.empty(size), np.empty(size, np.int64), np.empty(size, np.bool_)
    edges, place, pace = np.empty((2, nh)), np.empty((2, size)), np.empty((2, size))
    N, zero = np.zeros(nh), np.zeros(nh)
    first, past = np.empty((pieces.shape[2], 7)), np.empty((2, size), np.int64)
    counts[:] = 0
    moves[:] = False
    last = nd - 1                # the normal, where there is one
    for p in range(P):
        un = x[p, last] if has_normal else zero
        N[:] = 0.0
        if has_normal:
            N[:] = kn[p] * un
        N[0] += preload[p]
        if has_normal and kn[p] > 0:
            m = contact_instants(N, preload[p] + kn[p] * wave[p, last], kn[p] * rate[p, last], tau, at, kind, closed)
        else:
            m = n
            at[:n + 1] = tau
            kind[:n] = np.arange(n)
            kind[n] = 0
            closed[:n] = preload[p] > 0
        opened = open_pieces(at, closed, m, pieces[p, tangents], counts[p:p + 1, tangents])
        if opened > 0 and has_normal:
            moves[p, last] = True
        for d in range(tangents):
            if kt[p] == 0:
                continue
            if mu[p] == 0:
                pieces[p, d, 0, 0], pieces[p, d, 0, 1], pieces[p, d, 0, 2], counts[p, d] = OPEN, 0.0, TWO_PI, 1
            else:
                u, ratio = x[p, d], mu[p] / kt[p]
                edges[0], edges[1] = u - ratio * N, u + ratio * N
                for i in range(m + 1):
                    s = kind[i]
                    if s >= 0:
                        limit, limit_rate = ratio * preload[p], 0.0
                        if has_normal:
                            limit += ratio * kn[p] * wave[p, last, s]
                            limit_rate = ratio * kn[p] * rate[p, last, s]
                        place[0, i], place[1, i] = wave[p, d, s] - limit, wave[p, d, s] + limit
                        pace[0, i], pace[1, i] = rate[p, d, s] - limit_rate, rate[p, d, s] + limit_rate
                    else:
                        place[0, i], pace[0, i], _ = series(edges[0], at[i])
                        place[1, i], pace[1, i], _ = series(edges[1], at[i])
                counts[p, d] = march(u, edges, N, ratio, at, closed, m, place, pace, w_start[p, d], from_position,
                                     first, past, pieces[p, d])
            for q in range(counts[p, d]):
                piece = pieces[p, d, q]
                if piece[0] != STICK or piece[BY_U] != 0 or piece[BY_N] != 0:
                    moves[p, d] = True
        slip = TWO_PI - opened
        if mu[p] > 0 and tangents:
            slip = shared_slip(pieces[p, 0], counts[p, 0], pieces[p, tangents - 1], counts[p, tangents - 1])
        elif not tangents or kt[p] == 0:
            slip = 0.0
        shares[p, 2] = opened / TWO_PI
        shares[p, 1] = slip / TWO_PI
        shares[p, 0] = 1.0 - shares[p, 1] - shares[p, 2]


@njit(cache=True)
def open_pieces(at, closed, m, pieces, count):
    """List the intervals in which the pair is open, and return their total."""
    opened = 0.0
    k = 0
    for i in range(m):
        if closed[i]:
            continue
        opened += at[i + 1] - at[i]
        if k > 0 and pieces[k - 1, END] == at[i]:
            pieces[k - 1, END] = at[i + 1]
        else:
            pieces[k, 0], pieces[k, BEGIN], pieces[k, END] = OPEN, at[i], at[i + 1]
            k += 1
    count[0] = k
    return opened
