"""The worked examples: docs/studies/two_blade_rig as the documentation has them, default mesh, from
mesh to curves."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.tipdamp.backwards import followed_back
from tipdamp.hbm.contact import ContactTable
from tipdamp.stages.run import STAGES, applies, results_folder, run_stage
from tipdamp.study.study import load_study

pytestmark = pytest.mark.slow

pytest.importorskip("dolfinx")
FOLDER = Path(__file__).parents[2] / "docs" / "studies" / "two_blade_rig"
EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))  # N, frictionless balance between faces at 45 degrees


def run(tmp_path_factory, damper, stages, size="1"):
    from tipdamp.meshes.two_blade_rig import main

    folder = tmp_path_factory.mktemp(damper)
    main(["--damper", damper, "--size", size, "--out", str(folder / "meshes")])
    shutil.copy(FOLDER / f"{damper}.toml", folder)
    study = load_study(folder / f"{damper}.toml")
    store = results_folder(study, None)
    for name in (stage for stage in stages if applies(stage, study)):
        run_stage(name, study, store, quiet=True)
    return store


@pytest.fixture(scope="module")
def asymmetric(tmp_path_factory):
    return run(tmp_path_factory, "asymmetric", STAGES)


def test_frequencies_beside_the_papers(asymmetric):
    """Fitted to the paper (sections 5 and 8): free modes 0.5 %, stuck 3 % (1 % is within reach)."""
    summary = asymmetric.read_json("summary.json")
    assert summary["free_hz"]["out_of_phase"] == pytest.approx(1590, rel=5e-3)
    assert summary["free_hz"]["in_phase"] == pytest.approx(1665, rel=5e-3)
    for name, hz in (("full_line", 3500), ("tuned", 2800), ("full_area", 3600)):
        assert summary["stuck_hz"][name] == pytest.approx(hz, rel=1e-2)
    assert summary["tuned_pairs"] == {"front": 5, "back": 4}  # section 8
    even = [
        s for s in asymmetric.read_json("tune.json")["history"] if 0 <= s["front"] - s["back"] <= 1
    ]
    even.sort(key=lambda s: -s["front"] - s["back"])
    # falls as stations are detached
    assert len(even) >= 30 and (np.diff([s["hz"] for s in even]) < 0).all()


def test_preload_of_patch_and_kept_stations(asymmetric):
    summary = asymmetric.read_json("summary.json")
    for table in ("preload", "preload_kept"):
        for side in ("left", "right"):
            figures = summary[table][side]
            assert figures["sum_N"] == pytest.approx(EACH_SIDE, rel=1e-6)
            assert figures["equilibrium_N"] == pytest.approx(EACH_SIDE, rel=1e-9)
            assert figures["balance_error"] < 1e-6
    whole = ContactTable.load(asymmetric.path("preload.csv"))
    for side in ("left", "right"):
        mine = whole.side == side
        station = np.bincount(whole.station[mine], whole.preload[mine])
        assert min(station[0], station[30]) > 2 * station[15]  # ends against middle [figure 9]


def test_reduced_model_against_the_full_one(asymmetric):
    for figures in asymmetric.read_json("tune.json")["full_model_check"].values():
        assert figures["largest_error"] < 1e-3 and max(figures["reduced_hz"]) > 4000


def test_curves_are_complete_from_both_ends(asymmetric):
    responses = asymmetric.read_json("respond.json")["responses"]
    assert {(r["Fe_N"], r["H"]) for r in responses} == {
        (Fe, H) for Fe in (1, 6, 10, 12, 20) for H in (1, 5)
    }
    study = load_study(asymmetric.folder.parent.parent / "asymmetric.toml")
    backwards = followed_back(study, asymmetric, responses)
    for r, (down, peak, _) in zip(responses, backwards, strict=True):
        assert r["complete"] and r["failed_points"] == 0, r["ended"]
        assert r["alike_backwards"]
        assert down.complete and down.converged.all()
        assert peak.peak_m == pytest.approx(r["peak_m"], rel=1e-6)
        assert peak.peak_hz == pytest.approx(r["peak_hz"], rel=1e-6)


def test_slip_lowers_the_linear_peak(asymmetric):
    response = asymmetric.read_json("respond.json")
    tuned = asymmetric.read_json("tune.json")["stuck_hz"]["tuned"]
    for H in (1, 5):
        curves = {r["Fe_N"]: r for r in response["responses"] if r["H"] == H}
        assert curves[1]["slipping_pairs"] == []
        assert response["stuck_difference"][curves[1]["file"]] < 1e-6
        assert curves[1]["peak_hz"] == pytest.approx(tuned, rel=3e-3)
        per_newton = {Fe: r["peak_m"] / Fe for Fe, r in curves.items()}
        assert per_newton[20] < per_newton[12] < per_newton[10] < per_newton[6]  # trend of figure 7
        assert per_newton[20] < 0.85 * per_newton[1]


def test_report_and_figures_are_there(asymmetric):
    page = asymmetric.path("report.html").read_text()
    assert (
        "Two-blade rig, asymmetric damper" in page
        and len(list(asymmetric.path("figures").glob("*.png"))) >= 7
    )


@pytest.mark.parametrize("damper", ["wedge", "cylindrical"])
def test_stuck_frequencies_of_other_dampers(tmp_path_factory, damper):
    """On coarse meshes: what follows from equal sides holds on any."""
    store = run(tmp_path_factory, damper, ["inspect", "reduce", "preload", "tune"], size="0.5")
    for figures in store.read_json("preload.json")["sides"].values():
        assert figures["sum_N"] == pytest.approx(EACH_SIDE, rel=1e-6)
    stuck = store.read_json("tune.json")["stuck_hz"]
    assert stuck["full_area"] >= stuck["full_line"] * (1 - 1e-9) > stuck["tuned"] > 2000
    # both sides alike: the same map on both
    whole = ContactTable.load(store.path("preload.csv"))
    left, right = (whole.preload[whole.side == s] for s in ("left", "right"))
    assert left == pytest.approx(right, abs=1e-6)
