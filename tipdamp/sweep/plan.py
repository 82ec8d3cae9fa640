"""What a sweep consists of: the steps of its cases, each one known by the content that it follows
from, so that cases share what is the same."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from typing import Any

from tipdamp.engine.progress import Tick
from tipdamp.engine.store import fingerprint
from tipdamp.hbm.errors import InputError
from tipdamp.stages.run import STAGES, all_needed, applies, read_from, stages_needed
from tipdamp.study.view import Study
from tipdamp.sweep.cases import Case, study_of_case
from tipdamp.sweep.order import order_of_work, places

CURVES = "respond"  # stage of the curves, which every case has
STRESS = "stress"  # stage that follows it where the study asks for it
# its keys that choose among curves, and change none
CHOICE = tuple(
    f"[respond] {key}" for key in ("levels", "harmonics", "tolerance", "search", "both_ways")
)


@dataclass(frozen=True)
class SweepStep:
    """One stage of one case or of several; key - of all that it follows from; needs - keys of the
    steps that its stage reads; levels - of the curves: for each level a key of what they follow
    from, so that steps which have one in common have the same curves there."""

    stage: str
    key: str
    needs: tuple[str, ...]
    levels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Task:
    """What one process does at a time: steps that no other case has, or a single one that several
    share; before - steps whose products it needs; case - values of one that it belongs to;
    alike - keys of finished steps that have some of its curves."""

    steps: tuple[SweepStep, ...]
    before: tuple[SweepStep, ...]
    case: Case
    turn: int = 0
    alike: tuple[str, ...] = ()

    @property
    def last(self) -> SweepStep:
        """The step that it ends with."""
        return self.steps[-1]


@dataclass(frozen=True)
class Plan:
    """cases, with the key of the last step of each; tasks, each after those that it needs, in the
    order in which they are made: that of `order_of_work`."""

    cases: tuple[Case, ...]
    last: tuple[str, ...]
    tasks: tuple[Task, ...]

    @property
    def steps(self) -> Iterator[SweepStep]:
        """All of them, each once."""
        for task in self.tasks:
            yield from task.steps

    @property
    def chains(self) -> dict[str, tuple[str, ...]]:
        """{key of the last step of a case: keys of all its steps}."""
        ends = set(self.last)
        return {
            task.last.key: tuple(step.key for step in (*task.before, *task.steps))
            for task in self.tasks
            if task.last.key in ends
        }


def plan(path: Path, content: dict, cases: Sequence[Case], tick: Tick = lambda *_: None) -> Plan:
    """The steps of all cases of a study file with this content; tick - is told the share of the
    cases that are read. InputError where one of them is no valid study."""
    checked, known = dict[tuple, Any](), dict[tuple, Any]()
    chains = []
    for number, case in enumerate(cases, 1):
        chains.append(chain(study_of_case(path, content, number, case, checked), known))
        tick(number / len(cases), f"{number} of {len(cases)} cases")
    last = tuple(chain[-1].key for chain in chains)
    return Plan(tuple(cases), last, tuple(_tasks(cases, chains)))


def _tasks(cases: Sequence[Case], chains: Sequence[list[SweepStep]]) -> list[Task]:
    """Those of the cases with these steps, in the order in which they are made."""
    first = dict[str, int]()  # of cases that are the same
    for i, steps in enumerate(chains):
        first.setdefault(steps[-1].key, i)
    mine = list(first.values())
    shared = Counter(step.key for i in mine for step in chains[i])
    tasks: dict[str, Task] = {}
    for i in (mine[turn] for turn in order_of_work(places([cases[i] for i in mine]))):
        for some in _tasks_of(chains[i], shared):
            key = some[-1].key
            if key not in tasks:
                tasks[key] = Task(some, _before(some, chains[i]), cases[i], len(tasks))
    return list(tasks.values())


def _tasks_of(chain: Sequence[SweepStep], shared: Mapping[str, int]) -> list[tuple[SweepStep, ...]]:
    """The steps of a case that others share, each alone, and its own together."""
    own = tuple(step for step in chain if shared[step.key] == 1)
    return [*((step,) for step in chain if shared[step.key] > 1), *([own] if own else [])]


def _before(steps: Sequence[SweepStep], chain: Sequence[SweepStep]) -> tuple[SweepStep, ...]:
    """Steps of a case that these need, directly or not, beside themselves."""
    needed = {key for step in steps for key in step.needs}
    for step in reversed(chain):
        if step.key in needed:
            needed |= set(step.needs)
    return tuple(step for step in chain if step.key in needed and step not in steps)


@dataclass(frozen=True)
class _Read:
    """What a stage reads of a study: key of it, and of the curves their levels and a key without
    what chooses among them; study - the first, whose parts are those that others share."""

    key: str
    levels: tuple[float, ...]
    common: str
    study: Study


def chain(study: Study, known: dict[tuple, Any] | None = None) -> list[SweepStep]:
    """Steps of a case in the order of a run; known - what stages read of studies that share
    sections with this one."""
    for missing in STAGES[CURVES].lacks(study):
        raise InputError(f"{study.path}: section {missing} is missing: a sweep is of responses")
    last = STRESS if applies(STRESS, study) else CURVES
    keys: dict[str, str] = {}
    steps = []
    for name in (*all_needed(STAGES[last], study), last):
        needs = tuple(keys[need] for need in stages_needed(STAGES[name], study))
        read = _read(name, study, {} if known is None else known)
        keys[name] = fingerprint(name, read.key, needs)
        levels = tuple(fingerprint(read.common, level, needs) for level in read.levels)
        steps.append(SweepStep(name, keys[name], needs, levels))
    return steps


def _read(name: str, study: Study, known: dict[tuple, Any]) -> _Read:
    """What is the same is not read again."""
    stage, parts = STAGES[name], vars(study)
    reads = _by_part((*stage.reads, *stage.reads_more(study)))
    files = tuple(study.inputs(*stage.reads_files).items()) if stage.reads_files else ()
    seen = (name, reads, files, *(_identity(parts.get(part), keys, known) for part, keys in reads))
    if seen not in known:
        values = read_from(name, study, _mark)
        curves = name == CURVES
        common = {key: value for key, value in values.items() if curves and key not in CHOICE}
        levels = values["[respond] levels"] if curves else ()
        known[seen] = _Read(fingerprint(values), tuple(levels), fingerprint(common), study)
    return known[seen]


@lru_cache(maxsize=1000)
def _by_part(reads: tuple[str, ...]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """(part of a study, its keys that are read) of each part."""
    found: dict[str, list[str]] = {}
    for part, _, key in (read.partition(".") for read in reads):
        found.setdefault(part, []).append(key)
    return tuple((part, tuple(keys)) for part, keys in found.items())


def _identity(part: Any, keys: tuple[str, ...], known: dict[tuple, Any]) -> Any:
    """Of a part of a study that is read whole, by the object itself, or of keys of it, by their
    values."""
    if isinstance(part, dict):
        return tuple((table, _identity(one, keys, known)) for table, one in part.items())
    if part is None or isinstance(part, str | int | float):
        return part
    if "" in keys:
        return id(part)
    if (id(part), keys) not in known:
        values = tuple(repr(attrgetter(key)(part)) for key in keys)
        known[id(part), keys] = values, part  # which keeps its identity
    return known[id(part), keys][0]


def _mark(value: Any) -> Any:
    """The value itself, and of a file, which all cases may name, a fingerprint."""
    if not isinstance(value, Path):
        return value
    found = value.stat()
    return _fingerprint(value, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=1000)
def _fingerprint(file: Path, *_: int) -> str:
    return fingerprint(file)
