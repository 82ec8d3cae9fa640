"""The tasks of a sweep on a cluster of dask.distributed: the same work for the same store, which
all its processes must see under the same path."""

import asyncio
import logging
import platform
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import numpy
import scipy

import tipdamp
from tipdamp.engine.workers import Failed, Work
from tipdamp.hbm.errors import InputError, shown
from tipdamp.stages.run import program_mark

ANSWER = 10.0  # s for a scheduler to answer
LOCAL = "local"
LEVEL = {
    "logging": dict.fromkeys(("distributed", "distributed.client"), "critical")
}  # what went wrong is said in one line, by us
# by default dask has every process give freed memory back to the system at once, and samples what
# it does a hundred times a second: a sixth of the time of a case
PROCESSES = {
    "distributed.nanny.pre-spawn-environ": {
        "OMP_NUM_THREADS": 1,
        "OPENBLAS_NUM_THREADS": 1,
        "MALLOC_ARENA_MAX": 1,  # tasks run in a thread beside the main one
    },
    "distributed.worker.profile.enabled": False,
}


class Cluster:
    """Processes of a cluster, used as `engine.workers.Workers`: jobs - their number."""

    at_once = False  # tasks wait at the scheduler

    def __init__(self, client: Any, jobs: int) -> None:
        self.client, self.jobs = client, jobs

    def spread(
        self,
        work: Work,
        common: Any,
        tasks: Sequence[Any],
        _: Callable[[int, float, str], None],
        failed: Failed,
    ) -> Iterator[int]:
        """As `Workers.spread`; what runs does not report, see `work.at_work`."""
        from distributed import as_completed

        running, index, mine = as_completed(loop=self.client.loop), dict[Any, int](), versions()

        def submit() -> None:
            for i in range(len(index), len(tasks)):
                call = _one, work, common, tasks[i], mine
                future = self.client.submit(*call, pure=False, priority=-i)
                index[future] = i
                running.add(future)

        submit()
        for future in running:
            i = index[future]
            if future.status == "finished":
                future.release()  # else it is made again when the process is lost that made it
                yield i
            elif future.status == "error":
                failed(i, future.exception())
            else:
                raise ConnectionError(
                    f"the scheduler {self.client.scheduler.address} has gone; finished cases are "
                    "kept, run the same command to continue"
                )
            submit()


def _one(work: Work, common: Any, task: Any, wanted: dict[str, str]) -> None:
    """A task, in a process of the cluster, which may have joined only now."""
    if versions() != wanted:
        raise InputError(f"a process of the cluster has {_difference(versions(), wanted)}")
    work(common, task, lambda *_: None)


def versions() -> dict[str, str]:
    """What must be the same everywhere for the same numbers."""
    return {
        "python": platform.python_version(),
        **{one.__name__: one.__version__ for one in (numpy, scipy, numba, tipdamp)},
        "sources of tipdamp": program_mark(False),
    }


def _difference(theirs: dict[str, str], ours: dict[str, str]) -> str:
    return ", ".join(
        f"{k} {theirs.get(k)}, here {v}" for k, v in ours.items() if theirs.get(k) != v
    )


@contextmanager
def cluster(address: str, jobs: int, folder: Path) -> Iterator[Cluster]:
    """The cluster of a scheduler, or with 'local' one of so many processes on this machine.

    InputError where it does not answer, has no processes, or has some of other versions or without
    sight of the folder."""
    import dask

    with dask.config.set(LEVEL):
        from distributed import Client, LocalCluster  # it takes its logging from there

        if address == LOCAL:
            options = {"threads_per_worker": 1, "silence_logs": logging.CRITICAL}
            with (
                dask.config.set(PROCESSES),
                LocalCluster(n_workers=jobs, **options) as own,
                Client(own) as client,
            ):
                yield Cluster(client, jobs)
            return
        _check_address(address)
        try:
            asyncio.run(asyncio.wait_for(_ask(address), ANSWER))
            client = Client(address, timeout=ANSWER, set_as_default=False)
        except Exception as error:  # whatever comes of what another program says
            said = shown(" ".join(str(error).split()) or "silence", 200)
            if isinstance(error, MemoryError):  # of its words, read as the length of a message
                said = "something else does"
            raise InputError(
                f"--scheduler {address}: no scheduler of dask answers there within {ANSWER:g} s "
                f"({said}); start one with: dask scheduler"
            ) from None
        with client:
            yield Cluster(client, _checked(client, address, folder))


async def _ask(address: str) -> None:
    """Before a client is made, which has no limit of time for what accepts and stays silent;
    ConnectionError where something else than a scheduler answers."""
    from distributed import Security
    from distributed.core import rpc

    async with rpc(address, connection_args=Security().get_connection_args("client")) as there:
        answer = await there.identity()
    if answer.get("type") != "Scheduler":
        raise ConnectionError(f"a {answer.get('type')} does")


def _check_address(address: str) -> None:
    """Before a client is made: one that fails at its address says so in a traceback of its own."""
    from distributed.comm import get_address_host_port

    try:
        get_address_host_port(address if "://" in address else f"tcp://{address}")
    except ValueError as error:
        raise InputError(
            f"--scheduler {shown(address)}: is no address ({shown(error)}); such as "
            f"tcp://host:8786, or {LOCAL}"
        ) from None


def _checked(client: Any, address: str, folder: Path) -> int:
    """Number of the processes, after all of them were asked."""
    try:
        found = client.run(_look, str(folder.absolute()))
    except (ImportError, AttributeError) as error:
        raise InputError(
            f"--scheduler {address}: its processes cannot load this version of tipdamp ({error}); "
            "install the same there"
        ) from None
    if not found:
        raise InputError(
            f"--scheduler {address}: has no processes that work; start some with: dask worker "
            f"{address} --nthreads 1"
        )
    for name, (theirs, sees) in found.items():
        if wrong := _difference(theirs, versions()):
            raise InputError(
                f"--scheduler {address}: {name} has {wrong}: numbers would differ; install the "
                "same there"
            )
        if not sees:
            raise InputError(
                f"--scheduler {address}: {name} does not see {folder.absolute()}: the results "
                "folder must be on a disk that all processes share"
            )
    return len(found)


def _look(folder: str) -> tuple[dict[str, str], bool]:
    return versions(), Path(folder).is_dir()
