"""From an Abaqus file to a preload map

A damper in the corner between two clamped blocks, with material and node sets as a pre-processor
writes them: the proposed study, the one value that no file says, and the static preload.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from tipdamp import ContactTable
from tipdamp.cli import main

grid, far = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), -1).reshape(-1, 3), 5
ahead = np.array([0, 36, 42, 6, 1, 37, 43, 7])  # corners of a cell, by their nodes
cells = (grid[(grid < far).all(1)] @ [36, 6, 1])[:, None] + ahead
held = {"ONE": grid[:, 0] == 0, "TWO": grid[:, 2] == 0, "PIN": (grid[:, ::2] == far).all(1)}
at, text, place = {"ONE": (-1, 0, 0), "TWO": (0, 0, -1), "PIN": (0, 0, 0)}, [], np.arange(1, 217)
for k, (body, corner) in enumerate(at.items()):
    number, position = 1000 * k + place, 10.0 * (grid / far + corner)  # mm
    nodes = zip(number, *position.T, strict=True)
    text += ["*NODE", *(", ".join(map(str, node)) for node in nodes)]
    text += [f"*ELEMENT, TYPE=C3D8, ELSET={body}"]
    text += [", ".join(map(str, (number[c[0]], *number[c]))) for c in cells]
    text += [f"*NSET, NSET={'PULL' if body == 'PIN' else 'CLAMP'}", *map(str, number[held[body]])]
    text += [f"*SOLID SECTION, ELSET={body}, MATERIAL=STEEL"]
text += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "207000, 0.3", "*DENSITY", "7.85e-9", ""]
Path("corner.inp").write_text("\n".join(text))
main(["inspect", "corner.inp", "--pull", "100", "--quiet"])  # writes corner.toml
proposed = Path("corner.toml").read_text()
Path("corner.toml").write_text(proposed.replace('mu = "?"', "mu = 0.3"))
for stage in ("inspect", "reduce", "preload"):
    assert main([stage, "corner.toml", "--quiet"]) == 0
pairs = ContactTable.load("results/corner/preload.csv")
for side, axes in zip(pairs.sides, plt.subplots(1, 2, layout="constrained")[1], strict=True):
    pairs.plot(side, axes)
    force = pairs.preload[pairs.side == side].sum()
    assert np.isclose(force, 100 / np.sqrt(2), rtol=1e-3)  # N: a right angle, no friction
