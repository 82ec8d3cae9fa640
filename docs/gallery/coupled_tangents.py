"""Two coupled tangents

A tip that is driven along two directions, a quarter of a period apart, on isotropic friction: the
resultant of both tangents has the limit mu N, where two of `DryFriction2T` have it each.
"""

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import DryFriction2T, IsotropicFriction, Problem, contact_cycles

tip = Problem(M=0.05 * np.eye(3), K=np.diag([1e6, 1.1e6, 2e6]), damping_ratio=0.01)
tip = tip.force(0, 9.0).force(1, -6.0j)  # cosine along t1, sine along t2
orbits, friction = plt.subplots(1, 2, figsize=(8, 4), layout="constrained")[1]
largest = []
for law in (IsotropicFriction(), DryFriction2T()):
    damped = tip.add(law, (0, 1, 2), kn=1e6, kt=5e5, mu=0.5, preload=40.0)
    curve = damped.follow_band((600, 1000), outputs={"t1": 0, "t2": 1}, harmonics=3)
    cycle = contact_cycles(curve, damped, curve.amplitude()[:, 0].argmax())
    motion, force = 1e6 * cycle.motion[:, 0], cycle.force[:, 0]
    orbits.plot(motion[:, 0], motion[:, 1], label=law.name)
    friction.plot(force[:, 0], force[:, 1])
    largest.append(np.hypot(force[:, 0], force[:, 1]).max())
orbits.set(xlabel="t1 (µm)", ylabel="t2 (µm)", title="orbits at the peak")
friction.set(xlabel="t1 (N)", ylabel="t2 (N)", title="friction, limit mu N", aspect="equal")
friction.add_patch(plt.Circle((0, 0), 20.0, fill=False))
orbits.legend()

assert np.isclose(largest[0], 20.0) and largest[1] > 1.2 * 20.0
