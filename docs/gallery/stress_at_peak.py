"""Stress at the peak

A cantilever of finite elements with friction at its tip: the motion at the peak of its curve, back
on the whole mesh, and the alternating stress. (In a study: `[respond] stress = true`.)
"""

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import Jenkins1D, Material, Mesh, Problem, craig_bampton, elastic_body, whole_motion
from tipdamp.meshes.structured import extrude, join, ruled
from tipdamp.modal.stress_recovery import alternating_stress

length, width, height, steel = 0.1, 0.01, 0.005, Material(E=207e9, nu=0.3, density=7850.0)  # m, Pa
lower, upper = ([(x, z) for x in np.linspace(0, length, 21)] for z in (0, height))
place, cells = extrude(*join([ruled(lower, upper, 1)]), np.linspace(0, width, 3))
node, top = np.arange(len(place)), (place[:, 1] == width / 2) & (place[:, 2] == height)
mesh = Mesh(node, place, {"hexahedron27": cells}, {"clamp": node[place[:, 0] == 0]})
tip = node[top][place[top, 0].argmax()]
reduction = craig_bampton(elastic_body(mesh, steel, "beam", clamp="clamp"), [tip], modes=4)

up = reduction.model.displacement_row("beam", tip, [0, 0, 1])
beam = Problem(reduction.model.M, K=reduction.model.K, damping_ratio=0.002).force(up, 2.0)
damped = beam.add(Jenkins1D(), up, kt=2e3, mu=0.5, preload=4.0)
curve = damped.follow_band((380, 470), outputs={"tip": up}, harmonics=3)
motion = whole_motion(curve, damped, int(curve.amplitude()[:, 0].argmax()))
tensors = [reduction.stress(q, mesh, steel) for q in motion.T]
stress = 1e-6 * alternating_stress(np.stack(tensors, axis=2))  # MPa
_, axes = plt.subplots(figsize=(8, 2.5), layout="constrained")
side = place[:, 1] == 0
drawn = axes.tricontourf(*1e3 * place[side][:, [0, 2]].T, stress[side], levels=12)
plt.colorbar(drawn, label="alternating stress (MPa)")
axes.set(xlabel="x (mm)", ylabel="z (mm)")

# Euler-Bernoulli cantilever, first mode: at 0.4 of its length the curvature is 1.621 tip / length^2
there = 1e-6 * steel.E * height / 2 * 1.621 * curve.peak("tip")[1] / length**2
assert abs(stress[top][np.isclose(place[top, 0], 0.4 * length)][0] - there) < 0.03 * there
