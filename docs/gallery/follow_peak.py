"""Follow a peak over the pull

The peak of a blade with a friction damper, at one force, as the pull grows: the least lies between
the loose and the stuck damper. One branch instead of a curve for each pull.
"""

import numpy as np

from tipdamp import Jenkins1D, Problem, follow_peak

kt, force = 5e5, 5.0
blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.002)
problem = blade.add(Jenkins1D(), 0, kt=kt, mu=0.5, preload=1.0).contact_problem
given = {"outputs": {"tip": [1.0]}, "band": (600, 1000), "harmonics": 1}
peaks = follow_peak(problem, np.array([force]), "preload", (60.0, 0.5), **given)
axes = peaks.plot(unit="um")
axes.set_yscale("log")

# Force against friction at a resonance: pi F a = 4 Fc (a - Fc / kt); least a at Fc = pi F / 2
best = 0.5 * peaks.parameter[peaks.height.argmin()]  # friction limit Fc, N
assert abs(best - np.pi / 2 * force) < 0.05 * np.pi / 2 * force
