"""Line contact of a cylinder and a plane [Hertz 1881; Johnson, Contact Mechanics (1985), section
4.2].

    a^2 = 4 P R / (pi E*),    p0 = 2 P / (pi a)

P load per length N/m, R relative radius m, half-width a m. The plane problem has no stiffness of
its own; that of a cylinder of length L on half-spaces is the stiffness of a flat punch of L x 2a.
"""

import numpy as np

from tipdamp.static_contact.stiffness.elastic_constants import MaterialPair, Stiffness, Values
from tipdamp.static_contact.stiffness.rectangular_punch import rectangle_stiffness


def hertz_half_width(load: Values, radius: Values, e_star: Values) -> np.ndarray:
    """Half-width (m) of the line contact of relative radius R (m) under P (N/m)."""
    return np.sqrt(4 * np.asarray(load) * radius / (np.pi * e_star))


def hertz_peak_pressure(load: Values, half_width: Values) -> Values:
    """Pressure (Pa) on the centre line."""
    return 2 * load / (np.pi * half_width)


def hertz_stiffness(pair: MaterialPair, length: Values, radius: Values, force: Values) -> Stiffness:
    """Tangent stiffness (N/m), normal and tangential, of a cylinder of `length` and relative
    `radius` (m) under a normal `force` (N)."""
    return rectangle_stiffness(
        pair, length, 2 * hertz_half_width(force / length, radius, pair.E_star)
    )
