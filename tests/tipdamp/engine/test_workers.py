"""Processes that work side by side: what they load, say and return, and how they end."""

import logging
import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest

from tipdamp.cli import main
from tipdamp.engine.workers import THREADS, Workers, default_jobs
from tipdamp.hbm.errors import InputError

HEAVY = ("petsc4py", "slepc4py", "dolfinx", "mpi4py", "gmsh", "matplotlib", "plotly")


def write(folder, task, report):
    """A file named after the task, with the process, its threads, and what it has loaded."""
    report(0.5, f"task {task}")
    text = [
        str(os.getpid()),
        *(os.environ[name] for name in THREADS),
        *(name for name in HEAVY if name in sys.modules),
    ]
    time.sleep(0.05)
    (folder / task).write_text(" ".join(text))


def fail(_, task, __):
    warnings.warn("it is about to fail", stacklevel=1)
    if task == "slow":
        time.sleep(60.0)
    elif task == "unasked":
        os._exit(7)
    raise InputError(f"{task}: cannot be done")


def test_processes_with_one_thread_and_no_finite_elements(tmp_path):
    heard = []
    with Workers(2) as workers:
        workers.begin(write, "")  # fails: the folder is no file
        done = list(
            workers.spread(write, tmp_path, list("abcdef"), lambda *said: heard.append(said))
        )
    written = [(tmp_path / name).read_text().split() for name in "abcdef"]
    assert sorted(done) == list(range(6)) and [w[1:] for w in written] == [["1"] * 3] * 6
    assert {w[0] for w in written} <= {w[0] for w in written} - {str(os.getpid())} and len(
        {w[0] for w in written}
    ) == 2
    assert (0, 0.5, "task a") in heard


def test_one_job_is_done_here(tmp_path, monkeypatch):
    for name in THREADS:
        monkeypatch.setenv(name, "1")
    assert list(Workers(1).spread(write, tmp_path, ["a", "b"], lambda *_: None)) == [0, 1]
    assert all((tmp_path / name).read_text().split()[0] == str(os.getpid()) for name in "ab")


def test_an_error_is_raised_here_and_stops_the_others(caplog):
    began = time.monotonic()
    with (
        caplog.at_level(logging.WARNING),
        pytest.raises(InputError, match="b: cannot be done") as raised,
        Workers(2) as workers,
    ):
        list(workers.spread(fail, None, ["slow", "b"], lambda *_: None))
    assert time.monotonic() - began < 30 and "in fail" in "".join(raised.value.__notes__)
    assert "it is about to fail" in caplog.text


def test_a_process_that_ends_unasked_is_named():
    with (
        pytest.raises(ChildProcessError, match=r"ended unasked \(exit code 7\).*fewer --jobs"),
        Workers(2) as workers,
    ):
        list(workers.spread(fail, None, ["slow", "unasked"], lambda *_: None))


def complain(_, __, ___):
    logging.getLogger("hbm").warning("compiling")


def test_what_several_processes_say_is_said_once(caplog):
    with Workers(2) as workers:
        list(workers.spread(complain, None, range(5), lambda *_: None))
    assert caplog.text.count("compiling") == 1


def sleep(folder, task, _):
    """Long at work without a report."""
    (folder / f"{task}.tmp").write_text(str(os.getpid()))
    (folder / f"{task}.tmp").rename(folder / task)
    time.sleep(600.0)


def use(folder):
    """What a process of its own does with two others."""
    with Workers(2) as workers:
        list(workers.spread(sleep, folder, ["a", "b"], lambda *_: None))


def test_no_process_outlives_the_one_that_uses_it(tmp_path):
    """SIGKILL while both are at work: they end long before their work."""
    program = (
        "from pathlib import Path; from tests.tipdamp.engine.test_workers import use; "
        f"use(Path('{tmp_path}'))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parents[3],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )
    began = time.monotonic()
    while not all((tmp_path / name).exists() for name in "ab"):
        assert process.poll() is None and time.monotonic() - began < 300
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    theirs = [Path("/proc", (tmp_path / name).read_text()) for name in "ab"]
    began = time.monotonic()
    while any((one / "exe").exists() for one in theirs):
        assert time.monotonic() - began < 60
        time.sleep(0.05)


def test_the_server_that_is_prepared_is_the_one_that_forks():
    program = (
        "from multiprocessing.forkserver import _forkserver as server\n"
        "from tipdamp.engine.workers import Workers, nothing\n"
        "Workers(1).prepare()\n"
        "assert server._forkserver_pid is None\n"
        "with Workers(2) as workers:\n"
        "    workers.prepare()\n"
        "    prepared = server._forkserver_pid\n"
        "    done = sorted(workers.spread(nothing, None, 'ab', lambda *_: None))\n"
        "print(done, prepared is not None and server._forkserver_pid == prepared)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program],
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
    )
    assert ended.stdout.split("\n")[0] == "[0, 1] True", ended.stderr


def test_number_of_jobs(monkeypatch, capsys, matrices_study):
    monkeypatch.setenv("TIPDAMP_JOBS", "3")
    assert default_jobs() == 3
    monkeypatch.delenv("TIPDAMP_JOBS")
    assert default_jobs() == len(os.sched_getaffinity(0))
    assert main(["respond", str(matrices_study), "--jobs", "0"]) == 2
    assert "--jobs 0: must be 1 or more" in capsys.readouterr().err
    monkeypatch.setenv("TIPDAMP_JOBS", "many")
    assert main(["respond", str(matrices_study)]) == 2
    assert "TIPDAMP_JOBS = 'many': must be a whole number" in capsys.readouterr().err


def test_a_signal_within_a_callback_of_compiled_code_ends_the_process():
    """Python cannot raise there: it would say so and go on."""
    program = (
        "import ctypes, os, signal, sys\n"
        "from tipdamp.engine.workers import _serve\n"
        "class Pipe:\n"
        "    def recv(self):\n"
        "        ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGTERM))()\n"
        "        print('went on')\n"
        "        raise EOFError\n"
        "import tipdamp.engine.workers as workers\n"
        "workers.parent_process = lambda: None\n"
        "workers._end_with = lambda parent: None\n"
        "_serve(Pipe())\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (143, "", "")


def test_a_server_of_processes_that_was_killed_is_started_anew(tmp_path):
    """SIGKILL to the process from which the others begin, before they do: the next one answers."""
    script = tmp_path / "run.py"
    script.write_text(
        "import os, signal\n"
        "from multiprocessing import forkserver\n"
        "from tipdamp.engine import workers\n"
        "if __name__ == '__main__':\n"
        "    with workers.Workers(2) as some:\n"
        "        some.prepare()\n"
        "        ask = forkserver.connect_to_new_process\n"
        "        def killed(fds):\n"
        "            forkserver.connect_to_new_process = ask\n"
        "            raise EOFError('unexpected EOF')\n"
        "        forkserver.connect_to_new_process = killed\n"
        "        print(list(some.spread(workers.nothing, None, [1], print)))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert done.stdout.strip().endswith("[0]"), done.stderr
