"""Your own matrices, from Matrix Market and MATLAB files

Mass and stiffness from .mtx or .mat files, a dof table beside them: from there all is as with any
other model.
"""

import numpy as np
import scipy.io
import scipy.sparse as sp

from tipdamp import CubicSpring, Problem, ReducedModel, natural_frequencies

n = 12
K = sp.diags([2e6 * np.ones(n), -1e6 * np.ones(n - 1), -1e6 * np.ones(n - 1)], [0, 1, -1])
scipy.io.mmwrite("M.mtx", 0.01 * sp.eye(n))
scipy.io.mmwrite("K.mtx", K)
scipy.io.savemat("bar.mat", {"M": 0.01 * np.eye(n), "K": K.toarray()})
rows = "\n".join(f"{i},bar,{i + 1},x" for i in range(n))
open("dofs.csv", "w").write("row,body,node,direction\n" + rows + "\n")

market = ReducedModel.from_files("M.mtx", "K.mtx", dofs="dofs.csv")
matlab = ReducedModel.from_files("bar.mat", "bar.mat", dofs="dofs.csv")
bar = Problem(market.M, K=market.K, damping_ratio=0.01).add(CubicSpring(1e13), n - 1)
driven = bar.force(0, 50.0)
driven.follow_band((250, 700), outputs={"end": n - 1}, harmonics=3).plot(unit="mm")

assert np.allclose(natural_frequencies(market), natural_frequencies(matlab))
