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


def two_free(n, unit=1.0, preload=100.0, middle=False):
    """Two free beams side by side, of n nodes 4 mm apart, joined at both ends, and in the middle if
    wanted, by springs that may open."""
    one = beam_elements.bending(
        0.004 * np.arange(n), 200e9 * 0.0254 * 0.0127**3 / 12, 7850 * 0.0254 * 0.0127
    )
    K, M = (la.block_diag(A, A) for A in in_angles(one, unit))
    nodes = [0, n // 2, n - 1] if middle else [0, n - 1]
    rows, at = np.arange(len(nodes)), 2 * np.array(nodes)
    B = np.zeros((len(nodes), 4 * n))
    B[rows, at], B[rows, 2 * n + at] = 1.0, -1.0
    return ContactProblem(
        M,
        None,
        K,
        B,
        UnilateralSpring(),
        Contacts(*np.outer([1e7, 0, 0, preload], np.ones(len(nodes)))),
        damping_ratio=0.001,
    )


def in_modes(problem, force, rigid=None):
    """(problem, force) in the coordinates of the modes of K and M.

    rigid : (r, k) motions without stiffness, in place of the first k modes, to the last digit
    """
    stiffness, shapes = la.eigh(problem.K, problem.M)
    if rigid is not None:
        k = rigid.shape[1]
        rigid = rigid @ la.inv(la.cholesky(rigid.T @ problem.M @ rigid))
        shapes = np.hstack([rigid, shapes[:, k:] - rigid @ (rigid.T @ problem.M @ shapes[:, k:])])
        stiffness[:k] = 0.0
    return ContactProblem(
        np.eye(len(stiffness)),
        None,
        np.diag(stiffness),
        problem.B @ shapes,
        problem.law,
        problem.contacts,
        damping_ratio=problem.damping_ratio,
    ), shapes


def rigid_motions(n, unit=1.0):
    """(4 n, 4) of `two_free`: translation and rotation of each beam."""
    along = 0.004 * (np.arange(n) - 0.5 * (n - 1))
    one = np.zeros((2 * n, 2))
    one[::2, 0], one[::2, 1], one[1::2, 1] = 1.0, along, 1.0 / unit
    return la.block_diag(one, one)
