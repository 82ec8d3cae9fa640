"""Preload map and detachment

The pull of the damper, shared by the stations of both sides, and the set of stations that brings
the stuck frequency to a target.
"""

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import StuckAssembly, detach_until, preload, two_blades

model, pairs = two_blades(stations=5)
crowned = pairs.replace(gap=2e-6 * (pairs.position[:, 0] / 0.008) ** 2)  # m: ends stand off
found = preload(model, crowned, 60.0 * model.loads["pull"])
mode = sum(model.displacement_row("blade1", node, [0, 1, 0]) for node in range(1, 6))
mode = mode / np.sqrt(mode @ model.M @ mode)
tuned = detach_until(StuckAssembly(model), pairs, 1270.0, mode)
_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
found.pairs.plot("left", ax=left)
tuned.plot(ax=right)

assert found.residual < 1e-9 and abs(tuned.chosen.hz - 1270) < 10
