"""How much preload damps best

At one level of excitation, the peak over the preload of the damper: loose it does nothing, tight it
sticks and only stiffens. Each peak is solved, not read off a grid.
"""

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import Jenkins1D, Problem

blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.002).force(0, 5.0)
preload = np.array([5.0, 10, 20, 40, 60, 80, 120, 200])  # N
peaks = [
    blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=N)
    .follow_band((600, 1000), outputs={"tip": 0})
    .peak("tip")[1]
    for N in preload
]
_, axes = plt.subplots(layout="constrained")
axes.semilogy(preload, 1e6 * np.array(peaks), "o-")
axes.set(xlabel="preload (N)", ylabel="peak (µm)")
axes.set_yticks([50, 100, 200], ["50", "100", "200"])
axes.minorticks_off()

best = int(np.argmin(peaks))
assert 0 < best < len(preload) - 1
