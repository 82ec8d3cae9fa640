"""The monodromy matrix of a motion whose contacts are linear in a disturbance between instants.

In an interval the disturbance dg of the contact forces, less those of the stuck springs, is
integrated as in `tipdamp.hbm.time.events`: the poles exactly, dg as the quadratic with its values
at both ends and its rate at the begin, solved implicitly, and the defect in the rate at the end as
a cubic term. All columns at once; fourth order in the length of the intervals.
"""

from collections import namedtuple

import numpy as np

from tipdamp.hbm.compiled import njit
from tipdamp.hbm.time.events import fill_weights

Poles = namedtuple("Poles", "s out into static")
Poles.__doc__ = """As in `tipdamp.hbm.time.events.System`, at the components that act: s (n,), out
(nc, 2n), into (2n, nc), static (nc, nc)."""

Segments = namedtuple("Segments", "place length gamma rate memory captured capture turning")
Segments.__doc__ = """K intervals of the contacts that act: place (a, nd) of a component among the
nc that do, -1 of others; length (K,) s; and as in `tipdamp.hbm.laws.variation.CycleTangents`, gamma
less the stuck springs, rate by time; turning : Carried."""

AFRESH = 64  # intervals, after which the tangents are taken from those of the stuck springs again

Carried = namedtuple("Carried", "of memory rate kept follows")
Carried.__doc__ = (
    """As `tipdamp.hbm.laws.variation.Turning`, of (q,) among the contacts that act, by time."""
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
def add_acting(found: np.ndarray, place: np.ndarray, blocks: np.ndarray, u: np.ndarray) -> None:
    """Add to found (nc, m) blocks (a, nd, nd) of every contact on its rows of u."""
    nd = blocks.shape[1]
    for p in range(len(blocks)):
        for i in range(nd):
            for j in range(nd):
                value = blocks[p, i, j]
                if value != 0.0:
                    for c in range(u.shape[1]):
                        found[place[p, i], c] += value * u[place[p, j], c]


@njit(cache=True)
def acting(place: np.ndarray, blocks: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(nc, m) blocks (a, nd, nd) of every contact on its rows of u."""
    found = np.zeros_like(u)
    add_acting(found, place, blocks, u)
    return found


@njit(cache=True)
def minus(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n, m) a - b."""
    found = np.empty_like(a)
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            found[i, j] = a[i, j] - b[i, j]
    return found


@njit(cache=True)
def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a b, in a place of its own: what calls BLAS takes long to compile."""
    return np.dot(a, b)


@njit(cache=True)
def changed(now: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, bool]:
    """(now - before, whether they differ) of tangents (a, nd, nd)."""
    change, differ = np.empty_like(now), False
    for p in range(now.shape[0]):
        for i in range(now.shape[1]):
            for j in range(now.shape[2]):
                change[p, i, j] = now[p, i, j] - before[p, i, j]
                differ = differ or change[p, i, j] != 0.0
    return change, differ


@njit(cache=True)
def defect(h: float, end: np.ndarray, begin: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """(n, m) rate at the end of the quadratic with its values at both ends of an interval h and
    its rate at the begin."""
    found = np.empty_like(end)
    for i in range(end.shape[0]):
        for j in range(end.shape[1]):
            found[i, j] = 2 / h * (end[i, j] - begin[i, j]) - rate[i, j]
    return found


@njit(cache=True)
def rows_of(a: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Some rows of a (n, m)."""
    found = np.empty((len(of), a.shape[1]))
    for i in range(len(of)):
        for j in range(a.shape[1]):
            found[i, j] = a[of[i], j]
    return found


@njit(cache=True)
def inverse_beside_one(a: np.ndarray) -> np.ndarray:
    """(1 + a)^-1, a (n, n)."""
    system = a.copy()
    for i in range(len(a)):
        system[i, i] += 1.0
    return np.linalg.inv(system.T).T  # in the order of rows, as all others


@njit(cache=True)
def pushes(change: np.ndarray, p: int, j: int) -> bool:
    """Whether component j of contact p changes a force of the contact."""
    for i in range(change.shape[1]):
        if change[p, i, j] != 0.0:
            return True
    return False


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
            if pushes(change, p, j):
                of[n] = place[p, j]
                n += 1
    if n == 0:
        return seen, flexibility
    of, n = of[:n], 0
    pushed = np.zeros((len(flexibility), len(of)))  # flexibility change, in the columns `of`
    for p in range(len(place)):
        for j in range(place.shape[1]):
            if not pushes(change, p, j):
                continue
            for i in range(place.shape[1]):
                value = change[p, i, j]
                if value != 0.0:
                    for row in range(len(pushed)):
                        pushed[row, n] += flexibility[row, place[p, i]] * value
            n += 1
    pushed = product(pushed, inverse_beside_one(rows_of(pushed, of)))
    return (
        minus(seen, product(pushed, rows_of(seen, of))),
        minus(flexibility, product(pushed, rows_of(flexibility, of))),
    )


@njit(cache=True)
def yielded(flexibility: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(nc, m) flexibility on a force, most of whose rows are often zero."""
    rows = np.empty(len(force), np.int64)
    n = 0
    for i in range(len(force)):
        for c in range(force.shape[1]):
            if force[i, c] != 0.0:
                rows[n] = i
                n += 1
                break
    if n == len(force):
        return product(flexibility, force)
    rows = rows[:n]
    columns = np.empty((len(flexibility), n))
    for i in range(len(flexibility)):
        for j in range(n):
            columns[i, j] = flexibility[i, rows[j]]
    return product(columns, rows_of(force, rows))


@njit(cache=True)
def closing(
    place: np.ndarray, into: np.ndarray, weight: np.ndarray, seen: np.ndarray, gamma: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(flexibility within a step, by its poles alone, and the inverse that `stepped` needs), of
    the fewer of components and poles."""
    nc, n2 = seen.shape
    if nc > n2:
        by_poles = times(weight, product(into, acting(place, gamma, seen)))
        return np.empty((0, 0)), inverse_beside_one(by_poles)
    within, each = product(seen, times(weight, into)), np.eye(nc)
    return within, inverse_beside_one(product(within, acting(place, gamma, each)))


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
        return product(inverse, minus(free, yielded(within, force)))
    pushed = force.copy()
    add_acting(pushed, place, gamma, free)
    ahead = times(weight, product(into, pushed))
    return minus(free, product(seen, product(inverse, ahead)))


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
    nd = gamma.shape[1]
    for q in range(len(carried.of)):
        for i in range(nd):
            for j in range(nd):
                for n in range(nd):
                    led = carried.memory[1, k, q, i, n] * carried.follows[2, k, q, n, j]
                    whole[carried.of[q], i, j] += led
    return whole


@njit(cache=True)
def put(place: np.ndarray, w: np.ndarray, by: np.ndarray) -> None:
    """Replace the rows of w of some contacts, place (q, nd)."""
    for p in range(len(place)):
        for i in range(place.shape[1]):
            if place[p, i] >= 0:
                for c in range(w.shape[1]):
                    w[place[p, i], c] = by[place[p, i], c]


@njit(cache=True)
def capture(segments: Segments, k: int, u: np.ndarray, w: np.ndarray) -> None:
    """Set the places w of the sliders that come to rest at the begin of interval k."""
    place = segments.place
    rest = acting(place, segments.capture[k], u)
    for p in range(len(place)):
        for d in range(place.shape[1]):
            if segments.captured[k, p, d]:
                for c in range(w.shape[1]):
                    w[place[p, d], c] = rest[place[p, d], c]


@njit(cache=True)
def by_sliders(segments: Segments, k: int, turning: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(nc, m) force by the places w of the sliders in interval k; turning (q, nd, nd) : memory of
    those that turn, at an end of it."""
    force = held(segments.place, segments.memory[k], w)
    if len(turning):
        add_acting(force, segments.place[segments.turning.of], turning, w)
    return force


@njit(cache=True)
def rate_of_tangents(
    segments: Segments, rate: np.ndarray, turning: np.ndarray, u: np.ndarray, w: np.ndarray
) -> np.ndarray:
    """(nc, m) rate of the force since the tangents change; rate (a, nd, nd), turning (q, nd, nd) :
    by u and by the sliders w that turn, at an end of an interval."""
    found = acting(segments.place, rate, u)
    if len(turning):
        add_acting(found, segments.place[segments.turning.of], turning, w)
    return found


@njit(cache=True)
def led_on(
    segments: Segments, k: int, w: np.ndarray, u: np.ndarray, moving: np.ndarray
) -> np.ndarray:
    """(nc, m) places at the end of interval k of sliders that turn, by what is known at its
    begin."""
    carried, turns = segments.turning, segments.place[segments.turning.of]
    led = acting(turns, carried.kept[k], w)
    add_acting(led, turns, carried.follows[0, k], u)
    add_acting(led, turns, carried.follows[1, k], moving)
    return led


@njit(cache=True)
def moving_by(
    poles: Poles,
    tangents: tuple[np.ndarray, np.ndarray],
    z: np.ndarray,
    drive: np.ndarray,
    turning: np.ndarray,
) -> np.ndarray:
    """(nc, m) velocity of the components; tangents : (seen, flexibility)."""
    seen, flexibility = tangents
    return minus(product(seen, minus(times(poles.s, z), drive)), yielded(flexibility, turning))


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
            last = max(k - 1, 0)
            sliders = by_sliders(segments, last, carried.memory[1, last], w)
            capture(segments, k, minus(product(seen, z), yielded(flexibility, sliders)), w)
        force = by_sliders(segments, k, carried.memory[0, k], w)
        change, differ = changed(segments.gamma[0, k], gamma)
        gamma, known = segments.gamma[0, k], known and not differ
        if changes == AFRESH:  # rounding adds up
            seen, flexibility, changes = poles.out, poles.static, 0
            change = gamma
        seen, flexibility = at(place, seen, flexibility, change)
        given = yielded(flexibility, force)
        u = minus(product(seen, z), given)
        g = force.copy()
        add_acting(g, place, gamma, u)
        turning = rate_of_tangents(segments, segments.rate[0, k], carried.rate[0, k], u, w)
        drive = product(into, g)
        moving = moving_by(poles, (seen, flexibility), z, drive, turning)
        rising = turning.copy()
        add_acting(rising, place, gamma, moving)
        led = w
        if len(turns):
            led = led_on(segments, k, w, u, moving)
            w = w.copy()
            put(turns, w, led)
            force = by_sliders(segments, k, carried.memory[1, k], w)
        before = u
        z = carried_on(W[:3], z, drive, product(into, rising))
        change, differ = changed(segments.gamma[1, k], gamma)
        gamma, alike = segments.gamma[1, k], not differ
        seen, flexibility = at(place, seen, flexibility, change)
        changes += 1
        whole = with_sliders(gamma, carried, k)
        there, yields = at(place, seen, flexibility, changed(whole, gamma)[0])
        if len(turns) or not alike:
            given = yielded(yields, force)
        if not (known and alike and len(turns) == 0):
            closed, known = closing(place, into, W[3], there, whole), True
        free = minus(product(there, z), given)
        u = stepped(place, into, W[3], there, whole, force, free, closed)
        g1 = force.copy()
        add_acting(g1, place, whole, u)
        drive = product(into, g1)
        if len(turns):
            add_acting(led, turns, carried.follows[2, k], u)
            put(turns, w, led)
        turning = rate_of_tangents(segments, segments.rate[1, k], carried.rate[1, k], u, w)
        z = minus(z, times(W[3], drive))
        moving_on = moving_by(poles, (seen, flexibility), z, drive, turning)
        if len(turns):
            beyond = minus(moving_on, defect(h, u, before, moving))
            add_acting(w, turns, carried.follows[3, k], beyond)
        ends = turning
        add_acting(ends, place, gamma, moving_on)
        z = minus(z, times(W[4], product(into, minus(ends, defect(h, g1, g, rising)))))
    found = np.empty((m, m))
    for c in range(m):
        for i in range(n2):
            found[i, c] = z[i, c]
        for j in range(len(begins)):
            found[n2 + j, c] = w[begins[j], c]
    return found
