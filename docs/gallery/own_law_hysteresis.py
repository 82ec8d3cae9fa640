"""A law of your own with memory

Dahl's friction steps its state along the motion; the file is
[dahl.py](../studies/own_law/dahl.py). `check_law` is its conformance run.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "studies" / "own_law"))
from dahl import Dahl  # noqa: E402

from tipdamp import Problem, check_law, contact_cycles  # noqa: E402

check_law(Dahl())
problem = Problem([[1.0]], [[0.05]], [[1.0]]).add(Dahl(), 0, kt=2.0, mu=0.5, preload=1.0)
driven = problem.force(0, 1.0)
curve = driven.follow_band((0.1, 0.4), outputs={"x": 0}, harmonics=3)
top = int(np.argmax(curve.amplitude()[:, 0]))
loop = contact_cycles(curve, driven.contact_problem, top)
loop.plot().set_title("Dahl's friction creeps towards its limit")

assert loop.force.max() < 0.5
