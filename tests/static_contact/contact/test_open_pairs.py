"""The response about a preload that leaves pairs open, against the same model with its gaps and
static load."""

import numpy as np
import pytest

from tests.hbm.small_rig import small_rig
from tipdamp.hbm.contact import relative_motion
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.response import forced_response
from tipdamp.static_contact.contact.preload import StaticContact


@pytest.mark.slow
# the open pair stays open; and closes in each cycle
@pytest.mark.parametrize("level", [0.5, 300.0])
def test_response_about_open_pairs(level):
    """Sliders that start where the static solution puts the pairs; then both ways solve the same
    equations. The band ends where at 300 N the curve folds again and again, and rounding leads it
    to one branch or another."""
    model, pairs, tip = small_rig(stations=3)
    load = relative_motion(model, pairs)[2::3].T @ pairs.preload
    gap = np.where(np.arange(len(pairs)) == 1, 3, 0) * np.median(pairs.preload / pairs.kn)
    rest = StaticContact(model, pairs).solve(load, gap=gap, constrain=True)
    assert (rest.pairs.preload < 0).sum() == 1
    sliders = (relative_motion(model, pairs) @ rest.displacement).reshape(-1, 3)[:, :2]
    more = dict(
        law=DryFriction2T(),
        forcing=level * tip,
        band=(300, 330),
        harmonics=3,
        damping_ratio=0.02,
        outputs={"tip": tip},
        at=[310.0, 325.0],
    )
    about = forced_response(model, rest.pairs, **more)
    whole = forced_response(
        model, pairs.replace(gap=gap), origin="unloaded", static=load, start=sliders, **more
    )
    assert about.complete and whole.complete
    for hz in more["at"]:
        a, b = (curve.harmonics[curve.frequency == hz, 0] for curve in (about, whole))
        b[:, 0] -= tip @ rest.displacement
        assert np.abs(a - b).max() < 1e-7 * np.abs(b).max()
    assert (about.share_open[:, 1].min() == 1.0) == (level == 0.5)
