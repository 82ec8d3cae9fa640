"""The backbone of a friction damper

Frequency and damping of a mode over its amplitude: from stuck, over the best damping, to full slip.
"""

import matplotlib.pyplot as plt

from tipdamp import Jenkins1D, Problem, backbone

blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.0)
problem = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).contact_problem
mode = backbone(problem, 1, (1e-6, 1e-3), outputs={"tip": [1.0]}, harmonics=3)
_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
mode.plot(unit="um", ax=left)
for newton in (3.0, 5.0, 8.0):
    driven = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0).force(0, newton)
    curve = driven.follow_band((650, 950), outputs={"tip": 0})
    curve.plot(unit="um", label=f"{newton:g} N", ax=left)
left.set_ylim(0, 100)
right.semilogx(1e6 * mode.amplitude, 100 * mode.damping_ratio)
right.set(xlabel="amplitude (µm)", ylabel="damping ratio (%)")

free, stuck = 711.8, 871.7  # Hz
assert abs(mode.frequency[0] - stuck) < 0.1 and free < mode.frequency[-1] < 1.02 * free
assert mode.damping_ratio[0] < 1e-6
