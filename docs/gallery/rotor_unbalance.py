"""Rotor unbalance with a retainer

The force of an unbalanced mass grows with the square of the speed; past its resonance the rotor
turns about its centre of mass, unless a stop catches it.
"""

import numpy as np

from tipdamp import Problem, Unbalance, UnilateralSpring

moment, mass = 1e-4, 2.0  # kg m, kg
rotor = Problem(M=[[mass]], C=[[60.0]], K=[[2e5]]).force(0, Unbalance(moment))
axes = None
for name, gap in (("free", 10e-3), ("stop 0.3 mm away", 0.3e-3)):
    stopped = rotor.add(UnilateralSpring(), 0, kn=2e5, preload=-2e5 * gap)
    curve = stopped.follow_band((20, 200), outputs={"x": 0}, harmonics=5)
    axes = curve.plot(unit="mm", label=name, ax=axes)
axes.axhline(1e3 * moment / mass, color="grey", linestyle=":")

assert np.isclose(curve.amplitude()[-1, 0], moment / mass, rtol=0.1)
