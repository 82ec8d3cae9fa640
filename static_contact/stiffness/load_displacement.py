"""From the incremental compliance to the displacement: delta(P) = integral from 0 to P of C(p) dp.

The incremental frictionless problem is a flat punch on the contact of the moment, so the tangent
stiffness at load P is 1/C(P) and the secant stiffness P/delta(P). Source: Johnson, Contact
Mechanics (1985), section 5.5; the identity d(delta)/dP = C(P) holds by construction.
"""

from collections.abc import Callable

import numpy as np

from tipdamp.static_contact.stiffness.elastic_constants import Values, positive, require

PANELS, POINTS = 50, 12
_NODE, _WEIGHT = np.polynomial.legendre.leggauss(POINTS)


def approach(compliance: Callable, load: float, start: float = 0.0) -> np.ndarray:
    """Displacement (m), scalar or (...), between the loads `start` and `load`, both scalar.

    `compliance(loads (n,)) -> (..., n)`, smooth above zero load. Loads in N and compliance in m/N,
    or N/m and m2/N for a line. Exact to rounding: the panels halve towards zero load.
    """
    require("load", load, 0, unit="N or N/m")
    require("start", start, 0, load)
    loads, weights = graded_nodes(start, load)
    return compliance(loads) @ weights


def secant_stiffness(compliance: Callable, load: float) -> np.ndarray:
    """Secant stiffness P / delta(P), N/m (N/m2 for a line); P > 0."""
    positive("load", load, "N or N/m")
    return load / approach(compliance, load)


def graded_nodes(lower: Values, upper: Values) -> tuple[np.ndarray, np.ndarray]:
    """Gauss nodes and weights, each (..., PANELS * POINTS), on lower..upper (scalars or arrays, 0
    <= lower <= upper).

    The panels halve towards zero, so the nearest singularity stays two panel lengths away and 12
    points are exact to rounding; the last panel, 0..upper/2^49, counts for nothing. Panels below
    `lower` get weight zero.
    """
    lower, upper = np.broadcast_arrays(np.asarray(lower, float), np.asarray(upper, float))
    edges = np.append(0.5 ** np.arange(PANELS), 0.0) * upper[..., None]
    edges = np.maximum(edges, lower[..., None])
    centre = 0.5 * (edges[..., :-1] + edges[..., 1:])
    half = 0.5 * (edges[..., :-1] - edges[..., 1:])
    nodes = centre[..., None] + half[..., None] * _NODE
    weights = half[..., None] * _WEIGHT
    return nodes.reshape(*upper.shape, -1), np.broadcast_to(weights, (*half.shape, POINTS)).reshape(
        *upper.shape, -1
    )
