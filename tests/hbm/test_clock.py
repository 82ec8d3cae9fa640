"""A response does not depend on the instant from which time is counted, where no slider is dragged
along before it sticks for good."""

import numpy as np
import pytest

from tests.hbm.conformance import LAWS, one_dof
from tipdamp.hbm.balance.problem import contact_problem
from tipdamp.hbm.response import solve_at

PHASES = 2 * np.pi * np.array([3, 16, 41]) / 64  # rad: whole samples, for sampled laws
HZ, H = 1.4, 3
ROWS = dict(zip("xyz", np.eye(3), strict=True))
NORMAL = np.array([0.3, -0.2, 8.0])  # N, static, onto the contact and a little along it


def problem_of(law, origin):
    """A mass on springs before a wall, pressed onto it by its preload or by a static load."""
    model, pairs, force = one_dof(law)
    static = NORMAL if origin == "unloaded" else None
    return contact_problem(model, pairs, law, origin, static, damping_ratio=0.02)[0], force


@pytest.mark.parametrize(
    "level", [0.05, 0.6, 20.0], ids=["sticks", "begins to slip", "slips and opens"]
)
@pytest.mark.parametrize("origin", ["preloaded", "unloaded"])
@pytest.mark.parametrize("law", [case.law for case in LAWS], ids=lambda law: law.name)
def test_the_phase_of_the_force_only_shifts_time(law, origin, level):
    problem, force = problem_of(law, origin)
    turns = np.exp(1j * np.outer(PHASES, np.arange(H + 1)))
    known = solve_at(problem, level * force, HZ, harmonics=H, outputs=ROWS)
    assert known.converged
    for turn in turns:
        found = solve_at(problem, turn[1] * level * force, HZ, harmonics=H, outputs=ROWS)
        size = np.abs(known.harmonics).max()
        assert (
            found.converged
            and np.abs(found.harmonics / turn - known.harmonics).max() <= 1e-8 * size
        )
