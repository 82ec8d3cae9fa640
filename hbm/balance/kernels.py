"""Compiled loops of Newton's linear system and of the receptance: plain arrays in, plain arrays out.

Compiled code is stored per file: nothing compiled here is called from compiled code elsewhere.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def condensed(D, places, G, system):
    """Fill I + D G on the active rows into system[row, column].

    D (a, nd, nh, nd, nh) : derivatives of the contact forces; places (n,) : of the active components among a nd
    G (a nd, n, H+1) : complex receptance between the components and the active ones; system (>= n nh, >= n nh)
    """
    nd, nh, n = D.shape[1], D.shape[2], len(places)
    for i in range(n):
        c, d = divmod(places[i], nd)
        for row in range(i * nh, i * nh + nh):
            for column in range(n * nh):
                system[row, column] = 0.0
            for e in range(nd):
                left, acts = D[c, d, row - i * nh, e], False
                for m in range(nh):
                    acts |= left[m] != 0
                for j in range(n if acts else 0):
                    at = j * nh
                    system[row, at] += left[0] * G[c * nd + e, j, 0].real
                    for k in range(1, G.shape[2]):
                        g, cosine, sine = G[c * nd + e, j, k], left[2 * k - 1], left[2 * k]
                        system[row, at + 2 * k - 1] += cosine * g.real + sine * g.imag
                        system[row, at + 2 * k] += sine * g.real - cosine * g.imag
            system[row, row] += 1.0


@njit(cache=True)
def applied(D, places, contacts, x):
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
def scaled_border(system):
    """Divide the last row, then the last column, by its largest entry; return both sizes: the border in the units of
    the rest."""
    row_size = max(np.abs(system[-1]).max(), 1e-300)
    system[-1] /= row_size
    column_size = max(np.abs(system[:, -1]).max(), 1e-300)
    system[:, -1] /= column_size
    return row_size, column_size


@njit(cache=True)
def sign_of(lu, pivots):
    """Sign of the determinant of a factorised matrix; 0 where it is singular."""
    sign = 1.0
    for i in range(len(pivots)):
        if lu[i, i] == 0 or not np.isfinite(lu[i, i]):
            return 0.0
        if (lu[i, i] < 0) != (pivots[i] != i):
            sign = -sign
    return sign


@njit(cache=True, error_model="numpy")
def modal_factors(stiffness, mass, ratio, w):
    """d = 1/(k - m w^2 + 2 i zeta sqrt(k m) w) and dd/dw, each (modes, orders)."""
    d, rate = np.empty((len(mass), len(w)), np.complex128), np.empty((len(mass), len(w)), np.complex128)
    for r in range(len(mass)):
        b = 2 * ratio[r] * np.sqrt(stiffness[r] * mass[r])
        for k in range(len(w)):
            real, imag = stiffness[r] - mass[r] * w[k] * w[k], b * w[k]
            size = 1 / (real * real + imag * imag)
            d[r, k] = complex(real * size, -imag * size)
            rate[r, k] = complex(2 * mass[r] * w[k], -b) * d[r, k] * d[r, k]
    return d, rate
