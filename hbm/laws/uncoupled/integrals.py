"""Harmonics of friction and contact forces from the pieces of the cycle, and their exact
derivatives.

What is computed is the deviation g of the force from that of the stuck springs: g_t = -kt w with
the slider at w, and g_n = N - (preload + kn u_n), zero while closed. Both are continuous in time
and, piece by piece (see `events`), a constant or a combination of the harmonics of u. Pieces are
integrated in closed form; since g is continuous, the instants of the events contribute only through
the rest position of the slider.
"""

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.laws.uncoupled.breaks import (
    BACKWARD,
    BEGIN,
    BY_N,
    BY_U,
    END,
    FORWARD,
    INSTANT,
    OPEN,
    PLACE,
    STICK,
    TWO_PI,
    Sliders,
)


@njit(cache=True)
def add_integrals(a: float, b: float, C: np.ndarray, S: np.ndarray) -> None:
    """Add the integrals over [a, b] of cos(n tau) to C[n] and of sin(n tau) to S[n]."""
    C[0] += b - a
    ca1 = np.cos(a)
    sa1 = np.sin(a)
    cb1 = np.cos(b)
    sb1 = np.sin(b)
    ca = 1.0
    sa = 0.0
    cb = 1.0
    sb = 0.0
    for n in range(1, len(C)):
        ca, sa = ca * ca1 - sa * sa1, sa * ca1 + ca * sa1
        cb, sb = cb * cb1 - sb * sb1, sb * cb1 + cb * sb1
        C[n] += (sb - sa) / n
        S[n] += (ca - cb) / n


@njit(cache=True)
def add_products(D: np.ndarray, factor: float, C: np.ndarray, S: np.ndarray) -> None:
    """D[j, m] += factor * c_j * integral of e_j e_m, where c_j projects on e_j (1/2pi, then
    1/pi)."""
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
                s = q if sine_m else p  # order of the sine, c of the cosine
                c = p if sine_m else q
                value = -0.5 * (S[far] + (S[near] if s >= c else -S[near]))
            D[j, m] += f * value


@njit(cache=True)
def add_constant(g: np.ndarray, factor: float, C: np.ndarray, S: np.ndarray) -> None:
    """g[j] += factor * c_j * integral of e_j."""
    g[0] += factor * C[0] / TWO_PI
    for j in range(1, len(g)):
        k = (j + 1) // 2
        g[j] += factor / np.pi * (C[k] if j % 2 else -S[k])


@njit(cache=True)
def add_ride(g: np.ndarray, D: np.ndarray, factor: float, A: np.ndarray, u: np.ndarray) -> None:
    """D += factor A and g += factor A u: a force that follows u."""
    for j in range(len(u)):
        value = 0.0
        for m in range(len(u)):
            D[j, m] += factor * A[j, m]
            value += A[j, m] * u[m]
        g[j] += factor * value


@njit(cache=True)
def add_rest(
    into: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    contact: tuple[float, float, float, float],
    piece: np.ndarray,
    C: np.ndarray,
    S: np.ndarray,
) -> None:
    """Add the derivative of a rest: the integral of e_j times that of the rest position."""
    _, Dt, Dn, gp = into
    kt, kn, _, _ = contact
    nh = len(gp)
    projection = np.zeros(nh)
    add_constant(projection, -kt, C, S)
    c1, s1 = np.cos(piece[INSTANT]), np.sin(piece[INSTANT])
    ck, sk = 1.0, 0.0
    for k in range((nh - 1) // 2 + 1):
        for m in range(max(2 * k - 1, 0), 2 * k + 1):
            value = ck if m % 2 or m == 0 else -sk  # e_m at the instant
            for j in range(nh):
                Dt[j, m] += projection[j] * piece[BY_U] * value
                if kn != 0:
                    Dn[j, m] += projection[j] * piece[BY_N] * kn * value
        ck, sk = ck * c1 - sk * s1, sk * c1 + ck * s1
    for j in range(nh):
        gp[j] += projection[j] * piece[BY_N]


@njit(cache=True)
def tangent_deviation(
    into: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    u: np.ndarray,
    un: np.ndarray,
    contact: tuple[float, float, float, float],
    pieces: np.ndarray,
) -> float:
    """Add the harmonics of -kt w over the pieces, with derivatives by u, u_n and the preload;
    return the work in J of the friction force +-mu N along the slip dw = d(u -+ mu N/kt).

    into : g, Dt, Dn, gp; contact : kt, kn (0 without a normal component), mu, preload
    """
    g = into[0]
    kt, kn, mu, preload = contact
    nh, work = len(g), 0.0
    C, S = np.zeros((3, 2 * nh)), np.zeros((3, 2 * nh))
    for q in range(len(pieces)):
        state = int(pieces[q, 0])
        if state == STICK:
            w = pieces[q, PLACE]
            Cq, Sq = np.zeros(nh), np.zeros(nh)
            add_integrals(pieces[q, BEGIN], pieces[q, END], Cq, Sq)
            if w != 0:
                add_constant(g, -kt * w, Cq, Sq)
            if pieces[q, BY_U] != 0 or pieces[q, BY_N] != 0:
                add_rest(into, contact, pieces[q], Cq, Sq)
        else:
            add_integrals(pieces[q, BEGIN], pieces[q, END], C[state - 1], S[state - 1])
    for state in (FORWARD, BACKWARD, OPEN):
        if C[state - 1, 0] != 0:
            pushed = 0.0
            if state == FORWARD:
                pushed = mu
            elif state == BACKWARD:
                pushed = -mu
            moving = kt, kn, pushed, preload
            work += add_moving(into, u, un, moving, C[state - 1], S[state - 1])
    return work


@njit(cache=True)
def add_moving(
    into: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    u: np.ndarray,
    un: np.ndarray,
    contact: tuple[float, float, float, float],
    C: np.ndarray,
    S: np.ndarray,
) -> float:
    """Add the harmonics of -kt w while the slider moves in one way, and return the work; mu with
    the sign of the slip, 0 where the slider follows an open contact."""
    g, Dt, Dn, gp = into
    kt, kn, mu, preload = contact
    A = np.zeros((len(g), len(g)))
    add_products(A, 1.0, C, S)
    add_ride(g, Dt, -kt, A, u)
    if mu == 0:
        return 0.0
    add_constant(g, mu * preload, C, S)
    add_constant(gp, mu, C, S)
    if kn != 0:
        add_ride(g, Dn, mu * kn, A, un)
    return slip_work(A, u, un, contact)


@njit(cache=True)
def slip_work(
    A: np.ndarray, u: np.ndarray, un: np.ndarray, contact: tuple[float, float, float, float]
) -> float:
    """Integral of mu N d(u - mu N/kt) over the pieces whose products are in A; mu with the sign of
    the slip."""
    kt, kn, mu, preload = contact
    nh, work = len(u), 0.0
    for j in range(nh):
        load = kn * un[j] + (preload if j == 0 else 0.0)
        ride = 0.0
        for m in range(1, nh):
            k = (m + 1) // 2
            rate = (
                -k * (u[m + 1] - mu / kt * kn * un[m + 1])
                if m % 2
                else k * (u[m - 1] - mu / kt * kn * un[m - 1])
            )
            ride += A[j, m] * rate
        work += (TWO_PI if j == 0 else np.pi) * mu * load * ride
    return work


@njit(cache=True)
def normal_deviation(
    into: tuple[np.ndarray, np.ndarray, np.ndarray],
    un: np.ndarray,
    contact: tuple[float, float, float, float],
    pieces: np.ndarray,
) -> None:
    """Add the harmonics of N - (preload + kn u_n), which is zero while closed: into = g, Dn, gp."""
    g, Dn, gp = into
    _, kn, _, preload = contact
    nh = len(g)
    C, S, A = np.zeros(2 * nh), np.zeros(2 * nh), np.zeros((nh, nh))
    for q in range(len(pieces)):
        add_integrals(pieces[q, BEGIN], pieces[q, END], C, S)
    add_products(A, -1.0, C, S)
    add_ride(g, Dn, kn, A, un)
    add_constant(g, -preload, C, S)
    add_constant(gp, -1.0, C, S)


@njit(cache=True)
def add_forces(
    x: np.ndarray,
    pieces: np.ndarray,
    counts: np.ndarray,
    law: Sliders,
    place: np.ndarray,
    into: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Fill g and gp = dg/dpreload (P, nd, nh), the derivatives D (a, nd, nh, nd, nh) of the active
    contacts, and the friction work (P,) of a cycle.

    x (P, nd, nh) : harmonics of the relative motion; pieces, counts, law : of `events.find_pieces`
    place (P,) : of each contact in D, or -1; into : g, D, gp, work
    """
    g, D, gp, work = into
    P, nd, nh = x.shape
    last, none = nd - 1, np.zeros((nd, nh, nd, nh))  # the normal, where there is one
    D[:], g[:], gp[:], work[:] = 0.0, 0.0, 0.0, 0.0
    for p in range(P):
        Dp, un = D[place[p]] if place[p] >= 0 else none, x[p, last]
        contact = law.kt[p], law.kn[p] if law.normal else 0.0, law.mu[p], law.preload[p]
        if law.normal and counts[p, law.count]:
            normal_deviation(
                (g[p, last], Dp[last, :, last, :], gp[p, last]),
                un,
                contact,
                pieces[p, law.count, : counts[p, law.count]],
            )
        for d in range(law.count):
            work[p] += tangent_deviation(
                (g[p, d], Dp[d, :, d, :], Dp[d, :, last, :], gp[p, d]),
                x[p, d],
                un,
                contact,
                pieces[p, d, : counts[p, d]],
            )
