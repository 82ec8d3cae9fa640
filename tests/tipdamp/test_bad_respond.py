"""Bad input to the forced response through a study file: exit code 2 and one line, before anything heavy starts."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from hbm import problem
from hbm.model import ReducedModel
from tests.hbm.test_bad_input import with_entry
from tipdamp.cli import main

EXAMPLE = Path(__file__).parents[2] / "docs" / "studies" / "matrices_only" / "make_matrices.py"
STUDY = """
[model]
matrices = "model.npz"
axis = [1, 0, 0]
pull = 60
[contact]
pairs = "pairs.csv"
[contact.left]
shape = "cylinder"
[contact.right]
shape = "cylinder"
[tune]
stations = [1, 1]
[respond]
direction = [0, 1, 0]
levels = [5]
harmonics = [1]
band = [900, 1400]
damping_ratio = 0.01
"""


@pytest.fixture
def study(tmp_path):
    """Path of a valid study from matrices, without finite elements."""
    spec = importlib.util.spec_from_file_location("make_matrices", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    M, K = example.matrices()
    body, node = zip(*[(b, n) for b, nodes in example.NODES.items() for n in nodes], strict=True)
    pull = np.zeros(27)
    pull[[20, 26]] = 0.5                                  # z of the two ends of the damper
    ReducedModel.from_matrices(M, K, body=np.repeat(body, 3), node=np.repeat(node, 3), direction=["x", "y", "z"] * 9,
                               position=np.repeat(example.positions(), 3, axis=0), loads={"pull": pull},
                               groups={"blades/excitation": [2], "blades/patch_1": [2], "blades/patch_2": [12]},
                               ).save(tmp_path / "model.npz")
    example.contact_table().save(tmp_path / "pairs.csv")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


def text(old, new):
    def change(study):
        assert old in STUDY
        study.write_text(STUDY.replace(old, new))
    return change


def cell(column, value):
    """A cell of the contact table, in the third line of the file."""
    def change(study):
        path = study.parent / "pairs.csv"
        lines = path.read_text().splitlines()
        fields = lines[2].split(",")
        fields[lines[0].split(",").index(column)] = value
        lines[2] = ",".join(fields)
        path.write_text("\n".join(lines))
    return change


def no_rows(study):
    path = study.parent / "pairs.csv"
    path.write_text(path.read_text().splitlines()[0] + "\n")


def array(name, change):
    def changed(study):
        path = study.parent / "model.npz"
        with np.load(path) as z:
            arrays = {k: z[k] for k in z.files}
        arrays[name] = change(arrays[name])
        np.savez(path, **arrays)
    return changed


REFUSED_STUDIES = {
    "H negative": (text("harmonics = [1]", "harmonics = [-1]"), r"harmonics.*-1.*1.*99"),
    "H zero": (text("harmonics = [1]", "harmonics = [0]"), r"harmonics.*0.*1.*99"),
    "H not whole": (text("harmonics = [1]", "harmonics = [2.5]"), r"harmonics.*2\.5.*whole"),
    "H absurd": (text("harmonics = [1]", "harmonics = [5000]"), r"harmonics.*5000.*99"),
    "NaN in K": (array("K", lambda K: with_entry(K, 3, 5, np.nan)), r"K\[3, 5\] is nan"),
    "K unsymmetric": (array("K", lambda K: with_entry(K, 0, 1, 1e6)), r"K is not symmetric.*1e-10"),
    "M of another size": (array("M", lambda M: M[:-1, :-1]), r"M is \(26, 26\), K is \(27, 27\)"),
    "kn negative": (cell("kn", "-1"), r"pair 2: kn = -1"),
    "kt negative": (cell("kt", "-1"), r"pair 2: kt = -1"),
    "mu negative": (cell("mu", "-0.5"), r"pair 2: mu = -0\.5"),
    "mu a text": (cell("mu", "much"), r"line 3: mu = 'much' is not a number"),
    "no pairs": (no_rows, r"holds no contact pairs"),
    "band empty": (text("[900, 1400]", "[900, 900]"), r"band.*empty"),
    "band reversed": (text("[900, 1400]", "[1400, 900]"), r"band.*the first must be below the last"),
    "band negative": (text("[900, 1400]", "[-900, 1400]"), r"band.*-900"),
    "damping negative": (text("damping_ratio = 0.01", "damping_ratio = -0.01"), r"damping_ratio.*-0\.01"),
    "level not a number": (text("levels = [5]", "levels = ['much']"), r"levels.*much"),
    "key misspelt": (text("harmonics", "harmonic"), r"harmonic'.*harmonics"),
}


@pytest.mark.parametrize("row", REFUSED_STUDIES)
def test_refused_in_a_study(row, study, capsys, monkeypatch):
    """Exit code 2, one line on the error stream, before any stage is solved."""
    change, message = REFUSED_STUDIES[row]
    change(study)

    def heavy(*_, **__):
        raise AssertionError("something heavy has started")
    monkeypatch.setattr(problem, "stuck_receptance", heavy)
    assert main(["run", str(study), "--quiet"]) == 2
    error = capsys.readouterr().err.strip()
    assert re.search(message, error), error
    assert "Traceback" not in error and len(error.splitlines()) == 1


def test_unchanged_study_is_valid(study):
    assert main(["run", str(study), "--quiet"]) == 0
