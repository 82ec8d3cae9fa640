"""Studies that several tests change and run."""

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from hbm.model import ReducedModel
from tests.conftest import STUDY, changed
from tests.tipdamp.rig_study import CHAIN, SAID_BY_THE_TABLE
from tipdamp.cli import main

EXAMPLE = Path(__file__).parents[2] / "docs" / "studies" / "matrices_only" / "make_matrices.py"


@pytest.fixture
def copy(rig, rig_results, tmp_path):
    """A copy of the study, its meshes and its results."""
    folder = tmp_path / "copy"
    shutil.copytree(rig, folder)
    return folder


@pytest.fixture
def variant(rig_results, tmp_path):
    """variant(last, *(old, new)): the study on matrices with changes, up to a stage; returns the results folder."""
    shutil.copy(rig_results.path("model.npz"), tmp_path)
    shutil.copy(rig_results.path("preload.csv"), tmp_path / "pairs.csv")
    text = '[model]\nmatrices = "model.npz"\npull = 113\n[contact]\npairs = "pairs.csv"' + STUDY.split("[contact]")[1]
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
    (tmp_path / "study.toml").write_text(CHAIN)
    return tmp_path / "study.toml"


@pytest.fixture
def nothing_is_assembled(monkeypatch):
    """What is wrong with pairs and loads is answered before anything heavy is done."""
    def heavy(*_, **__):
        raise AssertionError("a body was assembled")

    monkeypatch.setattr("modal.elasticity.elastic_body", heavy)
