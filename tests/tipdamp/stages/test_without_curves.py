"""[respond] with patches and direction alone: the modes are named and tuned, no curve is asked
for."""

import json

import pytest

from tipdamp.cli import main
from tipdamp.hbm.errors import InputError
from tipdamp.study.study import load_study

OF_CURVES = ("levels", "band", "damping_ratio")


@pytest.fixture
def study(tmp_path):
    """study(*keys): the first study without these keys of [respond], nor what stands beside
    its curves."""
    main(["init", str(tmp_path)])
    path = tmp_path / "study.toml"
    lines = path.read_text().partition("[backbone]")[0].splitlines()

    def without(*keys):
        kept = [one for one in lines if not one.startswith(tuple(f"{key} =" for key in keys))]
        path.write_text("\n".join(kept))
        return path

    return without


def test_modes_are_named_and_tuned(study, capsys):
    path = study(*OF_CURVES)
    capsys.readouterr()
    assert main(["run", str(path), "--quiet", "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    assert "nothing to do: the study has no [respond] levels" in said
    assert "free: out of phase 740.7 Hz, in phase 703.5 Hz" in said
    results = path.parent / "results" / "study"
    tuned = json.loads((results / "tune.json").read_text())
    assert tuned["stuck_hz"]["tuned"] > 1300
    assert (results / "report.html").is_file() and not (results / "respond.json").exists()


def test_curves_need_all_three(study):
    with pytest.raises(InputError, match=r"\[respond\] band is missing: first and last frequency"):
        load_study(study("band"))


def test_without_respond_it_is_said_what_names_the_modes(study, capsys):
    path = study()
    path.write_text(path.read_text().partition("[tune]")[0])
    capsys.readouterr()
    assert main(["reduce", str(path), "--quiet"]) == 0
    assert "is told where [respond] names patches" in capsys.readouterr().out
