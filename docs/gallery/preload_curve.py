"""Following a parameter

At one frequency, the response over a factor on the preload: one curve, no loop over problems.
"""

import numpy as np

from tipdamp import Jenkins1D, Problem, follow_parameter

blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
given = dict(outputs={"tip": [1.0]}, harmonics=3)
axes = None
for hz in (720.0, 760.0, 820.0):
    curve = follow_parameter(problem, np.array([5.0]), hz, "preload", (0.1, 4), **given)
    axes = curve.plot(unit="um", label=f"{hz:g} Hz", ax=axes)
axes.set_xlabel("factor on the preload of 40 N")

assert curve.complete
