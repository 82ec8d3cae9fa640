"""`tipdamp init` writes a study that is right and runs; `tipdamp explain` says what a key is."""

import json

import pytest

from tipdamp.cli import main
from tipdamp.study.study import load_study


def test_a_first_study_is_written_beside_its_files(tmp_path, capsys):
    assert main(["init", str(tmp_path / "first")]) == 0
    assert "run it: tipdamp run" in capsys.readouterr().out
    study = load_study(tmp_path / "first" / "study.toml")
    assert study.respond.levels == (2.0, 10.0, 20.0)
    names = {path.name for path in (tmp_path / "first").iterdir()}
    assert names == {"study.toml", "model.npz", "pairs.csv", "M.mtx", "K.mtx", "dofs.csv"}


def test_nothing_is_written_over(tmp_path, capsys):
    (tmp_path / "pairs.csv").write_text("mine")
    assert main(["init", str(tmp_path)]) == 2
    assert "is there already; name another folder" in capsys.readouterr().err
    assert (tmp_path / "pairs.csv").read_text() == "mine"
    assert not (tmp_path / "study.toml").exists()


@pytest.mark.slow
def test_the_first_study_runs(tmp_path):
    main(["init", str(tmp_path)])
    assert main(["run", str(tmp_path / "study.toml"), "--quiet", "--jobs", "1"]) == 0
    results = tmp_path / "results" / "study"
    preload = json.loads((results / "preload.json").read_text())
    # two flanks whose normals stand 35 degrees above y share 60 N
    sums = [side["sum_N"] for side in preload["sides"].values()]
    assert sums == pytest.approx([60 / 2 / 0.573576436] * 2, rel=1e-6)
    report = (results / "report.html").read_text(encoding="utf-8")
    # the hold along x carries nothing but rounding: no figure of 4e-14 N, and it says so
    assert not (results / "figures" / "held.png").exists()
    assert "No mean force at any level, so no figure: damper: slide along x" in report
    # the blades are coupled by their fixture, so that modes are in and out of phase
    reduced = json.loads((results / "reduce.json").read_text())
    assert set(reduced["free_hz"]) == {"out_of_phase", "in_phase"} and not reduced["warnings"]
    # of the mode alone, with a tenth of damping: neighbours count at the largest level
    backbone = json.loads((results / "backbone.json").read_text())
    assert backbone["complete"] and backbone["zeta"] > 0.05
    for peak in backbone["peaks"]:
        assert peak["predicted_m"] == pytest.approx(peak["peak_m"], rel=0.02)


def test_a_key_is_explained_where_it_stands(capsys):
    assert main(["explain", "mu"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("[contact] mu") and "friction" in said
    assert main(["explain", "measured.level"]) == 0
    assert capsys.readouterr().out.startswith("[measured.NAME] level")


def test_a_key_of_several_sections_is_explained_in_each(capsys):
    main(["explain", "mesh"])
    said = capsys.readouterr().out
    assert "[blades] mesh" in said and "[damper] mesh" in said
    main(["explain", "blades.mesh"])
    assert "[damper]" not in capsys.readouterr().out


def test_a_key_is_explained_by_the_name_that_a_sweep_gives_it(capsys):
    assert main(["explain", "contact.left.kn"]) == 0
    assert capsys.readouterr().out.startswith("[contact.NAME] kn")


def test_a_section_is_explained_key_by_key(capsys):
    assert main(["explain", "sweep"]) == 0
    said = capsys.readouterr().out
    assert [line for line in said.splitlines() if line.startswith("[")] == [
        f"[sweep] {key}" for key in ("over", "cases", "sample", "samples", "seed")
    ]


@pytest.mark.parametrize("name", ["levles", "contact.levels", "damper.left.pull", "[x]\n"])
def test_no_such_key(name, capsys):
    assert main(["explain", name]) == 2
    assert "no key" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name, meant",
    [
        ("levles", "respond.levels"),
        ("contct.kn", "contact.NAME.kn"),
        ("pull_", "damper.pull"),
        ("blades.pull", "damper.pull"),
    ],
)
def test_the_nearest_few_keys_are_named(name, meant, capsys):
    """Where they stand, and no list of all."""
    assert main(["explain", name]) == 2
    said = capsys.readouterr().err
    assert meant in said and "tipdamp keys" in said
    assert len(said) < 200


def test_nothing_is_near(capsys):
    assert main(["explain", "qqqqqq"]) == 2
    assert capsys.readouterr().err == "tipdamp: no key 'qqqqqq' of a study; all: tipdamp keys\n"
    assert main(["explain", "backbone.first"]) == 2
    said = capsys.readouterr().err
    assert "backbone.amplitudes" in said and "contact." not in said
