"""`tipdamp preload --full`: the other route as a verb, alone and over ranks; other verbs refuse
ranks in one line."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tipdamp import corner_study
from tests.tipdamp.rig_study import files, read
from tipdamp.cli import main
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Workers
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.write import write_report
from tipdamp.study.study import load_study

pytest.importorskip("petsc4py")

SPIN = (
    "[rotation]\naxis = [0, 1, 0]\npoint = [-0.5, 0, -0.5]\n[loads.spin]\nspeed = 10\ngravity = "
    "[1, 0, -9.81]\n"
    '[preload]\ncase = "spin"\n[contact]'
)


def over_ranks(count, *words):
    """The command under mpirun, which root must be allowed."""
    if not shutil.which("mpirun"):
        pytest.skip("mpirun is not installed")
    root = {
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMP_NUM_THREADS": "1",
    }
    return subprocess.run(
        ["mpirun", "--oversubscribe", "-n", str(count), sys.executable, "-m", "tipdamp", *words],
        env={**os.environ, **root},
        capture_output=True,
        text=True,
        timeout=900,
    )


@pytest.mark.slow
def test_alone_and_over_ranks(tmp_path, capsys):
    """The same preload as the condensed one to 1e-8, also with a load case of weight and speed; the
    report shows it as long as it belongs to the preload that is there."""
    study = str(corner_study.write(tmp_path, change=[("[contact]", SPIN)]))
    out = tmp_path / "results" / "corner"
    for verb in ("inspect", "reduce"):
        assert main([verb, study, "--quiet"]) == 0
    assert main(["preload", study, "--full", "--quiet"]) == 0
    alone, table = read(out, "full.json"), ContactTable.load(out / "preload_full.csv")
    assert alone["difference"] < 1e-8 and alone["ranks"] == 1
    assert "off preload.csv by" in capsys.readouterr().out
    run = over_ranks(2, "preload", "--full", study, "--force", "--quiet")
    assert run.returncode == 0 and len(run.stdout.splitlines()) == 1, run.stderr
    found = read(out, "full.json")
    assert found["ranks"] == 2 and found["difference"] < 1e-8 and found["dofs"] == alone["dofs"]
    other = ContactTable.load(out / "preload_full.csv")
    assert other.preload == pytest.approx(table.preload, abs=1e-8 * table.preload.max())
    known = run_report(study, out)
    assert (
        known["full_preload"]["ranks"] == 2
        and "on the unreduced bodies" in (out / "report.html").read_text()
    )
    text = Path(study).read_text()
    Path(study).write_text(text.replace("pull = 10", "pull = 11"))
    for verb in ("reduce", "preload"):
        assert main([verb, study, "--quiet"]) == 0
    assert "full_preload" not in run_report(study, out)


def run_report(study, out):
    """The summary of a report on the preload alone."""
    said = {"inspect": [], "reduce": [], "preload": []}
    write_report(load_study(study), Store(out), lambda *_: None, said, Workers())
    return read(out, "summary.json")


def test_other_verbs_refuse_ranks(tmp_path):
    """One line from one of them, and nothing is written."""
    study = corner_study.write(tmp_path)
    before = files(tmp_path)
    run = over_ranks(2, "reduce", str(study), "--force")
    said = [line for line in run.stderr.splitlines() if line.startswith("tipdamp: ")]
    assert run.returncode == 2 and files(tmp_path) == before and not run.stdout
    assert said == [
        "tipdamp: reduce is the work of one process, and mpirun started 2: run it without mpirun "
        "(--jobs computes curves side by side); over ranks there is tipdamp preload --full"
    ]


@pytest.mark.slow
def test_ranks_are_released(tmp_path):
    """Where the first process cannot begin the others end too."""
    run = over_ranks(2, "preload", "--full", str(corner_study.write(tmp_path)), "--quiet")
    said = [line for line in run.stderr.splitlines() if line.startswith("tipdamp: ")]
    assert run.returncode == 2 and len(said) == 1
    assert "'full' needs the stages 'reduce' and 'preload', which have not been run" in said[0]


def test_without_friction(tmp_path, capsys):
    study = str(
        corner_study.write(
            tmp_path, change=[("[contact]", "[preload]\nfriction = true\n[contact]")]
        )
    )
    assert main(["reduce", study, "--quiet"]) == 0
    assert main(["preload", study, "--full", "--quiet"]) == 2
    assert (
        "[preload] friction = true: the full model is solved without friction"
        in capsys.readouterr().err
    )
