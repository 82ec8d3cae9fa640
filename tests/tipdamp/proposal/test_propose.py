"""Meshes without a study: the proposed study has the bodies, sides and directions, and runs once it is filled in."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.tipdamp import corner_study, mesh_texts
from tests.tipdamp.bodies.test_split import joined
from tests.tipdamp.rig_study import read
from tipdamp.cli import main
from tipdamp.proposal.propose import propose

WEDGE = Path(__file__).parents[2] / "reference" / "platform-wedge"
STEEL = {"E": "205e9", "nu": "0.3", "density": "7850", "pull": "10", "mu": "0.3"}


def filled(path, **values):
    """The proposed study with what only a person knows."""
    text = path.read_text()
    for key, value in {**STEEL, **values}.items():
        assert text.count(f'\n{key} = "?"') == 1
        text = text.replace(f'\n{key} = "?"', f"\n{key} = {value}")
    assert '\nclamp = "?"' not in text and '\nload_points = "?"' not in text
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("one_file", [False, True])
def test_from_meshes_to_a_preload(tmp_path, capsys, one_file):
    """Two files or one; the sides by the groups of the files, the pull into both of them: 10 N / sqrt(2) on each."""
    corner_study.write(tmp_path)
    mesh, _ = joined()
    (tmp_path / "all.inp").write_text(mesh_texts.plain(mesh))
    names = ["all.inp"] if one_file else ["damper.inp", "blades.inp"]
    assert main(["inspect", *(str(tmp_path / name) for name in names)]) == 0
    said = capsys.readouterr().out
    assert "meet 4 of the blades (touch_one)" in said and "nodes match" in said
    assert "clamp: clamp_one, clamp_two" in said
    study = filled((tmp_path / names[0]).with_suffix(".toml"))
    text = Path(study).read_text()
    assert "axis = [0, 1, 0]" in text and "pull_direction = [0.7071, 0, 0.7071]" in text
    assert 'load_points = "load"' in text
    assert ('cells = "pin"' in text) == one_file and 'length = "m"' in text
    for verb in ("inspect", "reduce", "preload"):
        assert main([verb, study, "--quiet"]) == 0
    sides = read(tmp_path / "results" / Path(study).stem, "preload.json")["sides"]
    assert [s["sum_N"] for s in sides.values()] == pytest.approx([10 / np.sqrt(2)] * 2, rel=1e-4)
    assert main(["inspect", *(str(tmp_path / name) for name in names)]) == 2
    assert "is there already and stays as it is" in capsys.readouterr().err


def test_what_is_not_filled_in_is_named(tmp_path, capsys):
    corner_study.write(tmp_path)
    assert main(["inspect", str(tmp_path / "damper.inp"), str(tmp_path / "blades.inp")]) == 0
    assert main(["inspect", str(tmp_path / "damper.toml")]) == 2
    assert "[material] E = '?'" in capsys.readouterr().err


def test_wedge_under_platforms():
    """Sides of 30 and 45 degrees, in mm, by surfaces that go on beyond the damper; pairs that match."""
    found = propose([WEDGE / "coarse_damper.msh", WEDGE / "coarse_blades.msh"])
    assert [(s.name, s.blade, s.damper, s.matching) for s in found.sides] == [
        ("left", "pf_L", "wd_L", True), ("right", "pf_R", "wd_R", True)]
    assert found.length == "mm" and found.axis.tolist() == [0, 1, 0] and found.pull.tolist() == [0, 0, 1]
    angles = [np.degrees(np.arctan2(abs(s.patch.normal[0]), s.patch.normal[2])) for s in found.sides]
    assert angles == pytest.approx([30, 45], abs=0.1) and all(s.patch.flat for s in found.sides)
    assert found.groups == {"clamp": ["Fixed"], "load_points": ["pullpts"], "excitation": ["shaker"],
                            "patches": ["tipL", "tipR"]}


def test_round_side(rig):
    """The asymmetric rig: a flat and a round side."""
    found = propose([rig / "asymmetric_blades.msh", rig / "asymmetric_damper.msh"])
    shapes = {s.patch.flat for s in found.sides}
    assert len(found.sides) == 2 and shapes == {True, False} and found.length == "m"


@pytest.mark.parametrize("names, message", [
    (["damper.inp", "blades.inp", "damper.inp"], "3 meshes: one file with all bodies is wanted"),
    (["damper.inp"], "all its cells are connected: blades and damper cannot be told apart"),
    (["far.inp", "blades.inp"], "no face of far.inp (27 nodes) lies within"),
    (["corner.toml", "blades.inp"], "one study at a time, or mesh files alone"),
])
def test_refusals(tmp_path, capsys, names, message):
    corner_study.write(tmp_path)
    (tmp_path / "far.inp").write_text(mesh_texts.plain(corner_study.damper(at=(0, 0.5, 0))))
    assert main(["inspect", *(str(tmp_path / name) for name in names)]) == 2
    assert message in capsys.readouterr().err and not (tmp_path / "damper.toml").exists()


def test_names_with_quotes(tmp_path):
    """Group names are text of the file: they cannot break out of the study."""
    shutil.copy(WEDGE / "coarse_blades.msh", tmp_path)
    text = (WEDGE / "coarse_damper.msh").read_text().replace('"pullpts"', '"pull\\"\\npts"'.replace("\\n", " "))
    (tmp_path / "coarse_damper.msh").write_text(text)
    assert main(["inspect", str(tmp_path / "coarse_damper.msh"), str(tmp_path / "coarse_blades.msh")]) == 0
    assert tomllib.loads((tmp_path / "coarse_damper.toml").read_text())["damper"]["load_points"] == 'pull\\" pts'
