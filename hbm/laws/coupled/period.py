"""A period of a coupled slider, event by event, and where its path repeats.

r is continuous in time: derivatives of its integrals are integrals of its derivatives, and the
instants of the events contribute only where they tell a place of rest.
"""

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
    Contact,
    basis_rate,
    bend,
    direction,
    motion,
    onset,
    slides,
)
from tipdamp.hbm.laws.coupled.slip import Panel, Sums, add_rest, keep, slip_through, turn_at
from tipdamp.hbm.laws.uncoupled.breaks import FORWARD as SLIP
from tipdamp.hbm.laws.uncoupled.breaks import OPEN, STICK, TWO_PI


@njit(cache=True)
def after_contact(contact: Contact, t: float, r: np.ndarray, sums: Sums) -> tuple[int, float]:
    """(state, angle) of a contact that closes at t, and the slider with its derivatives: at the
    place of the motion there it rests, or from it it is pulled along."""
    at, e, dr, nh = np.empty(6), sums.e, sums.dr, sums.g.shape[1]
    motion(contact.c, t, e, at)
    r[0], r[1] = at[P1], at[P2]
    speed, closing = np.hypot(at[RATE1], at[RATE2]), max(at[LIMIT_RATE], 1e-300)
    dr[:], sums.turn[:] = 0.0, 0.0
    slips, psi = speed > closing, np.arctan2(at[RATE2], at[RATE1])
    cos, sin, bent = np.cos(psi), np.sin(psi), bend(contact.c, e, psi)
    for m in range(nh if dr.shape[1] > 2 else 0):
        later = -e[m] / closing  # the instant of contact by the limit
        dr[0, 2 + m] = dr[1, 2 + nh + m] = e[m]
        if not slips:
            dr[0, 2 + 2 * nh + m], dr[1, 2 + 2 * nh + m] = at[RATE1] * later, at[RATE2] * later
        else:
            dr[0, 2 + 2 * nh + m], dr[1, 2 + 2 * nh + m] = -cos * e[m], -sin * e[m]
            rate = basis_rate(e, m)
            sums.turn[2 + m], sums.turn[2 + nh + m] = -sin * rate / speed, cos * rate / speed
            sums.turn[2 + 2 * nh + m] = bent / speed / (1 + speed / closing) * later
    return (SLIP if slips else STICK), psi


@njit(cache=True)
def slip_begins(contact: Contact, t: float, r: np.ndarray, sums: Sums) -> tuple[int, float, float]:
    """(state, angle, limit) of a slider at its limit at t; one that is too small to hold a
    direction against the motion holds none, and the contact is as if it had just closed."""
    at = np.empty(6)
    motion(contact.c, t, sums.e, at)
    speed = np.hypot(at[RATE1], at[RATE2])
    if at[LIMIT] <= SETTINGS.narrowest * speed and speed > at[LIMIT_RATE]:
        state, psi = after_contact(contact, t, r, sums)
        return state, psi, 0.0
    psi = direction(at, r)
    return SLIP, psi, turn_at(psi, np.hypot(at[P2] - r[1], at[P1] - r[0]), sums)


@njit(cache=True)
def first_state(contact: Contact, r: np.ndarray, sums: Sums) -> tuple[int, float, float]:
    """(state, angle, limit) of a slider at the begin of a period."""
    at = np.empty(6)
    motion(contact.c, 0.0, sums.e, at)
    if len(contact.opened) and contact.opened[0, 0] == 0:
        return OPEN, 0.0, 0.0
    psi, T = direction(at, r), np.hypot(at[P1] - r[0], at[P2] - r[1])
    if T >= (1 - SETTINGS.on_limit) * at[LIMIT] and slides(at, psi) > 0:
        return slip_begins(contact, 0.0, r, sums)
    return STICK, psi, 0.0


@njit(cache=True)
def one_period(contact: Contact, r: np.ndarray, panel: Panel, sums: Sums) -> tuple[float, float]:
    """Carry the slider r (2,) and its derivatives through a period, with the integrals over it;
    return how long it slips, and the work times kt."""
    e, at, dr, opened = sums.e, np.empty(6), sums.dr, contact.opened
    sums.g[:], sums.D[:], dr[:], sums.count[0] = 0.0, 0.0, 0.0, 0
    dr[0, 0] = dr[1, 1] = 1.0
    t, k, slid, work, h = 0.0, 0, 0.0, 0.0, SETTINGS.wide
    state, psi, limit = first_state(contact, r, sums)
    for _ in range(SETTINGS.pieces):
        stop = opened[k, 0] if k < len(opened) else TWO_PI
        if state == OPEN:
            keep(sums, OPEN, t, opened[k, 1], 0.0, panel.psi)
            t = opened[k, 1]
            k += 1
            limit, (state, psi) = 0.0, after_contact(contact, t, r, sums)
        elif state == STICK:
            end, slips = onset(contact, r, t, stop, e, at)
            add_rest(t, end, r, sums)
            keep(sums, STICK, t, end, 0.0, panel.psi)
            t, state = end, OPEN
            if slips:
                state, psi, limit = slip_begins(contact, t, r, sums)
        else:
            begin = t
            t, psi, h, stops, done = slip_through(contact, t, stop, psi, h, limit, panel, sums)
            slid, work = slid + t - begin, work + done
            state = SLIP
            if stops:
                state = STICK
            elif t >= stop:
                state = OPEN
            motion(contact.c, t, e, at)
            limit = at[LIMIT]
            r[0], r[1] = at[P1] - at[LIMIT] * np.cos(psi), at[P2] - at[LIMIT] * np.sin(psi)
        if t >= TWO_PI:
            return slid, work
    add_rest(t, TWO_PI, r, sums)
    keep(sums, STICK, t, TWO_PI, 0.0, panel.psi)
    return slid, work


@njit(cache=True)
def begin(contact: Contact, r: np.ndarray, pulled: np.ndarray, e: np.ndarray) -> bool:
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
def determinant(A: np.ndarray) -> float:
    """Of I - A: zero where a period leaves the slider, or a part of it, where it was."""
    return (1 - A[0, 0]) * (1 - A[1, 1]) - A[0, 1] * A[1, 0]


@njit(cache=True)
def settle(
    contact: Contact, r: np.ndarray, regular: float, panel: Panel, sums: Sums, room: np.ndarray
) -> tuple[int, bool, bool, bool]:
    """Take the slider to where its path repeats; returns (periods, repeats, whether there is no
    other such place, slipped).

    In the plane a slider only creeps to where it repeats. Newton on the map of a period takes it
    there, to the begin of the period with that map: where the limit is only touched, the next one
    may slip or stick by the last digit. It is taken where |det(I - A)| is above `regular`."""
    A = sums.dr
    before = np.empty(2)
    slid = 0.0
    jumped = False
    for periods in range(1, SETTINGS.max_periods + 1):
        before[:] = r
        slid += one_period(contact, r, panel, sums)[0]
        if slid == 0:
            return periods, True, False, False
        if np.abs(A).max() < SETTINGS.forgets:
            return periods, True, True, True
        e1, e2 = r[0] - before[0], r[1] - before[1]
        if periods > 1 and max(abs(e1), abs(e2)) <= SETTINGS.repeats * contact.size:
            if jumped:
                r[:] = before
            return periods, True, jumped, True
        det = determinant(A)
        if periods > 1 and abs(det) > regular:
            jumped = True
            r[0] = before[0] + ((1 - A[1, 1]) * e1 + A[0, 1] * e2) / det
            r[1] = before[1] + (A[1, 0] * e1 + (1 - A[0, 0]) * e2) / det
            begin(contact, r, room, sums.e)
    return SETTINGS.max_periods, False, jumped, True


@njit(cache=True)
def fixed_point(
    contact: Contact, r: np.ndarray, panel: Panel, sums: Sums, start: np.ndarray
) -> tuple[float, float, bool]:
    """(slipped, work times kt) of the period from r, and whether what it does to the slider can be
    inverted: `start` (2, 3 nh) is filled with the derivative of r by the series, where r comes back
    to itself."""
    slip, work = one_period(contact, r, panel, sums)
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
def from_start(
    contact: Contact,
    r: np.ndarray,
    periods: int,
    panel: Panel,
    sums: Sums,
    start: np.ndarray,
    room: np.ndarray,
) -> tuple[float, float]:
    """(slipped, work times kt) of the last of some periods from r; `start` (2, 3 nh), derivative of
    r by the series, is carried to its begin."""
    slip, work = 0.0, 0.0
    for period in range(periods):
        slip, work = one_period(contact, r, panel, sums)
        if period < periods - 1:
            carry(sums, start, room)
    return slip, work


@njit(cache=True)
def carry(sums: Sums, start: np.ndarray, room: np.ndarray) -> None:
    """Carry the derivative of the slider by the series, `start` (2, 3 nh), through the period that
    is in `sums`."""
    room[:] = sums.dr[:, 2:]
    for d in range(2):
        room[d] += sums.dr[d, 0] * start[0] + sums.dr[d, 1] * start[1]
    start[:] = room
