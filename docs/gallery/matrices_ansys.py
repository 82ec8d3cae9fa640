"""Matrices from Ansys

HBMAT writes the matrices of a .full file in Harwell-Boeing format and, beside them, a .mapping file
with node and dof of every row; a superelement goes through *EXPORT as Matrix Market.
"""

import numpy as np
import scipy.io
import scipy.sparse as sp

from tipdamp import Problem, ReducedModel, UnilateralSpring, natural_frequencies

# as HBMAT,K,hb,,ASCII,STIFF,NO,YES and HBMAT,M,hb,,ASCII,MASS,NO,NO leave them
n, k, m = 20, 4e7, 0.02
chain = sp.diags([2 * np.ones(n), -np.ones(n - 1), -np.ones(n - 1)], [0, 1, -1], format="csc")
scipy.io.hb_write("K.hb", k * chain)
scipy.io.hb_write("M.hb", m * sp.eye(n, format="csc"))
rows = "\n".join(f"{i + 1:10d}{500 + i:10d}  UX" for i in range(n))
open("K.mapping", "w").write("Matrix Eqn    Node   DOF\n" + rows + "\n")

model = ReducedModel.from_files("M.hb", "K.hb", dofs="K.mapping")
middle = model.dofs("body", 510)[0]
stop = {"kn": 2e7, "preload": -400.0}  # a gap of 0.02 mm
bar = Problem(model.M, C=3e-6 * model.K, K=model.K).add(UnilateralSpring(), middle, **stop)
curve = bar.force(middle, 60.0).follow_band((850, 1500), outputs={"x": middle}, harmonics=11)
curve.plot(unit="um")

closed = np.sqrt(k / m) * np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) / np.pi
assert np.allclose(natural_frequencies(model), closed)
