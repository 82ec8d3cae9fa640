"""Plane compliance of a line contact against a reference depth: a line on a half-plane has no
stiffness without one.

Displacement of the contact against the point at depth d below its centre, per unit load per length,
for the traction 1/(pi sqrt(a^2 - x^2)) of a flat punch of half-width a on one body; s = sqrt(d^2 +
a^2):

    normal  (1 - nu^2)/(pi E) [ 2 asinh(d/a) - (d/s)/(1 - nu) ]
    across  (1 - nu^2)/(pi E) [ 2 asinh(d/a) + (d/s)/(1 - nu) ]
    along   1/(pi G) asinh(d/a)

Exact for any d > 0, so the large-depth form 2 ln(2d/a) is nowhere used. From the Boussinesq and
Cerruti point solutions integrated along the line (Johnson, Contact Mechanics, 1985, ch. 2 and 3;
for a Hertz line and d >> a the integrated compliance is his eq. 5.56).
"""

import numpy as np

from tipdamp.static_contact.stiffness.elastic_constants import (
    MaterialPair,
    Stiffness,
    Values,
    positive,
)


def plane_compliance(
    half_width: Values, depth: Values, E: float, nu: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compliances (normal, across, along) of one body, m2/N; half_width and depth in m, scalar or
    array."""
    positive("half_width", half_width, "m")
    positive("depth", depth, "m")
    plane = (1 - nu**2) / (np.pi * E)
    spread = 2 * np.arcsinh(depth / half_width)
    shape = depth / np.hypot(depth, half_width) / (1 - nu)
    return plane * (spread - shape), plane * (spread + shape), (1 + nu) / (np.pi * E) * spread


def plane_stiffness(
    pair: MaterialPair, half_width: Values, depth1: Values, depth2: Values
) -> Stiffness:
    """Tangent stiffness per length (N/m2) of the pair; each body has its own reference depth (m),
    none by default."""
    first = plane_compliance(half_width, depth1, pair.E1, pair.nu1)
    second = plane_compliance(half_width, depth2, pair.E2, pair.nu2)
    normal, across, along = (1 / (a + b) for a, b in zip(first, second, strict=True))
    return Stiffness(normal, along, across)
