"""Flat elliptical (or circular) punch on a pair of half-spaces, closed form.

    S0 = int dt/sqrt(b^2 cos^2 t + a^2 sin^2 t),  S_a with cos^2 t and S_b with sin^2 t above the
    line, t = 0..pi/2
    Kn = pi E*/S0,      1/Kt(dir) = sum over both bodies of [ (1 - nu) S0 + nu S_dir ] / (2 pi G)

Circle: Kn = 2 a E*, Kt/Kn = 2 (1 - nu)/(2 - nu) for equal nu. Source: Johnson, Contact Mechanics
(1985), sections 3.3, 4.2 and 7.4; Mindlin, J. Appl. Mech. 16 (1949) 259. The integrals in Carlson's
symmetric form do not cancel at a = b."""

import numpy as np
from scipy.special import elliprd, elliprf

from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair, Stiffness, require


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
    require("a", a, 0, open_low=True, unit="m")
    require("b", b, 0, open_low=True, unit="m")
    s0, *directions = ellipse_integrals(a, b)
    nu, shear = pair.nu_tangential, pair.shear_compliance
    along, across = (2 * np.pi / (shear * ((1 - nu) * s0 + nu * s)) for s in directions)
    return Stiffness(np.pi * pair.E_star / s0, along, across)
