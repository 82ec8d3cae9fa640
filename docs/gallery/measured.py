"""A measured curve beside the computed one

Damping from the half-power width of a measured curve goes into the model; the band is the scatter
of three repeats (here made up, with noise).
"""

import numpy as np

from tipdamp import Jenkins1D, Problem, half_power

hz = np.linspace(650, 780, 300)
mass, k, zeta = 0.05, 1e6, 0.012
w = 2 * np.pi * hz
clean = 1 / abs(k - mass * w**2 + 2j * zeta * np.sqrt(k * mass) * w)  # m/N
repeats = clean * (1 + 0.02 * np.random.default_rng(0).normal(size=(3, 1)) * np.ones_like(hz))
mean, scatter = repeats.mean(axis=0), 2 * repeats.std(axis=0, ddof=1)

found = half_power(hz, mean).zeta
blade = Problem(M=[[mass]], K=[[k]], damping_ratio=found).force(0, 1.0)
loose = blade.add(Jenkins1D(), 0, kt=1e2, mu=0.5, preload=1.0)
axes = loose.follow_band((650, 780), outputs={"tip": 0}).plot(unit="um", label="computed")
axes.fill_between(
    hz, 1e6 * (mean - scatter), 1e6 * (mean + scatter), color="orange", label="measured"
)
axes.legend()

assert abs(found - zeta) < 0.02 * zeta
