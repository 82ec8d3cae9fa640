"""A beam with a friction contact

A cantilever of eight elements rubs at mid length. At small forces the contact sticks, at large ones
the beam moves as without it: between the two frequencies friction damps best.
"""

import numpy as np
from scipy.linalg import eigh

from tipdamp import Jenkins1D, Problem, cantilever

M, K = cantilever(length=0.71, height=0.05, thickness=0.03)
beam = Problem(M, K=K, damping_ratio=0.003).add(Jenkins1D(), 6, kt=1e6, mu=1, preload=5)
axes, peaks = None, []
for newton in (0.2, 1.0, 2.0, 5.0, 20.0):
    curve = beam.force(14, newton).follow_band((40, 110), outputs={"tip": 14}, harmonics=7)
    axes = curve.plot(unit="um", label=f"{newton:g} N", ax=axes)
    peaks.append(curve.peak("tip"))
axes.set_yscale("log")

# f = 1.8751^2 / (2 pi) sqrt(E I / (rho A L^4)) of a slender clamped beam, bent across its 30 mm
E, rho, length, depth = 210e9, 7850.0, 0.71, 0.03
free = 1.8751**2 / (2 * np.pi) * np.sqrt(E * depth**2 / (12 * rho)) / length**2
assert abs(peaks[-1][0] - free) < 0.02 * free
stuck = np.sqrt(eigh(K + np.diag(1e6 * np.eye(16)[6]), M, eigvals_only=True)[0]) / (2 * np.pi)
assert abs(peaks[0][0] - stuck) < 0.01 * stuck
