"""Rigid flat punches on a pair of half-spaces.

Rectangular punch L x w, stiffness from the table of rectangular_punch_bem.py:

Kn = E* L / c(0), Kt = 2 L / (c(nu) (1/G1 + 1/G2)), with c the dimensionless compliance along or
across, a function of length/width and nu. Between the table's Chebyshev nodes c is the polynomial
through them, in log(length/width) and nu; its error is below 1e-6 (error columns of the table, and
the tests). Beyond 1e8 c goes on straight in the logarithm, as the slender limit does.

Elliptical (or circular) punch, closed form:

    S0 = int dt/sqrt(b^2 cos^2 t + a^2 sin^2 t),  S_a with cos^2 t and S_b with sin^2 t above the
    line, t = 0..pi/2
    Kn = pi E*/S0,      1/Kt(dir) = sum over both bodies of [ (1 - nu) S0 + nu S_dir ] / (2 pi G)

Circle: Kn = 2 a E*, Kt/Kn = 2 (1 - nu)/(2 - nu) for equal nu. Source: Johnson, Contact Mechanics
(1985), sections 3.3, 4.2 and 7.4; Mindlin, J. Appl. Mech. 16 (1949) 259. The integrals in Carlson's
symmetric form do not cancel at a = b.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev
from scipy.special import elliprd, elliprf

from tipdamp.static_contact.stiffness.elastic_constants import (
    MaterialPair,
    Stiffness,
    Values,
    positive,
    require,
)

TABLE = Path(__file__).with_name("rectangular_punch_table.csv")
LONGEST = 1e8  # length / width at the end of the table
ASPECT_NODES, NU_NODES = 33, 6


def rectangle_stiffness(pair: MaterialPair, length: Values, width: Values) -> Stiffness:
    """Normal, along and across stiffness (N/m) of a flat contact `length` x `width` (m, scalars or
    arrays).

    Rigid punch in the sense that all points of the contact move together; sharp edges; no coupling
    (beta = 0). 'along' is parallel to `length`, which may be the shorter side.
    """
    length = np.asarray(positive("length", length, "m"), dtype=float)
    width = np.asarray(positive("width", width, "m"), dtype=float)
    longer, shorter = np.maximum(length, width), np.minimum(length, width)
    normal = rectangle_compliance(longer / shorter, 0.0)[0]
    by_longer, by_shorter = rectangle_compliance(longer / shorter, pair.nu_tangential)
    swap = width > length
    along = np.where(swap, by_shorter, by_longer)
    across = np.where(swap, by_longer, by_shorter)
    shear = 2 * longer / pair.shear_compliance
    return Stiffness(
        *(k[()] for k in (pair.E_star * longer / normal, shear / along, shear / across))
    )


def rectangle_compliance(aspect: Values, nu: Values) -> tuple[np.ndarray, np.ndarray]:
    """Dimensionless compliance (along the longer side, along the shorter side), aspect >= 1, 0 <=
    nu <= 0.5."""
    require("aspect", aspect, 1)
    require("nu", nu, 0, 0.5)
    place = np.log(aspect)
    inside = np.minimum(place, np.log(LONGEST))
    values = []
    for coefficients in _polynomials():
        series = chebyshev.chebval(4 * nu - 1, coefficients.T)  # over the aspect, at this nu
        value = chebyshev.chebval(2 * inside / np.log(LONGEST) - 1, series)
        slope = np.sum(series * np.arange(series.size) ** 2) * 2 / np.log(LONGEST)  # T_n'(1) = n^2
        values.append(value + slope * (place - inside))
    return tuple(values)


def ellipse_integrals(a: float, b: float) -> tuple[float, float, float]:
    """S0, S_a, S_b (1/m) for the semi-axes a and b (m), in any order; S_a belongs to the direction
    of a."""
    return (
        elliprf(0, a * a, b * b),
        a * a / 3 * elliprd(0, b * b, a * a),
        b * b / 3 * elliprd(0, a * a, b * b),
    )


def ellipse_stiffness(pair: MaterialPair, a: float, b: float) -> Stiffness:
    """Normal stiffness and tangential ones along the semi-axis a and across it (along b), N/m; a, b
    in m."""
    positive("a", a, "m")
    positive("b", b, "m")
    s0, *directions = ellipse_integrals(a, b)
    nu, shear = pair.nu_tangential, pair.shear_compliance
    along, across = (2 * np.pi / (shear * ((1 - nu) * s0 + nu * s)) for s in directions)
    return Stiffness(np.pi * pair.E_star / s0, along, across)


def slender_strip_stiffness(pair: MaterialPair, length: Values, half_width: Values) -> np.ndarray:
    """Normal stiffness (N/m) of a rigid strip, first order in 1/log: pi E* L / (2 (ln(4 L/a) - 1)).
    For comparison."""
    return np.pi * pair.E_star * length / (2 * (np.log(4 * length / half_width) - 1))


def uniform_line_stiffness(pair: MaterialPair, length: Values, half_width: Values) -> np.ndarray:
    """Load over displacement at mid-length (N/m) of a uniform line load: pi E* L / (2 ln(2 L/a)).
    For comparison."""
    return np.pi * pair.E_star * length / (2 * np.log(2 * length / half_width))


def table_nodes() -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev nodes (ends included) in log(aspect) over 1..LONGEST and in nu over 0..0.5: the
    rows of the table."""
    aspect = np.exp(
        0.5 * np.log(LONGEST) * (1 - np.cos(np.pi * np.arange(ASPECT_NODES) / (ASPECT_NODES - 1)))
    )
    nu = 0.25 * (1 - np.cos(np.pi * np.arange(NU_NODES) / (NU_NODES - 1)))
    return aspect, nu


@lru_cache(maxsize=1)
def _polynomials() -> list[np.ndarray]:
    """Chebyshev coefficients (aspect order, nu order) of both compliances."""
    table = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    aspect, nu = table_nodes()
    matrices = []
    for nodes in (2 * np.log(aspect) / np.log(LONGEST) - 1, 4 * nu - 1):
        matrices.append(np.linalg.inv(chebyshev.chebvander(nodes, nodes.size - 1)))
    return [
        matrices[0] @ table[:, column].reshape(aspect.size, nu.size) @ matrices[1].T
        for column in (2, 3)
    ]
