"""Every option of a study has its effect. On the small rig's matrices, where a variant takes a second."""

import json
import shutil

import numpy as np
import pytest

from hbm.contact import ContactTable
from hbm.errors import InputError
from modal.mesh import Mesh
from static_contact.pull import pull_forces
from static_contact.stiffness.contact_side import ContactSide
from static_contact.stiffness.elastic_constants import MaterialPair
from static_contact.stiffness.nodal_stiffness import StiffnessModel, nodal_stiffness
from static_contact.stiffness.rough_surfaces import Roughness
from tests.conftest import STUDY
from tipdamp import stiffness
from tipdamp.bodies.pair import matched_pairs
from tipdamp.bodies.read import read_meshes
from tipdamp.cli import main
from tipdamp.study.study import load_study

from .test_cli import SAID_BY_THE_TABLE

STEEL = (207e9, 0.3, 207e9, 0.3)
EACH_SIDE = 113 / (2 * np.sin(np.pi / 4))  # N, frictionless balance between faces at 45 degrees


@pytest.fixture
def run(rig_results, tmp_path):
    """run(verbs, *(old, new)): the study on matrices with changes, up to a stage; returns the results folder."""
    shutil.copy(rig_results.path("model.npz"), tmp_path)
    shutil.copy(rig_results.path("preload.csv"), tmp_path / "pairs.csv")
    text = '[model]\nmatrices = "model.npz"\npull = 113\n[contact]\npairs = "pairs.csv"' + STUDY.split("[contact]")[1]
    for line in SAID_BY_THE_TABLE:
        text = text.replace(line, "")

    def variant(last, *changes):
        changed = text
        for old, new in changes:
            assert old in changed
            changed = changed.replace(old, new)
        (tmp_path / "rig.toml").write_text(changed)
        for verb in ("inspect", "reduce", "preload", "tune", "respond", "report"):
            assert main([verb, str(tmp_path / "rig.toml"), "--quiet"]) == 0
            if verb == last:
                return tmp_path / "results" / "rig"
    return variant


def read(folder, name):
    return json.loads((folder / name).read_text())


def test_resolved_preload_still_balances_the_pull(run):
    folder = run("tune", ("[tune]", '[tune]\npreload = "resolved"'))
    found = read(folder, "tune.json")
    for figures in found["preload_kept"].values():
        assert figures["sum_N"] == pytest.approx(EACH_SIDE, rel=1e-6) and figures["balance_error"] < 1e-9
    # the roll that the edge line cannot balance: half the flat's width times the side force
    assert abs(found["redistribution"]["reactions"]["roll about y"]) == pytest.approx(EACH_SIDE * 0.8e-3, rel=1e-3)


def test_rows_kept_and_roll_stiffness(run):
    hz, roll = {}, {}
    for name, changes in {"edge": [], "no roll": [('rows = "edge"', 'rows = "edge"\nroll_stiffness = 0')],
                          "given roll": [('rows = "edge"', 'rows = "edge"\nroll_stiffness = 4.0')],
                          "all": [('rows = "edge"', 'rows = "all"')]}.items():
        found = read(run("tune", *changes), "tune.json")
        hz[name], roll[name] = found["stuck_hz"]["tuned"], found["roll_stiffness_Nm_per_rad"]
    # from_flat: kn w^2 / 12 at each of 9 stations
    assert roll == pytest.approx({"edge": 9 * 1.03e6 * 1.6e-3**2 / 12, "no roll": 0.0, "given roll": 4.0, "all": 0.0})
    assert hz["no roll"] < hz["edge"] < hz["given roll"] < hz["all"]


def test_rows_keep_their_part_of_the_map(run):
    folder = run("tune", ('rows = "edge"', 'rows = "all"'))
    whole, kept = (ContactTable.load(folder / f"{n}.csv") for n in ("preload", "kept"))
    on = kept.carrying & (kept.side == "right")
    factor = kept.preload[on] / whole.preload[on]
    assert np.ptp(factor) < 1e-9 * factor.mean()
    assert read(folder, "tune.json")["redistribution"]["moment_Nm"] == pytest.approx(0, abs=2e-2)


def test_the_in_phase_mode_can_be_followed(run):
    other = read(run("tune"), "tune.json")["stuck_hz"]["tuned"]
    found = read(run("tune", ("[tune]", '[tune]\nfollow = "in_phase"')), "tune.json")
    # the damper mostly rolls: the mode keeps its shape and nearly its frequency [Zucca 2016, section 5]
    assert found["mac"]["tuned"] > 0.7 and found["stuck_hz"]["tuned"] < 0.7 * other


def test_tuning_to_a_target(run):
    found = read(run("tune", ("stations = [5, 4]", "target_hz = 2500")), "tune.json")
    best = min(found["history"], key=lambda s: abs(s["hz"] - 2500))
    assert found["tuned_pairs"] == {"front": best["front"], "back": best["back"]} and len(found["history"]) == 30


def test_damping_per_mode_and_one_way(run):
    one = read(run("respond", ("levels = [1, 20]", "levels = [1]")), "respond.json")["responses"][0]
    ratios = "[" + ", ".join(["0.022"] * 3 + ["0.05"] * 3) + "]"
    folder = run("respond", ("levels = [1, 20]", "levels = [1]\nboth_ways = false"),
                 ("damping_ratio = 0.022", f"damping_ratio = {ratios}"))
    two = read(folder, "respond.json")["responses"][0]
    assert two["back"] is None and two["peak_m"] != pytest.approx(one["peak_m"], rel=1e-4)


def test_detached_rows_of_an_own_table_carry_nothing(run, tmp_path):
    """The upper row at weight 0: neither scale nor moment sees it."""
    run("inspect")
    pairs = ContactTable.load(tmp_path / "pairs.csv")
    upper = (pairs.row == 1) & (pairs.station > 0) & (pairs.station < 30)
    pairs.replace(weight=np.where(upper, 0.0, 1.0)).save(tmp_path / "pairs.csv")
    folder = run("tune", ('rows = "edge"', 'rows = "all"'))
    found = read(folder, "tune.json")
    assert ContactTable.load(folder / "preload.csv").preload[upper].tolist() == [0.0] * int(upper.sum())
    assert all(1 < scale < 4 for scale in found["redistribution"]["scale"].values())
    assert abs(found["redistribution"]["moment_Nm"]) < 0.1


def test_warning_of_friction_above_two(run, tmp_path):
    run("inspect")
    pairs = ContactTable.load(tmp_path / "pairs.csv")
    pairs.replace(mu=np.where(np.arange(len(pairs)) == 4, 60.0, pairs.mu)).save(tmp_path / "pairs.csv")
    warnings = read(run("inspect"), "inspect.json")["warnings"]
    assert [w for w in warnings if "1 of 93 pairs have a friction coefficient above 2, pair 5 (side 'left') 60" in w]


@pytest.mark.parametrize("change, message", [
    (lambda p: p.replace(station=p.station + 1), "stations must count from 0 without a gap, found 1..31"),
    (lambda p: p.replace(station=30 - p.station), "does not lie further along the axis"),
    (lambda p: p.replace(damper_body=np.full(len(p), "pin")), "damper_body 'pin' must be 'damper'"),
])
def test_own_tables_are_checked(run, tmp_path, capsys, change, message):
    run("inspect")
    change(ContactTable.load(tmp_path / "pairs.csv")).save(tmp_path / "pairs.csv")
    assert main(["reduce", str(tmp_path / "rig.toml"), "--quiet"]) == 2
    assert message in capsys.readouterr().err


RADIUS = ('shape = "cylinder"', 'shape = "cylinder"\nradius = 2e-3')
NO_LEFT, NO_RIGHT = ("kn = 3.32e6\nkt = 3.02e6\n", ""), ("kn = 1.03e6\nkt = 0.94e6\n", "")


def stiffness_of(rig_results, tmp_path, *changes):
    """(pairs with their stiffness, what each side's was made from) of the rig's study with changes."""
    text = STUDY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "s.toml").write_text(text)
    study, pairs = load_study(tmp_path / "s.toml"), ContactTable.load(rig_results.path("preload.csv"))
    materials = dict.fromkeys(pairs.sides, STEEL)
    return (stiffness.with_values(study, pairs, materials),
            stiffness.facts(study, stiffness.side_stiffness(study, pairs, materials)))


@pytest.mark.parametrize("words, left, right, how", [
    ('stiffness = "halfspace"', "", "", {}),
    ('stiffness = "halfspace"\nkind = "secant"\nscale = 0.1', "", "", {"kind": "secant", "scale": 0.1}),
    ('stiffness = "plane_depth"', "depth = [5e-3, 1e-3]", "depth = [5e-3, 1e-3]",
     {"name": "plane_depth", "depth": (5e-3, 1e-3)}),
    ('stiffness = "rough_series"', "h_rms = 1e-6\ngamma = 0.5", "h_rms = 1e-6\ngamma = 0.5",
     {"name": "rough_series", "roughness": Roughness(1e-6, 0.5)}),
])
def test_stiffness_from_a_model_is_the_modules_own(rig_results, tmp_path, words, left, right, how):
    """Every model, kind and factor of the half-space stiffness can be asked for in a study, and says what it is."""
    pairs, facts = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, ("mu = 0.6", f"mu = 0.6\n{words}"),
                                (RADIUS[0], f"{RADIUS[1]}\n{left}"), ("width = 1.6e-3", f"width = 1.6e-3\n{right}"))
    steel = MaterialPair(*STEEL)
    for name, side, nodes in (("left", ContactSide("cylinder", 0.07, steel, radius=2e-3), 31),
                              ("right", ContactSide("flat", 0.07, steel, width=1.6e-3), 62)):
        own, made = nodal_stiffness(side, EACH_SIDE, nodes, StiffnessModel(**how)), facts[name]
        assert pairs.kn[pairs.side == name] == pytest.approx(np.full(nodes, own.kn), rel=1e-6)
        assert pairs.kt[pairs.side == name] == pytest.approx(np.full(nodes, own.kt), rel=1e-6)
        assert (made.model, made.kind, made.scale, made.nodes) == (own.model, own.kind, own.scale, nodes)
        assert made.depth_m == own.depth and (made.h_rms_m is None) == (own.roughness is None)
        assert (made.load_N, made.half_width_m, made.length_m, made.E_star_Pa) == pytest.approx(
            (EACH_SIDE, own.size, 0.07, steel.E_star), rel=1e-6)


def test_rounded_side(rig_results, tmp_path):
    pairs, facts = stiffness_of(rig_results, tmp_path, NO_RIGHT, ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"'),
                                ('shape = "flat"', 'shape = "rounded"\nradius = 1e-3'))
    own = nodal_stiffness(ContactSide("rounded", 0.07, MaterialPair(*STEEL), width=1.6e-3, radius=1e-3), EACH_SIDE, 62)
    assert pairs.kn[pairs.side == "right"] == pytest.approx(np.full(62, own.kn), rel=1e-6)
    assert facts["right"].half_width_m == pytest.approx(own.size, rel=1e-6) and own.size > 0.8e-3


def test_given_values_win_over_the_model(rig_results, tmp_path):
    """Of the side that has them, and untouched by the factor on what the model gives; they need no radius."""
    pairs, facts = stiffness_of(rig_results, tmp_path, NO_RIGHT,
                                ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nscale = 0.5'))
    left = pairs.side == "left"
    assert (pairs.kn[left] == 3.32e6).all() and (pairs.kt[left] == 3.02e6).all()
    assert facts["left"].model == "given" and facts["left"].half_width_m is None
    own = nodal_stiffness(ContactSide("flat", 0.07, MaterialPair(*STEEL), width=1.6e-3), EACH_SIDE, 62,
                          StiffnessModel(scale=0.5))
    assert pairs.kn[~left] == pytest.approx(np.full(62, own.kn), rel=1e-6)


def test_shares_by_tributary_area(rig_results, tmp_path):
    """The total stays; a node at the end of the line, or at a corner of the flat, has half or a quarter of the most."""
    words = ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"\nshares = "tributary"')
    pairs, _ = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, RADIUS, words)
    equal, _ = stiffness_of(rig_results, tmp_path, NO_LEFT, NO_RIGHT, RADIUS, (words[0], words[1].rpartition("\n")[0]))
    for side in pairs.sides:
        mine = pairs.side == side
        end = mine & (pairs.station == 0)
        inner = mine & (pairs.station == 3)
        assert pairs.kn[mine].sum() == pytest.approx(equal.kn[mine].sum())
        assert pairs.kn[end].sum() == pytest.approx(pairs.kn[inner].sum() / 2, rel=0.02)


def test_conserved_total(run):
    """The stations that stay carry the stiffness of the whole side: more than their share, the stuck mode higher."""
    kept = read(run("tune"), "tune.json")["stuck_hz"]
    folder = run("tune", ("[tune]", '[tune]\nstiffness = "conserved"'))
    table, full = (ContactTable.load(folder / f"{name}.csv") for name in ("kept", "preload"))
    for side in table.sides:
        mine = table.carrying & (table.side == side)
        assert table.kn[mine].sum() == pytest.approx(full.kn[full.side == side].sum())
        assert table.kt[mine].sum() == pytest.approx(full.kt[full.side == side].sum())
    whole = read(folder, "tune.json")["stuck_hz"]
    assert whole["tuned"] > kept["tuned"] and whole["full_line"] > kept["full_line"]
    assert whole["full_area"] == pytest.approx(kept["full_area"], rel=1e-12)


@pytest.mark.parametrize("changes, message", [
    ([("kt = 3.02e6\n", "")], r"\[contact.left\] kn and kt are missing"),
    ([("kt = 3.02e6\n", ""), ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"')],
     r"\[contact.left\] kt is missing: kn is given, and only both together replace the model"),
    ([NO_LEFT, ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"')], r"\[contact.left\] radius is missing"),
    ([NO_LEFT, RADIUS, ("mu = 0.6", 'mu = 0.6\nstiffness = "plane_depth"')], r"\[contact.left\] depth is missing"),
    ([NO_LEFT, ("mu = 0.6", 'mu = 0.6\nstiffness = "plane_depth"'), (RADIUS[0], RADIUS[1] + "\ndepth = [1e-3]")],
     r"\[contact.left\] depth = \[0.001\]: must be two numbers"),
    ([NO_LEFT, ("mu = 0.6", 'mu = 0.6\nstiffness = "rough_series"'), (RADIUS[0], RADIUS[1] + "\nh_rms = 1e-6")],
     r"\[contact.left\] gamma is missing"),
    ([NO_LEFT, ("mu = 0.6", 'mu = 0.6\nstiffness = "halfspace"'), (RADIUS[0], RADIUS[1] + "\nh_rms = 1e-6")],
     r"\[contact.left\] h_rms: leave it out, it belongs to \[contact\] stiffness = \"rough_series\""),
    ([("mu = 0.6", 'mu = 0.6\nstiffness = "rough_series"\nkind = "secant"')], "has a tangent only"),
    ([("mu = 0.6", "mu = 0.6\nscale = 0.5")], r"\[contact\] scale: leave it out, stiffness = \"given\" uses no model"),
    ([("mu = 0.6", "mu = 0.6\nshares = \"area\"")], r"\[contact\] shares = 'area': .*equal, tributary"),
])
def test_stiffness_keys_that_do_not_fit(tmp_path, changes, message):
    text = STUDY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        load_study(tmp_path / "s.toml")


def test_gap_profile_reaches_the_pairs(rig, tmp_path):
    (tmp_path / "s.toml").write_text(STUDY.replace('shape = "cylinder"',
                                                   'shape = "cylinder"\ngap = [[0.0, 0.0], [0.035, 60e-6], [0.07, 0]]'))
    for mesh in rig.glob("*.msh"):
        shutil.copy(mesh, tmp_path)
    study = load_study(tmp_path / "s.toml")
    pairs = stiffness.with_values(study, matched_pairs(study, read_meshes(study)), {})
    left = pairs.select(pairs.side == "left")
    assert left.gap == pytest.approx(60e-6 * (1 - np.abs(left.position[:, 1] / 0.035 - 1)), abs=1e-12)
    assert (pairs.gap[pairs.side == "right"] == 0).all()


def line_mesh():
    """Nodes on a line along y with four load points; cells do not matter here."""
    y = np.linspace(0, 0.06, 7)
    position = np.column_stack([np.zeros(7), y, np.full(7, 0.05)])
    return Mesh(np.arange(11, 18), position, {}, {"load_points": np.array([11, 13, 15, 17])}, source="line")


@pytest.mark.parametrize("options, place", [({}, 0.03), ({"weights": (0.4, 0.3, 0.2, 0.1)}, 0.02),
                                            ({"positions": (0.25, 0.6)}, 0.0255),
                                            ({"positions": (0.1, 0.9), "weights": (0.75, 0.25)}, 0.018)])
def test_resultant_and_place_of_the_pull(options, place):
    nodes, forces = pull_forces(line_mesh(), "load_points", (0, 1, 0), (0, 0, 1), **options)
    assert forces.sum(axis=0) == pytest.approx([0, 0, 1])
    assert forces[:, 2] @ line_mesh().position[nodes - 11, 1] == pytest.approx(place)


@pytest.mark.parametrize("options", [{"weights": (0.5, 0.5)}, {"weights": (0.4, 0.3, 0.2, 0.2)}])
def test_shares_must_match_and_add_up(options):
    with pytest.raises(InputError, match="numbers that add to 1 are needed"):
        pull_forces(line_mesh(), "load_points", (0, 1, 0), (0, 0, 1), **options)


def test_an_empty_group_is_named(tmp_path):
    mesh = Mesh(np.arange(3), np.zeros((3, 3)), {}, groups={"clamp": np.empty(0, int)}, source="m.msh")
    with pytest.raises(InputError, match="m.msh: group 'clamp' is empty"):
        mesh.group("clamp")


@pytest.mark.parametrize("name, content", [("model.npz", b"not a zip"), ("pairs.csv", "side\n\u00e9".encode("utf-16"))])
def test_unreadable_files_are_one_line(run, tmp_path, capsys, name, content):
    run("inspect")
    (tmp_path / name).write_bytes(content)
    assert main(["reduce", str(tmp_path / "rig.toml"), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert name in error and error.count("\n") == 1


def test_an_interrupted_stage_is_run_again(run, tmp_path, monkeypatch):
    """Interrupted after it had written a file: the same command goes on."""
    from tipdamp.stages import run as stages

    folder = run("tune")
    job = stages.STAGES["preload"].work

    def interrupted(study, store, tick):
        with store.writing("preload.csv") as path:
            path.write_text("half")
        raise KeyboardInterrupt

    object.__setattr__(stages.STAGES["preload"], "work", interrupted)
    assert main(["preload", str(tmp_path / "rig.toml"), "--quiet", "--force"]) == 130
    object.__setattr__(stages.STAGES["preload"], "work", job)
    assert main(["preload", str(tmp_path / "rig.toml"), "--quiet"]) == 0
    assert len(ContactTable.load(folder / "preload.csv")) == 93  # 31 stations: one row left, two rows right
