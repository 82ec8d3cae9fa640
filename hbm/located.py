"""Harmonics of friction and contact forces with every transition located, and their exact derivatives.

A slider behind a tangential spring kt, held by the friction limit mu N(t), is a point w that rests until the corridor

    low(t) = u - mu N/kt  <=  w  <=  high(t) = u + mu N/kt,        N = max(0, preload + kn u_n)

pushes it [Yang, Menq 1998; Petrov, Ewins 2003]: w rests (stick), rides on `low` (slip forward) or on `high` (slip
backward), and where the pair is open the corridor has no width and w follows u, so that on re-contact the slider
starts at the current position. The force is T = kt (u - w).

What is computed is not the force but the *bracket* g = f - K_c u, the force less that of the stuck springs:
g_t = -kt w, and g_n = N - (preload + kn u_n), zero while closed. Both are continuous in time and, piece by piece, a
constant or a combination of the harmonics of u. Pieces are integrated in closed form; since g is continuous, the
moving instants contribute only through the rest position of the slider. The samples serve to find the pieces and
nothing else, so the result does not depend on how many there are.
"""

import numpy as np
from numba import njit

STICK, FORWARD, BACKWARD, OPEN = 0, 1, 2, 3
TWO_PI = 2 * np.pi


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
    v, d, dd = series(c, b)
    rising = (d if of_rate else v - level) > 0
    x = 0.5 * (a + b)
    for _ in range(80):
        v, d, dd = series(c, x)
        f = d if of_rate else v - level
        slope = dd if of_rate else d
        if (f > 0) == rising:
            b = x
        else:
            a = x
        new = x - f / slope if slope != 0 else 0.5 * (a + b)
        if not a < new < b:
            new = 0.5 * (a + b)
        if abs(new - x) <= 2e-16 * (1 + abs(x)):
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
def rest_data(state, rest, forward, backward, ratio, u_rate, n_rate):
    """How the rest position depends on u, u_n and the preload at the instant where the slider came to rest.

    `ratio` = mu/kt; the columns are instant, weight of u, weight of preload + kn u_n.
    """
    if state == FORWARD:
        rest[1], rest[2] = 1.0, -ratio
    elif state == BACKWARD:
        rest[1], rest[2] = 1.0, ratio
    else:
        rest[1], rest[2] = 1.0, -u_rate / n_rate


@njit(cache=True)
def after_contact(low_rate, high_rate):
    """State of a pair that has just closed: the slider is pushed only where the opening corridor overtakes it."""
    if low_rate > 0:
        return FORWARD
    if high_rate < 0:
        return BACKWARD
    return STICK


@njit(cache=True)
def stick_ends(low, high, w, t, b, lo_b, hi_b, lo_rate_t, hi_rate_t, lo_rate_b, hi_rate_b):
    """First instant in (t, b] at which the corridor reaches a resting slider, and the state that follows."""
    when, state = b, STICK
    if lo_b > w:
        when, state = root(low, w, False, t, b), FORWARD
    elif lo_rate_t > 0 and lo_rate_b < 0:
        turn = root(low, 0.0, True, t, b)
        if series(low, turn)[0] > w:
            when, state = root(low, w, False, t, turn), FORWARD
    found = state != STICK
    if hi_b < w:
        other = root(high, w, False, t, b)
        if not found or other < when:
            when, state = other, BACKWARD
    elif hi_rate_t < 0 and hi_rate_b > 0:
        turn = root(high, 0.0, True, t, b)
        if series(high, turn)[0] < w:
            other = root(high, w, False, t, turn)
            if not found or other < when:
                when, state = other, BACKWARD
    return when, state


@njit(cache=True)
def march(u, low, high, Nc, ratio, at, closed, m, lo, hi, lo_rate, hi_rate, w_start, from_position, pieces):
    """March the slider over two periods; fill `pieces` of the second (state, begin, end, w, then `rest_data`).

    lo, hi and their rates are the corridor at the break points. Returns the number of pieces.
    """
    rest = np.zeros(3)
    w = w_start
    if from_position:
        w = series(u, 0.0)[0]
        rest[1] = 1.0
    state = STICK
    if not closed[0]:
        state = OPEN
    elif lo[0] > w:
        w = lo[0]
        rest_data(FORWARD, rest, low, high, ratio, 0.0, 1.0)
    elif hi[0] < w:
        w = hi[0]
        rest_data(BACKWARD, rest, low, high, ratio, 0.0, 1.0)
    count = 0
    begin = 0.0
    for period in range(2):
        if period == 1:
            begin, count = 0.0, 0
        for i in range(m):
            a, b = at[i], at[i + 1]
            t = a
            new = state
            if closed[i] and state == OPEN:
                slope = series(Nc, a)[1]
                new = after_contact(lo_rate[i], hi_rate[i])
                u_value, u_rate, _ = series(u, a)
                w = u_value
                if new == STICK:
                    rest[0] = a
                    rest_data(OPEN, rest, low, high, ratio, u_rate, slope)
            elif not closed[i]:
                new = OPEN
            if new != state:
                count = close_piece(pieces, count, state, begin, a, w, rest)
                begin, state = a, new
            if not closed[i]:
                continue
            fresh_low, fresh_high = True, True
            for _ in range(12):
                if state == FORWARD:
                    if lo_rate[i + 1] >= 0:
                        break
                    t = root(low, 0.0, True, t, b) if lo_rate[i] > 0 or t > a else t
                    count = close_piece(pieces, count, state, begin, t, w, rest)
                    w = series(low, t)[0]
                    rest[0] = t
                    rest_data(FORWARD, rest, low, high, ratio, 0.0, 1.0)
                    begin, state, fresh_low = t, STICK, False
                elif state == BACKWARD:
                    if hi_rate[i + 1] <= 0:
                        break
                    t = root(high, 0.0, True, t, b) if hi_rate[i] < 0 or t > a else t
                    count = close_piece(pieces, count, state, begin, t, w, rest)
                    w = series(high, t)[0]
                    rest[0] = t
                    rest_data(BACKWARD, rest, low, high, ratio, 0.0, 1.0)
                    begin, state, fresh_high = t, STICK, False
                else:
                    when, new = stick_ends(low, high, w, t, b,
                                           lo[i + 1] if fresh_low else -np.inf, hi[i + 1] if fresh_high else np.inf,
                                           lo_rate[i] if fresh_low else -1.0, hi_rate[i] if fresh_high else 1.0,
                                           lo_rate[i + 1], hi_rate[i + 1])
                    if new == STICK:
                        break
                    count = close_piece(pieces, count, state, begin, when, w, rest)
                    begin, t, state = when, when, new
    return close_piece(pieces, count, state, begin, TWO_PI, w, rest)


@njit(cache=True)
def close_piece(pieces, count, state, begin, end, w, rest):
    if end <= begin or count >= len(pieces):
        return count
    pieces[count, 0], pieces[count, 1], pieces[count, 2], pieces[count, 3] = state, begin, end, w
    pieces[count, 4:] = rest
    return count + 1


@njit(cache=True)
def add_integrals(a, b, C, S):
    """Add the integrals over [a, b] of cos(n tau) to C[n] and of sin(n tau) to S[n]."""
    C[0] += b - a
    ca1, sa1, cb1, sb1 = np.cos(a), np.sin(a), np.cos(b), np.sin(b)
    ca, sa, cb, sb = 1.0, 0.0, 1.0, 0.0
    for n in range(1, len(C)):
        ca, sa = ca * ca1 - sa * sa1, sa * ca1 + ca * sa1
        cb, sb = cb * cb1 - sb * sb1, sb * cb1 + cb * sb1
        C[n] += (sb - sa) / n
        S[n] += (ca - cb) / n


@njit(cache=True)
def add_products(D, factor, C, S):
    """D[j, m] += factor * c_j * integral of e_j e_m, where c_j projects on e_j (1/2pi, then 1/pi)."""
    nh = D.shape[0]
    for j in range(nh):
        p = (j + 1) // 2
        f = factor / (TWO_PI if j == 0 else np.pi)
        sine_j = j > 0 and j % 2 == 0
        for m in range(nh):
            q = (m + 1) // 2
            sine_m = m > 0 and m % 2 == 0
            near, far = abs(p - q), p + q
            if sine_j and sine_m:
                value = 0.5 * (C[near] - C[far])
            elif not sine_j and not sine_m:
                value = 0.5 * (C[near] + C[far])
            else:
                s = q if sine_m else p          # order of the sine, c of the cosine
                c = p if sine_m else q
                value = -0.5 * (S[far] + (S[near] if s >= c else -S[near]))
            D[j, m] += f * value


@njit(cache=True)
def add_constant(g, factor, C, S):
    """g[j] += factor * c_j * integral of e_j."""
    g[0] += factor * C[0] / TWO_PI
    for j in range(1, len(g)):
        k = (j + 1) // 2
        g[j] += factor / np.pi * (C[k] if j % 2 else -S[k])


@njit(cache=True)
def add_ride(g, D, factor, A, u):
    """D += factor A and g += factor A u: a force that follows u."""
    for j in range(len(u)):
        value = 0.0
        for m in range(len(u)):
            D[j, m] += factor * A[j, m]
            value += A[j, m] * u[m]
        g[j] += factor * value


@njit(cache=True)
def add_rest(Dt, Dn, gp, kt, kn, piece, C, S, has_normal):
    """Derivative of a rest: the integral of e_j times that of the rest position."""
    nh = Dt.shape[0]
    projection = np.zeros(nh)
    add_constant(projection, -kt, C, S)
    e = np.zeros(nh)
    for m in range(nh):
        e[m] = 1.0
        e[m] = series(e, piece[4])[0] if m else 1.0
        value = e[m]
        e[:] = 0.0
        for j in range(nh):
            Dt[j, m] += projection[j] * piece[5] * value
            if has_normal:
                Dn[j, m] += projection[j] * piece[6] * kn * value
    for j in range(nh):
        gp[j] += projection[j] * piece[6]


@njit(cache=True)
def tangent_bracket(g, Dt, Dn, gp, u, un, kt, kn, mu, p, pieces, count, has_normal):
    """Harmonics of -kt w over the pieces, with derivatives by u, u_n and the preload; True where any is nonzero."""
    nh = len(g)
    moves = False
    C, S = np.zeros((3, 2 * nh)), np.zeros((3, 2 * nh))
    for q in range(count):
        state = int(pieces[q, 0])
        if state == STICK:
            w = pieces[q, 3]
            Cq, Sq = np.zeros(nh), np.zeros(nh)
            add_integrals(pieces[q, 1], pieces[q, 2], Cq, Sq)
            if w != 0:
                add_constant(g, -kt * w, Cq, Sq)
            if pieces[q, 5] != 0 or pieces[q, 6] != 0:
                moves = True
                add_rest(Dt, Dn, gp, kt, kn, pieces[q], Cq, Sq, has_normal)
        else:
            moves = True
            add_integrals(pieces[q, 1], pieces[q, 2], C[state - 1], S[state - 1])
    for state in (FORWARD, BACKWARD, OPEN):
        Cs, Ss = C[state - 1], S[state - 1]
        if Cs[0] == 0:
            continue
        A = np.zeros((nh, nh))
        add_products(A, 1.0, Cs, Ss)
        sign = 1.0 if state == FORWARD else (-1.0 if state == BACKWARD else 0.0)
        add_ride(g, Dt, -kt, A, u)
        if sign != 0:
            add_constant(g, sign * mu * p, Cs, Ss)
            add_constant(gp, sign * mu, Cs, Ss)
            if has_normal:
                add_ride(g, Dn, sign * mu * kn, A, un)
    return moves


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
def brackets(x, wave, rate, tau, tangents, has_normal, kt, kn, mu, preload, w_start, from_position,
             g, D, gp, moves, shares):
    """Fill g (P, nd, nh), D (P, nd, nh, nd, nh), gp = dg/dpreload, moves (P, nd) and shares (P, 3: stick, slip, open).

    x (P, nd, nh) are the harmonics of the relative motion; wave, rate (P, nd, n) its samples at tau[:n].
    """
    P, nd, nh = x.shape
    n = wave.shape[2]
    size = n + 4 * nh + 8
    at, kind, closed = np.empty(size), np.empty(size, np.int64), np.empty(size, np.bool_)
    lo, hi, lo_rate, hi_rate = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    pieces = np.empty((2, 8 * nh + 64, 7))
    counts = np.zeros(2, np.int64)
    Nc, zero = np.zeros(nh), np.zeros(nh)
    last = nd - 1                # the normal, where there is one
    C, S = np.zeros(2 * nh), np.zeros(2 * nh)
    for p in range(P):
        g[p], gp[p], moves[p] = 0.0, 0.0, False
        un = x[p, last] if has_normal else zero
        Nc[:] = 0.0
        if has_normal:
            Nc[:] = kn[p] * un
        Nc[0] += preload[p]
        if has_normal and kn[p] > 0:
            m = contact_instants(Nc, preload[p] + kn[p] * wave[p, last], kn[p] * rate[p, last], tau, at, kind, closed)
        else:
            m = n
            at[:n + 1] = tau
            kind[:n] = np.arange(n)
            kind[n] = 0
            closed[:n] = preload[p] > 0
        opened = 0.0
        for i in range(m):
            if not closed[i]:
                opened += at[i + 1] - at[i]
        fresh = False
        if opened > 0 and has_normal:
            fresh = True
            D[p] = 0.0
            C[:], S[:] = 0.0, 0.0
            for i in range(m):
                if not closed[i]:
                    add_integrals(at[i], at[i + 1], C, S)
            A = np.zeros((nh, nh))
            add_products(A, -1.0, C, S)
            add_ride(g[p, last], D[p, last, :, last, :], kn[p], A, un)
            add_constant(g[p, last], -preload[p], C, S)
            add_constant(gp[p, last], -1.0, C, S)
            moves[p, last] = True
        counts[:] = 0
        for d in range(tangents):
            if kt[p] == 0:
                continue
            u = x[p, d]
            if mu[p] == 0:
                pieces[d, 0, 0], pieces[d, 0, 1], pieces[d, 0, 2], counts[d] = OPEN, 0.0, TWO_PI, 1
            else:
                ratio = mu[p] / kt[p]
                low, high = u - ratio * Nc, u + ratio * Nc
                for i in range(m + 1):
                    if kind[i] >= 0:
                        s = kind[i]
                        Ns = preload[p]
                        Nr = 0.0
                        if has_normal:
                            Ns += kn[p] * wave[p, last, s]
                            Nr = kn[p] * rate[p, last, s]
                        lo[i], hi[i] = wave[p, d, s] - ratio * Ns, wave[p, d, s] + ratio * Ns
                        lo_rate[i], hi_rate[i] = rate[p, d, s] - ratio * Nr, rate[p, d, s] + ratio * Nr
                    else:
                        lo[i], lo_rate[i], _ = series(low, at[i])
                        hi[i], hi_rate[i], _ = series(high, at[i])
                counts[d] = march(u, low, high, Nc, ratio, at, closed, m, lo, hi, lo_rate, hi_rate,
                                  w_start[p, d], from_position, pieces[d])
            if not fresh:
                fresh = True
                D[p] = 0.0
            moves[p, d] = tangent_bracket(g[p, d], D[p, d, :, d, :], D[p, d, :, last, :], gp[p, d], u, un, kt[p],
                                          kn[p], mu[p], preload[p], pieces[d], counts[d], has_normal)
        slip = shared_slip(pieces[0], counts[0], pieces[1], counts[1])
        if tangents and kt[p] > 0 and mu[p] == 0:
            slip = TWO_PI - opened
        shares[p, 2] = opened / TWO_PI
        shares[p, 1] = slip / TWO_PI
        shares[p, 0] = 1.0 - shares[p, 1] - shares[p, 2]
