"""A detached resonance

A nonlinear absorber: the curve that begins at the edge of the band stays small, and a closed curve
ten times as high stands beside it. `curves_beside` looks for it.
"""

import numpy as np

from tipdamp import CubicSpring, Problem, Search, curves_beside

M, C = np.diag([1, 0.05]), np.array([[0.01, -0.005], [-0.005, 0.005]])
K = [[1.015, -0.015], [-0.015, 0.015]]
absorber = Problem(M, C, K).add(CubicSpring(0.2 / 3), (0, 1)).force(0, 0.0311)
curve = absorber.follow_band((0.0955, 0.2546), outputs={"x": 0}, harmonics=1, samples=16)
beside = curves_beside(curve, absorber.contact_problem, Search(frequencies=3, starts=4))
beside.plot().set_yscale("log")

(detached,) = beside.curves
assert detached.peak("x")[1] > 10 * curve.peak("x")[1]
