"""Time integration beside a curve

A second route with the same law: event-driven integration starts on the orbit of a point and must
stay there.
"""

import matplotlib.pyplot as plt

from tipdamp import Jenkins1D, Problem, compare

blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=0.01).force(0, 5.0)
damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
curve = damped.follow_band((600, 1000), outputs={"tip": 0})
_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
curve.plot(unit="um", ax=left)
for hz in (800.0, 858.0, 900.0):
    found = compare(curve, damped.contact_problem, hz)
    reached = abs(found.steady.harmonics[0, 1])
    left.plot(hz, 1e6 * reached, "k+", markersize=10)
    assert found.agrees and found.difference < 0.01
found.plot(unit="um", ax=right)
