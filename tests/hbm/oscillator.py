"""The planar blade-damper-blade oscillator of tests/reference/hbm/oscillator.md as a
ContactProblem."""

import numpy as np

from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.laws import Contacts, DryFriction2T

FORCE = np.array([0, -20.0, 5.0, 0, 0, 0]) * -1j  # times sin(w t) = Re(-i exp(i w t))
Y2 = {"y2": np.eye(6)[3]}


def oscillator(mu=0.5, kn=3e5, kt=3e5):
    """Dofs x1, y1, x2, y2, xD, yD; the second tangent of each pair does not exist (its row of B is
    zero)."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    M = np.diag([1.0, 1, 1, 1, 0.1, 0.1])
    K = np.diag([3e5] * 4 + [0, 0])
    for i, j, k in ((0, 2, 7e5), (1, 3, 7e5), (0, 1, 3e5), (2, 3, 3e5), (4, 5, 3e5)):
        K[np.ix_([i, j], [i, j])] += k * np.array([[1, -1], [-1, 1]])
    C = np.diag([20.0] * 4 + [0, 0])
    B = np.zeros((6, 6))
    for p, frame, blade in ((0, [[c, s], [-s, c]], [0, 1]), (1, [[c, -s], [s, c]], [2, 3])):
        rows = [3 * p, 3 * p + 2]
        B[np.ix_(rows, [4, 5])] = frame
        B[np.ix_(rows, blade)] = -np.array(frame)
    two = np.ones(2)
    pairs = Contacts(kn * two, kt * two, mu * two, 0 * two)
    return ContactProblem(
        M, C, K, B, DryFriction2T(), pairs, static=np.eye(6)[5] * 120.0, preloaded=False
    )
