"""Two orders of excitation

A rotor passes several wakes: a force with two harmonics, whose second meets the resonance at half
the speed.
"""

from tipdamp import CubicSpring, Problem

blade = Problem(M=[[1.0]], C=[[0.05]], K=[[1.0]]).add(CubicSpring(0.05), 0)
one = blade.force(0, 0.1)
two = one.force(0, 0.05, harmonic=2)
given = dict(outputs={"x": 0}, harmonics=7)
axes = one.follow_band((0.05, 0.25), **given).plot(label="order 1")
both = two.follow_band((0.05, 0.25), **given)
both.plot(label="orders 1 and 2", ax=axes)

half = both.amplitude()[abs(both.frequency - 0.08).argmin(), 0]
assert half > 2 * one.solve_at(0.08, **given).amplitude()[0]
