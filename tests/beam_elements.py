"""Euler-Bernoulli beams of Hermite elements."""

import numpy as np


def bending(x, EI, mass=0.0):
    """(K, M) of a free beam with nodes at x in m, dofs (w, slope) of each; EI in N m^2, mass in
    kg/m, consistent."""
    K, M = np.zeros((2, 2 * len(x), 2 * len(x)))
    for i, h in enumerate(np.diff(x)):
        at = slice(2 * i, 2 * i + 4)
        K[at, at] += (
            EI
            / h**3
            * np.array(
                [
                    [12, 6 * h, -12, 6 * h],
                    [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                    [-12, -6 * h, 12, -6 * h],
                    [6 * h, 2 * h**2, -6 * h, 4 * h**2],
                ]
            )
        )
        M[at, at] += (
            mass
            * h
            / 420
            * np.array(
                [
                    [156, 22 * h, 54, -13 * h],
                    [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                    [54, 13 * h, 156, -22 * h],
                    [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
                ]
            )
        )
    return K, M
