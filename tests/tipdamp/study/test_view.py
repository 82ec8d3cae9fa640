"""A stage sees what it declares of a study, and its key follows from that."""

from dataclasses import replace

import pytest

from tests.tipdamp import corner_study
from tipdamp.engine.store import Store
from tipdamp.stages import run
from tipdamp.study.study import load_study
from tipdamp.study.view import Undeclared, View

TUNE = ("[respond]", "[tune]\nstations = 'all'\n[respond]")


@pytest.fixture
def study(tmp_path):
    return load_study(corner_study.write(tmp_path, change=[TUNE]))


@pytest.mark.parametrize(
    "read",
    [
        lambda view: view.contact,
        lambda view: view.respond.levels,
        lambda view: view.sides["one"].kn,
        lambda view: "rotation" in view,
    ],
)
def test_undeclared_reads_fail(study, read):
    view = View(study, "trial", ("tune", "respond.patches", "sides.blade"))
    assert view.tune.stations == "all" and view.respond.patches == ("touch_one", "touch_two")
    assert view.sides["two"].blade == "touch_two" and view.path == study.path
    with pytest.raises(Undeclared, match="declared"):
        read(view)


def test_stages_get_their_view(study, tmp_path, monkeypatch):
    stage = run.STAGES["reduce"]
    monkeypatch.setitem(
        run.STAGES, "reduce", replace(stage, reads=[r for r in stage.reads if r != "blades"])
    )
    with pytest.raises(Undeclared, match="stage 'reduce': blades is read, but not declared"):
        run.run_stage("reduce", study, Store(tmp_path / "results"), quiet=True)


BODIES = {"inspect", "reduce", "tune", "stress", "report"}


@pytest.mark.parametrize(
    "old, new, changed",
    [
        (
            "levels = [1]",
            "levels = [2]",
            {"respond", "backbone", "cycles", "fit", "stress", "report"},
        ),
        ("levels = [1]", "levels = [1]\nstress = true", {"reduce", "stress", "report"}),
        ("mu = 0.3", "mu = 0.4", {"inspect", "preload", "report"}),
        ("pull = 10", "pull = 11", {"preload", "tune", "stress", "report"}),
        (
            "kn = 1e6",
            "kn = 2e6",
            {"preload", "tune", "respond", "backbone", "cycles", "fit", "stress", "report"},
        ),
        ("modes = 5", "modes = 6", BODIES),
        ("modes = 5", "error = 1e-4", {*BODIES}),
        ("stations = 'all'", "stations = [1, 1]", {"tune", "report"}),
        ("[blades]", "[free]\nband = [1, 2]\n[blades]", {"reduce", "report"}),
        ("[material]", "title = 'other'\n[material]", {"inspect", "report"}),
        (
            "[material]",
            "[units]\nlength = 'mm'\n[material]",
            {*BODIES, "preload", "respond", "backbone", "cycles", "fit"},
        ),
    ],
)
def test_keys_follow_the_declarations(study, tmp_path, old, new, changed):
    """Of each stage by itself: the results of those that it needs count too, and are the same
    here."""
    store = Store(tmp_path / "results")
    (tmp_path / "changed").mkdir()
    other = load_study(corner_study.write(tmp_path / "changed", change=[TUNE, (old, new)]))
    assert {
        name
        for name in run.STAGES
        if run.stage_key(name, study, store) != run.stage_key(name, other, store)
    } == changed


def test_law_counts_for_the_preload_with_friction(tmp_path):
    """Its friction limit is that of the static solution; without friction the preload does not
    depend on the law."""
    changed = {}
    for friction in ("true", "false"):
        one, other = (
            load_study(
                corner_study.write(
                    tmp_path,
                    change=[
                        TUNE,
                        (
                            "[respond]",
                            f"[preload]\nfriction = {friction}\n[respond]\nlaw = '{law}'",
                        ),
                    ],
                )
            )
            for law in ("DryFriction2T", "IsotropicFriction")
        )
        store = Store(tmp_path / "results")
        changed[friction] = {
            name
            for name in run.STAGES
            if run.stage_key(name, one, store) != run.stage_key(name, other, store)
        }
    assert changed == {
        "true": {"preload", "tune", "respond", "backbone", "cycles", "fit", "stress", "report"},
        "false": {"respond", "backbone", "cycles", "fit", "stress", "report"},
    }


def test_springs_count_for_a_wanted_error(tmp_path):
    """Modes that are chosen by the error of stuck frequencies depend on the stiffness of the
    contact."""
    keys = []
    for kn in ("1e6", "2e6"):
        path = corner_study.write(
            tmp_path, change=[("modes = 5", "error = 1e-4"), ("kn = 1e6", f"kn = {kn}")]
        )
        keys.append(run.stage_key("reduce", load_study(path), Store(tmp_path / "results")))
    assert keys[0] != keys[1]


def test_a_study_is_not_changed(study):
    with pytest.raises(AttributeError):
        study.title = "other"
    with pytest.raises(ValueError, match="frozen"):
        study.tune.target_hz = 1.0
