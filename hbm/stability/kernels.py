"""The monodromy matrix of a motion whose contacts are linear in a disturbance between instants.

In an interval the disturbance dg of the contact forces, less those of the stuck springs, is
integrated as in `hbm.time.events`: the poles exactly, dg as the quadratic with its values at both
ends and its rate at the begin, solved implicitly, and the defect in the rate at the end as a cubic
term. All columns at once; fourth order in the length of the intervals.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.time.events import fill_weights

Poles = namedtuple("Poles", "s out into static")
Poles.__doc__ = """As in `hbm.time.events.System`, at the components that act: s (n,), out (nc, 2n),
into (2n, nc), static (nc, nc)."""

Segments = namedtuple("Segments", "place length gamma rate memory captured capture turning")
Segments.__doc__ = """K intervals of the contacts that act: place (a, nd) of a component among the
nc that do, -1 of others; length (K,) s; and as in `hbm.laws.variation.CycleTangents`, gamma less
the stuck springs, rate by time; turning : Carried."""

Carried = namedtuple("Carried", "of memory rate kept follows")
Carried.__doc__ = (
    """As `hbm.laws.variation.Turning`, of (q,) among the contacts that act, by time."""
)


@njit(cache=True)
def solve(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A^-1 B (n, m) in place of B, by elimination with pivots; A is used up."""
    n = len(A)
    for k in range(n):
        top = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[top, k]):
                top = i
        if top != k:
            for c in range(n):
                A[k, c], A[top, c] = A[top, c], A[k, c]
            for c in range(B.shape[1]):
                B[k, c], B[top, c] = B[top, c], B[k, c]
        for i in range(k + 1, n):
            if A[i, k] != 0.0:
                factor = A[i, k] / A[k, k]
                for c in range(k + 1, n):
                    A[i, c] -= factor * A[k, c]
                for c in range(B.shape[1]):
                    B[i, c] -= factor * B[k, c]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            factor = A[k, j]
            if factor != 0.0:
                for c in range(B.shape[1]):
                    B[k, c] -= factor * B[j, c]
        inverse = 1.0 / A[k, k]
        for c in range(B.shape[1]):
            B[k, c] *= inverse
    return B


@njit(cache=True)
def times(weight: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Complex weights (n,) on the columns z = [Re, Im] (2n, m)."""
    n = len(weight)
    result = np.empty_like(z)
    for j in range(n):
        a, b = weight[j].real, weight[j].imag
        for c in range(z.shape[1]):
            result[j, c] = a * z[j, c] - b * z[n + j, c]
            result[n + j, c] = a * z[n + j, c] + b * z[j, c]
    return result


@njit(cache=True)
def held(place: np.ndarray, memory: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(nc, m) force of the sliders, memory (a, nd)."""
    found = np.zeros_like(w)
    for p in range(len(place)):
        for d in range(place.shape[1]):
            i = place[p, d]
            if i >= 0 and memory[p, d] != 0.0:
                for c in range(w.shape[1]):
                    found[i, c] = memory[p, d] * w[i, c]
    return found


@njit(cache=True)
def acting(place: np.ndarray, blocks: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(nc, m) blocks (a, nd, nd) of every contact on its rows of u."""
    found, nd = np.zeros_like(u), blocks.shape[1]
    for p in range(len(blocks)):
        for i in range(nd):
            for j in range(nd):
                value = blocks[p, i, j]
                if value != 0.0:
                    for c in range(u.shape[1]):
                        found[place[p, i], c] += value * u[place[p, j], c]
    return found


@njit(cache=True)
def closing(place: np.ndarray, flexibility: np.ndarray, gamma: np.ndarray) -> np.ndarray:
    """(nc, nc) inverse of 1 + flexibility gamma."""
    nc, nd = len(flexibility), gamma.shape[1]
    matrix = np.eye(nc)
    for p in range(len(gamma)):
        for i in range(nd):
            for j in range(nd):
                if gamma[p, i, j] != 0.0:
                    for c in range(nc):
                        matrix[c, place[p, j]] += flexibility[c, place[p, i]] * gamma[p, i, j]
    return solve(matrix, np.eye(nc))


@njit(cache=True)
def solved(
    place: np.ndarray,
    flexibility: np.ndarray,
    inverse: np.ndarray,
    gamma: np.ndarray,
    force: np.ndarray,
    free: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(u, g) with u + flexibility g = free, g = gamma u + force; (nc, m) each. inverse : of
    `closing`, for they are solved more than once."""
    u = np.dot(inverse, free - np.dot(flexibility, force))
    return u, acting(place, gamma, u) + force


@njit(cache=True)
def at(
    place: np.ndarray,
    flexibility: np.ndarray,
    gamma: np.ndarray,
    before: np.ndarray,
    inverse: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(gamma, its inverse of `closing`), that of `before` where they are the same."""
    if np.array_equal(gamma, before):
        return before, inverse
    return gamma, closing(place, flexibility, gamma)


@njit(cache=True)
def with_sliders(gamma: np.ndarray, carried: Carried, k: int) -> np.ndarray:
    """gamma at the end of interval k, with the force of sliders that follow the motion there."""
    if not len(carried.of):
        return gamma
    whole = gamma.copy()
    for q in range(len(carried.of)):
        whole[carried.of[q]] += np.dot(carried.memory[1, k, q], carried.follows[2, k, q])
    return whole


@njit(cache=True)
def replaced(place: np.ndarray, w: np.ndarray, by: np.ndarray) -> np.ndarray:
    """w with the rows of some contacts, place (q, nd), of another."""
    new = w.copy()
    for p in range(len(place)):
        for i in range(place.shape[1]):
            if place[p, i] >= 0:
                new[place[p, i]] = by[place[p, i]]
    return new


@njit(cache=True)
def by_sliders(
    segments: Segments, turns: np.ndarray, k: int, end: int, w: np.ndarray
) -> np.ndarray:
    """(nc, m) force by the places w of the sliders in interval k, at its begin (0) or its end (1);
    turns (q, nd) : places of the contacts that are `turning`."""
    force = held(segments.place, segments.memory[k], w)
    if len(turns):
        force += acting(turns, segments.turning.memory[end, k], w)
    return force


@njit(cache=True)
def seen(poles: Poles) -> np.ndarray:
    """(2 nc, 2n): the motion of the components and its rate, both without their force, of z."""
    nc = len(poles.out)
    rows = np.empty((2 * nc, poles.out.shape[1]))
    rows[:nc] = poles.out
    rows[nc:] = times(poles.s.conj(), poles.out.T).T
    return rows


@njit(cache=True)
def monodromy(poles: Poles, segments: Segments, begins: np.ndarray) -> np.ndarray:
    """(2n + k, 2n + k) derivative of [z, w] after a period by those before; begins (k,) :
    components whose sliders rest at t = 0."""
    n2, nc = poles.into.shape
    place, static, carried = segments.place, poles.static, segments.turning
    turns = place[carried.of]
    m = n2 + len(begins)
    z, w = np.zeros((n2, m)), np.zeros((nc, m))
    for j in range(n2):
        z[j, j] = 1.0
    for j in range(len(begins)):
        w[begins[j], n2 + j] = 1.0
    rows, across = seen(poles), np.dot(poles.out, poles.into)
    gamma = segments.gamma[1, 0]
    inverse = closing(place, static, gamma)  # with the static flexibility, at gamma
    W, length = np.empty((5, len(poles.s)), np.complex128), -1.0
    last, stepping, known = gamma, inverse, False  # the same with D, of a step
    for k in range(len(segments.length)):
        h = segments.length[k]
        if abs(h - length) > 1e-12 * h:
            fill_weights(poles.s, h, W)
            begin, rise = times(W[1], poles.into), times(W[2], poles.into)
            end, defect = times(W[3], poles.into), times(W[4], poles.into)
            by_end = np.dot(rows, end)  # of the force at the end, on what is seen there
            D, onward, length, known = by_end[:nc] + static, by_end[nc:] + across, h, False
        free = np.dot(rows, z)
        if segments.captured[k].any():
            # by the motion before: what comes to rest now has had the forces of before
            sliders = by_sliders(segments, turns, max(k - 1, 0), 1, w)
            u = solved(place, static, inverse, gamma, sliders, free[:nc])[0]
            rest = acting(place, segments.capture[k], u)
            for p in range(len(place)):
                for d in range(place.shape[1]):
                    if segments.captured[k, p, d]:
                        w[place[p, d]] = rest[place[p, d]]
        force = by_sliders(segments, turns, k, 0, w)
        gamma, inverse = at(place, static, segments.gamma[0, k], gamma, inverse)
        u, g = solved(place, static, inverse, gamma, force, free[:nc])
        turning = acting(place, segments.rate[0, k], u)
        if len(turns):
            turning += acting(turns, carried.rate[0, k], w)
        moving, rising = solved(
            place, static, inverse, gamma, turning, free[nc:] - np.dot(across, g)
        )
        if len(turns):
            led = acting(turns, carried.kept[k], w) + acting(turns, carried.follows[0, k], u)
            led += acting(turns, carried.follows[1, k], moving)
            w = replaced(turns, w, led)
            force = by_sliders(segments, turns, k, 1, w)
        before = u
        z = times(W[0], z) - np.dot(begin, g) - np.dot(rise, rising)
        free = np.dot(rows, z)
        gamma, inverse = at(place, static, segments.gamma[1, k], gamma, inverse)
        whole = with_sliders(gamma, carried, k)
        if not known or not np.array_equal(whole, last):
            last, stepping, known = whole, closing(place, D, whole), True
        u, g1 = solved(place, D, stepping, whole, force, free[:nc])
        turning = acting(place, segments.rate[1, k], u)
        if len(turns):
            w = replaced(turns, w, led + acting(turns, carried.follows[2, k], u))
            turning += acting(turns, carried.rate[1, k], w)
        moved, ends = solved(place, static, inverse, gamma, turning, free[nc:] - np.dot(onward, g1))
        if len(turns):
            beyond = moved - (2 / h * (u - before) - moving)
            w += acting(turns, carried.follows[3, k], beyond)
        z -= np.dot(end, g1) + np.dot(defect, ends - (2 / h * (g1 - g) - rising))
    found = np.empty((m, m))
    found[:n2] = z
    for j in range(len(begins)):
        found[n2 + j] = w[begins[j]]
    return found
