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

AFRESH = 64  # intervals, after which the tangents are taken from those of the stuck springs again

Carried = namedtuple("Carried", "of memory rate kept follows")
Carried.__doc__ = (
    """As `hbm.laws.variation.Turning`, of (q,) among the contacts that act, by time."""
)


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
def at(
    place: np.ndarray, seen: np.ndarray, flexibility: np.ndarray, change: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(seen, flexibility) of the components, (nc, 2n) and (nc, nc), under further forces change
    (a, nd, nd) times their motion: (1 + flexibility change)^-1 of both. What an event changes is
    of few contacts, whose columns alone are solved for."""
    of = np.empty(place.size, np.int64)
    n = 0
    for p in range(len(place)):
        for j in range(place.shape[1]):
            if change[p, :, j].any():
                of[n] = place[p, j]
                n += 1
    if n == 0:
        return seen, flexibility
    of, n = of[:n], 0
    pushed = np.zeros((len(flexibility), len(of)))  # flexibility change, in the columns `of`
    for p in range(len(place)):
        for j in range(place.shape[1]):
            if not change[p, :, j].any():
                continue
            for i in range(place.shape[1]):
                if change[p, i, j] != 0.0:
                    pushed[:, n] += flexibility[:, place[p, i]] * change[p, i, j]
            n += 1
    pushed = np.dot(pushed, np.linalg.inv(np.eye(n) + pushed[of]))
    return seen - np.dot(pushed, seen[of]), flexibility - np.dot(pushed, flexibility[of])


@njit(cache=True)
def yielded(flexibility: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(nc, m) flexibility on a force, most of whose rows are often zero."""
    rows = np.empty(len(force), np.int64)
    n = 0
    for i in range(len(force)):
        if force[i].any():
            rows[n] = i
            n += 1
    if n == len(force):
        return np.dot(flexibility, force)
    rows = rows[:n]
    return np.dot(np.ascontiguousarray(flexibility[:, rows]), force[rows])


@njit(cache=True)
def closing(
    place: np.ndarray, into: np.ndarray, weight: np.ndarray, seen: np.ndarray, gamma: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(flexibility within a step, by its poles alone, and the inverse that `stepped` needs), of
    the fewer of components and poles."""
    nc, n2 = seen.shape
    within = np.dot(seen, times(weight, into)) if nc <= n2 else np.empty((0, 0))
    if nc <= n2:
        system = np.eye(nc) + acting(place, gamma.transpose(0, 2, 1), within.T).T
    else:
        system = np.eye(n2) + times(weight, np.dot(into, acting(place, gamma, seen)))
    return within, np.linalg.inv(system)


@njit(cache=True)
def stepped(
    place: np.ndarray,
    into: np.ndarray,
    weight: np.ndarray,
    seen: np.ndarray,
    gamma: np.ndarray,
    force: np.ndarray,
    free: np.ndarray,
    closed: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """(nc, m) u = free - seen weight (into (gamma u + force)), the motion at the end of a step
    with what the force there does within it; closed : of `closing`."""
    within, inverse = closed
    if len(within):
        return np.dot(inverse, free - yielded(within, force))
    ahead = times(weight, np.dot(into, acting(place, gamma, free) + force))
    return free - np.dot(seen, np.dot(inverse, ahead))


@njit(cache=True)
def carried_on(weights: np.ndarray, z: np.ndarray, g: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(2n, m) weights[0] z - weights[1] g - weights[2] rate."""
    n = weights.shape[1]
    found = np.empty_like(z)
    for j in range(n):
        E, G, R = weights[0, j], weights[1, j], weights[2, j]
        for c in range(z.shape[1]):
            a, b = z[j, c], z[n + j, c]
            d, e = g[j, c], g[n + j, c]
            p, q = rate[j, c], rate[n + j, c]
            found[j, c] = (
                E.real * a - E.imag * b - G.real * d + G.imag * e - R.real * p + R.imag * q
            )
            found[n + j, c] = (
                E.real * b + E.imag * a - G.real * e - G.imag * d - R.real * q - R.imag * p
            )
    return found


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
def monodromy(poles: Poles, segments: Segments, begins: np.ndarray) -> np.ndarray:
    """(2n + k, 2n + k) derivative of [z, w] after a period by those before; begins (k,) :
    components whose sliders rest at t = 0.

    The motion of the components is u = seen z - flexibility f, with f what the sliders hold: both
    belong to the tangents gamma, and change with them.
    """
    s, into, place, carried = poles.s, poles.into, segments.place, segments.turning
    n2, nc = into.shape
    turns = place[carried.of]
    m = n2 + len(begins)
    z, w = np.zeros((n2, m)), np.zeros((nc, m))
    for j in range(n2):
        z[j, j] = 1.0
    for j in range(len(begins)):
        w[begins[j], n2 + j] = 1.0
    gamma = segments.gamma[1, 0]
    seen, flexibility = at(place, poles.out, poles.static, gamma)
    W, length, changes = np.empty((5, len(s)), np.complex128), -1.0, 0
    closed, known = closing(place, into, s, seen, gamma), False  # of a step, by its length
    for k in range(len(segments.length)):
        h = segments.length[k]
        if abs(h - length) > 1e-12 * h:
            fill_weights(s, h, W)
            length, known = h, False
        if segments.captured[k].any():
            # by the motion before: what comes to rest now has had the forces of before
            sliders = by_sliders(segments, turns, max(k - 1, 0), 1, w)
            u = np.dot(seen, z) - yielded(flexibility, sliders)
            rest = acting(place, segments.capture[k], u)
            for p in range(len(place)):
                for d in range(place.shape[1]):
                    if segments.captured[k, p, d]:
                        w[place[p, d]] = rest[place[p, d]]
        force = by_sliders(segments, turns, k, 0, w)
        change, gamma = segments.gamma[0, k] - gamma, segments.gamma[0, k]
        known = known and not change.any()
        if changes == AFRESH:  # rounding adds up
            seen, flexibility, changes = poles.out, poles.static, 0
            change = gamma
        seen, flexibility = at(place, seen, flexibility, change)
        given = yielded(flexibility, force)
        u = np.dot(seen, z) - given
        g = acting(place, gamma, u) + force
        turning = acting(place, segments.rate[0, k], u)
        if len(turns):
            turning += acting(turns, carried.rate[0, k], w)
        drive = np.dot(into, g)
        moving = np.dot(seen, times(s, z) - drive) - yielded(flexibility, turning)
        rising = acting(place, gamma, moving) + turning
        if len(turns):
            led = acting(turns, carried.kept[k], w) + acting(turns, carried.follows[0, k], u)
            led += acting(turns, carried.follows[1, k], moving)
            w = replaced(turns, w, led)
            force = by_sliders(segments, turns, k, 1, w)
        before = u
        z = carried_on(W[:3], z, drive, np.dot(into, rising))
        change, gamma = segments.gamma[1, k] - gamma, segments.gamma[1, k]
        alike = not change.any()
        seen, flexibility = at(place, seen, flexibility, change)
        changes += 1
        whole = with_sliders(gamma, carried, k)
        there, yields = at(place, seen, flexibility, whole - gamma)
        if len(turns) or not alike:
            given = yielded(yields, force)
        if not (known and alike and len(turns) == 0):
            closed, known = closing(place, into, W[3], there, whole), True
        u = stepped(place, into, W[3], there, whole, force, np.dot(there, z) - given, closed)
        g1 = acting(place, whole, u) + force
        drive = np.dot(into, g1)
        turning = acting(place, segments.rate[1, k], u)
        if len(turns):
            w = replaced(turns, w, led + acting(turns, carried.follows[2, k], u))
            turning += acting(turns, carried.rate[1, k], w)
        z -= times(W[3], drive)
        moving_on = np.dot(seen, times(s, z) - drive) - yielded(flexibility, turning)
        if len(turns):
            beyond = moving_on - (2 / h * (u - before) - moving)
            w += acting(turns, carried.follows[3, k], beyond)
        ends = acting(place, gamma, moving_on) + turning
        z -= times(W[4], np.dot(into, ends - (2 / h * (g1 - g) - rising)))
    found = np.empty((m, m))
    found[:n2] = z
    for j in range(len(begins)):
        found[n2 + j] = w[begins[j]]
    return found
