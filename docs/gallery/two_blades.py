"""Two blades and a damper

The route of a study in one page: static preload, forced response at three levels, and what the
damper does per newton of force.
"""

from tipdamp import DryFriction2T, forced_response, preload, two_blades

model, pairs = two_blades(stations=3)
loaded = preload(model, pairs, 60.0 * model.loads["pull"]).pairs
tip, other = (model.displacement_row(blade, 2, [0, 1, 0]) for blade in ("blade1", "blade2"))
given = dict(damping_ratio=0.01, harmonics=7, outputs={"tip": tip})
axes = None
for newton in (2.0, 20.0, 40.0):
    force = newton * (tip - other)
    curve = forced_response(model, loaded, DryFriction2T(), force, (1000, 1700), **given)
    axes = curve.plot(unit="um", label=f"{newton:g} N", ax=axes)

assert curve.complete and len(curve.slipping_pairs) == 6
