"""Coulomb friction coupled in the tangential plane: stick, slip and lift-off of the periodic cycle.

In forces: of a contact the spring carries T = p - r under the limit L = mu N (`motion`). Events are
located in time, slip between them is integrated by collocation (`slip`), period by period
(`period`) until the path of the slider repeats or it has found its rest (`resting_place`).
"""

from typing import TYPE_CHECKING

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.coupled.motion import LIMIT, SETTINGS, Contact, motion
from tipdamp.hbm.laws.coupled.period import (
    begin,
    carry,
    fixed_point,
    from_start,
    one_period,
    settle,
)
from tipdamp.hbm.laws.coupled.resting_place import resting_place
from tipdamp.hbm.laws.coupled.slip import PIECE, STAGES, Panel, Sums, keep
from tipdamp.hbm.laws.uncoupled.breaks import STICK, TWO_PI

if TYPE_CHECKING:
    from tipdamp.hbm.laws.records import SliderStart


@njit(cache=True)
def at_rest(
    r: np.ndarray, start: np.ndarray, sums: Sums, D: np.ndarray
) -> tuple[float, float, np.bool_]:
    """As `one_contact`, of a slider that stays at r with the derivative `start` (2, 3 nh)."""
    sums.g[:], sums.g[:, 0] = 0.0, TWO_PI * r
    D[:], D[0] = 0.0, TWO_PI * start
    return 0.0, 0.0, start.any()


@njit(cache=True)
def one_contact(
    contact: Contact,
    r: np.ndarray,
    given: tuple[bool, bool],
    panel: Panel,
    light: Sums,
    sums: Sums,
    D: np.ndarray,
) -> tuple[float, float, bool]:
    """(slipped, work times kt, whether D is not zero) of the periodic cycle of a contact; sums.g is
    filled, and D (nh, 2, 3 nh) with the integrals of the derivatives of r.

    r (2,) : the slider at the start, then at the begin of the cycle; given : from_position and
    nearest of the SliderStart
    The derivative is that of a fixed point of the map of a period. Where a contact has come to
    rest, and where it creeps to a rest that Newton would miss, the derivative is carried through
    all periods from the start. With `nearest` whether it rests at all is decided by whether there
    is a place, and not by the slip of a period, which may be rounding.
    """
    nh, from_position, opens = sums.g.shape[1], given[0], len(contact.opened) > 0
    start, nearest = np.zeros((2, 3 * nh)), given[1] and not from_position and not opens
    if nearest and resting_place(contact, r, 0.0, start, sums.e):
        return at_rest(r, start, sums, D)
    if from_position:
        motion(contact.c, 0.0, sums.e, np.empty(6))
        for d in range(2):
            r[d], start[d, d * nh : (d + 1) * nh] = contact.wave[d, 0], sums.e
    pulled = not from_position and begin(contact, r, start, sums.e)
    first, repeated, room = r.copy(), start.copy(), np.empty((2, 3 * nh))
    periods, repeats, alone, slid = settle(contact, r, SETTINGS.regular, panel, light, room)
    if not slid and not pulled and not from_position:
        return at_rest(r, start, sums, D)
    slip, work, inverted = 0.0, 0.0, False
    if alone and repeats:
        slip, work, inverted = fixed_point(contact, r, panel, sums, repeated)
    if not inverted:
        r[:] = first
        if alone:
            periods, repeats = settle(contact, r, np.inf, panel, light, room)[:2]
            r[:] = first
        slip, work = from_start(contact, r, periods, panel, sums, start, room)
        repeated[:] = start
        if not (repeats or opens):
            carry(sums, start, room)
            if resting_place(contact, r, SETTINGS.nearly * contact.scale, start, sums.e):
                return at_rest(r, start, sums, D)
    for j in range(nh):
        for d in range(2):
            by = sums.D[j, d]
            D[j, d] = by[2:] + by[0] * repeated[0] + by[1] * repeated[1]
    return slip, work, True


@njit(cache=True)
def largest_limit(
    c: np.ndarray, at_samples: np.ndarray, opened: np.ndarray, e: np.ndarray
) -> float:
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
def room_for(nh: int) -> tuple[Panel, Sums, Sums]:
    """Panel, Sums, and Sums without derivatives by the series of nh coefficients and without their
    integrals; no path is kept."""
    s = STAGES
    square, inverse = np.empty((s, s)), np.empty((s, s))
    panel = Panel(
        np.empty((s, nh)), np.empty((s, 6)), np.empty(s), inverse, square, np.empty(s), np.empty(s)
    )
    columns = 2 + 3 * nh
    g, D, e = np.empty((2, nh)), np.empty((nh, 2, columns)), np.empty(nh)
    path, count = np.empty((0, PIECE)), np.zeros(1, np.int64)
    sums = Sums(g, D, np.empty((2, columns)), np.empty(columns), e, path, count)
    return panel, sums, Sums(g, D[:0], np.empty((2, 2)), np.empty(2), e, path, count)


@njit(cache=True)
def contact_at(
    p: int, c: np.ndarray, waves: tuple, opened: tuple[np.ndarray, np.ndarray], e: np.ndarray
) -> Contact:
    """Contact p of those that `cycle` is given; its scale is not positive where it never
    closes."""
    (wave, rate, tau), apart = waves, opened[0][p, : opened[1][p], 1:3]
    scale = largest_limit(c[p], wave[p, 2], apart, e)
    size = np.abs(wave[p, :2]).max() + 1e-300
    return Contact(c[p], wave[p], rate[p], tau, apart, size, scale)


@njit(cache=True)
def cycle(
    c: np.ndarray,
    waves: tuple[np.ndarray, np.ndarray, np.ndarray],
    kt: np.ndarray,
    start: "SliderStart",
    opened: tuple[np.ndarray, np.ndarray],
    found: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Sliders of the periodic cycle at the motion c (P, 3, nh), in forces: kt u1, kt u2 and mu N.

    waves : c at the samples (P, 3, n), its rates, instants (n + 1,); start : SliderStart in forces
    opened : pieces (P, k, 7) in which a contact is open (`uncoupled.events`), and their numbers
    (P,)
    found : filled with the harmonics of -r (P, 2, nh) and of their derivatives by c (P, 2, nh, 3,
        nh), work (P,); in active (P, 3) and shares (P, 3) slip is added
    """
    g, D, active, shares, works = found
    P, _, nh = c.shape
    panel, sums, light = room_for(nh)
    raw = np.empty((nh, 2, 3 * nh))
    for p in range(P):
        contact = contact_at(p, c, waves, opened, sums.e)
        if kt[p] == 0 or contact.scale <= 0:
            continue
        r, given = start.positions[p].copy(), (start.from_position, start.nearest)
        slid, work, moves = one_contact(contact, r, given, panel, light, sums, raw)
        shares[p, 1], works[p] = slid / TWO_PI, work / kt[p]
        shares[p, 0] = max(0.0, 1 - shares[p, 1] - shares[p, 2])
        if moves:
            active[p, :2] = True
        for j in range(nh):
            project = -1 / (TWO_PI if j == 0 else np.pi)
            for d in range(2):
                g[p, d, j] = project * sums.g[d, j]
                if moves:
                    D[p, d, j] = project * raw[j, d].reshape(3, nh)


@njit(cache=True)
def paths(
    c: np.ndarray,
    waves: tuple[np.ndarray, np.ndarray, np.ndarray],
    kt: np.ndarray,
    start: "SliderStart",
    opened: tuple[np.ndarray, np.ndarray],
    found: tuple[np.ndarray, np.ndarray],
) -> None:
    """Fill path (P, m, PIECE) and counts (P,) with the pieces of the periodic cycle, as in `Sums`;
    none of a contact that carries no tangential force. The others are as in `cycle`.

    A slider that has a place of rest stays there: that it slips where it touches its limit would be
    rounding."""
    (path, counts), (P, _, nh) = found, c.shape
    panel, sums, light = room_for(nh)
    raw = np.empty((nh, 2, 3 * nh))
    for p in range(P):
        counts[p] = 0
        contact = contact_at(p, c, waves, opened, sums.e)
        if kt[p] == 0 or contact.scale <= 0:
            continue
        r, given = start.positions[p].copy(), (start.from_position, start.nearest)
        slid = one_contact(contact, r, given, panel, light, sums, raw)[0]
        kept = Sums(light.g, light.D, light.dr, light.turn, light.e, path[p], light.count)
        if slid > 0 or len(contact.opened):
            one_period(contact, r, panel, kept)
        else:
            kept.count[0] = 0
            keep(kept, STICK, 0.0, TWO_PI, 0.0, panel.psi)
        counts[p] = light.count[0]
