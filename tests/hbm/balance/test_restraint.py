"""Which motions are free: decided in units of the dofs, however small the elements and whatever
rotations count in."""

import numpy as np
import pytest

from tests import beam_elements
from tests.hbm.fine_beams import clamped, in_angles, two_free
from tipdamp.hbm.balance.restraint import acts_along, floating_motions, stiff_factor, with_gauge


@pytest.mark.parametrize("n", [5, 81, 121])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_two_joined_beams_float_in_two_motions(n, unit):
    problem = two_free(n, unit)
    free = floating_motions(problem.M, problem.K, problem.stuck_stiffness, problem.B)
    R = np.stack(
        [
            np.tile([1.0, 0.0], 2 * n),
            np.ravel([0.004 * np.tile(np.arange(n), 2), np.ones(2 * n) / unit], "F"),
        ]
    )
    assert free.shapes.shape[1] == 2
    rigid = R.T @ np.linalg.inv(np.linalg.cholesky(R @ problem.M @ R.T)).T
    overlap = rigid.T @ problem.M @ free.shapes
    assert overlap.T @ overlap == pytest.approx(np.eye(2), abs=1e-9)
    assert stiff_factor(with_gauge(problem.M, problem.stuck_stiffness, free.shapes)) is not None


@pytest.mark.slow
def test_bending_of_a_very_fine_beam_is_no_free_motion():
    """Its softest mode stores 9e-11 of the stiffness of an element, less than reduction may leave
    of a rigid one."""
    n = 700
    K, M = in_angles(beam_elements.bending(np.linspace(0, 1, n), 1e3, 1.0), 1.0)
    assert floating_motions(M, K, K, np.zeros((0, 2 * n))).shapes.shape[1] == 2
    K, M, _ = clamped(n)
    assert floating_motions(M, K, K, np.zeros((0, len(K)))).shapes.shape[1] == 0


def test_a_load_acts_along_a_free_motion_in_any_unit():
    for unit in (1e-6, 1.0, 1e6):
        problem, n = two_free(81, unit), 81
        stuck = problem.stuck_stiffness
        free = floating_motions(problem.M, problem.K, stuck, problem.B)
        pushed, bent = np.zeros((2, 4 * n))
        # node (n - 1)/2 is in the middle
        pushed[0], bent[[0, n - 1, 2 * n - 2]] = 1.0, [1.0, -2.0, 1.0]
        couple = unit * np.eye(4 * n)[1]
        assert (
            acts_along(free, stuck, pushed) is not None
            and acts_along(free, stuck, couple) is not None
        )
        assert acts_along(free, stuck, bent) is None
