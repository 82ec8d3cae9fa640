"""A subharmonic motion

Three periods of the force make one of the motion: a `guess` of the order 1/3 starts a curve that no
other curve leads to.
"""

import numpy as np

from tipdamp import CubicSpring, Problem

quiet = Problem([[1.0]], [[0.05]], [[1.0]]).add(CubicSpring(1.0), 0).force(0, 2.0)
third = np.array([0.0, 2.0, 0.0])  # of x: mean, cosine and sine of a third of the excitation
given = dict(outputs={"x": 0}, harmonics=9)
plain = quiet.follow_band((0.5, 1.1), **given)
third_order = quiet.follow_band((0.5, 1.1), guess=(6 / (2 * np.pi), third), periods=3, **given)
axes = third_order.plot(label="order 1/3")
plain.plot(label="order 1", ax=axes)

assert third_order.periods == 3 and third_order.peak("x")[1] > 5 * plain.at(0.9).amplitude()[0]
