"""Peaks over the pull of a damper reduced from meshes, past kinks of its curves."""

from unittest import mock

import numpy as np
import pytest

from tests.hbm.following.test_follow import swept
from tests.validation.three_dampers import FOLDER, PULL, prepared
from tipdamp.hbm.following.case import Case
from tipdamp.hbm.following.follow import follow_peak

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
FORCE = 20.0  # N


def test_past_a_kink_at_the_peak(tmp_path):
    """The curve has a corner at its peak over a part of the way: places are fitted there, and the
    equation holds again beyond, without a whole curve at each kink."""
    from tipdamp.stages.assembly import assembled

    study = FOLDER / "rig_60mm" / "asymmetric.toml"
    made = assembled(*prepared(study, tmp_path, (PULL / FORCE,), size=0.5)).curves
    name = next(name for name in made.rows if name.startswith("patch_1"))
    given = dict(outputs={name: made.rows[name]}, band=(2300, 3300), harmonics=3)
    case, whole, curve = (made.problem, FORCE * made.force), [], Case.curve

    def counted(self, value, band=None, *further):
        whole.extend([value] if band is None else [])
        return curve(self, value, band, *further)

    with mock.patch.object(Case, "curve", counted):
        peaks = follow_peak(*case, "pull", (0.85, 0.8), at=[0.84, 0.81], **given)
    assert peaks.complete and not peaks.jumps.any() and {0.84, 0.81} <= set(peaks.parameter)
    assert whole == [0.85, 0.8]
    assert peaks.fitted[peaks.at(0.81)] and not peaks.fitted[[0, peaks.at(0.84), -1]].any()
    for i in (peaks.at(0.84), peaks.at(0.81), np.flatnonzero(peaks.fitted)[0]):
        there = swept(*case, "pull", peaks.parameter[i], given, peaks.kind)
        assert peaks.height[i] == pytest.approx(there[1], rel=1e-8)
        assert peaks.frequency[i] == pytest.approx(there[0], rel=1e-6)
