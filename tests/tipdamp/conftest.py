"""Studies that several tests change and run."""

import shutil

import pytest

from tests.conftest import STUDY, changed
from tests.tipdamp.rig_study import SAID_BY_THE_TABLE, write_chain
from tipdamp.cli import main
from tipdamp.engine import curves


@pytest.fixture
def copy(rig, rig_results, tmp_path):
    """A copy of the study, its meshes and its results."""
    folder = tmp_path / "copy"
    shutil.copytree(rig, folder)
    return folder


@pytest.fixture
def variant(rig_results, tmp_path):
    """variant(last, *(old, new)): the study on matrices with changes, up to a stage; returns the
    results folder."""
    shutil.copy(rig_results.path("model.npz"), tmp_path)
    shutil.copy(rig_results.path("preload.csv"), tmp_path / "pairs.csv")
    text = (
        '[model]\nmatrices = "model.npz"\npull = 113\n[contact]\npairs = "pairs.csv"'
        + STUDY.split("[contact]")[1]
    )
    for line in SAID_BY_THE_TABLE:
        text = text.replace(line, "")

    def run(last, *changes):
        (tmp_path / "rig.toml").write_text(changed(text, *changes))
        for verb in ("inspect", "reduce", "preload", "tune", "respond", "cycles", "report"):
            assert main([verb, str(tmp_path / "rig.toml"), "--quiet"]) == 0
            if verb == last:
                return tmp_path / "results" / "rig"

    return run


@pytest.fixture
def matrices_study(tmp_path):
    """Path of a valid study from matrices, without finite elements."""
    return write_chain(tmp_path)


@pytest.fixture
def made(monkeypatch):
    """Names of the curves that are computed, in their order."""
    names, real = [], curves.Curves._followed
    monkeypatch.setattr(
        curves.Curves,
        "_followed",
        lambda self, case, *a: names.append(case.name) or real(self, case, *a),
    )
    return names


@pytest.fixture
def nothing_is_assembled(monkeypatch):
    """What is wrong with pairs and loads is answered before anything heavy is done."""

    def heavy(*_, **__):
        raise AssertionError("a body was assembled")

    monkeypatch.setattr("tipdamp.modal.elasticity.elastic_body", heavy)
