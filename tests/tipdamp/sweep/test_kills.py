"""A sweep whose processes are killed: what is finished stays as it is, and is not made again."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.robustness import counts
from tests.tipdamp.rig_study import CHAIN
from tests.tipdamp.sweep.dask_processes import scheduler, worker
from tipdamp.cli import main
from tipdamp.sweep.index import Index
from tipdamp.sweep.work import products

KILLS = int(os.environ.get("TIPDAMP_KILLS", "4"))
LEVELS = max(8, 2 * KILLS)  # so many that the sweep outlives the kills
SWEEP = f"""
[sweep.over]
model.pull = [60, 30, 20]
respond.levels = {{ start = 2, stop = 12, count = {LEVELS} }}
"""
VICTIMS = ("front process", "process") + ("scheduler", "worker") * bool(find_spec("distributed"))
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


def kill_front(study, folder, count):
    """Once so many steps are finished; False where the sweep ends before."""
    process = begun(study, "--jobs", "2")
    wait_for(folder, count, process)
    alive = process.poll() is None
    process.kill()
    process.communicate()
    return alive


def kill_process(study, folder, count):
    """As `kill_front`, one that computes; the front process goes on, and is killed later."""
    process = begun(study, "--jobs", "2")
    wait_for(folder, count, process)
    alive = process.poll() is None
    if alive:
        os.kill(at_work(process.pid)[-1], signal.SIGKILL)
        wait_for(folder, len(finished(folder)) + 2, process)
    process.kill()
    process.communicate()
    return alive


def kill_scheduler(study, folder, count):
    """As `kill_front`, the scheduler of two workers: the front process ends by itself."""
    with scheduler() as (victim, address), worker(address), worker(address):
        process = begun(study, "--scheduler", address)
        wait_for(folder, count, process)
        alive = process.poll() is None
        victim.kill()
        process.communicate(timeout=PATIENCE)
    return alive


def kill_worker(study, folder, count):
    """As `kill_process`, one of the two workers of a scheduler."""
    with scheduler() as (_, address), worker(address) as (victim, _), worker(address):
        process = begun(study, "--scheduler", address)
        wait_for(folder, count, process)
        alive = process.poll() is None
        victim.kill()
        wait_for(folder, len(finished(folder)) + 2, process)
        process.kill()
        process.communicate()
    return alive


KILL = {
    "front process": kill_front,
    "process": kill_process,
    "scheduler": kill_scheduler,
    "worker": kill_worker,
}


@pytest.mark.slow
def test_killed_processes_cost_the_running_case_alone(matrices_study):
    """The front process, one that computes, scheduler and worker of a cluster, killed in turn
    without warning: what was finished before is the same file at the end, and the numbers are those
    of a sweep in peace."""
    matrices_study.write_text(CHAIN + SWEEP)
    folder = matrices_study.parent / "results" / "study" / "sweep"
    before, lost = {}, Counter()
    for kill in range(KILLS):
        victim = VICTIMS[kill % len(VICTIMS)]
        if not KILL[victim](matrices_study, folder, len(before) + 3):
            break
        lost[victim] += 1
        now = finished(folder)
        assert before.items() <= now.items()  # not one was made again
        before = now
    assert lost.total() == KILLS and set(lost) == set(VICTIMS)
    cases = 3 * LEVELS
    assert f"{cases} of {cases} cases done, 0 failed" in begun(matrices_study).communicate()[0]
    assert before.items() <= finished(folder).items()
    assert len(finished(folder)) == 1 + 3 + 3 + cases
    killed = curves(folder)
    assert (
        main(["sweep", str(matrices_study), "--quiet", "--jobs", "1", "--out", str(folder / "p")])
        == 0
    )
    assert curves(folder / "p" / "sweep") == killed
    if "TIPDAMP_KILLS" in os.environ:
        counts.keep(
            "SIGKILL over tipdamp sweep",
            kills=KILLS,
            victims=", ".join(f"{victim} {count}" for victim, count in lost.items()),
            cases=cases,
            finished_steps_by_the_last_kill=len(before),
            finished_steps_made_again=0,
            cases_with_other_numbers=0,
        )


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
