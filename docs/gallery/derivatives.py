"""What a peak depends on

Derivatives of frequency and height of a peak by friction, stiffness, pull and level, from the
solution itself and per relative change; crosses: what they promise for other frictions.
"""

import numpy as np

from tipdamp import Jenkins1D, Problem, peak_derivatives


def peak(mu):
    blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
    damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=mu, preload=4.0)
    curve = damped.follow_band((600, 1000), outputs={"tip": 0}, harmonics=3)
    return curve, damped


curve, damped = peak(0.5)
hz, height = peak_derivatives(curve, damped, "tip").total("mu")
axes = curve.plot(unit="um", label="mu = 0.5")
for mu in (0.4, 0.6):
    other, _ = peak(mu)
    other.plot(unit="um", label=f"mu = {mu}", ax=axes)
    at, top = curve.peak("tip")
    axes.plot(at + (mu / 0.5 - 1) * hz, 1e6 * (top + (mu / 0.5 - 1) * height), "k+", ms=12)

more, less = (peak(0.5 + d)[0].peak("tip")[1] for d in (1e-3, -1e-3))  # by differences
assert np.isclose(height, (more - less) / 4e-3, rtol=1e-3)
