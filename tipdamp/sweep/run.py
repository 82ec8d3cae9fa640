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
from tipdamp.results.response_results import RespondResult
from tipdamp.results.static_results import TuneResult
from tipdamp.study.own_law import ALLOWED
from tipdamp.study.study import study_of
from tipdamp.study.toml_file import read_toml
from tipdamp.sweep.cases import cases_of
from tipdamp.sweep.dataset import units_of_keys, write_netcdf, write_table
from tipdamp.sweep.estimate import SweepEstimate, sweep_estimate
from tipdamp.sweep.index import CurveRow, Index
from tipdamp.sweep.plan import LAST, Plan, SweepStep, Task, plan
from tipdamp.sweep.work import SweepWork, product, products, read_member, warned, work

if TYPE_CHECKING:
    from tipdamp.sweep.cluster import Cluster

LONGEST = 2000  # letters of a reason
TOLD_EVERY = 2.0  # s
DAMAGED = (BadZipFile, LookupError, ValueError, TypeError)
ASSUMED = 8  # tasks of each process that what is assumed of it counts for
TRIES = 2  # of a task whose process ends unasked


def folder_of(store: Store) -> Path:
    """Folder of the sweep in a results folder."""
    return store.path("sweep")


def planned(path: Path) -> tuple[Plan, dict]:
    """The plan of the sweep of a study file, and its content."""
    content = read_toml(path)
    return plan(path, content, cases_of(study_of(path, content))), content


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
    with Store(folder).lock(), Index(folder, write=True) as index:
        shutil.rmtree(folder / "working", ignore_errors=True)  # of processes that were killed
        whole, content = planned(path)
        tell(sweep_estimate(whole, content, path, store, workers.jobs))
        index.begin(whole.cases, whole.last, whole.chains)
        units = units_of_keys(list(whole.cases[0]), content)
        index.say(study=str(path.absolute()), units=units, left=None)
        common = SweepWork(path.absolute(), content, folder.absolute(), ALLOWED.get())
        sweep = _Running(common, whole, index, workers.jobs)
        sweep.take_stock(retry)
        with display(quiet=quiet).job("sweep", patience=0.0) as tick:
            sweep.run(workers, tick)
    return [one for one in (write_table(folder), write_netcdf(folder)) if one]


class _Running:
    """A sweep that runs. tasks - those that can begin or have begun, in this order; the others
    wait in `needed_by` for what they need, `missing` has it by the key of their last step."""

    def __init__(self, common: SweepWork, whole: Plan, index: Index, jobs: int) -> None:
        self.common, self.whole, self.index = common, whole, index
        self.tasks: list[Task] = []
        self.made: set[str] = set()  # before it began
        self.missing: dict[str, set[str]] = {}
        self.needed_by: dict[str, list[Task]] = {}
        self.lost = Counter[str]()
        self.clock = Clock(index.costs(), jobs)
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
        levels = self.index.levels()
        for task in self.whole.tasks:
            to_make = [step for step in task.steps if step.key not in self.made | failed]
            if not to_make or any(step.key in failed for step in task.steps):
                continue
            self.clock.left.update(step.stage for step in to_make)
            alike = dict.fromkeys(levels[one] for one in task.last.levels if one in levels)
            task = replace(task, alike=tuple(alike))
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

    def run(self, workers: "Workers | Cluster", tick: Ticker) -> None:
        """Make all that waits."""
        self._show(tick)
        for i in workers.spread(work, self.common, self.tasks, lambda *_: None, self._failed):
            steps = self.tasks[i].steps
            entered = self._enter(steps)
            self.clock.made({step.stage: s for step, s in entered if step.key not in self.made})
            for step in steps:
                self.cases_left.pop(step.key, None)
                for task in self.needed_by.pop(step.key, ()):
                    lacking = self.missing.get(task.last.key, set())
                    lacking.discard(step.key)
                    if not lacking:
                        self.tasks.append(task)
            self._show(tick)

    def _enter(self, steps: Sequence[SweepStep]) -> list[tuple[SweepStep, float]]:
        """Finished steps into the index; returns the seconds that each took."""
        found, rows, folder = [], list[CurveRow](), self.common.folder
        said = list[tuple[str, str]]()
        for step in steps:
            record = json.loads(read_member(folder, step.key, f".stages/{step.stage}.json"))
            found.append((step, record["seconds"], product(folder, step.key).stat().st_size))
            warnings = json.loads(read_member(folder, step.key, warned(step.stage)))
            said += [(step.key, str(text)) for text in warnings]
            if step.stage == LAST:
                rows += curve_rows(folder, step)
        self.index.done(found, rows, said)
        return [(step, seconds) for step, seconds, _ in found]

    def _failed(self, i: int, error: Exception) -> None:
        """A task that could not be made is recorded with its reason, and all that needs it; a
        process that was lost is replaced, and what no process can mend ends the sweep."""
        task = self.tasks[i]
        if isinstance(error, ChildProcessError):
            self.lost[task.last.key] += 1
            if self.lost[task.last.key] < TRIES:
                self.tasks.append(task)
                return
        elif isinstance(error, OSError):
            raise error
        broken = {s.key: s.stage for s in task.steps if not self._is_made(s)}
        waiting = list(broken)
        while waiting:
            for later in self.needed_by.pop(waiting.pop(), ()):
                new = {s.key: s.stage for s in later.steps if s.key not in broken}
                waiting += new
                broken |= new
        self.clock.left.subtract(broken.values())
        for key in broken:
            self.missing.pop(key, None)
        self._give_up(broken)
        self.index.failed(broken.items(), _reason(error))

    def _give_up(self, keys: Iterable[str]) -> None:
        """Cases whose last step is among these have failed."""
        self.cases_failed += sum(self.cases_left.pop(key, 0) for key in keys)

    def _is_made(self, step: SweepStep) -> bool:
        return product(self.common.folder, step.key).is_file()

    def _show(self, tick: Ticker) -> None:
        cases, left = len(self.whole.cases), self.clock.seconds_left
        through, failed = cases - self.cases_left.total(), self.cases_failed
        said = f"{through - failed} of {cases} cases" + f", {failed} failed" * bool(failed)
        rest = "" if left is None or through == cases else f", about {duration(left)} left"
        tick(through / cases, f"{said}{rest}")
        if self.clock.due:
            self.index.say(left=left, told=time.time())


class Clock:
    """How long the rest takes: by the steps that are left, the mean of each stage, and the time
    that went by for those made here.

    costs - {stage: (number, mean s, ...)} of earlier steps; jobs - tasks at a time: all processes
    are taken to work until it is known better, for while what all cases need is made one does"""

    def __init__(self, costs: dict[str, tuple[int, float, float]], jobs: int = 1) -> None:
        self.jobs, self.tasks = jobs, 0
        self.left = Counter[str]()
        self.count = Counter({stage: n for stage, (n, _, _) in costs.items()})
        self.seconds = Counter({stage: n * s for stage, (n, s, _) in costs.items()})
        self.began: float | None = None  # when the first step was made: before, processes start
        self.told = time.monotonic()
        self.spent = 0.0

    def made(self, steps: dict[str, float]) -> None:
        """{stage: s} of steps that were made now."""
        self.left.subtract(steps.keys())
        self.count.update(steps.keys())
        self.seconds.update(steps)
        if self.began is None:
            self.began = time.monotonic()
            return
        self.spent += sum(steps.values())
        self.tasks += 1

    @property
    def seconds_left(self) -> float | None:
        """None before a second task is done, and while a stage that is left was never made."""
        left = {stage: n for stage, n in self.left.items() if n > 0}
        if self.began is None or not self.spent or not all(self.count[stage] for stage in left):
            return None
        work = sum(n * self.seconds[stage] / self.count[stage] for stage, n in left.items())
        went_by, assumed = time.monotonic() - self.began, ASSUMED * self.jobs
        pace = (assumed / self.jobs + self.tasks * went_by / self.spent) / (assumed + self.tasks)
        return work * pace

    @property
    def due(self) -> bool:
        """Whether readers of the index were told a moment ago."""
        now = time.monotonic()
        if now - self.told < TOLD_EVERY:
            return False
        self.told = now
        return True


def _reason(error: Exception) -> str:
    """Why a case failed, with the stage, in one line."""
    notes = [note for note in vars(error).get("__notes__", ()) if note.startswith("in the stage")]
    said = str(error) or type(error).__name__
    return shown(" ".join(f"{said} {' '.join(notes)}".split()), LONGEST)


def curve_rows(folder: Path, step: SweepStep) -> list[CurveRow]:
    """Curves of a finished case, a row for each and each patch."""
    found = RespondResult.model_validate_json(read_member(folder, step.key, RespondResult.file))
    tune = TuneResult.model_validate_json(read_member(folder, step.needs[-1], TuneResult.file))
    return [
        CurveRow(
            key=step.key,
            patch=patch,
            Fe_N=one.Fe_N,
            H=one.H,
            peak_m=peak.peak_m,
            peak_hz=peak.peak_hz,
            at_least_m=peak.at_least_m,
            at_least_hz=peak.at_least_hz,
            truncation=peak.truncation,
            complete=one.complete,
            unstable=one.unstable,
            slipping_pairs=len(one.slipping_pairs),
            kept_pairs=tune.kept_pairs,
            stuck_hz=tune.stuck_hz.tuned,
            ended=one.ended,
        )
        for one in found.responses
        for patch, peak in one.patches.items()
    ]
