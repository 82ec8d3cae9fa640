"""What the stages keep to be looked at: .vtu files for ParaView."""

import numpy as np
import pytest

from tipdamp.fields import surface
from tipdamp.fields.visualization import Shapes
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.model import ReducedModel


def test_preload_vtu(rig_results):
    meshio = pytest.importorskip("meshio")
    found = meshio.read(rig_results.path("preload.vtu"))
    pairs = ContactTable.load(rig_results.path("preload.csv"))
    assert np.array_equal(found.point_data["preload (N), pull"], pairs.preload)
    assert np.array_equal(found.point_data["damper node"], pairs.damper_node)
    a, b, c = found.points[found.cells_dict["triangle"]].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    p = found.point_data["pressure (N/mm2), pull"][found.cells_dict["triangle"]].mean(axis=1)
    force = rig_results.read_json("preload.json")["sides"]["right"]["sum_N"]
    assert 1e6 * (area * p).sum() == pytest.approx(force, rel=1e-3)  # linear between the pairs


def test_stuck_modes_vtu(rig_results):
    meshio = pytest.importorskip("meshio")
    model = ReducedModel.load(rig_results.path("model.npz"))
    surfaces = surface.load(rig_results.path("surface.npz"))
    stuck = Shapes.load(rig_results.path("stuck_modes.npz"))
    found = meshio.read(rig_results.path("stuck_modes.vtu"))
    names = [n for n in found.point_data if "stuck" in n]
    assert names == [f"{k}, {t}" for k, t in zip(stuck.kind, stuck.label, strict=True)]
    damper = found.point_data["body"] == 1
    assert np.array_equal(found.point_data["node"][damper], surfaces["damper"].node)
    u = surfaces["damper"].displacement(stuck.q[model.body == "damper", 0])
    assert np.allclose(found.point_data[names[0]][damper], u, rtol=1e-5)
