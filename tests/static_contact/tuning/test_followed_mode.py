"""The followed mode among many sets of springs, more of them than modes and fewer, against all
modes by LAPACK."""

import numpy as np
import pytest

from tests.contact_tables import contact_table
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.tuning.followed_mode import FollowedMode
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly


@pytest.mark.parametrize("springs", [12, 90])
def test_sets_in_turn(springs):
    """Springs that leave one after the other, all at once, and come back with a part."""
    rng, r = np.random.default_rng(4), 40
    lam = np.sort(rng.uniform(1, 400, r)) ** 2
    phi = np.linalg.qr(rng.standard_normal((r, r)))[0]
    rows, follow = rng.standard_normal((springs, r)), phi[:, 5]
    mode, search = FollowedMode(lam, phi, rows, follow), None
    k = rng.uniform(50, 900, springs)
    for keep in (1.0, 0.95, 0.9, 0.4, 0.9, 0.4):
        own = k * (rng.uniform(size=springs) < keep)
        value, shapes = np.linalg.eigh(phi @ np.diag(lam) @ phi.T + (rows.T * own) @ rows)
        mac = (follow @ shapes) ** 2
        search = mode.near(value[mac.argmax()] * 1.01)
        assert search.find(own) == pytest.approx((value[mac.argmax()], mac.max()), rel=1e-9)


@pytest.mark.parametrize("shift", [0.9, 1.3, 5.0])
@pytest.mark.parametrize("springs", [1, 9])
@pytest.mark.parametrize("seed", range(3))
def test_modes_that_resemble_the_shape_alike(seed, springs, shift):
    """A shape that is half of one mode and half of two others of one frequency, in any mixture: the
    lower frequency is followed, and equal modes count as one. With modes from LAPACK and by Lanczos
    the same."""
    random = np.random.default_rng(seed)
    lam = np.array([1.0, 4.0, 4.0, 9.0, 16.0, 25.0])
    phi = np.linalg.qr(random.normal(size=(6, 6)))[0]
    share = random.normal(size=2)
    follow = phi[:, :3] @ np.r_[1.0, share / np.linalg.norm(share)] / np.sqrt(2)
    K = phi @ np.diag(lam) @ phi.T
    mode = FollowedMode(lam, phi, np.repeat(phi[:, 5:].T, springs, axis=0), follow)
    assert mode.near(shift).find(np.full(springs, 0.1)) == pytest.approx((1.0, 0.5), rel=1e-9)
    model = ReducedModel.from_matrices(np.eye(6), (K + K.T) / 2, body=["damper"] * 6)
    found = StuckAssembly(model, lambda *_: np.zeros((3, 6))).modes(
        contact_table(np.eye(3)[None]), follow
    )
    assert found.tracked == 0 and found.mac == pytest.approx(0.5, rel=1e-9)
    assert ((follow @ found.shapes) ** 2)[:3] == pytest.approx([0.5, 0.5, 0.0], abs=1e-12)
