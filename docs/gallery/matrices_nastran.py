"""Matrices from Nastran

A punch (EXTSEOUT(DMIGPCH) or PARAM,EXTOUT,DMIGPCH) names the node and dof of each entry itself:
the model needs no table. OUTPUT4 (.op4) needs one, as OUTPUT2 (.op2) does, which pyNastran reads.
"""

import numpy as np

from tipdamp import Jenkins1D, Problem, ReducedModel, natural_frequencies, write_model

# Two masses of 20 kg on springs of 30 kN/mm, as Nastran punches them
entries = {"KAAX": (60e6, -30e6, 30e6), "MAAX": (20.0, 0.0, 20.0)}
lines = []
for name, (a11, a21, a22) in entries.items():
    lines += [f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}"]
    for column, rows in ((101, {101: a11, 102: a21}), (102, {102: a22})):
        lines += [f"DMIG*   {name:16s}{column:16d}{1:16d}"]
        lines += [f"*       {row:16d}{1:16d}{value:16.9E}" for row, value in rows.items()]
open("blade.pch", "w").write("\n".join(lines) + "\n")

model = ReducedModel.from_files("blade.pch", "blade.pch")
op4, dofs = write_model(model, ".", "op4")
tip = model.dofs("body", 102)[0]
blade = Problem(model.M, K=model.K, damping_ratio=0.002).add(
    Jenkins1D(), tip, kt=1e7, mu=0.4, preload=500
)
curve = blade.force(tip, 300.0).follow_band((90, 170), outputs={"tip": tip}, harmonics=5)
curve.plot(unit="um")

golden = np.array([np.sqrt(5) - 1, np.sqrt(5) + 1]) / 2  # of a chain of two: closed form
expected = np.sqrt(30e6 / 20.0) * golden / (2 * np.pi)
for one in (model, ReducedModel.from_files(op4, op4, dofs=dofs)):
    assert np.allclose(natural_frequencies(one), expected)
