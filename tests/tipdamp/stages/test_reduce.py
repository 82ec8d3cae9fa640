"""Stage reduce: files for other programs."""

import numpy as np
import pytest


def test_free_modes_can_be_looked_at(rig_results):
    """The file for ParaView: mode 1 out of phase, mode 2 in phase at the tips, on the user's node
    numbers."""
    meshio = pytest.importorskip("meshio")
    picture = meshio.read(rig_results.path("free_modes.vtu"))
    names = [n for n in picture.point_data if n.startswith("mode")]
    free = rig_results.read_json("reduce.json")["free_hz"]
    assert names[0] == f"mode 1, {free['out_of_phase']:.1f} Hz" and len(names) == 6
    tips = [
        np.flatnonzero((picture.points[:, 2] > 0.073) & (side * picture.points[:, 0] > 0))
        for side in (-1, 1)
    ]
    for name, sign in zip(names[:2], (-1, 1), strict=True):
        left, right = (picture.point_data[name][t, 0].mean() for t in tips)
        assert np.sign(left * right) == sign and 0.9 < abs(left / right) < 1.1
