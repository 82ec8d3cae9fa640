"""A shaken base

The ground moves, and friction to the ground acts on the relative motion: at a small shake the
slider sticks, at a large one it damps.
"""

from tipdamp import Jenkins1D, Problem

chain = Problem(M=[[1.0, 0], [0, 1.0]], K=[[2e4, -1e4], [-1e4, 1e4]], damping_ratio=0.01)
damped = chain.add(Jenkins1D(), 1, kt=2e3, mu=0.5, preload=4.0)
axes, per_metre = None, []
for shake in (1e-5, 1e-4, 3e-4):
    curve = damped.base_motion([1.0, 1.0], shake).follow_band((7, 16), outputs={"top": 1})
    axes = curve.plot(unit="mm", label=f"{1e3 * shake:g} mm", ax=axes)
    per_metre.append(curve.peak("top")[1] / shake)

assert min(per_metre) < 0.5 * per_metre[0]
