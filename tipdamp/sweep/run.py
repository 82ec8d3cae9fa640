"""Run a sweep: what is missing of its cases, side by side; what is finished is in the store and in
the index."""

import json
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile

from tipdamp.engine.progress import Ticker, display, duration
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Workers
from tipdamp.hbm.errors import shown
from tipdamp.study.own_law import ALLOWED
from tipdamp.study.study import study_of
from tipdamp.study.toml_file import read_toml
from tipdamp.sweep.cases import cases_of
from tipdamp.sweep.dataset import units_of_keys, write_netcdf, write_table
from tipdamp.sweep.estimate import SweepEstimate, sweep_estimate
from tipdamp.sweep.index import Index
from tipdamp.sweep.plan import Plan, SweepStep, Task, plan
from tipdamp.sweep.queue import Queue
from tipdamp.sweep.rows import Row, rows_of
from tipdamp.sweep.time_left import Clock
from tipdamp.sweep.work import SweepWork, product, products, read_member, warned, work

if TYPE_CHECKING:
    from tipdamp.sweep.cluster import Cluster

LONGEST = 2000  # letters of a reason
DAMAGED = (BadZipFile, LookupError, ValueError, TypeError)
TRIES = 2  # of a task whose process ends unasked


def folder_of(store: Store) -> Path:
    """Folder of the sweep in a results folder."""
    return store.path("sweep")


def planned(path: Path, *, quiet: bool = False) -> tuple[Plan, dict]:
    """The plan of the sweep of a study file, and its content."""
    content = read_toml(path)
    cases = cases_of(study_of(path, content))
    with display(quiet=quiet).job("plan") as tick:
        return plan(path, content, cases, tick), content


def run_sweep(
    path: str | Path,
    store: Store,
    workers: "Workers | Cluster",
    *,
    quiet: bool = False,
    retry: bool = False,
    tell: Callable[[SweepEstimate], object] = lambda _: None,
) -> list[Path]:
    """Make what is missing of the sweep of a study file; the files of all its results.

    store - the results folder, the sweep is in its folder `sweep`; retry - whether what failed is
    tried again; tell - is given the estimate before anything is made

    Raises BlockingIOError while another sweep works there; OSError where the disk is full."""
    path, folder = Path(path), folder_of(store)
    with Store(folder).lock():
        shutil.rmtree(folder / "working", ignore_errors=True)  # of processes that were killed
        whole, content = planned(path, quiet=quiet)
        tell(sweep_estimate(whole, content, path, store, workers.jobs))
        units = units_of_keys(list(whole.cases[0]), content)
        common = SweepWork(path.absolute(), content, folder.absolute(), ALLOWED.get())
        with Index(folder, write=True) as index:  # none of a study that is refused
            index.begin(whole.cases, whole.last, whole.chains)
            index.say(units=units, left=None)
            sweep = _Running(common, whole, index, workers)
            sweep.take_stock(retry)
            with display(quiet=quiet).job("sweep", patience=0.0) as tick:
                sweep.run(tick)
    return [one for one in (write_table(folder), write_netcdf(folder)) if one]


class _Running:
    """A sweep that runs. tasks - those that have begun or can begin; the others wait in `needed_by`
    for what they need, `missing` has it by the key of their last step."""

    def __init__(
        self, common: SweepWork, whole: Plan, index: Index, workers: "Workers | Cluster"
    ) -> None:
        self.common, self.whole, self.index, self.workers = common, whole, index, workers
        self.clock = Clock(whole.tasks, workers.jobs, index.seconds())
        self.tasks = Queue(self.clock, workers.at_once)
        self.made: set[str] = set()  # before it began
        self.missing: dict[str, set[str]] = {}
        self.needed_by: dict[str, list[Task]] = {}
        self.lost = Counter[str]()
        self.cases_left, self.cases_failed = Counter(whole.last), 0

    def take_stock(self, retry: bool) -> None:
        """The index follows the finished steps; what failed before is left, or tried again."""
        states, there = self.index.states(), products(self.common.folder)
        self.index.forget(
            key
            for key, state in states.items()
            if state == "done" and key not in there or state == "failed" and retry
        )
        self.made = {s.key for s in self.whole.steps if s.key in there and self._known(s, states)}
        failed = {key for key, state in states.items() if state == "failed" and not retry}
        failed -= self.made
        for key in self.made:
            self.cases_left.pop(key, None)
        self._give_up(failed)
        levels, settled = self.index.levels(), self.made | failed
        for task in self.whole.tasks:
            to_make = [step.key for step in task.steps if step.key not in settled]
            if to_make and not any(step.key in failed for step in task.steps):
                self.clock.wait_for(to_make)
                own = (one for step in task.steps for one in step.levels)
                alike = dict.fromkeys(levels[one] for one in own if one in levels)
                self._begin_or_wait(replace(task, alike=tuple(alike)))

    def _begin_or_wait(self, task: Task) -> None:
        """It can begin, unless it needs what is still to be made."""
        if lacking := {step.key for step in task.before} - self.made:
            self.missing[task.last.key] = lacking
            for key in lacking:
                self.needed_by.setdefault(key, []).append(task)
        else:
            self.tasks.append(task)

    def _known(self, step: SweepStep, states: dict[str, str]) -> bool:
        """Whether a finished step is in the index, or could be entered; a damaged one is
        removed."""
        if states.get(step.key) == "done":
            return True
        try:
            self._enter([step])
        except DAMAGED:
            product(self.common.folder, step.key).unlink()
            return False
        return True

    def run(self, tick: Ticker) -> None:
        """Make all that waits."""
        self._show(tick)
        spread = self.workers.spread
        for i in spread(work, self.common, self.tasks, lambda *_: None, self._failed):
            task = self.tasks[i]
            self.clock.end(task, {step.key: s for step, s in self._enter(task.steps)})
            for step in task.steps:
                self.cases_left.pop(step.key, None)
                for later in self.needed_by.pop(step.key, ()):
                    lacking = self.missing.get(later.last.key, set())
                    lacking.discard(step.key)
                    if not lacking:
                        self.tasks.append(later)
            self._show(tick)
        self._show(tick)  # what failed after the last that was made

    def _enter(self, steps: Sequence[SweepStep]) -> list[tuple[SweepStep, float]]:
        """Finished steps into the index; returns the seconds that each took."""
        found, rows, folder = [], list[Row](), self.common.folder
        said = list[tuple[str, str]]()
        for step in steps:
            record = json.loads(read_member(folder, step.key, f".stages/{step.stage}.json"))
            found.append((step, record["seconds"], product(folder, step.key).stat().st_size))
            warnings = json.loads(read_member(folder, step.key, warned(step.stage)))
            said += [(step.key, str(text)) for text in warnings]
            rows += rows_of(folder, step)
        self.index.done(found, rows, said)
        return [(step, seconds) for step, seconds, _ in found]

    def _failed(self, i: int, error: Exception) -> None:
        """A task that could not be made is recorded with its reason, and all that needs it; a
        process that was lost is replaced, and what no process can mend ends the sweep."""
        task = self.tasks[i]
        self.clock.end(task, {})
        if isinstance(error, ChildProcessError):
            self.lost[task.last.key] += 1
            if self.lost[task.last.key] < TRIES:
                self.tasks.append(task)
                return
        elif isinstance(error, OSError):
            raise error
        made = [s for s in task.steps if self._is_made(s)]
        if mine := [s for s in made if s.key not in self.made]:
            self.clock.end(task, {step.key: s for step, s in self._enter(mine)})
        broken = self._with_what_needs_it({s.key: s.stage for s in task.steps if s not in made})
        self.clock.forget([*broken, *(step.key for step in task.steps)])
        for key in broken:
            self.missing.pop(key, None)
        self._give_up(broken)
        self.index.failed(broken.items(), _reason(error))

    def _with_what_needs_it(self, broken: dict[str, str]) -> dict[str, str]:
        """{key: stage} of steps that will not be made, and of all that need them."""
        waiting = list(broken)
        while waiting:
            for later in self.needed_by.pop(waiting.pop(), ()):
                new = {s.key: s.stage for s in later.steps if s.key not in broken}
                waiting += new
                broken |= new
        return broken

    def _give_up(self, keys: Iterable[str]) -> None:
        """Cases whose last step is among these have failed."""
        self.cases_failed += sum(self.cases_left.pop(key, 0) for key in keys)

    def _is_made(self, step: SweepStep) -> bool:
        return product(self.common.folder, step.key).is_file()

    def _show(self, tick: Ticker) -> None:
        cases, left = len(self.whole.cases), self.clock.seconds_left
        self.index.say(left=left, told=time.time())
        through, failed = cases - self.cases_left.total(), self.cases_failed
        said = f"{through - failed} of {cases} cases" + f", {failed} failed" * bool(failed)
        rest = "" if left is None or through == cases else f", about {duration(left)} left"
        tick(through / cases, f"{said}{rest}")


def _reason(error: Exception) -> str:
    """Why a case failed, with the stage, in one line."""
    notes = [note for note in vars(error).get("__notes__", ()) if note.startswith("in the stage")]
    said = str(error) or type(error).__name__
    return shown(" ".join(f"{said} {' '.join(notes)}".split()), LONGEST)
