"""Slip of a coupled slider by collocation, with its integrals over the cycle.

In slip T = L (cos psi, sin psi), and the angle obeys

    L psi' = p' . t(psi),        t = (-sin psi, cos psi)

until p' . n - L', the rate at which the slider moves, is no longer positive. This is integrated by
Radau collocation [Hairer, Wanner 1996, IV.5], implicit, since the angle follows the velocity ever
faster the smaller L is, and multiplied by L, so that it holds where the contact closes and opens.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.coupled.motion import (
    LIMIT,
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
    slides,
)
from tipdamp.hbm.laws.uncoupled.breaks import FORWARD

STAGES = 6


def _radau(s: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
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

Panel = namedtuple("Panel", "e at psi inverse stage slope turn")
Panel.__doc__ = (
    "Basis e (s, nh), motion at (s, 6), angle psi (s,), inverse (s, s) of its equations, and "
    "room for them."
)

Sums = namedtuple("Sums", "g D dr turn e path count")
Sums.__doc__ = """Integrals over a period: g (2, nh) of e_j r, D (nh, 2, columns) of e_j dr, or
empty where they are not wanted; dr (2, columns) now, turn (columns,) of the angle; e (nh,) room.
Columns: the slider at t = 0 (2), then the series of p1, p2 and L.

path (m, PIECE), count (1,) : pieces of the period, state, begin, end, and of slip the angle at the
begin and at the nodes; m = 0 where they are not kept"""

PIECE = 4 + STAGES


@njit(cache=True)
def invert(J: np.ndarray, inverse: np.ndarray) -> bool:
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
def newton_step(h: float, psi0: float, panel: Panel) -> float:
    """One step of Newton's method for the angles at the nodes; the largest change in rad, infinite
    where there is none."""
    psi, slope, J = panel.psi, panel.slope, panel.stage
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
    return moved


@njit(cache=True)
def collocate(contact: Contact, t: float, h: float, psi0: float, panel: Panel) -> float:
    """Angle at the nodes of the panel [t, t + h] of slip; its highest term in rad of the largest
    limit, infinite where Newton's method fails."""
    for i in range(STAGES):
        motion(contact.c, t + h * NODES[i], panel.e[i], panel.at[i])
        panel.psi[i] = psi0
    for _ in range(SETTINGS.newton):
        moved = newton_step(h, psi0, panel)
        if not moved <= 2.0:
            return np.inf
        if moved <= SETTINGS.turned:
            highest, limit = THROUGH[0] * psi0, 0.0
            for i in range(STAGES):
                highest += THROUGH[i + 1] * panel.psi[i]
                limit = max(limit, panel.at[i, LIMIT])
            return abs(highest) / 2.0 ** (2 * STAGES - 1) * limit / contact.scale
    return np.inf


@njit(cache=True)
def rests(
    contact: Contact, t: float, h: float, psi0: float, panel: Panel, e: np.ndarray, at: np.ndarray
) -> float:
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
def between(psi: np.ndarray, psi0: float, x: float) -> float:
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
def keep(sums: Sums, state: int, begin: float, end: float, psi0: float, psi: np.ndarray) -> None:
    """Append a piece to the path that is kept."""
    k = sums.count[0]
    if k < len(sums.path) and end > begin:
        piece = sums.path[k]
        piece[0], piece[1], piece[2], piece[3] = state, begin, end, psi0
        piece[4:] = psi
        sums.count[0] = k + 1


@njit(cache=True)
def add_rest(a: float, b: float, r: np.ndarray, sums: Sums) -> None:
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
            for q in range(sums.D.shape[2] if len(sums.D) else 0):
                sums.D[j, d, q] += weight * sums.dr[d, q]


@njit(cache=True)
def add_panel(h: float, limit: float, panel: Panel, sums: Sums) -> float:
    """Add the integrals over a panel of slip that begins at `limit`, and carry the derivatives to
    its end, its last node; return the work times kt."""
    e, dr, work = panel.e, sums.dr, 0.0
    for i in range(STAGES):
        at, cos, sin = panel.at[i], np.cos(panel.psi[i]), np.sin(panel.psi[i])
        weight, L = h * WEIGHTS[i], at[LIMIT]
        work += weight * L * slides(at, panel.psi[i])
        for j in range(e.shape[1]):
            sums.g[0, j] += weight * e[i, j] * (at[P1] - L * cos)
            sums.g[1, j] += weight * e[i, j] * (at[P2] - L * sin)
        if not len(sums.D) and i < STAGES - 1:
            continue
        turns(i, h, limit, panel, sums)
        if i == STAGES - 1:
            sums.turn[:] = dr[0]
        slider_by_angle(e[i], L, cos, sin, dr)
        for j in range(len(sums.D)):
            f = weight * e[i, j]
            for d in range(2):
                for q in range(dr.shape[1]):
                    sums.D[j, d, q] += f * dr[d, q]
    return work


@njit(cache=True)
def slider_by_angle(e: np.ndarray, L: float, cos: float, sin: float, dr: np.ndarray) -> None:
    """Fill the derivative dr (2, columns) of a slider in slip at the limit L, from that of the
    angle, which dr[0] is; e (nh,) : basis at the instant."""
    nh, columns = len(e), dr.shape[1]
    for q in range(columns):
        along = L * dr[0, q]
        dr[0, q], dr[1, q] = along * sin, -along * cos
    for m in range(nh if columns > 2 else 0):
        dr[0, 2 + m] += e[m]
        dr[1, 2 + nh + m] += e[m]
        dr[0, 2 + 2 * nh + m] -= cos * e[m]
        dr[1, 2 + 2 * nh + m] -= sin * e[m]


@njit(cache=True)
def turns(i: int, h: float, limit: float, panel: Panel, sums: Sums) -> None:
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
            rate = basis_rate(e[k], m)
            into[2 + m] += t1 * rate
            into[2 + nh + m] += t2 * rate
            into[2 + 2 * nh + m] -= back * e[k, m]


@njit(cache=True)
def slip_through(
    contact: Contact,
    t: float,
    stop: float,
    psi: float,
    h: float,
    limit: float,
    panel: Panel,
    sums: Sums,
) -> tuple[float, float, float, bool, float]:
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
        width = h
        if left <= h:
            width = left
        elif left < 2 * h:
            width = 0.5 * left
        error = collocate(contact, t, width, psi, panel)
        growth = 0.8 * (SETTINGS.degree / max(error, 1e-300)) ** (1 / STAGES)
        if error > SETTINGS.degree and width > SETTINGS.narrowest:
            h = width * max(0.2, growth)
            continue
        if np.isinf(error):  # nothing turns in no time
            t += width
            continue
        share = rests(contact, t, width, psi, panel, sums.e, at)
        slips = share * width
        if share < 1 and slips > 1e-14:
            collocate(contact, t, slips, psi, panel)
        if slips > 1e-14:
            work += add_panel(slips, limit, panel, sums)
            keep(sums, FORWARD, t, t + slips, psi, panel.psi)
            psi, limit = panel.psi[STAGES - 1], panel.at[STAGES - 1, LIMIT]
        t += slips
        if share < 1:
            return t, psi, h, True, work
        h = min(widest, width * min(4.0, growth))
    return t, psi, h, False, work


@njit(cache=True)
def turn_at(psi: float, limit: float, sums: Sums) -> float:
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
