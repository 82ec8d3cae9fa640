"""The followed mode among many sets of springs, more of them than modes and fewer, against all modes by LAPACK."""

import numpy as np
import pytest

from static_contact.followed_mode import FollowedMode


@pytest.mark.parametrize("springs", [12, 90])
def test_sets_in_turn(springs):
    """Springs that leave one after the other, all at once, and come back with a part."""
    rng, r = np.random.default_rng(4), 40
    lam, phi = np.sort(rng.uniform(1, 400, r)) ** 2, np.linalg.qr(rng.standard_normal((r, r)))[0]
    rows, follow = rng.standard_normal((springs, r)), phi[:, 5]
    mode, search = FollowedMode(lam, phi, rows, follow), None
    k = rng.uniform(50, 900, springs)
    for keep in (1.0, 0.95, 0.9, 0.4, 0.9, 0.4):
        own = k * (rng.uniform(size=springs) < keep)
        value, shapes = np.linalg.eigh(phi @ np.diag(lam) @ phi.T + (rows.T * own) @ rows)
        mac = (follow @ shapes) ** 2
        search = mode.near(value[mac.argmax()] * 1.01)
        assert search.find(own) == pytest.approx((value[mac.argmax()], mac.max()), rel=1e-9)
