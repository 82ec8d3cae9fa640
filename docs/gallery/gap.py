"""A stop behind a gap

A blade hits a stiff stop once it moves by more than the gap: the curve is linear up to there, then
the resonance moves up. A negative preload is the gap times the stiffness of the stop.
"""

from tipdamp import Problem, UnilateralSpring

gap, kn = 20e-6, 1e6  # m, N/m
blade = Problem(M=[[0.05]], C=[[4.5]], K=[[1e6]])  # 1 % while the stop is open
stopped = blade.add(UnilateralSpring(), 0, kn=kn, preload=-gap * kn)
axes, peaks = None, {}
for newton in (0.2, 1.0, 2.0):
    curve = stopped.force(0, newton).follow_band((600, 900), outputs={"tip": 0}, harmonics=9)
    axes = curve.plot(unit="um", label=f"{newton:g} N", ax=axes)
    peaks[newton] = curve.peak("tip")[1]
axes.axhline(1e6 * gap, color="grey", linestyle=":")

assert peaks[0.2] < gap < peaks[1.0]
assert peaks[2.0] < 10 * peaks[0.2]  # no longer in proportion to the force
