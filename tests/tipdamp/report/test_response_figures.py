"""Curves of a family: per newton and absolute; with harmonics = "auto" one of each level."""

import json

import numpy as np
import pytest

from tests.tipdamp.report.files import FULL, artefacts, results_of
from tipdamp.hbm.drawing.figure import Band, Curve, Figure, Line, Marks, Panel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.report.drawing import plotly
from tipdamp.report.subjects import assumptions, friction, peaks, response
from tipdamp.report.summary import summarise


def test_left_per_newton_and_right_absolute(tmp_path):
    """In µm/N and µm, of m; a circle at the peak of the curve file."""
    results = results_of(*artefacts(tmp_path))
    figures = list(response.families(results))
    assert [{case.H for case in family} for family in results.families] == [{1}, {3}]
    for figure, cases in zip(figures, reversed(results.families), strict=True):
        assert {case.Fe for case in cases} != {1.0}
        for panel, scale in zip(
            figure.panels, ([1e6 / case.Fe for case in cases], [1e6] * len(cases)), strict=True
        ):
            curves = [item for item in panel.items if isinstance(item, Curve)][: len(cases)]
            circles = [item for item in panel.items if isinstance(item, Marks) and not item.filled]
            for curve, circle, case, factor in zip(curves, circles, cases, scale, strict=False):
                top = case.patch(results.first_patch).max(axis=1)
                np.testing.assert_allclose(curve.y, factor * top)
                assert circle.y == pytest.approx([factor * case.facts.peak_m])


def test_the_stuck_response_is_drawn_per_newton_alone(tmp_path):
    """In µm/N, the larger of the nodes of the patch, dotted; and as a level beside the peaks."""
    results = results_of(*artefacts(tmp_path))
    s = results.stuck.hz / 2800
    for figure in response.families(results):
        left, right = (
            [item for item in panel.items if getattr(item, "name", "") == "linear, stuck"]
            for panel in figure.panels
        )
        assert len(left) == 1 and right == [] and left[0].dash == "dot"
        assert left[0].y == pytest.approx(0.044 / np.abs(1 - s**2 + 0.044j * s))
    (trend,) = response.trend(results)
    height, place = ([i for i in p.items if isinstance(i, Line)] for p in trend.panels)
    assert [(one.axis, one.value, one.label) for one in (*height, *place)] == [
        ("y", pytest.approx(1.0, rel=1e-3), "linear, stuck 1.00 µm/N"),
        ("y", 2801.0, "stuck 2801.0 Hz"),
    ]


def test_levels_are_absolute_and_peaks_per_newton(tmp_path):
    """From 20 N down: the band over the patch in µm, the stuck response at the force of the level,
    and the smaller H beside; over the levels the peaks in µm/N."""
    results = results_of(*artefacts(tmp_path))
    s = results.cases[0].curve.frequency / 2800
    one = 0.044 / np.abs(1 - s**2 + 0.044j * s)  # µm/N
    (levels,) = response.levels(results)
    assert [panel.title for panel in levels.panels] == ["Fe = 20 N", "Fe = 1 N"]
    for panel, Fe in zip(levels.panels, (20.0, 1.0), strict=True):
        (band,) = [item for item in panel.items if isinstance(item, Band)]
        assert band.high == pytest.approx(Fe * one) and band.low == pytest.approx(0.9 * Fe * one)
        curves = [item for item in panel.items if isinstance(item, Curve)]
        drawn = {curve.name: curve.y for curve in curves}
        assert list(drawn) == ["H = 3, largest and smallest", "", "H = 1, largest", "linear, stuck"]
        for name, share in zip(drawn, (1.0, 0.9, 1.0, 1.0), strict=True):
            assert drawn[name] == pytest.approx(share * Fe * one), name
        assert panel.y_label == "amplitude (µm)" and Fe < panel.y_range[1] < 1.1 * Fe
    (trend,) = response.trend(results)
    for panel, value in zip(trend.panels, (1.0, 2798.7), strict=True):
        drawn = [item for item in panel.items if isinstance(item, Curve | Marks)]
        assert [item.name for item in drawn] == ["", "H = 1", "", "H = 3"]
        for item in drawn:
            assert list(item.x) == [1.0, 20.0] and item.y == pytest.approx([value] * 2, rel=1e-3)


def test_peaks_in_the_table_have_their_units(tmp_path):
    (table,) = peaks.peaks(results_of(*artefacts(tmp_path)))
    low, high = table.records[:2]
    for row, Fe in ((low, 1.0), (high, 20.0)):
        assert float(row["peak (Hz)"]) == pytest.approx(2798.7, abs=0.1)
        assert float(row["largest (µm)"]) == pytest.approx(Fe, rel=1e-3)
        assert float(row["smallest (µm)"]) == pytest.approx(0.9 * Fe, rel=1e-3)
        assert float(row["largest per force (µm/N)"]) == pytest.approx(1.0, rel=1e-3)
    assert high["slip or open anywhere on the curve"] == "left 0\N{EN DASH}1; right 4"
    assert low["slip or open anywhere on the curve"] == "none"


def found_automatically(files):
    """1 N with H = 1, 20 N with H = 3, which misses the tolerance."""
    low, _, _, high = files["responses"]
    low |= {"tried": [{"H": 1, "error": 2e-4}], "within_tolerance": True, "truncation": 1e-4}
    tried = [{"H": 1, "error": None}, {"H": 3, "error": 5e-3}]
    tried.append({"H": 5, "error": 2e-3, "complete": False})
    high |= {"tried": tried, "within_tolerance": False, "truncation": 4e-3}
    files["responses"] = [high, low]


def test_each_level_with_its_own_harmonics(tmp_path):
    """One family, with H in its legends; the estimated error as a band in place of curves with
    fewer; and a table of what was tried."""
    sections = FULL.replace("[1, 3]", '"auto"')
    study, store = artefacts(tmp_path, sections=sections, damage=found_automatically)
    path = store.path("responses/Fe_20N_H3.npz")
    curve = ForcedResponse.load(path)
    vars(curve)["truncation"] = 1e-8 * np.ones((41, 4))
    curve.save(path)
    results = results_of(study, store)
    assert [[case.H for case in family] for family in results.families] == [[1, 3]]
    (family,) = response.families(results)
    assert family.name == "family_auto" and "H = 1 to 3" in family.title
    legends = [item.name for item in family.panels[0].items if isinstance(item, Curve)]
    assert legends[:2] == ["Fe = 1 N, H = 1", "Fe = 20 N, H = 3"]
    (levels,) = response.levels(results)
    assert [panel.title for panel in levels.panels] == ["Fe = 20 N, H = 3", "Fe = 1 N, H = 1"]
    bands = [item for item in levels.panels[0].items if isinstance(item, Band)]
    (error,) = [band for band in bands if band.name == "estimated error"]
    np.testing.assert_allclose(error.high - error.low, 2 * np.sqrt(2) * 1e-2)
    assert "at the peaks 0.40 % at most (Fe = 20 N)" in levels.caption
    (trend,) = response.trend(results)
    assert [item.name for item in trend.panels[0].items if isinstance(item, Marks)] == [
        "H = 1 to 3"
    ]
    (states,) = friction.states(results)
    assert "at H = 1 to 3:" in states.caption
    (table,) = peaks.harmonics(results)
    assert table.rows == (
        ("1", "1", "0.0002", "met", "0.0002 with 1"),
        ("20", "3", "0.005", "not met", "– with 1; 0.005 with 3; 0.002 with 5, incomplete"),
    )
    (rows,) = peaks.peaks(results)
    assert [row[:2] for row in rows.rows] == [("1", "1"), ("3", "20")]
    (assumed,) = assumptions.assumptions(results)
    assert any("99 % of the points" in row[1] for row in assumed.rows if row[0] == "harmonics")
    one = summarise(results)["responses"][1]
    assert one["within_tolerance"] is False and one["tried"][1]["error"] == 5e-3


def test_named_harmonics_have_no_table_of_tries(tmp_path):
    assert not list(peaks.harmonics(results_of(*artefacts(tmp_path))))


@pytest.mark.parametrize("end", ["high", "low"])
@pytest.mark.parametrize("left", [False, True])
def test_the_label_of_a_line_stands_on_its_side(end, left):
    """Beside an upright line, which is where the text ends or begins; above or below a level one,
    at one end of it."""
    panel = Panel("", "x", "y", [Line(axis, 3.0, axis, end=end, left=left) for axis in "xy"])
    page = plotly.draw(Figure("lines", "", "", [panel]))
    start = page.index("[", page.index('"annotations":'))
    labels, _ = json.JSONDecoder().raw_decode(page, start)
    found = {one["text"]: one for one in labels}
    upright, level = found["x"], found["y"]
    assert upright["x"] == 3.0 and upright["xanchor"] == ("right" if left else "left")
    assert (upright["y"], upright["yanchor"]) == ((1, "top") if end == "high" else (0, "bottom"))
    assert level["y"] == 3.0 and level["yanchor"] == ("bottom" if end == "high" else "top")
    assert (level["x"], level["xanchor"]) == ((0, "left") if left else (1, "right"))
