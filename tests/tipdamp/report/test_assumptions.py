"""What is declared or fixed by the method: loads, stiffness and what it was made from."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipdamp.report.files import artefacts, results_of
from tipdamp.report.subjects import assumptions
from tipdamp.results.static_results import SideStiffness

MADE = {
    "model": "rough_series",
    "kn_N_per_m": 1e6,
    "kt_N_per_m": 9e5,
    "kt_along_N_per_m": 8.5e5,
    "kt_across_N_per_m": 9.5e5,
    "nodes": 5,
    "load_N": 70.0,
    "length_m": 0.04,
    "kind": "line contact",
    "half_width_m": 5e-5,
    "depth_m": None,
    "h_rms_m": 0.8e-6,
    "gamma": 0.25,
    "scale": 1.0,
    "shares": "equal",
    "E_star_Pa": 1.1e11,
}


def values(results):
    return dict(next(assumptions.assumptions(results)).rows)


@pytest.fixture
def results(tmp_path):
    return results_of(*artefacts(tmp_path))


def made(results, **changed):
    """The row of the left side, whose stiffness was made so."""
    one = SideStiffness(**MADE | changed)
    preload = results.preload.model_copy(update={"stiffness": {"left": one}})
    return values(replace(results, preload=preload))["side 'left'"]


def test_what_the_stiffness_was_made_from_with_its_units(results):
    said = made(results)
    assert said == (
        "cylinder; kn = 1, kt = 0.9 N/µm per node, half-spaces in series with a rough interface "
        "(rough_series), line contact at 70.00 N on 40 mm, half-width of contact 50.00 µm, "
        "E* = 110.0 GPa, kt along 0.85, across 0.95 N/µm, h_rms 0.8000 µm, gamma 0.25; "
        "1 row in the patch"
    )
    plane = made(results, model="plane_depth", h_rms_m=None, gamma=None, depth_m=(0.002, 0.0135))
    assert "plane strain (plane_depth)" in plane and "depths 2 and 13.5 mm" in plane
    assert "h_rms" not in plane and "times" not in plane and "tributary" not in plane
    scaled = made(results, scale=0.5, shares="tributary")
    assert "gamma 0.25, times 0.5, shared by tributary area (mean); 1 row" in scaled
    given = made(results, model="given", shares="tributary")
    assert "per node, given, shared by tributary area (mean); 1 row" in given


def test_stiffness_of_given_pairs_and_rows(results):
    said = values(results)
    assert said["side 'left'"].endswith("from pairs.csv; 1 row in the patch")
    assert said["side 'right'"].endswith(
        "2 rows in the patch, represented by the lower edge line in the line model"
    )


def test_stiffness_of_surfaces_is_per_area(results):
    """Sum over sum: of five points 1 N/µm each on 10 mm² in all, 0.5 N/µm per mm²."""
    area = np.r_[[1e-6, 1e-6, 2e-6, 2e-6, 4e-6], np.full(10, 1e-6)]
    said = values(replace(results, whole=results.whole.replace(area=area)))
    assert "kn = 500, kt = 450 N/mm³ per area" in said["side 'left'"]
    assert "5 contact points on 10.00 mm² in 1 row" in said["side 'left'"]
    assert "10 contact points on 10.00 mm² in 2 rows" in said["side 'right'"]


def test_pull_and_where_it_acts(results):
    reduce = results.reduce.model_copy(update={"pull_positions_m": (0.0, 0.0125)})
    vars(results.study)["damper"] = SimpleNamespace(shares=())
    said = values(replace(results, reduce=reduce))
    assert said["pull Fc"].startswith("100 N along (")
    assert said["pull acts at"] == "0.0 and 12.5 mm along the axis, in equal parts"
    vars(results.study)["damper"] = SimpleNamespace(shares=(0.25, 0.75))
    said = values(replace(results, reduce=reduce))
    assert said["pull acts at"] == "0.0 and 12.5 mm along the axis, 0.25, 0.75"


def test_how_the_response_was_computed(results):
    said = values(results)
    assert said["damping ratio of the stuck modes"] == "0.022 (one value for all)"
    assert said["displacements measured from"] == "the preloaded state"
    assert said["initial slider positions"] == "unstrained in the preloaded state"
    assert said["harmonics"].startswith("orders 0 to H, H = 1 and 3; the estimated error")
    assert said["roll stiffness of the kept edge lines"].startswith("1.70 N m/rad, for the rows")
    assert said["preload of what is kept"] == (
        "scaled to the whole load: 1.500 on side 'left', 1.600 on side 'right'"
    )
    again = results.tune.redistribution.model_copy(
        update={"scale": {}, "reactions": {"roll about y": 0.05, "along x": -2.0}}
    )
    tune = results.tune.model_copy(update={"redistribution": again})
    rows = next(assumptions.assumptions(replace(results, tune=tune))).rows
    assert ("preload of what is kept", "static contact solved again on them") in rows
    loads = [value for name, value in rows if name.startswith("load balanced")]
    assert loads == ["0.0500 N m along 'roll about y'", "\N{MINUS SIGN}2.00 N along 'along x'"]
