"""The period at a peak as a series of .vtu: places, states and times."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from tests.tipdamp import corner_study
from tipdamp.cli import main
from tipdamp.fields.animation import FRAMES, GAP, SLIP, STICK, states
from tipdamp.results.response_results import CyclesResult
from tipdamp.stages.run import results_folder
from tipdamp.study.study import load_study


def test_states_of_a_period():
    """One pair sticks, one slips between two instants, one lifts at two."""
    force = np.ones((5, 3, 2))
    force[2:4, 2, 1] = 0.0
    sliders = np.zeros((5, 3, 1))
    sliders[2:, 1] = 1e-6
    found = states(force, sliders, ("t1", "n"))
    assert found[:, 0].tolist() == [STICK] * 4
    assert found[:, 1].tolist() == [STICK, SLIP, STICK, STICK]
    assert found[:, 2].tolist() == [STICK, STICK, GAP, GAP]


@pytest.mark.slow
def test_a_series_for_paraview(tmp_path):
    """Each frame has its time in the period; the patch moves as the curve says."""
    meshio = pytest.importorskip("meshio")
    path = corner_study.write(
        tmp_path,
        change=[
            ("levels = [1]", "levels = [0.01]\nharmonics = [1]\nanimate = true"),
            ("[20000, 40000]", "[20000, 20100]"),
            ("[respond]", "[tune]\nstations = 'all'\n[respond]"),
        ],
    )
    for stage in ("reduce", "preload", "tune", "respond", "cycles"):
        assert main([stage, str(path), "--quiet"]) == 0
    store = results_folder(load_study(path), None)
    (one,) = CyclesResult.load(store).curves
    series = ET.parse(store.path("motion_Fe_0.01N_H1.pvd")).findall(".//DataSet")
    assert len(series) == FRAMES
    times = [float(frame.get("timestep")) for frame in series]
    assert times == pytest.approx(np.arange(FRAMES) / FRAMES / one.hz)
    frames = [meshio.read(store.path(frame.get("file"))) for frame in series]
    u = np.array([frame.point_data["displacement (m)"] for frame in frames])
    mean = u.mean(axis=0)
    half = np.exp(-2j * np.pi * np.arange(FRAMES) / FRAMES) @ (u - mean).reshape(FRAMES, -1)
    again = np.array([np.exp(2j * np.pi * k / FRAMES) for k in range(FRAMES)])
    back = np.real(np.outer(again, 2 * half / FRAMES)).reshape(u.shape)
    assert u - mean == pytest.approx(back, abs=1e-6 * np.abs(u).max())  # one harmonic
    state = np.array([frame.point_data["state"] for frame in frames])
    contacts = state[0] >= 0
    assert contacts.sum() == len(frames[0].cells_dict["vertex"]) > 0
    assert (state[:, contacts] == STICK).all()  # nothing slips at 0.01 N
