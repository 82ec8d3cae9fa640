"""Coulomb friction coupled in the tangential plane: stick, slip and lift-off located in time, slip
by collocation.

In forces: the spring carries T = p - r, with p = kt u and r = kt w of the slider w, under the limit
L = mu N. A slider at rest slips where |T| reaches L, a root in time. In slip T = L (cos psi, sin
psi), and the angle obeys

    L psi' = p' . t(psi),        t = (-sin psi, cos psi)

until p' . n - L', the rate at which the slider moves, is no longer positive. This is integrated by
Radau collocation [Hairer, Wanner 1996, IV.5], implicit, since the angle follows the velocity ever
faster the smaller L is, and multiplied by L, so that it holds where the contact closes and opens. r
is continuous in time: derivatives of its integrals are integrals of its derivatives, and the
instants of the events contribute only where they tell a place of rest. Compiled code is stored per
file: nothing compiled here is called from compiled code elsewhere.
"""

from collections import namedtuple
from typing import NamedTuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.records import ContactState

STICK = int(ContactState.STICK)
SLIP = int(ContactState.FORWARD)
OPEN = int(ContactState.OPEN)
TWO_PI = 2 * np.pi
TINY = 1e-150  # of what is divided by: products with the quotient neither overflow nor vanish
P1, P2, LIMIT, RATE1, RATE2, LIMIT_RATE = range(6)  # of the motion at an instant, in forces


class CoupledSettings(NamedTuple):
    """Tolerances of the periodic cycle."""

    max_periods: int = 60  # a slider that creeps longer is taken as it is then
    repeats: float = 1e-12  # of the largest motion: the slider has come back to where it was
    regular: float = 1e-5  # of det(I - A): below, what a period does to the slider is not inverted
    forgets: float = 1e-12  # of A: a period leaves nothing of where the slider was before
    # of the limit force: a slider that near slips on from the period before
    on_limit: float = 1e-12
    discs: int = 40  # of limits between which a slider comes to rest; five are enough
    nearly: float = 1e-5  # of the limit force, by which it may miss a place of rest
    corner: float = 1e-9  # sine of the angle between two limits: less is none
    # rad: highest term of the angle over a panel; its square is the error of the order
    degree: float = 1e-6
    widest: float = 2.0  # of a panel, over the highest harmonic, whose wave it resolves ...
    wide: float = 0.5  # ... in rad, where that is low
    narrowest: float = 1e-9  # rad
    # of a change of the motion, to the force at a node; it is 0.3 but where limits vanish
    adds: float = 2.0
    newton: int = 12  # steps of the collocation, else the panel is too wide
    turned: float = 1e-8  # rad: Newton's method squares the error once more
    pieces: int = 400  # of a period, of stick and of slip ...
    panels: int = 20  # ... and more of them for each harmonic


SETTINGS = CoupledSettings()
STAGES = 6


def _radau(s):
    """Nodes (s,) in 0..1, inverse of the matrix and weights of the Radau IIA method, weights of the
    interpolation through 0 and the nodes."""
    x = np.polynomial.Polynomial([0.0, 1.0])
    nodes = np.sort(np.real((x ** (s - 1) * (x - 1) ** s).deriv(s - 1).roots()))
    powers = np.arange(s)
    A = nodes[:, None] ** (powers + 1) / (powers + 1) @ np.linalg.inv(nodes[:, None] ** powers)
    places = np.r_[0.0, nodes]
    apart = places[:, None] - places + np.eye(s + 1)
    return nodes, np.linalg.inv(A), A[-1].copy(), 1 / apart.prod(axis=1)


NODES, INVERSE, WEIGHTS, THROUGH = _radau(STAGES)
OF_START = INVERSE.sum(axis=1)

Contact = namedtuple("Contact", "c wave rate tau opened size scale")
Contact.__doc__ = """Motion of a contact in forces: p1, p2 and L.

c (3, nh) : its series; wave, rate (3, n) : at the samples tau (n + 1,), and by tau
opened (k, 2) : times in which it is open; size, scale : largest |p| and L at the samples
"""
Panel = namedtuple("Panel", "e at psi inverse stage slope turn")
Panel.__doc__ = (
    "Basis e (s, nh), motion at (s, 6), angle psi (s,), inverse (s, s) of its equations, and "
    "room for them."
)
Sums = namedtuple("Sums", "g D dr turn e")
Sums.__doc__ = """Integrals over a period: g (2, nh) of e_j r, D (nh, 2, columns) of e_j dr; dr (2,
columns) now, turn (columns,) of the angle; e (nh,) room. Columns: the slider at t = 0 (2), then the
series of p1, p2 and L."""


@njit(cache=True)
def motion(c, t, e, at):
    """Fill the basis e (nh,) and p1, p2, L with their rates (6,) at an instant."""
    c1, s1 = np.cos(t), np.sin(t)
    ck, sk = 1.0, 0.0
    e[0] = 1.0
    for d in range(3):
        at[d], at[3 + d] = c[d, 0], 0.0
    for k in range(1, (len(e) - 1) // 2 + 1):
        ck, sk = ck * c1 - sk * s1, sk * c1 + ck * s1
        e[2 * k - 1], e[2 * k] = ck, -sk
        for d in range(3):
            at[d] += c[d, 2 * k - 1] * ck - c[d, 2 * k] * sk
            at[3 + d] -= k * (c[d, 2 * k - 1] * sk + c[d, 2 * k] * ck)


@njit(cache=True)
def excess(at, r):
    """|p - r|^2 - L^2, and half its rate."""
    T1, T2 = at[P1] - r[0], at[P2] - r[1]
    return T1 * T1 + T2 * T2 - at[LIMIT] ** 2, T1 * at[RATE1] + T2 * at[RATE2] - at[LIMIT] * at[
        LIMIT_RATE
    ]


@njit(cache=True)
def slides(at, psi):
    """Rate at which a slider in slip is pulled along: positive, or it comes to rest."""
    return at[RATE1] * np.cos(psi) + at[RATE2] * np.sin(psi) - at[LIMIT_RATE]


@njit(cache=True)
def secant(a, fa, b, fb):
    """Where the line through two values of opposite sign is zero, or the middle."""
    x = (a * fb - b * fa) / (fb - fa)
    return x if a < x < b else 0.5 * (a + b)


@njit(cache=True)
def narrowed(beyond, x, f, a, fa, b, fb, side):
    """The bracket with x, which is `beyond` the root or not, as an end; an end that stays twice
    counts half [Dowell, Jarratt 1971: Illinois method]."""
    if beyond:
        return a, fa * (0.5 if side == 1 else 1.0), x, f, 1
    return x, f, b, fb * (0.5 if side == -1 else 1.0), -1


@njit(cache=True)
def excess_root(contact, r, of_rate, a, b, e, at):
    """Where the excess (falling: its rate) changes sign in [a, b], at b beyond it; bisection with
    secant steps."""
    x, side = 0.5 * (a + b), 0
    fa = fb = np.nan
    for _ in range(100):
        motion(contact.c, x, e, at)
        value, rate = excess(at, r)
        f = -rate if of_rate else value
        if f == 0:
            return x
        a, fa, b, fb, side = narrowed(f > 0, x, f, a, fa, b, fb, side)
        if b - a <= 4e-16 * (1 + b):
            break
        x = secant(a, fa, b, fb)
    return b


@njit(cache=True)
def onset(contact, r, t, stop, e, at):
    """First instant in [t, stop] at which a slider at rest slips, and whether there is one; it may
    begin and end between two samples."""
    tau, n = contact.tau, len(contact.tau) - 1
    motion(contact.c, t, e, at)
    a, rate_a = t, excess(at, r)[1]
    value_a = min(excess(at, r)[0], 0.0)
    i = min(int(t / TWO_PI * n), n - 1)
    while a < stop:
        i += 1
        b = min(tau[min(i, n)], stop)
        if b <= a:
            continue
        if b == stop:
            motion(contact.c, b, e, at)
        else:
            for d in range(3):
                at[d], at[3 + d] = contact.wave[d, i % n], contact.rate[d, i % n]
        value_b, rate_b = excess(at, r)
        if value_b > 0:
            return excess_root(contact, r, False, a, b, e, at), True
        if rate_a > 0 > rate_b:
            # tangents at both ends meet no lower than a maximum between them
            meet = (value_b - value_a - 2 * rate_b * (b - a)) / (rate_a - rate_b) / 2
            if value_a + 2 * rate_a * min(max(meet, 0.0), b - a) > 0:
                top = excess_root(contact, r, True, a, b, e, at)
                motion(contact.c, top, e, at)
                if excess(at, r)[0] > 0:
                    return excess_root(contact, r, False, a, top, e, at), True
        a, value_a, rate_a = b, value_b, rate_b
    return stop, False


@njit(cache=True)
def invert(J, inverse):
    """Inverse (s, s) by elimination with row exchanges; whether there is one. J is used up."""
    s = len(J)
    inverse[:] = 0.0
    for i in range(s):
        inverse[i, i] = 1.0
    for i in range(s):
        best = i
        for k in range(i + 1, s):
            if abs(J[k, i]) > abs(J[best, i]):
                best = k
        if J[best, i] == 0.0:
            return False
        for k in range(s):
            J[i, k], J[best, k] = J[best, k], J[i, k]
            inverse[i, k], inverse[best, k] = inverse[best, k], inverse[i, k]
        scale = 1.0 / J[i, i]
        for k in range(s):
            J[i, k] *= scale
            inverse[i, k] *= scale
        for row in range(s):
            if row != i:
                factor = J[row, i]
                for k in range(s):
                    J[row, k] -= factor * J[i, k]
                    inverse[row, k] -= factor * inverse[i, k]
    return True


@njit(cache=True)
def collocate(contact, t, h, psi0, panel):
    """Angle at the nodes of the panel [t, t + h] of slip; its highest term in rad of the largest
    limit, infinite where Newton's method fails."""
    psi, slope, J = panel.psi, panel.slope, panel.stage
    for i in range(STAGES):
        motion(contact.c, t + h * NODES[i], panel.e[i], panel.at[i])
        psi[i] = psi0
    for _ in range(SETTINGS.newton):
        for i in range(STAGES):
            at = panel.at[i]
            cos, sin = np.cos(psi[i]), np.sin(psi[i])
            slope[i] = 0.0
            for j in range(STAGES):
                slope[i] += INVERSE[i, j] * (psi[j] - psi0)
                J[i, j] = at[LIMIT] * INVERSE[i, j]
            J[i, i] += h * (at[RATE1] * cos + at[RATE2] * sin)
            panel.turn[i] = h * (at[RATE2] * cos - at[RATE1] * sin) - at[LIMIT] * slope[i]
        if not invert(J, panel.inverse):
            return np.inf
        moved = 0.0
        for i in range(STAGES):
            step = 0.0
            for j in range(STAGES):
                step += panel.inverse[i, j] * panel.turn[j]
            psi[i] += step
            moved = max(moved, abs(step))
        if not moved <= 2.0:
            return np.inf
        if moved <= SETTINGS.turned:
            highest, limit = THROUGH[0] * psi0, 0.0
            for i in range(STAGES):
                highest += THROUGH[i + 1] * psi[i]
                limit = max(limit, panel.at[i, LIMIT])
            return abs(highest) / 2.0 ** (2 * STAGES - 1) * limit / contact.scale
    return np.inf


@njit(cache=True)
def rests(contact, t, h, psi0, panel, e, at):
    """Share of the panel at which the slider comes to rest, by the angle that it has; 1 where it
    slips on."""
    a, fa = 0.0, 1.0
    for i in range(STAGES):
        b, fb = NODES[i], slides(panel.at[i], panel.psi[i])
        if fb >= 0:
            a, fa = b, fb
            continue
        side = 0
        if a == 0:
            motion(contact.c, t, e, at)
            fa = slides(at, psi0)
            if fa <= 0:
                return 0.0
        for _ in range(60):
            x = secant(a, fa, b, fb)
            if b - a <= 1e-13 or x in (a, b):
                break
            motion(contact.c, t + h * x, e, at)
            f = slides(at, between(panel.psi, psi0, x))
            a, fa, b, fb, side = narrowed(f < 0, x, f, a, fa, b, fb, side)
            if abs(f) <= 1e-15 * (abs(at[RATE1]) + abs(at[RATE2])):
                return x
        return b
    return 1.0


@njit(cache=True)
def between(psi, psi0, x):
    """The angle at a share x of the panel, by interpolation."""
    if x == 0.0:
        return psi0
    above, below = THROUGH[0] / x * psi0, THROUGH[0] / x
    for i in range(STAGES):
        if x == NODES[i]:
            return psi[i]
        factor = THROUGH[i + 1] / (x - NODES[i])
        above += factor * psi[i]
        below += factor
    return above / below


@njit(cache=True)
def add_rest(a, b, r, sums, collect):
    """Add the integrals over [a, b] of a slider that rests."""
    nh = sums.g.shape[1]
    for j in range(nh):
        k = (j + 1) // 2
        if j == 0:
            weight = b - a
        elif j % 2:
            weight = (np.sin(k * b) - np.sin(k * a)) / k
        else:
            weight = (np.cos(k * b) - np.cos(k * a)) / k
        for d in range(2):
            sums.g[d, j] += weight * r[d]
            if collect:
                for q in range(sums.dr.shape[1]):
                    sums.D[j, d, q] += weight * sums.dr[d, q]


@njit(cache=True)
def add_panel(h, limit, panel, sums, collect):
    """Add the integrals over a panel of slip that begins at `limit`, and carry the derivatives to
    its end, its last node; return the work times kt."""
    e, dr, work = panel.e, sums.dr, 0.0
    nh, columns = e.shape[1], dr.shape[1]
    for i in range(STAGES):
        at, cos, sin = panel.at[i], np.cos(panel.psi[i]), np.sin(panel.psi[i])
        weight, L = h * WEIGHTS[i], at[LIMIT]
        work += weight * L * slides(at, panel.psi[i])
        for j in range(nh):
            sums.g[0, j] += weight * e[i, j] * (at[P1] - L * cos)
            sums.g[1, j] += weight * e[i, j] * (at[P2] - L * sin)
        if not collect and i < STAGES - 1:
            continue
        turns(i, h, limit, panel, sums)
        if i == STAGES - 1:
            sums.turn[:] = dr[0]
        for q in range(columns):
            along = L * dr[0, q]
            dr[0, q], dr[1, q] = along * sin, -along * cos
        for m in range(nh if columns > 2 else 0):
            dr[0, 2 + m] += e[i, m]
            dr[1, 2 + nh + m] += e[i, m]
            dr[0, 2 + 2 * nh + m] -= cos * e[i, m]
            dr[1, 2 + 2 * nh + m] -= sin * e[i, m]
        for j in range(nh if collect else 0):
            f = weight * e[i, j]
            for d in range(2):
                for q in range(columns):
                    sums.D[j, d, q] += f * dr[d, q]
    return work


@njit(cache=True)
def turns(i, h, limit, panel, sums):
    """Fill dr[0] with the derivative of the angle at node i: that of the collocation, from the one
    at its begin.

    limit : at the begin; 0 where the contact closes there
    Slip brings sliders together, never apart: of a change of the force at the begin no more than
    all is kept, and no more than all of a change of the motion is added. The collocation loses that
    where limit and speed vanish."""
    into, e, nh = sums.dr[0], panel.e, panel.e.shape[1]
    keeps = 0.0
    for k in range(STAGES):
        keeps += panel.inverse[i, k] * panel.at[k, LIMIT] * OF_START[k]
    now = max(panel.at[i, LIMIT], TINY)
    most = SETTINGS.adds / now
    for q in range(len(into)):
        all_of_it = max(most, limit / now * abs(sums.turn[q]))
        into[q] = min(max(keeps * sums.turn[q], -all_of_it), all_of_it)
    for k in range(STAGES if len(into) > 2 else 0):
        f = min(max(panel.inverse[i, k], -most), most)
        t1 = -f * h * np.sin(panel.psi[k])
        t2 = f * h * np.cos(panel.psi[k])
        back = f * panel.slope[k]
        into[2 + 2 * nh] -= back
        for m in range(1, nh):
            rate = (m + 1) // 2 * (e[k, m + 1] if m % 2 else -e[k, m - 1])
            into[2 + m] += t1 * rate
            into[2 + nh + m] += t2 * rate
            into[2 + 2 * nh + m] -= back * e[k, m]


@njit(cache=True)
def slip_through(contact, t, stop, psi, h, limit, panel, sums, collect):
    """Slip from t, where it begins at `limit`, up to `stop` or to where the slider comes to rest:
    (instant, angle, width of the next panel, whether it rests, work times kt); before either where
    the panels are too many."""
    nh, work = sums.g.shape[1], 0.0
    widest, at = min(SETTINGS.wide, 2 * SETTINGS.widest / max(nh - 1, 1)), np.empty(6)
    h = min(h, widest)
    for _ in range(SETTINGS.pieces + SETTINGS.panels * (nh // 2)):
        left = stop - t
        if left <= SETTINGS.narrowest:
            return stop, psi, h, False, work
        width = left if left <= h else (0.5 * left if left < 2 * h else h)
        error = collocate(contact, t, width, psi, panel)
        if error > SETTINGS.degree and width > SETTINGS.narrowest:
            h = width * (
                0.2
                if np.isinf(error)
                else max(0.2, 0.8 * (SETTINGS.degree / error) ** (1 / STAGES))
            )
            continue
        if np.isinf(error):  # nothing turns in no time
            t += width
            continue
        share = rests(contact, t, width, psi, panel, sums.e, at)
        if share < 1 and share * width > 1e-14:
            collocate(contact, t, share * width, psi, panel)
        if share * width > 1e-14:
            work += add_panel(share * width, limit, panel, sums, collect)
            psi, limit = panel.psi[STAGES - 1], panel.at[STAGES - 1, LIMIT]
        t += share * width
        if share < 1:
            return t, psi, h, True, work
        h = min(
            widest, width * min(4.0, 0.8 * (SETTINGS.degree / max(error, 1e-300)) ** (1 / STAGES))
        )
    return t, psi, h, False, work


@njit(cache=True)
def turn_at(psi, limit, sums):
    """Fill the derivative of the angle where slip begins, from that of the slider, and return the
    limit; the basis is in sums.e."""
    nh, cos, sin = sums.g.shape[1], np.cos(psi), np.sin(psi)
    limit = max(limit, TINY)
    for q in range(len(sums.turn)):
        sums.turn[q] = (sin * sums.dr[0, q] - cos * sums.dr[1, q]) / limit
    for m in range(nh if len(sums.turn) > 2 else 0):
        sums.turn[2 + m] -= sin * sums.e[m] / limit
        sums.turn[2 + nh + m] += cos * sums.e[m] / limit
    return limit


@njit(cache=True)
def after_contact(contact, t, r, sums):
    """(state, angle) of a contact that closes at t, and the slider with its derivatives: at the
    place of the motion there it rests, or from it it is pulled along."""
    at = np.empty(6)
    e = sums.e
    dr = sums.dr
    nh = sums.g.shape[1]
    motion(contact.c, t, e, at)
    r[0], r[1] = at[P1], at[P2]
    speed, closing = np.hypot(at[RATE1], at[RATE2]), max(at[LIMIT_RATE], 1e-300)
    dr[:], sums.turn[:] = 0.0, 0.0
    slips, psi = speed > closing, np.arctan2(at[RATE2], at[RATE1])
    bend = 0.0  # of the velocity, by the phase
    for m in range(1, nh):
        k = (m + 1) // 2
        bend -= k * k * e[m] * (contact.c[1, m] * np.cos(psi) - contact.c[0, m] * np.sin(psi))
    for m in range(nh if dr.shape[1] > 2 else 0):
        later = -e[m] / closing  # the instant of contact by the limit
        dr[0, 2 + m] = dr[1, 2 + nh + m] = e[m]
        if not slips:
            dr[0, 2 + 2 * nh + m], dr[1, 2 + 2 * nh + m] = at[RATE1] * later, at[RATE2] * later
        else:
            dr[0, 2 + 2 * nh + m], dr[1, 2 + 2 * nh + m] = -np.cos(psi) * e[m], -np.sin(psi) * e[m]
            k = (m + 1) // 2
            rate = 0.0 if m == 0 else k * (e[m + 1] if m % 2 else -e[m - 1])
            sums.turn[2 + m], sums.turn[2 + nh + m] = (
                -np.sin(psi) * rate / speed,
                np.cos(psi) * rate / speed,
            )
            sums.turn[2 + 2 * nh + m] = bend / speed / (1 + speed / closing) * later
    return (SLIP if slips else STICK), psi


@njit(cache=True)
def slip_begins(contact, t, r, sums):
    """(state, angle, limit) of a slider at its limit at t; one that is too small to hold a
    direction against the motion holds none, and the contact is as if it had just closed."""
    at = np.empty(6)
    motion(contact.c, t, sums.e, at)
    speed = np.hypot(at[RATE1], at[RATE2])
    if at[LIMIT] <= SETTINGS.narrowest * speed and speed > at[LIMIT_RATE]:
        state, psi = after_contact(contact, t, r, sums)
        return state, psi, 0.0
    psi = np.arctan2(at[P2] - r[1], at[P1] - r[0])
    return SLIP, psi, turn_at(psi, np.hypot(at[P2] - r[1], at[P1] - r[0]), sums)


@njit(cache=True)
def one_period(contact, r, panel, sums, collect):
    """Carry the slider r (2,) and its derivatives through a period, with the integrals over it;
    return how long it slips, and the work times kt.

    collect : the integrals of the derivatives, too; these have 2 columns or 2 + 3 nh
    """
    e = sums.e
    at = np.empty(6)
    dr = sums.dr
    opened = contact.opened
    sums.g[:], dr[:] = 0.0, 0.0
    if collect:
        sums.D[:] = 0.0
    dr[0, 0] = dr[1, 1] = 1.0
    t = 0.0
    k = 0
    slid = 0.0
    work = 0.0
    h = SETTINGS.wide
    psi = 0.0
    limit = 0.0
    state = STICK
    motion(contact.c, 0.0, e, at)
    if len(opened) and opened[0, 0] == 0:
        state = OPEN
    else:
        psi = np.arctan2(at[P2] - r[1], at[P1] - r[0])
        if (
            np.hypot(at[P1] - r[0], at[P2] - r[1]) >= (1 - SETTINGS.on_limit) * at[LIMIT]
            and slides(at, psi) > 0
        ):
            state, psi, limit = slip_begins(contact, 0.0, r, sums)
    for _ in range(SETTINGS.pieces):
        stop = opened[k, 0] if k < len(opened) else TWO_PI
        if state == OPEN:
            t = opened[k, 1]
            k += 1
            limit, (state, psi) = 0.0, after_contact(contact, t, r, sums)
        elif state == STICK:
            end, slips = onset(contact, r, t, stop, e, at)
            add_rest(t, end, r, sums, collect)
            t, state = end, OPEN
            if slips:
                state, psi, limit = slip_begins(contact, t, r, sums)
        else:
            begin = t
            t, psi, h, stops, done = slip_through(
                contact, t, stop, psi, h, limit, panel, sums, collect
            )
            slid, work = slid + t - begin, work + done
            state = STICK if stops else (OPEN if t >= stop else SLIP)
            motion(contact.c, t, e, at)
            limit = at[LIMIT]
            r[0], r[1] = at[P1] - at[LIMIT] * np.cos(psi), at[P2] - at[LIMIT] * np.sin(psi)
        if t >= TWO_PI:
            return slid, work
    add_rest(t, TWO_PI, r, sums, collect)
    return slid, work


@njit(cache=True)
def begin(contact, r, pulled, e):
    """Pull the slider at t = 0 along where the limit does not hold it; whether it is. pulled (2, 3
    nh) : derivative by the series."""
    nh, at = len(e), np.empty(6)
    motion(contact.c, 0.0, e, at)
    T1, T2 = at[P1] - r[0], at[P2] - r[1]
    T, L = np.hypot(T1, T2), max(at[LIMIT], 0.0)
    pulled[:] = 0.0
    if T <= L:
        return False
    n1, n2, back = T1 / T, T2 / T, L / T
    r[0], r[1] = at[P1] - L * n1, at[P2] - L * n2
    for m in range(nh):
        pulled[0, m], pulled[0, nh + m] = (1 - back * n2 * n2) * e[m], back * n1 * n2 * e[m]
        pulled[1, m], pulled[1, nh + m] = back * n1 * n2 * e[m], (1 - back * n1 * n1) * e[m]
        if L > 0:
            pulled[0, 2 * nh + m], pulled[1, 2 * nh + m] = -n1 * e[m], -n2 * e[m]
    return True


@njit(cache=True)
def determinant(A):
    """Of I - A: zero where a period leaves the slider, or a part of it, where it was."""
    return (1 - A[0, 0]) * (1 - A[1, 1]) - A[0, 1] * A[1, 0]


@njit(cache=True)
def settle(contact, r, newton, panel, sums, room):
    """Take the slider to where its path repeats; returns (periods, repeats, whether there is no
    other such place, slipped).

    In the plane a slider only creeps to where it repeats. Newton on the map of a period takes it
    there, to the begin of the period with that map: where the limit is only touched, the next one
    may slip or stick by the last digit."""
    A = sums.dr
    before = np.empty(2)
    slid = 0.0
    jumped = False
    for periods in range(1, SETTINGS.max_periods + 1):
        before[:] = r
        slid += one_period(contact, r, panel, sums, False)[0]
        if slid == 0:
            return periods, True, False, False
        if newton and np.abs(A).max() < SETTINGS.forgets:
            return periods, True, True, True
        e1, e2 = r[0] - before[0], r[1] - before[1]
        if periods > 1 and max(abs(e1), abs(e2)) <= SETTINGS.repeats * contact.size:
            if jumped:
                r[:] = before
            return periods, True, jumped, True
        det = determinant(A)
        if periods > 1 and newton and abs(det) > SETTINGS.regular:
            jumped = True
            r[0] = before[0] + ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det
            r[1] = before[1] + (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det
            begin(contact, r, room, sums.e)
    return SETTINGS.max_periods, False, jumped, True


@njit(cache=True)
def fixed_point(contact, r, panel, sums, start):
    """(slipped, work times kt) of the period from r, and whether what it does to the slider can be
    inverted: `start` (2, 3 nh) is filled with the derivative of r by the series, where r comes back
    to itself."""
    slip, work = one_period(contact, r, panel, sums, True)
    A, e1, e2 = sums.dr[:, :2], sums.dr[0, 2:], sums.dr[1, 2:]
    det = determinant(A)
    if not abs(det) > SETTINGS.regular:
        return slip, work, False
    start[0], start[1] = (
        ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det,
        (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det,
    )
    return slip, work, True


@njit(cache=True)
def from_start(contact, r, periods, panel, sums, start, room):
    """(slipped, work times kt) of the last of some periods from r; `start` (2, 3 nh), derivative of
    r by the series, is carried to its begin."""
    slip, work = 0.0, 0.0
    for period in range(periods):
        slip, work = one_period(contact, r, panel, sums, period == periods - 1)
        if period < periods - 1:
            carry(sums, start, room)
    return slip, work


@njit(cache=True)
def carry(sums, start, room):
    """Carry the derivative of the slider by the series, `start` (2, 3 nh), through the period that
    is in `sums`."""
    room[:] = sums.dr[:, 2:]
    for d in range(2):
        room[d] += sums.dr[d, 0] * start[0] + sums.dr[d, 1] * start[1]
    start[:] = room


@njit(cache=True)
def beyond(at, r):
    """|p - r| - L, and its rate."""
    T1, T2 = at[P1] - r[0], at[P2] - r[1]
    T = max(np.hypot(T1, T2), TINY)
    return T - at[LIMIT], (T1 * at[RATE1] + T2 * at[RATE2]) / T - at[LIMIT_RATE]


@njit(cache=True)
def furthest(contact, r, e, at):
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
def crest(contact, r, a, b, e, at):
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
def nearest_common(first, discs, room, r):
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
def onto(first, disc, tried):
    """Fill in the point of the border of a disc that is nearest to `first`, outside; returns 1."""
    away = max(np.hypot(first[0] - disc[0], first[1] - disc[1]), TINY)
    for d in range(2):
        tried[0, d] = disc[d] + disc[2] / away * (first[d] - disc[d])
    return 1


@njit(cache=True)
def borders(first, a, b, tried):
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
def carry_onto(contact, first, t, start, e):
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
        k = (m + 1) // 2
        rate = 0.0 if m == 0 else k * (e[m + 1] if m % 2 else -e[m - 1])
        dp1, dp2, dL = e[m] * (q < nh), e[m] * (nh <= q < 2 * nh), e[m] * (q >= 2 * nh)
        changed = rate * (n1 * (q < nh) + n2 * (nh <= q < 2 * nh) - (q >= 2 * nh))
        changed += across * (n1 * (dp2 - start[1, q]) - n2 * (dp1 - start[0, q]))
        later = -changed / bend if abs(bend) > 1e-12 * contact.size else 0.0
        dp1, dp2, dL = (
            dp1 + at[RATE1] * later,
            dp2 + at[RATE2] * later,
            dL + at[LIMIT_RATE] * later,
        )
        turn = L / d * (n1 * (start[1, q] - dp2) - n2 * (start[0, q] - dp1))
        start[0, q], start[1, q] = dp1 - n1 * dL - n2 * turn, dp2 - n2 * dL + n1 * turn


@njit(cache=True)
def carry_to_corner(contact, r, t1, t2, start, e):
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
def resting_place(contact, r, missed, start, e):
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
        times[k], discs[k, 0], discs[k, 1], discs[k, 2] = t, at[P1], at[P2], at[LIMIT]
        discs[k, 2] += slack
        i, j = nearest_common(first, discs[: k + 1], room, r)
        low = slack
        while i < 0 and slack < missed:
            low, wider = slack, max(9 * slack, room)
            slack += wider
            discs[: k + 1, 2] += wider
            i, j = nearest_common(first, discs[: k + 1], room, r)
        while i >= 0 and slack - low > 1e-3 * slack + room:  # no more than they miss
            less = 0.5 * (slack - low)
            discs[: k + 1, 2] -= less
            i, j = nearest_common(first, discs[: k + 1], room, r)
            if i >= 0:
                slack -= less
                continue
            low += less
            discs[: k + 1, 2] += less
            i, j = nearest_common(first, discs[: k + 1], room, r)
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


@njit(cache=True)
def at_rest(r, start, sums, D):
    """As `one_contact`, of a slider that stays at r with the derivative `start` (2, 3 nh)."""
    sums.g[:], sums.g[:, 0] = 0.0, TWO_PI * r
    D[:], D[0] = 0.0, TWO_PI * start
    return 0.0, 0.0, start.any()


@njit(cache=True)
def one_contact(contact, given, panel, light, sums, D):
    """(slipped, work times kt, whether D is not zero) of the periodic cycle of a contact; sums.g is
    filled, and D (nh, 2, 3 nh) with the integrals of the derivatives of r.

    The derivative is that of a fixed point of the map of a period. Where a contact has come to
    rest, and where it creeps to a rest that Newton would miss, the derivative is carried through
    all periods from the start. With `nearest` whether it rests at all is decided by whether there
    is a place, and not by the slip of a period, which may be rounding.
    """
    nh = sums.g.shape[1]
    r = np.array([given[0], given[1]])
    start = np.zeros((2, 3 * nh))
    from_position, nearest = given[2], given[3] and not given[2] and not len(contact.opened)
    if nearest and resting_place(contact, r, 0.0, start, sums.e):
        return at_rest(r, start, sums, D)
    if from_position:
        motion(contact.c, 0.0, sums.e, np.empty(6))
        for d in range(2):
            r[d], start[d, d * nh : (d + 1) * nh] = contact.wave[d, 0], sums.e
    pulled = not from_position and begin(contact, r, start, sums.e)
    first, repeated, room = r.copy(), start.copy(), np.empty((2, 3 * nh))
    periods, repeats, alone, slid = settle(contact, r, True, panel, light, room)
    if not slid and not pulled and not from_position:
        return at_rest(r, start, sums, D)
    slip, work, inverted = 0.0, 0.0, False
    if alone and repeats:
        slip, work, inverted = fixed_point(contact, r, panel, sums, repeated)
    if not inverted:
        r[:] = first
        if alone:
            periods, repeats = settle(contact, r, False, panel, light, room)[:2]
            r[:] = first
        slip, work = from_start(contact, r, periods, panel, sums, start, room)
        repeated[:] = start
        if not (repeats or len(contact.opened)):
            carry(sums, start, room)
            if resting_place(contact, r, SETTINGS.nearly * contact.scale, start, sums.e):
                return at_rest(r, start, sums, D)
    for j in range(nh):
        for d in range(2):
            D[j, d] = (
                sums.D[j, d, 2:] + sums.D[j, d, 0] * repeated[0] + sums.D[j, d, 1] * repeated[1]
            )
    return slip, work, True


@njit(cache=True)
def largest_limit(c, at_samples, opened, e):
    """Of a contact at the samples, and half way through each time in which it is closed, which may
    lie between two of them."""
    largest = at_samples.max()
    at = np.empty(6)
    closed = 0.0
    for k in range(len(opened) + 1):
        opens = opened[k, 0] if k < len(opened) else TWO_PI
        if opens > closed:
            motion(c, 0.5 * (closed + opens), e, at)
            largest = max(largest, at[LIMIT])
        if k < len(opened):
            closed = opened[k, 1]
    return largest


@njit(cache=True)
def cycle(c, waves, kt, start, opened, found):
    """Sliders of the periodic cycle at the motion c (P, 3, nh), in forces: kt u1, kt u2 and mu N.

    waves : c at the samples (P, 3, n), its rates, instants (n + 1,); start : SliderStart in forces
    opened : pieces (P, k, 7) in which a contact is open (`uncoupled.events`), and their numbers
    (P,)
    found : filled with the harmonics of -r (P, 2, nh) and of their derivatives by c (P, 2, nh, 3,
        nh), work (P,); in active (P, 3) and shares (P, 3) slip is added
    """
    (wave, rate, tau), (g, D, active, shares, works) = waves, found
    P, _, nh = c.shape
    panel = Panel(
        np.empty((STAGES, nh)),
        np.empty((STAGES, 6)),
        np.empty(STAGES),
        np.empty((STAGES, STAGES)),
        np.empty((STAGES, STAGES)),
        np.empty(STAGES),
        np.empty(STAGES),
    )
    sums = Sums(
        np.empty((2, nh)),
        np.empty((nh, 2, 2 + 3 * nh)),
        np.empty((2, 2 + 3 * nh)),
        np.empty(2 + 3 * nh),
        np.empty(nh),
    )
    light = Sums(sums.g, sums.D, np.empty((2, 2)), np.empty(2), sums.e)
    raw = np.empty((nh, 2, 3 * nh))
    for p in range(P):
        apart = opened[0][p, : opened[1][p], 1:3]
        scale = largest_limit(c[p], wave[p, 2], apart, sums.e)
        if kt[p] == 0 or scale <= 0:
            continue
        contact = Contact(
            c[p], wave[p], rate[p], tau, apart, np.abs(wave[p, :2]).max() + 1e-300, scale
        )
        given = (
            start.positions[p, 0],
            start.positions[p, 1],
            start.from_position,
            start.nearest,
        )
        slid, work, moves = one_contact(contact, given, panel, light, sums, raw)
        shares[p, 1], works[p] = slid / TWO_PI, work / kt[p]
        shares[p, 0] = max(0.0, 1 - shares[p, 1] - shares[p, 2])
        active[p, 0], active[p, 1] = active[p, 0] or moves, active[p, 1] or moves
        for j in range(nh):
            project = -1 / (TWO_PI if j == 0 else np.pi)
            for d in range(2):
                g[p, d, j] = project * sums.g[d, j]
                for m in range(3 * nh if moves else 0):
                    D[p, d, j, m // nh, m % nh] = project * raw[j, d, m]
