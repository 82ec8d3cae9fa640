"""The step-size rule."""

import numpy as np
import pytest

from tipdamp.hbm.continuation.branch import next_step, shorter_step
from tipdamp.hbm.continuation.settings import DEFAULT


@pytest.mark.parametrize(
    "errors, iterations, shortened, expected",
    [
        ([DEFAULT.aim] * 2, 2, False, (1, 0.1)),  # erred as aimed: the same step, the lower order
        # an eighth at third order would double it: at most 1.8
        ([1.0, 2**-3 * DEFAULT.aim], 2, False, (2, 0.18)),
        # the error goes with the power order + 1 of the step
        ([DEFAULT.aim / 2, DEFAULT.aim], 2, False, (1, 0.1 * 2 ** (1 / 2))),
        ([1.0, DEFAULT.aim / 4], 2, False, (2, 0.1 * 4 ** (1 / 3))),
        ([1.0, 2**-3 * DEFAULT.aim], 2, True, (2, 0.1)),  # not before what stopped a longer one
        ([1.0, 2**-3 * DEFAULT.aim], 5, False, (2, 0.06)),  # shorter where the corrector took long
        ([1.0], 2, False, (1, 0.05)),
    ],
)  # at most halved
def test_step_by_error(errors, iterations, shortened, expected):
    assert next_step(0.1, np.array(errors), iterations, shortened, DEFAULT) == pytest.approx(
        expected
    )


def test_steps_are_bounded_and_shortened():
    assert next_step(0.2, np.array([0.0]), 1, False, DEFAULT) == (1, DEFAULT.largest_step)
    assert shorter_step(0.1, 4) == (2, pytest.approx(0.04)) and shorter_step(0.005, 4) == (
        1,
        pytest.approx(0.002),
    )
