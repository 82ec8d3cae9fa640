"""From incremental compliance to displacement: delta(P) = integral from 0 to P of C(p) dp.

The incremental frictionless problem is a flat punch on the contact of the moment, so the tangent stiffness at load P
is 1/C(P) and the secant stiffness P/delta(P). Source: Johnson, Contact Mechanics (1985), section 5.5; the identity
d(delta)/dP = C(P) holds by construction.
"""

from static_contact.graded import graded_nodes
from static_contact.moduli import require


def approach(compliance, load, start=0.0):
    """Displacement (m), scalar or (...), between the loads `start` and `load`, both scalar.

    `compliance(loads (n,)) -> (..., n)`, smooth above zero load. Loads in N and compliance in m/N, or N/m and m2/N
    for a line. Exact to rounding: the panels halve towards zero load.
    """
    require("load", load, 0, unit="N or N/m")
    require("start", start, 0, load)
    loads, weights = graded_nodes(start, load)
    return compliance(loads) @ weights


def secant(compliance, load):
    """Secant stiffness P / delta(P), N/m (N/m2 for a line); P > 0."""
    require("load", load, 0, open_low=True, unit="N or N/m")
    return load / approach(compliance, load)
