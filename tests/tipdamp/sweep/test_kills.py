"""A sweep whose processes are killed: what is finished stays as it is, and is not made again."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.tipdamp.rig_study import CHAIN
from tipdamp.cli import main
from tipdamp.sweep.index import Index
from tipdamp.sweep.work import products

SWEEP = """
[sweep.over]
model.pull = [60, 30, 20]
respond.levels = { start = 2, stop = 12, count = 8 }
"""
KILLS = 6
PATIENCE = 120.0  # s for a step to be finished


def begun(study, *options):
    command = [sys.executable, "-m", "tipdamp", "sweep", str(study), "--quiet", *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)


def children(pid):
    """Of a process."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            if int(stat.read_text().rpartition(")")[2].split()[1]) == pid:
                found.append(int(stat.parent.name))
        except (OSError, IndexError):  # it has ended meanwhile
            continue
    return found


def at_work(pid):
    """Processes that the server of a front process has forked."""
    return [inner for one in children(pid) for inner in children(one)]


def finished(folder):
    """{file: when it was written} of the finished steps."""
    return {path.name: path.stat().st_mtime_ns for path in (folder / "made").rglob("*.zip")}


def wait_for(folder, count, process):
    began = time.monotonic()
    while len(products(folder)) < count and process.poll() is None:
        assert time.monotonic() - began < PATIENCE
        time.sleep(0.02)


def curves(folder):
    with Index(folder) as index:
        return [row for _, row in index.curves()]


@pytest.mark.slow
def test_killed_processes_cost_the_running_case_alone(matrices_study):
    """The front process and one that computes, killed in turn without warning: what was finished
    before is the same file at the end, and the numbers are those of a sweep in peace."""
    matrices_study.write_text(CHAIN + SWEEP)
    folder = matrices_study.parent / "results" / "study" / "sweep"
    before, lost = {}, 0
    for kill in range(KILLS):
        process = begun(matrices_study, "--jobs", "2")
        wait_for(folder, len(before) + 3, process)
        if process.poll() is not None:
            break
        victim = at_work(process.pid)[-1] if kill % 2 else process.pid
        os.kill(victim, signal.SIGKILL)
        lost += victim != process.pid
        if victim != process.pid:
            wait_for(folder, len(finished(folder)) + 2, process)
            os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        now = finished(folder)
        assert before.items() <= now.items()  # not one was made again
        before = now
    assert lost >= 2
    assert "24 of 24 cases done, 0 failed" in begun(matrices_study).communicate()[0]
    assert before.items() <= finished(folder).items()
    assert len(finished(folder)) == 1 + 3 + 3 + 24
    killed = curves(folder)
    assert (
        main(["sweep", str(matrices_study), "--quiet", "--jobs", "1", "--out", str(folder / "p")])
        == 0
    )
    assert curves(folder / "p" / "sweep") == killed


@pytest.mark.slow
def test_a_process_that_always_dies_fails_its_case_alone(matrices_study, monkeypatch, capsys):
    """A case that takes its process with it is tried twice, then told; the others are made."""
    matrices_study.write_text(CHAIN + "[sweep.over]\nrespond.levels = [2, 3]\n")
    monkeypatch.setattr("tipdamp.sweep.run.work", deadly)
    assert main(["sweep", str(matrices_study), "--quiet", "--jobs", "2"]) == 3
    told = capsys.readouterr().out
    assert "1 of 2 cases done, 1 failed, 0 to do" in told
    assert "ended unasked (exit code -9)" in told
    assert "case 2: respond.levels = 3" in told


def deadly(common, task, report):
    """Work that ends its process at the level of 3 N."""
    from tipdamp.sweep.work import work

    if task.case["respond.levels"] == 3 and task.last.stage == "respond":
        os.kill(os.getpid(), signal.SIGKILL)
    work(common, task, report)
