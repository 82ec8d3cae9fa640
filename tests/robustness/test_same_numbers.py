"""One study in other units, numbers, axes, threads and places: the same numbers."""

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.conftest import changed
from tests.robustness.rows import chain, stages, tipdamp
from tests.robustness.runtime import environment
from tests.robustness.runtime import numbers as all_numbers
from tests.robustness.runtime import same as same_curves
from tests.tipdamp import corner_study
from tests.tipdamp.stages.test_full import over_ranks
from tipdamp.engine import ranks
from tipdamp.hbm.contact import ContactTable
from tipdamp.results import STAGES

STILL, TURN = np.eye(3), Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
TEXT = changed(
    corner_study.TEXT,
    ("[respond]", '[tune]\nstations = "all"\n[respond]\ndirection = [1, 0, 0]'),
    ("levels = [1]", "levels = [2]\nharmonics = [1]\nboth_ways = false"),
    ("kn = 1e6", "kn = 1e8"),
    ("kt = 1e6", "kt = 1e8"),
    ("band = [20000, 40000]", "band = [45000, 56000]"),
    # whole sets
    ("modes = 5", "modes_below_hz = 3e5"),
    ("modes = 3", "modes_below_hz = 3e5"),
    ("pull_direction", "axis = [0, 1, 0]\npull_direction"),
)
MM = (
    ("[material]", '[units]\nlength = "mm"\nstress = "MPa"\ndensity = "t/mm3"\n[material]'),
    ("207e9", "207e3"),
    ("density = 7850", "density = 7.85e-9"),
    ("kn = 1e8", "kn = 1e5"),
    ("kt = 1e8", "kt = 1e5"),
    ("width = 0.01", "width = 10"),
)


def written(folder, meshes, *changes):
    folder.mkdir(parents=True)
    path = corner_study.write(folder, *meshes)
    path.write_text(changed(TEXT, *changes), encoding="utf-8")
    return path


def plain():
    return corner_study.blades(), corner_study.damper()


def moved(mesh, turn=STILL, factor=1.0):
    return replace(mesh, position=factor * mesh.position @ turn.T)


def renumbered(mesh, seed):
    """Other node numbers in another order; cells and groups follow."""
    order = np.random.default_rng(seed).permutation(len(mesh.node))
    new = 1000 + 7 * np.arange(len(order))
    to = dict(zip(mesh.node[order], new, strict=True))
    place = np.argsort(order)
    return replace(
        mesh,
        node=new,
        position=mesh.position[order],
        cells={k: place[c] for k, c in mesh.cells.items()},
        groups={k: np.sort([to[n] for n in g]) for k, g in mesh.groups.items()},
    )


def found(study, turn=STILL):
    """What a study finds: frequencies, the preload by place, the curve's peak."""
    stages(study, "respond")
    folder = study.parent / "results" / study.stem
    pairs = ContactTable.load(folder / "preload.csv")
    place = np.round(pairs.position @ turn, 9)
    order = np.lexsort((*place.T, pairs.side))
    curve = json.loads((folder / "respond.json").read_text())["responses"][0]
    return {
        "preload": pairs.preload[order],
        "peak": np.array([curve["peak_m"]]),
        "peak_hz": np.array([curve["peak_hz"]]),
        "free_hz": np.array(json.loads((folder / "reduce.json").read_text())["free_modes_hz"]),
    }


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return found(written(tmp_path_factory.mktemp("same") / "plain", plain()))


def same(one, two, tolerance):
    for name, values in one.items():
        # a peak is flat
        allowed = max(tolerance, 1e-6) if name == "peak_hz" and tolerance else tolerance
        assert np.abs(values - two[name]).max() <= allowed * np.abs(values).max(), name


def test_millimetres(reference, tmp_path):
    study = written(tmp_path / "mm", [moved(m, factor=1e3) for m in plain()], *MM)
    same(reference, found(study), 1e-8)


def test_other_node_numbers(reference, tmp_path):
    study = written(tmp_path / "numbers", [renumbered(m, i) for i, m in enumerate(plain())])
    same(reference, found(study), 1e-8)


def test_rotated_axes(reference, tmp_path):
    def vector(v):
        return str((TURN @ v).tolist())

    study = written(
        tmp_path / "turned",
        [moved(m, TURN) for m in plain()],
        ("axis = [0, 1, 0]", f"axis = {vector([0, 1, 0])}"),
        ("pull_direction = [1, 0, 1]", f"pull_direction = {vector([1, 0, 1])}"),
        ("direction = [1, 0, 0]", f"direction = {vector([1, 0, 0])}"),
    )
    same(reference, found(study, TURN), 1e-8)


def test_a_path_with_spaces_and_umlauts(reference, tmp_path):
    same(reference, found(written(tmp_path / "Prüfstand 2, größer" / "a b", plain())), 0.0)


@pytest.mark.slow
def test_ranks(tmp_path):
    """The preload of the full model by `preload --full`, alone and over 1, 2 and 4 ranks."""
    study, tables = written(tmp_path / "ranks", plain()), []
    stages(study, "preload")
    for count in (1, 2, 4):
        run = over_ranks(count, "preload", "--full", str(study), "--force", "--quiet")
        assert run.returncode == 0, run
        folder = study.parent / "results" / study.stem
        assert json.loads((folder / "full.json").read_text())["ranks"] == count
        tables.append(ContactTable.load(folder / "preload_full.csv").preload)
    for other in tables[1:]:
        assert np.abs(other - tables[0]).max() <= 1e-9 * np.abs(tables[0]).max()


@pytest.mark.parametrize("rank", [0, 1])
@pytest.mark.parametrize("verb", [*STAGES, "run", "export", "doctor", "keys"])
def test_a_verb_that_is_the_work_of_one_process(tmp_path, monkeypatch, verb, rank):
    """Under mpirun the first process says so, the others are silent, and nothing is written."""
    study = [] if verb in ("doctor", "keys") else [chain(tmp_path)]
    for name, value in zip(ranks._TOLD[0], (4, rank), strict=True):
        monkeypatch.setenv(name, str(value))
    said = tipdamp(verb, *study)
    assert not (tmp_path / "results").exists() and not said.out
    assert (
        said.err.startswith(f"tipdamp: {verb} is the work of one process, and mpirun started 4")
        or rank
    )
    assert said.code == (0 if rank else 2) and (not rank or not said.err)


class Clock:
    """Of the system, as it is set: it jumps by years at every look, back and forth."""

    def __init__(self):
        self.real, self.looks = time.time(), 0

    def time(self):
        self.looks += 1
        return self.real + (-1) ** self.looks * 3e7 * self.looks

    def time_ns(self):
        return int(1e9 * self.time())


def test_a_clock_that_jumps(tmp_path, monkeypatch):
    """While stages run and between them, with files from the future and of 1970: the same bits,
    nothing made again."""
    studies = [
        chain(tmp_path / name) for name in ("still", "jumps") if (tmp_path / name).mkdir() is None
    ]
    stages(studies[0], "respond")
    clock = Clock()
    monkeypatch.setattr(time, "time", clock.time)
    monkeypatch.setattr(time, "time_ns", clock.time_ns)
    for k, verb in enumerate(("inspect", "reduce", "preload", "tune", "respond")):
        for path in tmp_path.joinpath("jumps").rglob("*"):
            os.utime(path, (4e9, 4e9) if k % 2 else (0, 0))
        assert tipdamp(verb, studies[1], "--quiet").code == 0
    for path in tmp_path.joinpath("jumps").rglob("*"):
        os.utime(path, (4e9, 4e9))
    for verb in ("inspect", "reduce", "preload", "tune", "respond"):
        assert "up to date" in tipdamp(verb, studies[1], "--quiet").out
    same_curves(*(all_numbers(study) for study in studies))


def test_threads_and_a_second_run(tmp_path):
    """Two BLAS threads 1e-9; a second run in a process of its own every bit."""
    results = []
    for k, threads in enumerate((1, 1, 2)):
        study = written(tmp_path / str(k), plain())
        program = (
            "from tipdamp.cli import main\nfor v in ('inspect', 'reduce', 'preload', 'tune', "
            "'respond'): assert main([v, 'corner.toml', '--quiet']) == 0"
        )
        subprocess.run(
            [sys.executable, "-c", program],
            cwd=study.parent,
            check=True,
            capture_output=True,
            timeout=200,
            env={
                **os.environ,
                "PYTHONPATH": str(Path(__file__).parents[2]),
                "TIPDAMP_JOBS": "1",
                "OMP_NUM_THREADS": str(threads),
                "OPENBLAS_NUM_THREADS": str(threads),
            },
        )
        results.append(found(study))
    same(results[0], results[1], 0.0)
    same(results[0], results[2], 1e-9)


def test_curves_with_any_number_of_threads_and_jobs(tmp_path):
    """From the same matrices and pairs: every bit."""
    study = written(tmp_path / "one", plain(), ("levels = [2]", "levels = [1, 2]"))
    stages(study, "tune")
    for k, threads in enumerate("124"):
        copy = tmp_path / threads / "one"
        shutil.copytree(study.parent, copy)
        run = subprocess.run(
            [sys.executable, "-m", "tipdamp", "respond", "corner.toml", f"--jobs={1 + k % 2}"],
            cwd=copy,
            capture_output=True,
            text=True,
            timeout=200,
            env=environment(OMP_NUM_THREADS=threads, OPENBLAS_NUM_THREADS=threads),
        )
        assert run.returncode == 0, run.stderr
        same_curves(
            all_numbers(tmp_path / "1" / "one" / study.name), all_numbers(copy / study.name)
        )
