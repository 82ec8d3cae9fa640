"""Dampers compared

Response per newton over the force, for three dampers: a stiffer contact lowers the least that can
be reached, more friction moves it to larger forces. For whole studies: `tipdamp compare`
([how](../comparison.md)).
"""

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import Jenkins1D, Problem, follow_peak

blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=2e-4)
dampers = {  # N/m and friction limit in N
    "soft": (2e5, 4.0),
    "stiff": (5e5, 4.0),
    "stiff, rough": (5e5, 8.0),
}
_, axes = plt.subplots(layout="constrained")
for name, (kt, limit) in dampers.items():
    problem = blade.add(Jenkins1D(), 0, kt=kt, mu=0.5, preload=limit / 0.5).contact_problem
    given = {"outputs": {"tip": [1.0]}, "band": (600, 1000), "harmonics": 1}
    peaks = follow_peak(problem, np.array([1.0]), "level", (1.0, 20.0), **given)
    per_newton = 1e6 * peaks.height / peaks.parameter
    axes.loglog(peaks.parameter, per_newton, label=name)

    # pi F a = 4 Fc (a - Fc / kt) at a resonance: the least a / F is pi / kt, at F = 2 Fc / pi
    least = int(per_newton.argmin())
    assert abs(per_newton[least] - 1e6 * np.pi / kt) < 0.05 * 1e6 * np.pi / kt
    assert abs(peaks.parameter[least] - 2 / np.pi * limit) < 0.1 * limit
axes.set(xlabel="force (N)", ylabel="peak (µm/N)")
axes.legend()
