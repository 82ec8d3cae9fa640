"""The statics of the two-blade rig with the asymmetric damper, on a small mesh."""

import shutil

import numpy as np
import pytest

from tests.conftest import STUDY, changed
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.static_contact.contact.equilibrium import side_forces, side_normals
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.tuning.kept_stations import keep_ends
from tipdamp.static_contact.tuning.redistribution import redistribute
from tipdamp.static_contact.tuning.reduction_error import stuck_error_bound
from tipdamp.static_contact.tuning.station_detachment import detach_until
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly

# Fc / (2 sin 45): frictionless balance between faces at 45 degrees
EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))


@pytest.fixture(scope="module")
def model(rig_results):
    return ReducedModel.load(rig_results.path("model.npz"))


@pytest.fixture(scope="module")
def whole(rig_results):
    return ContactTable.load(rig_results.path("preload.csv"))


@pytest.fixture(scope="module")
def follow(model):
    from scipy.linalg import eigh

    blades = model.part("blades")
    shape = np.zeros(model.size)
    shape[model.body == "blades"] = eigh(blades.K, blades.M, subset_by_index=(0, 0))[1][:, 0]
    return shape


def test_side_forces_are_the_closed_form(whole):
    forces = side_forces(side_normals(whole), [0, 0, 113.0])
    assert forces == pytest.approx({"left": EACH_SIDE, "right": EACH_SIDE}, rel=1e-9)


def test_preload_sums_to_the_equilibrium(rig_results, whole):
    for side, figures in rig_results.read_json("preload.json")["sides"].items():
        assert figures["sum_N"] == pytest.approx(EACH_SIDE, rel=1e-6), side
        assert figures["balance_error"] < 1e-6
        station = np.bincount(whole.station[whole.side == side], whole.preload[whole.side == side])
        # ends loaded, middle less [Zucca 2016, figure 9]
        assert station[[0, -1]].min() > 2 * station[15]


def test_frames_are_right_handed_and_face_the_blades(whole):
    """Rows t1 along the axis, t2 across, n into the blade: up and outwards on both sides."""
    assert np.allclose(np.linalg.det(whole.frame), 1.0)
    assert np.allclose(whole.frame[:, 0], [0, 1, 0])
    outward = np.where(whole.side == "left", -1.0, 1.0) * np.sin(np.pi / 4)
    assert np.allclose(whole.normal[:, 0], outward, atol=1e-6) and np.allclose(
        whole.normal[:, 2], np.sin(np.pi / 4)
    )


def test_rows_count_from_the_lower_edge(whole):
    flat = whole.select(whole.side == "right")
    low, high = flat.select(flat.row == 0), flat.select(flat.row == 1)
    assert high.position[:, 2] - low.position[:, 2] == pytest.approx(
        1.6e-3 * np.sin(np.pi / 4), rel=1e-6
    )


def test_edge_line_alone_leaves_the_roll_unbalanced(model, whole):
    """Its normal misses the centre by half the flat's width: 79.9 N x 0.8 mm."""
    line = whole.select(whole.row == 0)
    statics = StaticContact(model, line)
    with pytest.raises(InputError, match="roll about y is loaded: 0.0639 N m"):
        statics.solve(113 * model.loads["pull"])
    held = statics.solve(113 * model.loads["pull"], constrain=True)
    assert abs(held.reactions["roll about y"]) == pytest.approx(EACH_SIDE * 0.8e-3, rel=1e-4)
    # a pure couple is taken up: the sides still balance the pull
    assert held.residual < 1e-8 and held.balance < 1e-9
    for side in ("left", "right"):
        assert np.maximum(held.pairs.preload, 0)[line.side == side].sum() == pytest.approx(
            EACH_SIDE, rel=1e-6
        )


def test_crown_opens_the_middle(model, whole):
    """An initial gap of 60 um in the middle opens pairs there and raises the ends."""
    y = whole.position[:, 1] / 0.07
    crowned = StaticContact(model, whole.replace(gap=60e-6 * (1 - (2 * y - 1) ** 2))).solve(
        113 * model.loads["pull"]
    )
    left = crowned.pairs.select(crowned.pairs.side == "left")
    assert 4 <= (left.preload < 0).sum() <= 20 and (left.preload[[0, -1]] > 10).all()
    assert np.maximum(left.preload, 0).sum() == pytest.approx(EACH_SIDE, rel=1e-6)


def test_carried_preload_is_the_whole_pull(whole):
    kept = keep_ends(whole.replace(weight=(whole.row == 0).astype(float)), 5, 4)
    kept = kept.select(kept.carrying)
    done = redistribute(whole, kept, {"left": EACH_SIDE, "right": EACH_SIDE})
    for side in ("left", "right"):
        assert done.pairs.preload[kept.side == side].sum() == pytest.approx(EACH_SIDE, rel=1e-12)
        assert 1.5 < done.scale[side] < 3
    assert (done.pairs.preload > 0).all()
    # what the edge line cannot balance
    assert abs(done.moment[1]) == pytest.approx(EACH_SIDE * 0.8e-3, rel=1e-3)


def test_detachment_against_brute_force(model, whole, follow):
    """Every split by an eigenvalue problem of its own: the same frequencies, falling from the
    middle outwards with each station that goes, and none nearer the target."""
    line, target = whole.replace(weight=(whole.row == 0).astype(float)), 2500.0
    assembly = StuckAssembly(model)
    found = detach_until(assembly, line, target, follow)
    hz = {(s.front, s.back): s.hz for s in found.history}
    assert (
        len(hz) == 436 and (np.diff([hz[(n + 1) // 2, n // 2] for n in range(31, 1, -1)]) < 0).all()
    )
    brute = {s: assembly.modes(keep_ends(line, *s), follow).tracked_hz for s in list(hz)[::3]}
    assert max(abs(hz[s] - brute[s]) for s in brute) < 1e-5
    assert abs(found.chosen.hz - target) < min(abs(v - target) for v in hz.values()) + 1e-6
    kept = found.pairs.station[found.pairs.carrying & (found.pairs.side == "left")]
    assert kept.tolist() == [*range(found.chosen.front), *range(31 - found.chosen.back, 31)]


@pytest.mark.parametrize("target", [9000.0, 1000.0])
def test_target_out_of_reach(model, whole, follow, target):
    """The answer names the range of the whole sequence, whichever side the target lies on."""
    line = whole.replace(weight=(whole.row == 0).astype(float))
    assembly = StuckAssembly(model)
    low, high = (
        assembly.modes(keep_ends(line, *ends), follow).tracked_hz for ends in ((1, 1), (16, 15))
    )
    with pytest.raises(
        InputError, match=rf"not reachable: {low:.0f}\.\.{high:.0f} Hz with 2..31 stations"
    ):
        detach_until(StuckAssembly(model), line, target, follow)


def test_removing_a_pair_never_raises_a_stuck_frequency(model, whole, follow):
    """Weyl: K loses a positive semidefinite term."""
    assembly = StuckAssembly(model)
    one = assembly.modes(whole, follow).hz
    two = assembly.modes(whole.replace(weight=np.where(whole.station == 3, 0.0, 1.0)), follow).hz
    assert (two <= one * (1 + 1e-9)).all() and (two < one * (1 - 1e-6)).any()


def test_reduced_stuck_frequencies_match_the_full_model(rig_results):
    """Below 5 kHz within 0.1 %, for the whole patch, the line and the kept stations."""
    check = rig_results.read_json("tune.json")["full_model_check"]
    assert set(check) == {"full_area", "full_line", "tuned"}
    for figures in check.values():
        error = np.array(figures["reduced_hz"]) / figures["full_hz"] - 1
        assert (error > -1e-6).all() and (error < 1e-3).all()  # from above (Rayleigh), within 0.1 %
        bound = np.array(figures["error_bound"])
        # never passed, and worth reading
        assert (bound >= error).all() and (bound < 3 * error + 1e-5).all()


@pytest.mark.slow
def test_modes_by_frequency_and_by_error(rig, tmp_path):
    """The study may say how many modes, how high, or how good."""
    from tipdamp.bodies import CHECK_BELOW_HZ
    from tipdamp.engine.store import Store
    from tipdamp.modal.truncation import Truncation
    from tipdamp.stages.run import run_stage
    from tipdamp.study.study import load_study

    for mesh in rig.glob("*.msh"):
        shutil.copy(mesh, tmp_path)
    text = changed(STUDY, ("modes = 30", "error = 1e-4"), ("modes = 10", "modes_below_hz = 60e3"))
    (tmp_path / "by_error.toml").write_text(text)
    study = load_study(tmp_path / "by_error.toml")
    store = Store(study.results)
    for stage in ("reduce", "preload"):
        run_stage(stage, study, store, quiet=True)
    model = ReducedModel.load(store.path("model.npz"))
    pairs = ContactTable.load(store.path("preload.csv"))
    facts = store.read_json("reduce.json")
    truncation = Truncation.load(store.path("truncation.npz"))
    modes = facts["reduction"]["modes"]
    assert truncation.omega[0] >= 2 * np.pi * facts["highest_fixed_interface_hz"]["blades"]
    assert facts["highest_fixed_interface_hz"]["damper"] < 60e3 <= truncation.omega[1] / (2 * np.pi)
    hz = StuckAssembly(model).modes(pairs, np.zeros(model.size) + 1e-9).hz
    bound = stuck_error_bound(model, truncation, pairs, hz[hz < CHECK_BELOW_HZ])
    assert 5e-5 < bound.max() < 1.2e-4 and 10 < modes["blades"] < 200
