"""Motions are named by the body that moves."""

import numpy as np
import pytest

from tipdamp.hbm.example import two_blades
from tipdamp.hbm.hold.named_motion import describe_motion

MODEL, _ = two_blades()


@pytest.mark.parametrize("body", sorted(set(MODEL.body.tolist())))
def test_the_body_that_moves_is_named(body):
    assert describe_motion(MODEL, np.where(MODEL.body == body, 1.0, 0.01)).body == body
