"""Sweeps on a cluster of dask.distributed: the same numbers, and answers in one line."""

import os
import shutil
import signal
import socket
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

import tipdamp
from tests.tipdamp.rig_study import CHAIN
from tests.tipdamp.sweep.dask_processes import scheduler, worker
from tipdamp.cli import main
from tipdamp.sweep import cluster
from tipdamp.sweep.index import Index

distributed = pytest.importorskip("distributed")
SWEEP = """
[sweep.over]
model.pull = [60, 30]
respond.levels = [5, 8]
"""


@pytest.fixture
def sweep(matrices_study):
    matrices_study.write_text(CHAIN + SWEEP)
    return matrices_study


def swept(path, *options):
    return main(["sweep", str(path), "--quiet", *options])


def curves(folder):
    with Index(folder / "sweep") as index:
        return index.curves()


@pytest.mark.slow
def test_the_same_cases_and_numbers(sweep, tmp_path):
    assert swept(sweep, "--jobs", "1", "--out", str(tmp_path / "here")) == 0
    options = ["--scheduler", "local", "--jobs", "2", "--out", str(tmp_path / "there")]
    assert swept(sweep, *options) == 0
    assert curves(tmp_path / "there") == curves(tmp_path / "here")


@pytest.mark.slow
def test_processes_of_their_own_give_the_same_table(sweep, tmp_path, capsys):
    """A scheduler and two workers that were started apart, as on other machines: sweep.csv is that
    of one job, byte for byte. One more, whose sources are others, is refused in one line."""
    with scheduler() as (_, address), worker(address), worker(address):
        out = ["--out", str(tmp_path / "there")]
        assert swept(sweep, "--scheduler", address, *out) == 0
        capsys.readouterr()
        with worker(address, other_sources(tmp_path)):
            assert swept(sweep, "--scheduler", address, *out) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and "has sources of tipdamp" in error
    assert swept(sweep, "--jobs", "1", "--out", str(tmp_path / "here")) == 0
    there, here = (tmp_path / name / "sweep" / "sweep.csv" for name in ("there", "here"))
    assert there.read_bytes() == here.read_bytes()


def other_sources(folder):
    """A copy of the program with a comment more."""
    copy = folder / "other" / "tipdamp"
    no_cache = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(tipdamp.__file__).parent, copy, ignore=no_cache)
    with (copy / "sweep" / "work.py").open("a") as file:
        file.write("# of another version\n")
    return copy.parent


@pytest.mark.slow
def test_a_scheduler_that_is_killed_costs_no_finished_case(sweep, tmp_path, capsys):
    """One line; on a new one, or here, the sweep goes on with what is there."""
    from multiprocessing import get_context

    ready = get_context("spawn").Queue()
    process = get_context("spawn").Process(target=own_cluster, args=(ready,))
    process.start()
    address = ready.get(timeout=60)
    at_three = get_context("spawn").Process(
        target=kill_at, args=(process.pid, str(tmp_path / "r" / "sweep"), 3)
    )
    at_three.start()
    out = ["--out", str(tmp_path / "r")]
    assert swept(sweep, "--scheduler", address, *out) == 4
    assert "has gone; finished cases are kept" in capsys.readouterr().err
    made = {p: p.stat().st_mtime_ns for p in (tmp_path / "r" / "sweep" / "made").rglob("*.zip")}
    assert len(made) >= 3
    assert swept(sweep, "--jobs", "1", *out) == 0
    assert all(p.stat().st_mtime_ns == at for p, at in made.items())
    at_three.join()


def own_cluster(ready):
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp://"
    ) as made:
        ready.put(made.scheduler_address)
        time.sleep(300)


def kill_at(pid, folder, count):
    from tipdamp.sweep.work import products

    for _ in range(12000):
        if len(products(Path(folder))) >= count:
            break
        time.sleep(0.01)
    os.kill(pid, signal.SIGKILL)


@pytest.mark.slow
def test_a_worker_that_is_lost_takes_no_finished_task_along(tmp_path):
    """dask makes again what a lost process held, as long as somebody keeps it."""
    log = tmp_path / "log"
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False) as own,
        distributed.Client(own) as client,
    ):
        done = cluster.Cluster(client, 2).spread(noted, log, range(6), None, None)
        ended = [next(done) for _ in range(5)]
        time.sleep(0.5)
        own.sync(next(one for one in own.workers.values() if not one.state.executing).close)
        ended += done
    assert sorted(ended) == list(range(6))
    assert sorted(map(int, log.read_text().split())) == list(range(6))


def noted(log, task, report):
    """Work that says which task it was given; the last one takes long."""
    time.sleep(2.0 * (task == 5))
    with log.open("a") as file:
        file.write(f"{task}\n")


def test_nobody_answers(sweep, monkeypatch, capsys):
    monkeypatch.setattr(cluster, "ANSWER", 1.0)
    assert swept(sweep, "--scheduler", "tcp://127.0.0.1:9") == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "no scheduler of dask answers there within 1 s" in error
    assert swept(sweep, "--scheduler", "nonsense://x") == 2


@contextmanager
def listening(answer):
    """Address at which a port accepts every connection and answers so, or is silent."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def accept():
            with ExitStack() as kept, suppress(OSError):  # until it is shut down
                while True:
                    connection = kept.enter_context(server.accept()[0])
                    if answer:
                        connection.sendall(answer)

        thread = threading.Thread(target=accept)
        thread.start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
        server.shutdown(socket.SHUT_RDWR)
        thread.join()


@pytest.mark.parametrize(
    "answer, told",
    [(b"", "("), (b"HTTP/1.1 400 Bad Request\r\n\r\n", "(something else does)")],
    ids=["silent", "HTTP"],
)
def test_something_else_listens_there(sweep, monkeypatch, capfd, answer, told):
    """A port that accepts and says nothing is not waited for longer than one that is closed; what
    another protocol says is not read as the length of a message."""
    monkeypatch.setattr(cluster, "ANSWER", 1.0)
    began = time.monotonic()
    with listening(answer) as address:
        assert swept(sweep, "--scheduler", address) == 2
    assert time.monotonic() - began < 10.0
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert f"no scheduler of dask answers there within 1 s {told}" in error


@pytest.mark.slow
def test_a_worker_is_no_scheduler(sweep, monkeypatch, capfd):
    with scheduler() as (_, address), worker(address) as (_, own):
        assert swept(sweep, "--scheduler", own) == 2
    error = capfd.readouterr().err
    assert error.count("\n") == 1 and "(a Worker does)" in error


@pytest.mark.parametrize("address", ["nonsense", "host", "tcp://host", "nonsense://x"])
def test_an_address_that_is_none_is_not_waited_for(sweep, capsys, monkeypatch, address):
    """Without a client, which would end in a traceback of its own after 20 s."""
    monkeypatch.setattr("distributed.Client", None)
    assert swept(sweep, "--scheduler", address) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"--scheduler {address}: is no address" in error


@pytest.mark.parametrize(
    "found, answer",
    [
        ({}, "has no processes that work"),
        (
            {"tcp://w": ({**cluster.versions(), "numpy": "1.0"}, True)},
            "tcp://w has numpy 1.0, here",
        ),
        ({"tcp://w": (cluster.versions(), False)}, "tcp://w does not see"),
    ],
)
def test_processes_that_cannot_be_used(found, answer, tmp_path):
    """Of other versions, without sight of the results, or none."""

    class Client:
        def run(self, *_):
            return found

    with pytest.raises(cluster.InputError, match=answer):
        cluster._checked(Client(), "tcp://scheduler", tmp_path)


def test_a_process_that_joins_late_is_checked_too():
    wanted = {**cluster.versions(), "numpy": "1.0"}
    with pytest.raises(cluster.InputError, match="here 1.0"):
        cluster._one(None, None, None, wanted)
