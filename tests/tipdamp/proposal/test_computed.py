"""What a proposal computes: band, nodes, stiffness of steel, levels; what it says
where it cannot."""

import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.proposal.test_propose import filled
from tests.tipdamp.rig_study import read, without_report
from tipdamp.bodies.free_modes import NAMES
from tipdamp.cli import main
from tipdamp.proposal import response_text
from tipdamp.proposal import trial as trial_module
from tipdamp.proposal.trial import LEVELS, MULTIPLES, SOFTEST, STEEL, Trial
from tipdamp.proposal.words import vector
from tipdamp.results.static_results import TrackedMode


def proposed(folder, capsys, *more):
    """(the study file that meshes in the folder propose, what was said of it)"""
    names = (str(folder / name) for name in ("damper.inp", "blades.inp"))
    assert main(["inspect", *names, "--quiet", *more]) == 0
    return folder / "damper.toml", capsys.readouterr().out


@pytest.mark.slow
def test_band_holds_what_the_completed_study_finds(tmp_path, capsys):
    """Of another steel than the proposal took; the study needs nothing but what a person knows."""
    corner_study.write(tmp_path)
    path, said = proposed(tmp_path, capsys, "--pull", "10")
    assert "nothing but friction holds the damper (slide along y)" in said
    path.write_text(path.read_text().replace("\npull = 10 ", '\npull = "?"'))
    study = filled(path, E="197e9", density="7900")
    for verb in ("inspect", "reduce", "preload", "tune"):
        assert main([verb, study, "--quiet"]) == 0
    results = tmp_path / "results" / "damper"
    low, high = tomllib.loads(path.read_text())["respond"]["band"]
    stuck = read(results, "tune.json")
    every = [
        *read(results, "reduce.json")["free_hz"].values(),
        stuck["stuck_hz"]["full_area"],
        *(mode["hz"] for mode in stuck["other_modes"].values()),
    ]
    assert low < 0.95 * min(every) and 1.02 * max(every) < high < 2 * max(every)


@pytest.mark.slow
def test_levels_begin_at_the_slip_of_this_model(tmp_path, capsys):
    """In proportion to the pull; the largest makes most contacts slip in the forced response, the
    least none. Without the pull they are asked for, with the shares in words."""
    corner_study.write(tmp_path)
    path, _ = proposed(tmp_path, capsys, "--pull", "250")
    study = tomllib.loads(path.read_text())
    levels = np.array(study["respond"]["levels"])
    assert study["damper"]["pull"] == 250
    assert levels / levels[1] == pytest.approx(np.array(MULTIPLES) / MULTIPLES[1], rel=0.05)
    text = path.read_text().replace('harmonics = "auto"', "harmonics = 3")
    text = text.replace("\npull = 250", '\npull = "?"')  # asked for with the material
    path.write_text(text.replace(vector(levels), vector(levels[::3])))
    assert not any(without_report(filled(path, pull=250)))
    few, many = read(tmp_path / "results" / path.stem, "respond.json")["responses"]
    assert len(few["slipping_pairs"]) == 0 < len(many["slipping_pairs"])
    path.unlink()
    path, _ = proposed(tmp_path, capsys)
    assert "respond" not in tomllib.loads(path.read_text())
    text = path.read_text()
    shares = text.split("the pull times ")[1].split(", Fc/Fe")[0]
    assert '# levels = "?"' in text
    assert np.array(shares.split(", "), dtype=float) == pytest.approx(levels / 250, rel=0.05)


@pytest.mark.slow
def test_computed_with_the_materials_of_the_file(tmp_path, capsys):
    """Four times as stiff as steel, blades and damper: twice its frequencies."""
    hz = {}
    for name, E in {"steel": None, "stiffer": 4 * STEEL["m"][0]}.items():
        folder = tmp_path / name
        folder.mkdir()
        for body, file in ((corner_study.blades(), "blades"), (corner_study.damper(), "damper")):
            cells = {"whole": np.concatenate(list(body.number.values()))}
            text = mesh_texts.plain(replace(body, cell_groups=cells))
            if E:
                text += (
                    f"*MATERIAL, NAME=stiff\n*ELASTIC\n{E}, 0.3\n*DENSITY\n7850.\n"
                    "*SOLID SECTION, ELSET=whole, MATERIAL=stiff\n"
                )
            (folder / f"{file}.inp").write_text(text)
        path, said = proposed(folder, capsys, "--pull", "10")
        made_of = "the given materials" if E else "steel"
        assert f"of {made_of}: free" in said and f"computed with {made_of}" in path.read_text()
        hz[name] = tomllib.loads(path.read_text())["respond"]["band"]
    assert hz["stiffer"] == pytest.approx(2 * np.array(hz["steel"]), rel=0.06)


@pytest.mark.slow
def test_nodes_are_where_the_blades_move_most(tmp_path, capsys):
    """Two cubes, each clamped on one face: the free end opposite to it moves most, by whatever mode
    is the lowest."""
    corner_study.write(tmp_path)
    path, said = proposed(tmp_path, capsys, "--pull", "10")
    assert "the blades move most at" in said
    blades = corner_study.blades()
    names = tomllib.loads(path.read_text())["respond"]["patches"]
    for name in names:
        at = blades.position[blades.index([int(name.removeprefix("node "))])][0]
        clamps = (
            blades.position[blades.index(blades.groups[g])] for g in ("clamp_one", "clamp_two")
        )
        away = [np.linalg.norm(clamp - at, axis=1).min() for clamp in clamps]
        assert min(away) == pytest.approx(corner_study.A, rel=1e-6)
    assert len(set(names)) == 2


@pytest.mark.slow
def test_stiffness_has_the_unit_of_the_study(tmp_path, capsys):
    """The same body in mm has a thousandth of the number; half-spaces are the upper end."""
    found = {}
    for factor in (1.0, 1e3):
        folder = tmp_path / f"{factor:g}"
        folder.mkdir()
        bodies = (corner_study.blades(), corner_study.damper())
        bodies = (replace(b, position=factor * b.position) for b in bodies)
        corner_study.write(folder, *bodies)
        line = next(
            text
            for text in proposed(folder, capsys)[0].read_text().splitlines()
            if text.startswith("# half-spaces of steel")
        )
        found[factor] = float(line.split("kn of each node = ")[1].split(",")[0])
        assert line.split(" N/")[1].startswith("m" if factor == 1 else "mm")
    assert found[1e3] == pytest.approx(1e-3 * found[1.0], rel=0.05)


@pytest.mark.slow
def test_a_node_by_its_number_is_a_group(tmp_path, capsys):
    corner_study.write(tmp_path)
    free = corner_study.blades().groups["touch_one"][0]
    study = tmp_path / "study.toml"
    wanted = corner_study.TEXT.replace('excitation = "touch_one"', f'excitation = "node {free}"')
    study.write_text(wanted)
    assert main(["inspect", str(study), "--quiet"]) == 0
    study.write_text(wanted.replace(f"node {free}", "node 999999"))
    assert main(["inspect", str(study), "--quiet"]) == 2
    assert "node 999999" in capsys.readouterr().err


@pytest.mark.slow
def test_what_cannot_be_computed_is_said(tmp_path, capsys, monkeypatch):
    """The study is proposed all the same."""
    corner_study.write(tmp_path)
    monkeypatch.setattr("tipdamp.proposal.trial.LONGEST", 0.0)
    path, said = proposed(tmp_path, capsys, "--pull", "10")
    assert "band and nodes are not computed: it would take about" in said
    assert '# band = "?"' in path.read_text()


def test_a_pull_is_for_meshes(tmp_path, capsys):
    corner_study.write(tmp_path)
    (tmp_path / "study.toml").write_text(corner_study.TEXT)
    assert main(["inspect", str(tmp_path / "study.toml"), "--pull", "5"]) == 2
    assert "its own pull" in capsys.readouterr().err
    for pull in ("-5", "abc"):
        with pytest.raises(SystemExit):
            main(["inspect", str(tmp_path / "blades.inp"), "--pull", pull])
        assert f"'{pull}' is no number above 0" in capsys.readouterr().err


def test_band_by_hand():
    """A tenth on both sides of all that was found."""
    values = dict(only_friction=(), excitation=(), patches=(), moved="", sides={})
    tried = Trial(**values, free_hz=(1600.0, 1700.0), soft_hz=(2700.0,), stuck_hz=(3450.0,))
    assert tried.band == (1400, 3800)
    assert tried.levels == LEVELS  # nothing ever slips
    assert replace(tried, slip=0.0123).levels == (0.0037, 0.037, 0.12, 0.37)
    assert 0 < SOFTEST < 1 and STEEL["mm"][0] == pytest.approx(1e-6 * STEEL["m"][0])


def test_no_best_damping_is_promised_where_contacts_open_first():
    """By hand: a tenth of them lift off at a third of the level at which half of them move."""
    values = dict(only_friction=(), excitation=(), patches=(), moved="", sides={})
    hz = dict(free_hz=(1600.0,), soft_hz=(2700.0,), stuck_hz=(3450.0,))
    found = {
        lift: " ".join(response_text._levels(80.0, Trial(**values, **hz, slip=3e-3, lift=lift)))
        for lift in (None, 9e-3, 1e-3)
    }
    assert all("about the best damping" in found[lift] for lift in (None, 9e-3))
    assert "best damping" not in found[1e-3] and "contacts open from 0.08 N on" in found[1e-3]


def test_a_mode_that_resembles_no_free_one_is_left_out():
    """By hand: the band ends above those that do, and the tracked one is the other."""
    values = dict(only_friction=(), excitation=(), patches=(), moved="", sides={})
    hz = dict(free_hz=(426.0, 436.0), soft_hz=(491.0,), stuck_hz=(598.0,))
    unlike = {"out_of_phase": TrackedMode(hz=7490.0, mac=0.32)}
    tried = Trial(**values, **hz, unlike=unlike)
    assert (tried.band, tried.follow) == ((380, 660), "in_phase")
    assert response_text._followed(tried)[-1] == 'follow = "in_phase"'
    said = " ".join(response_text._unlike(tried))
    assert "resembles the free out-of-phase one; the nearest, 7490 Hz" in said
    assert "has a MAC of 0.32 with it" in said
    both = unlike | {"in_phase": TrackedMode(hz=9000.0, mac=0.1)}
    for other in ({}, both, {"in_phase": TrackedMode(hz=9000.0, mac=0.1)}):
        assert response_text._followed(replace(tried, unlike=other)) == []
    assert response_text._unlike(replace(tried, unlike={})) == []


@pytest.mark.parametrize(
    "macs, expected",
    [((0.9, 0.9), (700, 800)), ((0.3, 0.9), (800,)), ((0.3, 0.2), (500, 600))],
)
def test_stuck_modes_are_those_that_resemble(monkeypatch, macs, expected):
    """Of the two tracked ones; the lowest two where neither does."""
    modes = {
        name: SimpleNamespace(hz=np.array([500, 600, 700]), tracked_hz=hz, mac=mac)
        for name, hz, mac in zip(NAMES, (700, 800), macs, strict=True)
    }
    monkeypatch.setattr(trial_module, "_run", lambda *_: None)
    monkeypatch.setattr(trial_module, "tracked_modes", lambda *_: modes)
    found = trial_module._stuck(None, None, True)
    assert [found.tracked[name].mac for name in NAMES] == list(macs)
    assert found.without([n for n, mac in zip(NAMES, macs, strict=True) if mac < 0.5]) == expected
