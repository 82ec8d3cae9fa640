"""A law of your own, in numba beside numpy

numpy is enough for most laws; a loop that numba compiles is faster, for the same curve.
"""

import runpy
from pathlib import Path

import numba
import numpy as np

from tipdamp import Problem

Dahl = runpy.run_path(f"{Path(__file__).parents[1]}/studies/own_law/dahl.py")["Dahl"]


@numba.njit
def creep(u, before, kt, limit, state):
    for p in range(len(u)):
        s = 1.0 if u[p].real > before[p, 1].real else -1.0
        fading = np.exp(-kt[p] * s * (u[p] - before[p, 1]) / limit[p])
        state[p] = s * limit[p] + (before[p, 0] - s * limit[p]) * fading, u[p]


class CompiledDahl(Dahl):
    def step(self, motion, state, contacts):
        new = np.empty(state.shape, np.result_type(motion.u, state))
        creep(motion.u[:, 0], state, contacts.kt, contacts.mu * contacts.preload, new)
        return new[:, :1], new


axes, peaks = None, []
for law in (CompiledDahl(), Dahl()):
    problem = Problem([[1.0]], [[0.05]], [[1.0]]).add(law, 0, kt=2.0, mu=0.5, preload=1.0)
    curve = problem.force(0, 1.0).follow_band((0.1, 0.3), outputs={"x": 0}, harmonics=1)
    axes = curve.plot(label=law.name, ax=axes)
    peaks.append(curve.peak("x")[1])

assert creep.signatures and np.isclose(*peaks, rtol=1e-9)
