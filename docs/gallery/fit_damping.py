"""Damping fitted with friction in the model

Half-power takes the whole width of a peak for damping: where contacts slip, friction is in it, more
or less with the level. `fit_damping` tells both apart, from two levels, here made up with noise.
"""

from dataclasses import replace

import numpy as np

from tipdamp import Jenkins1D, MeasuredResponse, Problem, fit_damping, half_power

zeta = 0.008
blade = Problem(M=[[0.05]], K=[[1e6]], damping_ratio=zeta)
damped = blade.add(Jenkins1D(), 0, kt=5e5, mu=0.5, preload=40.0)
noise, runs, by_half_power = np.random.default_rng(0), [], []
for newton in (2.0, 8.0):
    curve = damped.force(0, newton).follow_band((650, 950), outputs={"tip": 0}, harmonics=3)
    hz, response = curve.frequency, curve.amplitude("harmonic")[:, 0]
    response = response * (1 + 0.01 * noise.normal(size=len(hz)))
    runs.append(MeasuredResponse(hz, response, [1.0], level=newton))
    by_half_power.append(half_power(hz, response).zeta)

guess = replace(damped.contact_problem, damping_ratio=0.02)
fitted = fit_damping(guess, [1.0], runs, mu=True, harmonics=3)


damping, mu = fitted.values
low, high = by_half_power
fitted.plot(unit="um").set_title(f"half-power: {low:.1%} and {high:.1%}, fit: {damping:.1%}")

assert high > 2 * low > 4 * zeta
assert fitted.low[0] < zeta < fitted.high[0] and abs(mu - 1) < 0.01
