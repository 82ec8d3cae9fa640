"""Friction loops

A Jenkins element between blade and ground. Its loop has the area of the energy that friction takes
in a period; at the limit mu N the slider moves.
"""

import numpy as np

from tipdamp import Jenkins1D, Problem, contact_cycles

blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01)
damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
axes = None
for newton in (3.0, 5.0, 8.0):
    pushed = damped.force(0, newton)
    curve = pushed.follow_band((600, 1000), outputs={"tip": 0})
    top = int(np.argmax(curve.amplitude()[:, 0]))
    loop = contact_cycles(curve, pushed.contact_problem, top)
    axes = loop.plot(unit="um", ax=axes, label=f"{newton:g} N")
axes.set_title("loops at the peaks")

assert np.isclose(loop.force.max(), 0.5 * 40.0)
