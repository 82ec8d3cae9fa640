"""Small equations for the continuation, and what it needs of their linearisation."""

import numpy as np

from tipdamp.hbm.continuation.corrector import solve_fixed


class Dense:
    """What `evaluate` must return, for small equations."""

    def __init__(self, residual, J, by_parameter):
        self.residual, self.J, self.by_parameter = residual, J, by_parameter

    def _solve(self, row, corner, right):
        A = np.block([[self.J, self.by_parameter[:, None]], [row[None], np.array([[corner]])]])
        y = np.linalg.solve(A, right)
        return y[:-1], y[-1], np.sign(np.linalg.det(A))

    def solve(self, row, corner, value, residual=None):
        return self._solve(
            row, corner, np.r_[-(self.residual if residual is None else residual), value]
        )[:2]

    def moved(self, dx, dp):
        return self

    def restoring(self, away):
        return 0 * away

    def forget(self):
        pass

    def direction(self, row, corner):
        return self._solve(row, corner, np.r_[0 * self.residual, 1.0])


def s_curve(x, p):
    """x^3 - 3 x = p: folds at p = 2, x = -1 and p = -2, x = 1."""
    return Dense(x**3 - 3 * x - p, np.diag(3 * x**2 - 3), np.array([-1.0]))


def start_at(evaluate, x, p):
    point = solve_fixed(evaluate, np.array([x]), p, np.ones(1))
    assert point.converged
    return point
