"""Compiled loops of Newton's linear system and of the receptance: plain arrays in, plain arrays
out.
"""

import numpy as np

from tipdamp.hbm.compiled import njit


@njit(cache=True)
def modal_push(
    level: float, force: np.ndarray, static: np.ndarray, contact: np.ndarray
) -> np.ndarray:
    """(m, H+1) modal force: level times the excitation, the static force (m,) in order 0, less that
    of the contacts."""
    push = np.empty_like(contact)
    for r in range(push.shape[0]):
        for k in range(push.shape[1]):
            push[r, k] = level * force[r, k] - contact[r, k]
        push[r, 0] += static[r]
    return push


@njit(cache=True)
def norms(X: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """(n, 2) norms of order 0 and of the others, of X (n, r, H+1) over units (n, r); the largest
    entry is taken out, so that nothing under- or overflows."""
    found = np.zeros((len(X), 2))
    tiny = np.finfo(np.float64).tiny
    for i in range(len(X)):
        largest = tiny
        for r in range(X.shape[1]):
            for k in range(X.shape[2]):
                largest = max(
                    largest, abs(X[i, r, k].real) / unit[i, r], abs(X[i, r, k].imag) / unit[i, r]
                )
        for r in range(X.shape[1]):
            share = 1 / unit[i, r]
            for k in range(X.shape[2]):
                real = X[i, r, k].real * share / largest
                imag = X[i, r, k].imag * share / largest
                found[i, min(k, 1)] += real * real + imag * imag
        found[i] = largest * np.sqrt(found[i])
    return found


@njit(cache=True)
def by_order(rates: np.ndarray, push: np.ndarray) -> np.ndarray:
    """(m, H+1) k rates push of the orders k."""
    found = np.empty_like(push)
    for r in range(push.shape[0]):
        for k in range(push.shape[1]):
            found[r, k] = k * rates[r, k] * push[r, k]
    return found


@njit(cache=True)
def away_from(x: np.ndarray, both: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x (nc nh,) less the motion, and minus its change, of both (nc, 2H+2): the harmonics of motion
    and change."""
    n, half = both.shape[0], both.shape[1] // 2
    nh = 2 * half - 1
    residual, change = np.empty(n * nh), np.empty(n * nh)
    for c in range(n):
        at = c * nh
        residual[at], change[at] = x[at] - both[c, 0].real, -both[c, half].real
        for k in range(1, half):
            j = at + 2 * k - 1
            residual[j], residual[j + 1] = x[j] - both[c, k].real, x[j + 1] - both[c, k].imag
            change[j], change[j + 1] = -both[c, half + k].real, -both[c, half + k].imag
    return residual, change


@njit(cache=True)
def regularise(
    D: np.ndarray, contacts: np.ndarray, springs: np.ndarray, active: np.ndarray, share: float
) -> None:
    """Add a share of the springs (P, nd) of active components to the derivatives of their mean by
    the mean."""
    for c in range(len(contacts)):
        p = contacts[c]
        for d in range(D.shape[1]):
            if active[p, d]:
                D[c, d, 0, d, 0] += share * springs[p, d]


@njit(cache=True)
def border_of(
    linear: tuple[np.ndarray, np.ndarray, np.ndarray],
    border: tuple[np.ndarray, float, np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray, float, float, float]:
    """Column, row and corner of the system on the active rows, the row and then the column divided
    by its largest entry, and the sizes of both.

    linear : D, places, contacts of `applied`; border : row (n,), corner, derivative of the residual
    by the parameter (n,), and the receptance from the row to the active components (., H+1),
    conjugate
    """
    D, places, contacts = linear
    given, corner, by_parameter, along = border
    column = applied(D, places, contacts, by_parameter)
    K = along.shape[1]
    row = np.empty_like(column)
    for i in range(len(places)):
        at = i * (2 * K - 1)
        row[at] = -along[i, 0].real
        for k in range(1, K):
            row[at + 2 * k - 1], row[at + 2 * k] = -along[i, k].real, along[i, k].imag
    last = corner - np.dot(given, by_parameter)
    row_size = max(np.abs(row).max(), abs(last), 1e-300)
    last /= row_size
    column_size = max(np.abs(column).max(), abs(last), 1e-300)
    return column / column_size, row / row_size, last / column_size, row_size, column_size


@njit(cache=True)
def right_side(
    linear: tuple[np.ndarray, np.ndarray, np.ndarray],
    residual: np.ndarray,
    row: np.ndarray,
    value: float,
    row_size: float,
) -> np.ndarray:
    """(n+1,) of the bordered system; linear : D, places, contacts as there."""
    D, places, contacts = linear
    n = len(places) * D.shape[2]
    right = np.empty(n + 1)
    right[:n] = -applied(D, places, contacts, residual)
    right[n] = (value + np.dot(row, residual)) / row_size
    return right


@njit(cache=True)
def complex_rows(y: np.ndarray, n: int, K: int) -> np.ndarray:
    """(n, K) complex of the first n (2K - 1) real coefficients."""
    Y = np.empty((n, K), np.complex128)
    for i in range(n):
        at = i * (2 * K - 1)
        Y[i, 0] = y[at]
        for k in range(1, K):
            Y[i, k] = complex(y[at + 2 * k - 1], y[at + 2 * k])
    return Y


@njit(cache=True)
def step_of(
    residual: np.ndarray, by_parameter: np.ndarray, dp: float, response: np.ndarray
) -> np.ndarray:
    """(n,) -residual - by_parameter dp - response; that is given as harmonics (nc, H+1)."""
    K = response.shape[1]
    dx = -residual - by_parameter * dp
    for c in range(response.shape[0]):
        at = c * (2 * K - 1)
        dx[at] -= response[c, 0].real
        for k in range(1, K):
            dx[at + 2 * k - 1] -= response[c, k].real
            dx[at + 2 * k] -= response[c, k].imag
    return dx


@njit(cache=True)
def added(g: np.ndarray, rows: np.ndarray, dg: np.ndarray) -> np.ndarray:
    """g (P, nd, nh) with dg, flat, added to the components `rows`, counted through."""
    new = g.copy()
    flat = new.reshape(-1)
    nh = g.shape[2]
    for i in range(len(rows)):
        for h in range(nh):
            flat[rows[i] * nh + h] += dg[i * nh + h]
    return new


@njit(cache=True)
def condensed(D: np.ndarray, places: np.ndarray, G: np.ndarray, system: np.ndarray) -> None:
    """Fill I + D G on the active rows into system[row, column].

    D (a, nd, nh, nd, nh) : derivatives of the contact forces; places (n,) : of the active
    components among a nd G (a nd, n, H+1) : complex receptance between the components and the
    active ones; system (>= n nh, >= n nh)"""
    nd, nh, n = D.shape[1], D.shape[2], len(places)
    for i in range(n):
        c, d = divmod(places[i], nd)
        for row in range(i * nh, i * nh + nh):
            for column in range(n * nh):
                system[row, column] = 0.0
            for e in range(nd):
                left = D[c, d, row - i * nh, e]
                acts = False
                for m in range(nh):
                    acts |= left[m] != 0
                for j in range(n if acts else 0):
                    at = j * nh
                    system[row, at] += left[0] * G[c * nd + e, j, 0].real
                    for k in range(1, G.shape[2]):
                        g = G[c * nd + e, j, k]
                        cosine = left[2 * k - 1]
                        sine = left[2 * k]
                        system[row, at + 2 * k - 1] += cosine * g.real + sine * g.imag
                        system[row, at + 2 * k] += sine * g.real - cosine * g.imag
            system[row, row] += 1.0


@njit(cache=True)
def applied(D: np.ndarray, places: np.ndarray, contacts: np.ndarray, x: np.ndarray) -> np.ndarray:
    """(n nh,) D x on the active rows; contacts (a,) : their numbers; x : flat, of all contacts."""
    nd, nh = D.shape[1], D.shape[2]
    y = np.zeros(len(places) * nh)
    for i in range(len(places)):
        c, d = divmod(places[i], nd)
        first = contacts[c] * nd * nh
        for h in range(nh):
            value = 0.0
            for e in range(nd):
                for m in range(nh):
                    value += D[c, d, h, e, m] * x[first + e * nh + m]
            y[i * nh + h] = value
    return y


@njit(cache=True)
def alike_in_orders(
    D: np.ndarray, active: np.ndarray, rounding: float
) -> tuple[np.ndarray, np.ndarray]:
    """(a,) bool, contacts whose force components follow their own displacement alone, order by
    order and with no phase; (a, nd, K) N/m, by how much. D (a, nd, nh, nd, nh), active (a, nd);
    rounding : share of the largest entry of a contact that is none."""
    a, nd, nh = D.shape[:3]
    alike = np.zeros(a, np.bool_)
    rates = np.zeros((a, nd, (nh + 1) // 2))
    for c in range(a):
        if not active[c].all() or not _alike(D[c], rounding):
            continue
        alike[c] = True
        for d in range(nd):
            rates[c, d, 0] = D[c, d, 0, d, 0]
            for k in range(1, (nh + 1) // 2):
                rates[c, d, k] = D[c, d, 2 * k, d, 2 * k]
    return alike, rates


@njit(cache=True)
def _alike(D: np.ndarray, rounding: float) -> bool:
    """Whether D (nd, nh, nd, nh) is diagonal, with the same entry for sine and cosine."""
    nd, nh = D.shape[:2]
    small = 0.0
    for d in range(nd):
        small = max(small, rounding * abs(D[d, nh - 1, d, nh - 1]))
    for d in range(nd):
        for h in range(nh):
            for e in range(nd):
                for m in range(nh):
                    if abs(D[d, h, e, m]) > small and (d != e or h != m):
                        return False
        for k in range(1, (nh + 1) // 2):
            if abs(D[d, 2 * k - 1, d, 2 * k - 1] - D[d, 2 * k, d, 2 * k]) > small:
                return False
    return True


@njit(cache=True)
def orders_apart(
    D: np.ndarray, places: np.ndarray, G: np.ndarray, u: np.ndarray, H: int
) -> np.ndarray:
    """(n, k) complex y of (I + D G) y = D u at each of the k orders above H by itself, and u less
    G y in its place; D (a, nd, nh, nd, nh), places (n,) of the active components in (a nd), G (a
    nd, n, k) and u (a nd, k) complex. NaN where a system is singular."""
    n, count = len(places), u.shape[1]
    y = np.empty((n, count), np.complex128)
    system, right = np.empty((2 * n, 2 * n)), np.empty(2 * n)
    for i in range(count):
        order_system((D, places, G[:, :, i], u[:, i]), 2 * (H + 1 + i) - 1, system, right)
        eliminated(system, right)
        for m in range(n):
            y[m, i] = complex(right[2 * m], right[2 * m + 1])
        for c in range(len(u)):
            for m in range(n):
                u[c, i] -= G[c, m, i] * y[m, i]
    return y


@njit(cache=True)
def eliminated(A: np.ndarray, b: np.ndarray) -> None:
    """A^-1 b (n,) in place of b, by elimination with pivots; A is used up, NaN where singular."""
    n = len(b)
    for k in range(n):
        top = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[top, k]):
                top = i
        if A[top, k] == 0.0:
            b[:] = np.nan
            return
        if top != k:
            b[k], b[top] = b[top], b[k]
            for c in range(k, n):
                A[k, c], A[top, c] = A[top, c], A[k, c]
        for i in range(k + 1, n):
            factor = A[i, k] / A[k, k]
            if factor != 0.0:
                b[i] -= factor * b[k]
                for c in range(k + 1, n):
                    A[i, c] -= factor * A[k, c]
    for k in range(n - 1, -1, -1):
        for c in range(k + 1, n):
            b[k] -= A[k, c] * b[c]
        b[k] /= A[k, k]


@njit(cache=True)
def coupled_orders(D: np.ndarray, motion: np.ndarray, low: int) -> np.ndarray:
    """(a, nd, low) change of the lower orders of the forces, D (a, nd, nh, nd, nh), under a motion
    (a, nd, nh - low) of the higher ones."""
    a, nd, count = motion.shape
    found = np.zeros((a, nd, low))
    for c in range(a):
        for d in range(nd):
            for j in range(low):
                for e in range(nd):
                    for m in range(count):
                        found[c, d, j] += D[c, d, j, e, low + m] * motion[c, e, m]
    return found


@njit(cache=True)
def order_system(
    linear: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    j: int,
    system: np.ndarray,
    right: np.ndarray,
) -> None:
    """Fill system (2n, 2n) and right side (2n,) of I + D G and D u at the order of the coefficients
    j and j + 1 alone, real and imaginary part of each of n active components side by side; linear :
    D, places, G (a nd, n) and u (a nd,) of `orders_apart`."""
    D, places, G, u = linear
    n, nd = len(places), D.shape[1]
    system[:], right[:] = 0.0, 0.0
    for i in range(n):
        c, d = places[i] // nd, places[i] % nd
        for r in range(2):
            row = 2 * i + r
            system[row, row] = 1.0
            for e in range(nd):
                real, imag = D[c, d, j + r, e, j], D[c, d, j + r, e, j + 1]
                if real == 0.0 and imag == 0.0:
                    continue
                at = c * nd + e
                right[row] += real * u[at].real + imag * u[at].imag
                for m in range(n):
                    g = G[at, m]
                    system[row, 2 * m] += real * g.real + imag * g.imag
                    system[row, 2 * m + 1] += imag * g.real - real * g.imag


@njit(cache=True)
def rotated(column: np.ndarray, rotations: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(m,) the last column (m+1,) of a Hessenberg matrix of m columns, made triangular: by the
    rotations (m-1, 2) of the columns before and its own, which is noted there and applied to the
    target (m+1,)."""
    m = len(column) - 1
    column = column.copy()
    for i in range(m - 1):
        c, s = rotations[i]
        a, b = column[i], column[i + 1]
        column[i], column[i + 1] = c * a + s * b, c * b - s * a
    length = np.hypot(column[m - 1], column[m])
    c, s = column[m - 1] / length, column[m] / length
    rotations[m - 1] = c, s
    target[m - 1], target[m] = c * target[m - 1], -s * target[m - 1]
    column[m - 1] = length
    return column[:m]


@njit(cache=True)
def sign_of(lu: np.ndarray, pivots: np.ndarray) -> float:
    """Sign of the determinant of a factorised matrix; 0 where it is singular."""
    sign = 1.0
    for i in range(len(pivots)):
        if lu[i, i] == 0 or not np.isfinite(lu[i, i]):
            return 0.0
        if (lu[i, i] < 0) != (pivots[i] != i):
            sign = -sign
    return sign


@njit(cache=True, error_model="numpy")
def modal_factors(
    stiffness: np.ndarray, mass: np.ndarray, ratio: np.ndarray, w: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """d = 1/(k - m w^2 + 2 i zeta sqrt(k m) w) and dd/dw, each (modes, orders)."""
    d = np.empty((len(mass), len(w)), np.complex128)
    rate = np.empty((len(mass), len(w)), np.complex128)
    for r in range(len(mass)):
        b = 2 * ratio[r] * np.sqrt(stiffness[r] * mass[r])
        for k in range(len(w)):
            real, imag = stiffness[r] - mass[r] * w[k] * w[k], b * w[k]
            size = 1 / (real * real + imag * imag)
            d[r, k] = complex(real * size, -imag * size)
            rate[r, k] = complex(2 * mass[r] * w[k], -b) * d[r, k] * d[r, k]
    return d, rate
