"""The command line: bad input with one line and exit code 2, and whole runs without meshes or
responses."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import STUDY
from tests.hbm.test_bad_input import with_entry
from tests.tipdamp.rig_study import SAID_BY_THE_TABLE, edit, files, text
from tipdamp.cli import PARALLEL, Terminated, main
from tipdamp.hbm.balance import problem
from tipdamp.stages.run import STAGES

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "verb, old, new, message",
    [
        (
            "inspect",
            "asymmetric_blades.msh",
            "none.msh",
            "[blades] mesh = 'none.msh': no such file",
        ),
        (
            "reduce",
            'clamp = "clamp"',
            'clamp = "clmp"',
            "[blades] clamp[0]: asymmetric_blades.msh: no group 'clmp'; did you mean 'clamp'",
        ),
        ("reduce", 'blade = "contact_right"', 'blade = "contact_left"', "the groups are swapped"),
        (
            "reduce",
            "asymmetric_blades.msh",
            "asymmetric_damper.msh",
            "mesh is the file of the [blades] too, and all its "
            "cells are connected; name another file",
        ),
        (
            "reduce",
            "[respond]",
            '[respond]\nexcitation = "tip"',
            "[respond] excitation: asymmetric_blades.msh: no group",
        ),
        ("run", "band = [2300, 3300]", "band = [3300, 2300]", "the band is empty"),
    ],
)
def test_bad_input_exits_with_one_line(copy, capsys, verb, old, new, message):
    path = edit(copy, old, new)
    before = files(copy / "results")
    assert main([verb, path, "--quiet"]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert files(copy / "results") == before  # nothing overwritten


@pytest.mark.slow
def test_matrices_only_way_without_finite_elements(rig, rig_results, tmp_path):
    """From model.npz and pairs.csv alone, where dolfinx, petsc4py, slepc4py, gmsh and mpi4py cannot
    be imported."""
    shutil.copy(rig_results.path("model.npz"), tmp_path)
    shutil.copy(rig_results.path("preload.csv"), tmp_path / "pairs.csv")
    head, rest = STUDY.split("[contact]")
    text = '[model]\nmatrices = "model.npz"\npull = 113\n[contact]\npairs = "pairs.csv"' + rest
    for line in SAID_BY_THE_TABLE:
        assert line in text
        text = text.replace(line, "")
    (tmp_path / "rig.toml").write_text(text)
    program = (
        "import sys\nfor name in ('dolfinx', 'petsc4py', 'slepc4py', 'gmsh', 'mpi4py'): "
        "sys.modules[name] = None\nfrom tipdamp.cli import main\nfor verb in ('inspect', "
        "'reduce', 'preload', 'tune', 'respond'):\n    code = main([verb, 'rig.toml', "
        "'--quiet'])\n    assert code == 0, (verb, code)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    ours = json.loads((tmp_path / "results" / "rig" / "respond.json").read_text())["responses"]
    for one, two in zip(ours, rig_results.read_json("respond.json")["responses"], strict=True):
        assert one["peak_hz"] == pytest.approx(two["peak_hz"], rel=1e-9)
        assert one["peak_m"] == pytest.approx(two["peak_m"], rel=1e-7)


@pytest.mark.slow
def test_a_study_of_the_preload_alone(copy, capsys):
    """Without [tune] and [respond] the run ends with the preload map and its report."""
    path = copy / "rig.toml"
    path.write_text(path.read_text().split("[tune]")[0])
    assert main(["run", str(path), "--quiet", "--out", str(copy / "alone")]) == 0
    out = capsys.readouterr().out
    assert "nothing to do: the study has no [tune], [respond]" in out
    summary = json.loads((copy / "alone" / "summary.json").read_text())
    # 113 / (2 sin 45)
    assert summary["preload"]["left"]["sum_N"] == pytest.approx(79.903, abs=1e-3)
    assert "Preload" in (copy / "alone" / "report.html").read_text()


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
    "band reversed": (
        text("[900, 1400]", "[1400, 900]"),
        r"band.*the first must be below the last",
    ),
    "band negative": (text("[900, 1400]", "[-900, 1400]"), r"band.*-900"),
    "damping negative": (
        text("damping_ratio = 0.01", "damping_ratio = -0.01"),
        r"damping_ratio.*-0\.01",
    ),
    "level not a number": (text("levels = [5]", "levels = ['much']"), r"levels.*much"),
    "key misspelt": (text("harmonics", "harmonic"), r"harmonic'.*harmonics"),
}


@pytest.mark.parametrize("row", REFUSED_STUDIES)
def test_refused_in_a_study(row, matrices_study, capsys, monkeypatch):
    """Exit code 2, one line on the error stream, before any stage is solved."""
    change, message = REFUSED_STUDIES[row]
    change(matrices_study)

    def heavy(*_, **__):
        raise AssertionError("something heavy has started")

    monkeypatch.setattr(problem, "stuck_receptance", heavy)
    assert main(["run", str(matrices_study), "--quiet"]) == 2
    error = capsys.readouterr().err.strip()
    assert re.search(message, error), error
    assert "Traceback" not in error and len(error.splitlines()) == 1


def test_unchanged_study_is_valid(matrices_study):
    assert main(["run", str(matrices_study), "--quiet"]) == 0


@pytest.mark.parametrize("way", ["relative", "absolute", "link"])
def test_results_of_a_study_stay_in_its_folder(matrices_study, tmp_path, way, capsys):
    """Unless the command line says otherwise; a study may come from somebody else."""
    study, outside = tmp_path / "theirs" / "study.toml", tmp_path / "outside"
    outside.mkdir()
    study.parent.mkdir()
    for name in ("study.toml", "model.npz", "pairs.csv"):
        (tmp_path / name).rename(study.parent / name)
    (study.parent / "linked").symlink_to(outside)
    place = {"relative": "../outside", "absolute": str(outside), "link": "linked/study"}[way]
    study.write_text(f'results = "{place}"\n' + study.read_text())
    assert main(["inspect", str(study), "--quiet"]) == 2
    assert re.search(
        r"study.toml: its results lead out of its own folder, to \S*outside.*--allow-outside",
        capsys.readouterr().err,
    ) and not list(outside.iterdir())
    assert main(["inspect", str(study), "--quiet", "--allow-outside"]) == 0 and list(
        outside.iterdir()
    )
    assert main(["inspect", str(study), "--quiet", "--out", str(tmp_path / "mine")]) == 0


def _ended(program, cwd=None):
    """A program that hears Ctrl-C, which a shell may have switched off for what it runs."""
    return subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=cwd,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )


@pytest.mark.parametrize("late", ["SIGINT", "SIGTERM"])
def test_a_signal_while_the_interpreter_is_taken_down(late):
    """Comes after the work is done, with Python's own handlers gone: it changes nothing."""
    program = (
        f"import os, signal, sys\nclass Late:\n    def __del__(self, kill=os.kill, me=os.getpid(), "
        f"how=signal.{late}): kill(me, how)\n"
        "from tipdamp import cli\nlate = Late()\nsys.argv[1:] = ['--version']\n"
        "cli._main = lambda argv: 0\ncli.command()"
    )
    ended = _ended(program)
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize(
    "early, code, said", [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated")]
)
def test_a_signal_while_libraries_are_loaded(early, code, said, tmp_path):
    """In the first second of a command: a line and its code, as later."""
    program = (
        "import os, signal, sys\nclass Early:\n    def find_spec(self, name, *_):\n"
        "        if name == 'numpy':\n"
        f"            os.kill(os.getpid(), signal.{early})\n"
        "from tipdamp import cli\nsys.meta_path.insert(0, Early())\n"
        "sys.argv[1:] = ['inspect', 'none.toml']\ncli.command()"
    )
    ended = _ended(program, tmp_path)
    assert ended.returncode == code, ended.stderr
    assert ended.stderr.startswith(f"tipdamp: {said}; ") and ended.stderr.count("\n") == 1


def test_a_reader_that_leaves_costs_nothing():
    """As `head` does: `tipdamp keys` writes more than a pipe holds."""
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "wb") as pipe:
        ended = subprocess.run(
            [sys.executable, "-c", "from tipdamp.cli import command; command()", "keys"],
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert (ended.returncode, ended.stderr) == (0, "")


def test_inputs_from_outside_are_named(matrices_study, tmp_path, caplog):
    (tmp_path / "theirs").mkdir()
    study = matrices_study.rename(tmp_path / "theirs" / "study.toml")
    study.write_text(
        study.read_text()
        .replace('"model.npz"', '"../model.npz"')
        .replace('"pairs.csv"', '"linked.csv"')
    )
    (study.parent / "linked.csv").symlink_to(tmp_path / "pairs.csv")
    assert main(["inspect", str(study), "--quiet"]) == 0
    assert caplog.messages == [
        f"[model] matrices is read from outside the study's folder: {tmp_path / 'model.npz'}",
        f"[contact] pairs is read from outside the study's folder: {tmp_path / 'pairs.csv'}",
    ]


@pytest.mark.parametrize("signal_sent, code", [(KeyboardInterrupt, 130), (Terminated, 143)])
@pytest.mark.parametrize("wrapped", [SystemError, RuntimeError, ImportError])
def test_an_interrupt_in_compiled_code_is_an_interrupt(
    monkeypatch, capsys, signal_sent, code, wrapped
):
    def stopped(_):
        try:
            raise signal_sent
        except KeyboardInterrupt as interrupt:
            raise wrapped("a function returned a result with an exception set") from interrupt

    monkeypatch.setattr("tipdamp.cli._doctor", stopped)
    assert main(["doctor"]) == code
    assert "the same command to continue" in capsys.readouterr().err


def test_an_error_that_is_no_interrupt_stays(monkeypatch):
    def fails(_):
        raise SystemError("a fault")

    monkeypatch.setattr("tipdamp.cli._doctor", fails)
    with pytest.raises(SystemError, match="a fault"):
        main(["doctor"])


@pytest.mark.parametrize("stderr", ["2>&-", "2>/dev/full"])
@pytest.mark.parametrize("arguments, code", [("keys", 0), ("inspect none.toml", 2), ("what", 2)])
def test_stderr_that_takes_nothing(stderr, arguments, code):
    """Closed, or on a full disk: messages are lost, the exit code and stdout stay."""
    command = f"{sys.executable} -m tipdamp {arguments}"
    here, lost = (
        subprocess.run(
            ["sh", "-c", f"{command} {end}"],
            capture_output=True,
            text=True,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
        for end in ("", stderr)
    )
    assert (here.returncode, here.stdout) == (lost.returncode, lost.stdout) and not lost.stderr
    assert lost.returncode == code and bool(here.stderr) == (code != 0)


def test_parallel_verbs_are_the_parallel_stages():
    assert set(PARALLEL) == {name for name, stage in STAGES.items() if stage.parallel}
