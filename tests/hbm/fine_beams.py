"""Beams of elements so small that rounding of their stiffness is large beside the forces."""

import numpy as np
import scipy.linalg as la

from tests import beam_elements
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.laws import Contacts, UnilateralSpring


def in_angles(matrices, unit):
    """Matrices of dofs (w, slope) with slopes in multiples of `unit` rad."""
    size = np.tile([1.0, unit], len(matrices[0]) // 2)
    return tuple(size[:, None] * A * size for A in matrices)


def clamped(n=160, unit=1.0):
    """(K, M, row of the tip): 0.7 m x 14 mm x 14 mm of steel, clamped at its first of n nodes."""
    K, M = in_angles(
        beam_elements.bending(np.linspace(0, 0.7, n), 205e9 * 0.014**4 / 12, 7800 * 0.014**2), unit
    )
    return K[2:, 2:], M[2:, 2:], np.eye(len(K) - 2)[-2]


def two_free(n, unit=1.0, preload=100.0):
    """Two free beams side by side, of n nodes 4 mm apart, joined at both ends by springs that may
    open."""
    one = beam_elements.bending(
        0.004 * np.arange(n), 200e9 * 0.0254 * 0.0127**3 / 12, 7850 * 0.0254 * 0.0127
    )
    K, M = (la.block_diag(A, A) for A in in_angles(one, unit))
    B = np.zeros((2, 4 * n))
    B[[0, 1], [0, 2 * n - 2]], B[[0, 1], [2 * n, 4 * n - 2]] = 1.0, -1.0
    return ContactProblem(
        M,
        None,
        K,
        B,
        UnilateralSpring(),
        Contacts([1e7] * 2, [0] * 2, [0] * 2, [preload] * 2),
        damping_ratio=0.001,
    )


def in_modes(problem, force, rigid=0):
    """(problem, force) in the coordinates of the modes of K and M, the first `rigid` of frequency 0
    exactly."""
    stiffness, shapes = la.eigh(problem.K, problem.M)
    stiffness[:rigid] = 0.0
    return ContactProblem(
        np.eye(len(stiffness)),
        None,
        np.diag(stiffness),
        problem.B @ shapes,
        problem.law,
        problem.contacts,
        damping_ratio=problem.damping_ratio,
    ), shapes
