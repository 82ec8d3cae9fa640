"""Studies that tests change by replacing texts: of the small rig, and CHAIN of the matrices of the example."""

import json
from pathlib import Path

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


def edit(folder, old, new):
    path = folder / "rig.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return str(path)


SAID_BY_THE_TABLE = ('blade = "contact_left"\n', 'damper = "contact_left"\n', 'blade = "contact_right"\n',
                     'damper = "contact_right"\n', "mu = 0.6\n", "kn = 3.32e6\n", "kt = 3.02e6\n", "kn = 1.03e6\n",
                     "kt = 0.94e6\n")


def own_pairs(folder):
    """The study with the pairs of mine.csv, and without what the table says."""
    for line in SAID_BY_THE_TABLE:
        edit(folder, line, "")
    return edit(folder, "[contact]", '[contact]\npairs = "mine.csv"')


def files(folder):
    """Times of all files but the name of who holds the lock."""
    return {p: p.stat().st_mtime_ns for p in Path(folder).rglob("*") if p.is_file() and p.name != ".holder"}


def read(folder, name):
    return json.loads((folder / name).read_text())


def text(old, new):
    def change(study):
        assert old in CHAIN
        study.write_text(CHAIN.replace(old, new))
    return change
