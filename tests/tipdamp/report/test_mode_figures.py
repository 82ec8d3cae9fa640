"""The backbone beside the curves, and the pictures of modes, from made-up results."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, results_of
from tipdamp.hbm.drawing.figure import Band, Marks
from tipdamp.hbm.modes.result import Backbone
from tipdamp.report.drawing import plotly, plotly_moving
from tipdamp.report.subjects import backbone, modes
from tipdamp.results.response_results import BackboneResult, PredictedPeak


def mode_of(amplitude):
    """Three free motions of two outputs, the second half as large, with a mean and one harmonic."""
    n = len(amplitude)
    harmonics = np.zeros((n, 2, 2), dtype=complex)
    harmonics[:, :, 1] = np.outer(amplitude, [1.0, 0.5])
    nothing = np.zeros((n, 1))
    return Backbone(
        mode=1, amplitude=amplitude, frequency=np.array([2800.0, 2700, 2650]),
        damping_ratio=np.array([0.01, 0.04, 0.02]),
        output_names=np.array(["patch_1:1", "patch_1:2"]),
        harmonics=harmonics, shape=harmonics[:, :, 1], modal_amplitude=amplitude,
        share_stick=nothing + 1, share_slip=nothing, share_open=nothing, stuck_frequency=2800.0,
        stuck_damping_ratio=0.01, ended="the last amplitude", complete=True, unknowns=nothing, H=1,
        output_rows=np.eye(2), seconds=0.0,
    )  # fmt: skip


@pytest.fixture
def with_backbone(tmp_path):
    """Results with the mode, one level with a peak and one without."""
    peaks = (
        PredictedPeak(
            Fe_N=1.0, peak_hz=2790.0, peak_m=1.1e-6, predicted_hz=2795.0, predicted_m=1.0e-6
        ),
        PredictedPeak(Fe_N=20.0, peak_hz=None, peak_m=None, said="no peak in the band"),
    )
    found = BackboneResult(
        mode=1, stuck_hz=2800.0, stuck_zeta=0.01, response="patch_1", output="patch_1:1", H=1,
        first_m=1e-6, last_m=9e-6, reached_m=9e-6, low_hz=2650.0, high_hz=2800.0, zeta=0.04,
        zeta_at_m=3e-6, points=3, complete=True, ended="", peaks=peaks,
    )  # fmt: skip
    mode = mode_of(np.array([1e-6, 3e-6, 9e-6]))
    return replace(results_of(*artefacts(tmp_path)), backbone=found, mode=mode)


def test_the_backbone_stands_over_its_curves(with_backbone):
    """The larger node of the patch on both, in um; circles where a level has a peak."""
    (figure,) = backbone.figure(with_backbone)
    over, frequency, damping = figure.panels
    case = with_backbone.finest[0]
    forced = next(item for item in over.items if np.size(item.x) == len(case.curve.frequency))
    largest = 1e6 * np.abs(case.curve.harmonics[:, 0, 1])
    assert np.asarray(forced.y) == pytest.approx(largest, rel=1e-2)
    own = next(item for item in over.items if item.name == backbone.NAME)
    assert np.asarray(own.y) == pytest.approx([1, 3, 9]) and list(own.x) == [2800, 2700, 2650]
    (marks,) = [item for item in frequency.items if isinstance(item, Marks)]
    assert list(marks.x) == pytest.approx([1.1]) and list(marks.y) == [2790.0]
    assert list(damping.items[0].y) == pytest.approx([1, 4, 2])


def test_what_the_backbone_predicts(with_backbone):
    (table,) = backbone.table(with_backbone)
    assert [float(table.rows[0][k]) for k in range(5)] == pytest.approx([1, 1.1, 2790, 1, 2795])
    assert "9.09 %" in table.rows[0][5]
    assert table.rows[1][-1] == "no peak in the band"
    H = {case.H for case in with_backbone.finest}
    assert H != {1} and f"The backbone has H = 1, the curves H = {H.pop()}" in table.caption


def test_modes_are_drawn_as_large_as_what_moves():
    """A share of the diagonal of the box of the bodies that move, largest at the largest node."""
    place = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 12], [1, 1, 1]]) + [5, 0, 0]
    motion = {"blades": np.array([2.0, 0, 0]), "damper": np.zeros(3)}
    surfaces = {
        name: SimpleNamespace(
            position=place * size, displacement=lambda q: np.outer([1, -2, 0, 0, 0], q)
        )
        for name, size in (("blades", 1.0), ("damper", 10.0))
    }
    shape = SimpleNamespace(
        kind=np.array(["stuck"]),
        label=np.array(["1"]),
        hz=np.array([100.0]),
        q=np.concatenate(list(motion.values()))[:, None],
    )
    picture = SimpleNamespace(
        model=SimpleNamespace(body=np.repeat(list(motion), 3)),
        surfaces=surfaces,
        shapes=[shape],
        whole=None,
        axis=np.array([0.0, 1, 0]),
    )
    (drawn,) = next(modes.shapes(picture)).motions
    assert drawn.amplitude == pytest.approx(modes.LARGEST * 1000 * 13)
    assert list(drawn.shapes) == ["blades"]
    assert drawn.shapes["blades"][0, :2].tolist() == [[0.5, 0, 0], [-1, 0, 0]]


def test_colours_of_a_mode_run_over_the_whole_scale():
    assert [place for place, _ in plotly_moving.COLORS] == [0, 0.5, 1]


def test_a_band_is_a_closed_polygon_for_each_run():
    """Low to the right, high back to the left; a gap between the runs and none behind the last."""
    x = np.array([1.0, 2, np.nan, 4, 5])
    band = Band(x, low=x, high=x + 10, name="between")
    (drawn,) = plotly._band(band)
    nan = np.nan
    assert np.array_equal(drawn["x"], [1, 2, 2, 1, nan, 4, 5, 5, 4], equal_nan=True)
    assert np.array_equal(drawn["y"], [1, 2, 12, 11, nan, 4, 5, 15, 14], equal_nan=True)
