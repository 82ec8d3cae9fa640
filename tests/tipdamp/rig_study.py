"""Studies that tests change by replacing texts: of the small rig, and CHAIN of the matrices of the
example."""

import importlib.util
import json
from pathlib import Path

import numpy as np

from tipdamp.cli import main
from tipdamp.hbm.model import ReducedModel

EXAMPLE = Path(__file__).parents[2] / "docs" / "studies" / "matrices_only" / "make_matrices.py"
CHAIN = """
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

CHAIN_OF_STAGES = ("reduce", "preload", "tune", "respond")


def write_chain(folder):
    """Study CHAIN with its matrices and pairs into a folder; returns the study's path."""
    spec = importlib.util.spec_from_file_location("make_matrices", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    M, K = example.matrices()
    body, node = zip(*[(b, n) for b, nodes in example.NODES.items() for n in nodes], strict=True)
    pull = np.zeros(27)
    pull[[20, 26]] = 0.5  # z of the two ends of the damper
    ReducedModel.from_matrices(
        M,
        K,
        body=np.repeat(body, 3),
        node=np.repeat(node, 3),
        direction=["x", "y", "z"] * 9,
        position=np.repeat(example.positions(), 3, axis=0),
        loads={"pull": pull},
        groups={"blades/excitation": [2], "blades/patch_1": [2], "blades/patch_2": [12]},
    ).save(folder / "model.npz")
    example.contact_table().save(folder / "pairs.csv")
    (folder / "study.toml").write_text(CHAIN)
    return folder / "study.toml"


def edit(folder, old, new):
    path = folder / "rig.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return str(path)


SAID_BY_THE_TABLE = (
    'blade = "contact_left"\n',
    'damper = "contact_left"\n',
    'blade = "contact_right"\n',
    'damper = "contact_right"\n',
    "mu = 0.6\n",
    "kn = 3.32e6\n",
    "kt = 3.02e6\n",
    "kn = 1.03e6\n",
    "kt = 0.94e6\n",
)


def own_pairs(folder):
    """The study with the pairs of mine.csv, and without what the table says."""
    for line in SAID_BY_THE_TABLE:
        edit(folder, line, "")
    return edit(folder, "[contact]", '[contact]\npairs = "mine.csv"')


def files(folder):
    """Times of all files but the name of who holds the lock, and what verbs said."""
    return {
        p: p.stat().st_mtime_ns
        for p in Path(folder).rglob("*")
        if p.is_file() and p.name != ".holder" and p.suffix != ".receipt"
    }


def read(folder, name):
    return json.loads((folder / name).read_text())


def text(old, new):
    def change(study):
        assert old in CHAIN
        study.write_text(CHAIN.replace(old, new))

    return change


def without_report(study):
    """Exit codes of the stages up to `cycles`: as `run`, which draws the report too."""
    verbs = ("inspect", *CHAIN_OF_STAGES, "cycles")
    return [main([verb, str(study), "--quiet"]) for verb in verbs]


def run_chain(study, *options):
    """Exit code of `respond`, with the options, after the stages before it."""
    return [
        main([stage, str(study), "--quiet", *(options if stage == "respond" else ())])
        for stage in CHAIN_OF_STAGES
    ][-1]
