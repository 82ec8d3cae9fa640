"""Quadrature for integrands that are smooth above zero and have a root, a kink or a logarithm at zero."""

import numpy as np

PANELS, POINTS = 50, 12
_NODE, _WEIGHT = np.polynomial.legendre.leggauss(POINTS)


def graded_nodes(lower, upper):
    """Gauss nodes and weights, each (..., PANELS * POINTS), on lower..upper (scalars or arrays, 0 <= lower <= upper).

    The panels halve towards zero, so the nearest singularity stays two panel lengths away and 12 points are exact to
    rounding; the last panel, 0..upper/2^49, counts for nothing. Panels below `lower` get weight zero.
    """
    lower, upper = np.broadcast_arrays(np.asarray(lower, float), np.asarray(upper, float))
    edges = np.append(0.5 ** np.arange(PANELS), 0.0) * upper[..., None]
    edges = np.maximum(edges, lower[..., None])
    centre, half = 0.5 * (edges[..., :-1] + edges[..., 1:]), 0.5 * (edges[..., :-1] - edges[..., 1:])
    nodes = centre[..., None] + half[..., None] * _NODE
    weights = half[..., None] * _WEIGHT
    return nodes.reshape(*upper.shape, -1), np.broadcast_to(weights, (*half.shape, POINTS)).reshape(*upper.shape, -1)
