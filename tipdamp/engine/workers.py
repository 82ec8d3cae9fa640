"""Processes that work side by side, each with one BLAS thread.

They are forked from a server that has loaded the equations and nothing of the finite elements, and
end with the process that uses them, however that ends.
"""

import logging
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from multiprocessing import connection, forkserver, get_context, parent_process
from multiprocessing.context import ForkServerContext
from types import ModuleType, TracebackType
from typing import Any

from tipdamp.hbm.errors import InputError

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
PRELOADED = "tipdamp.engine.further"  # with all that it imports
BETWEEN = 0.1  # s between two reports of a task
PATIENCE = 10.0  # s for a process to keep what it has and end

Report = Callable[[float, str], None]  # share done, figures
Work = Callable[[Any, Any, Report], None]  # (what all tasks have in common, a task, report)
Failed = Callable[[int, Exception], None]  # (index of a task, what ended it)


def default_jobs() -> int:
    """TIPDAMP_JOBS where it is set, else the cores that this process may use; InputError for
    anything but a number."""
    given = os.environ.get("TIPDAMP_JOBS", "")
    if not given:
        return len(os.sched_getaffinity(0))
    if not given.isdecimal() or int(given) < 1:
        raise InputError(f"TIPDAMP_JOBS = '{given}': must be a whole number, 1 or more")
    return int(given)


class Workers:
    """Up to `jobs` processes, started when there is work for them; with one job the work is done in
    this process, with the BLAS threads that it has (`respond` leaves it one).

    with Workers(2) as workers:
        for i in workers.spread(work, common, tasks, report): ...
    """

    at_once = True  # a task is begun when it is taken from the sequence

    def __init__(self, jobs: int = 1) -> None:
        self.jobs = jobs
        self.idle: list[_Worker] = []
        self.busy: dict[connection.Connection, tuple[_Worker, int]] = {}
        self.said: set[tuple] = set()

    def __enter__(self) -> "Workers":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _: BaseException | None, __: TracebackType | None
    ) -> None:
        started = [*self.idle, *(worker for worker, _ in self.busy.values())]
        for worker in started:
            worker.end(at_once=bool(self.busy))
        for worker in started:
            worker.wait()
        self.idle, self.busy = [], {}

    def prepare(self) -> None:
        """Let the server load what the processes need, and go on."""
        if self.jobs > 1:
            with _apart():
                _forked()
                forkserver.ensure_running()

    def begin(self, work: Work, task: Any) -> None:
        """Start a task in a process of its own and go on; what becomes of it is not waited for."""
        worker = _Worker()
        worker.start(work, None, task)
        self.busy[worker.pipe] = worker, -1

    def spread(
        self,
        work: Work,
        common: Any,
        tasks: Sequence[Any],
        report: Callable[[int, float, str], None],
        failed: Failed | None = None,
    ) -> Iterator[int]:
        """Indices of the tasks as they are finished; report(index, share done, figures) of those
        that run. Tasks that are appended meanwhile are done, too.

        An error of a task, or the end of its process, is handed to `failed` and the others go on;
        without it it is raised here, and those that run beside it are stopped.
        """
        while any(i < 0 for _, i in self.busy.values()):  # begun before: kernels that all need
            for pipe in connection.wait(list(self.busy)):
                yield from self._heard(pipe, report, failed)
        if self.jobs == 1:
            # arrays lie in memory as elsewhere: the same to the last bit
            common = pickle.loads(pickle.dumps(common))
            for i, task in enumerate(tasks):
                try:
                    work(common, task, partial(report, i))
                except Exception as error:
                    if failed is None:
                        raise
                    failed(i, error)
                    continue
                yield i
            return
        begun = 0
        while begun < len(tasks) or self.busy:
            while begun < len(tasks) and (self.idle or len(self.busy) < self.jobs):
                worker = self.idle.pop() if self.idle else _Worker()
                self.busy[worker.pipe] = worker, begun
                worker.start(work, common, tasks[begun])
                begun += 1
            for pipe in connection.wait(list(self.busy)):
                yield from self._heard(pipe, report, failed)

    def _heard(self, pipe: Any, report: Callable, failed: Failed | None) -> Iterator[int]:
        worker, i = self.busy[pipe]
        try:
            what, *content = worker.hear()
        except ChildProcessError as error:
            if failed is None or i < 0:
                raise
            del self.busy[pipe]
            failed(i, error)
            return
        if what == "report" and i >= 0:
            report(i, *content)
        elif what == "said":
            name, level, text = content
            if (name, text) in self.said:  # each process compiles, or warns of the same model
                return
            self.said.add((name, text))
            logging.getLogger(name).log(level, text)
        elif what == "failed" and i >= 0:
            if failed is None:
                raise content[0]
            del self.busy[pipe]
            self.idle.append(worker)
            failed(i, content[0])
        elif what in ("done", "failed"):
            del self.busy[pipe]
            self.idle.append(worker)
            if i >= 0:
                yield i


def nothing(_: Any, __: Any, ___: Report) -> None:
    """Work that tells whether a process can be started."""


class _Worker:
    """A process and the pipe to it; what it has been given in common with earlier tasks is not sent
    again."""

    def __init__(self) -> None:
        context = _forked()
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self.common: Any = None
        with _apart():
            self._begin()
        theirs.close()

    def _begin(self) -> None:
        """Where the server of processes was killed it is started anew, once."""
        try:
            self.process.start()
        except (EOFError, ConnectionError):
            forkserver.ensure_running()
            self.process.start()

    def start(self, work: Work, common: Any, task: Any) -> None:
        """Hand a task over."""
        if common is not self.common:
            self.pipe.send(("common", common))
            self.common = common
        self.pipe.send((work, task))

    def hear(self) -> tuple:
        """The next message; ChildProcessError where the process has ended."""
        try:
            return self.pipe.recv()
        except (EOFError, ConnectionError):
            self.process.join(PATIENCE)
            raise ChildProcessError(
                f"a process at work ended unasked (exit code "
                f"{self.process.exitcode}), perhaps for want of memory; run the same command with "
                "fewer --jobs"
            ) from None

    def end(self, at_once: bool) -> None:
        """Ask it to end; at once where it may be at work: what it has is kept."""
        self.pipe.close()
        if at_once:
            self.process.terminate()

    def wait(self) -> None:
        """Until it has ended."""
        self.process.join(PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


def _forked() -> ForkServerContext:
    """Processes forked from a server with all that is PRELOADED."""
    context = get_context("forkserver")
    context.set_forkserver_preload([PRELOADED])
    return context


@contextmanager
def _apart() -> Iterator[None]:
    """For a process that is started now: one thread in its environment, and no main program that it
    would run again."""
    before = {name: os.environ.get(name) for name in THREADS}
    main = sys.modules["__main__"]
    os.environ.update(dict.fromkeys(THREADS, "1"))
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


class _Forwarded(logging.Handler):
    """Log records, sent to the process that shows them."""

    def __init__(self, pipe: connection.Connection) -> None:
        super().__init__()
        self.pipe = pipe

    def emit(self, record: logging.LogRecord) -> None:
        self.pipe.send(("said", record.name, record.levelno, record.getMessage()))


def _unraisable(error: Any) -> None:
    """A signal while compiled code calls back cannot be raised through it, and would be lost with
    a traceback: the process ends there."""
    if issubclass(error.exc_type, SystemExit):
        os._exit(128 + signal.SIGTERM)
    sys.__unraisablehook__(error)


def _serve(pipe: connection.Connection) -> None:
    """What a process does until its pipe is closed: one task after the other."""
    # of the terminal: the process that uses this one decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    sys.unraisablehook = _unraisable
    threading.Thread(target=_end_with, args=(parent_process(),), daemon=True).start()
    logging.captureWarnings(True)
    logging.getLogger().handlers = [_Forwarded(pipe)]
    common = None
    try:
        while True:
            work, task = pipe.recv()
            if work == "common":
                common = task
                continue
            try:
                work(common, task, _reporter(pipe))
                pipe.send(("done",))
            except ConnectionError:  # nobody listens any more
                raise
            except Exception as error:
                error.add_note(traceback.format_exc())
                pipe.send(("failed", error))
    except (EOFError, ConnectionError):
        pass


def _end_with(user: Any) -> None:
    """Terminate this process when the one that uses it has ended, however that ended: else one that
    is long at work would notice nothing before its next report."""
    connection.wait([user.sentinel])
    os.kill(os.getpid(), signal.SIGTERM)


def _reporter(pipe: connection.Connection) -> Callable:
    """What tells the using process of progress, now and then."""
    told = [0.0]

    def report(share: float | None, figures: str) -> None:
        if time.monotonic() - told[0] >= BETWEEN:
            told[0] = time.monotonic()
            pipe.send(("report", share, figures))

    return report
