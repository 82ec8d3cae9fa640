"""Where the cycle of a contact is cut: at its samples, and at the instants of contact and lift-off.

The stick interval of a tangent, low(t) = u - mu N/kt to high(t) = u + mu N/kt, is known by series
and by its values there. The samples only separate the events: the result does not depend on how
many there are.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.records import ContactState

STICK, FORWARD, BACKWARD, OPEN = (int(state) for state in ContactState)
TWO_PI = 2 * np.pi
BEGIN, END, PLACE, INSTANT, BY_U, BY_N = range(1, 7)  # columns of a piece after its state
ROUNDING = 1e-9  # of the value at one end of a bracket: one that small at the other has no sign

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
def series(c: np.ndarray, tau: float) -> tuple[float, float, float]:
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
def root(c: np.ndarray, level: float, of_rate: bool, a: float, b: float) -> float:
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
def normal_crossings(
    N: np.ndarray,
    values: tuple[float, float],
    rates: tuple[float, float],
    ends: tuple[float, float],
    crossings: np.ndarray,
) -> int:
    """Fill in where the series N passes zero between two samples, of which its values and rates are
    known, and return how often; an excursion between them is found by its extremum."""
    a, b = ends
    if (values[0] > 0) != (values[1] > 0):
        crossings[0] = root(N, 0.0, False, a, b)
        return 1
    sign = 1.0 if values[0] > 0 else -1.0
    if sign * rates[0] < 0 and sign * rates[1] > 0:
        turn = root(N, 0.0, True, a, b)
        if sign * series(N, turn)[0] < 0:
            crossings[0] = root(N, 0.0, False, a, turn)
            crossings[1] = root(N, 0.0, False, turn, b)
            return 2
    return 0


@njit(cache=True)
def contact_instants(
    N: np.ndarray, n_wave: np.ndarray, n_rate: np.ndarray, tau: np.ndarray, breaks: Breaks
) -> int:
    """Fill `at`, `kind` and `closed` of the break points, and return how many intervals there are.

    N are the coefficients of preload + kn u_n.
    """
    at, kind, closed = breaks.marks[:, AT], breaks.kind, breaks.closed
    n, m, crossings = len(n_wave), 0, np.empty(2)
    for i in range(n):
        j, ends = (i + 1) % n, (tau[i], tau[i + 1])
        values, rates = (n_wave[i], n_wave[j]), (n_rate[i], n_rate[j])
        count = normal_crossings(N, values, rates, ends, crossings)
        is_closed = n_wave[i] > 0
        at[m], kind[m], closed[m] = tau[i], i, is_closed
        m += 1
        for q in range(count):
            is_closed = not is_closed
            at[m], kind[m], closed[m] = crossings[q], -1, is_closed
            m += 1
    at[m], kind[m] = tau[n], 0
    return m


@njit(cache=True)
def break_points(
    x: np.ndarray,
    samples: tuple[np.ndarray, np.ndarray, np.ndarray],
    law: Sliders,
    p: int,
    N: np.ndarray,
    breaks: Breaks,
) -> int:
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
def stick_interval(
    u: np.ndarray,
    N: np.ndarray,
    contact: tuple[float, float, float],
    samples: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    breaks: Breaks,
) -> None:
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
def open_pieces(breaks: Breaks, pieces: np.ndarray, count: np.ndarray) -> float:
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
