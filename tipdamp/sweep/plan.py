"""What a sweep consists of: the steps of its cases, each one known by the content that it follows
from, so that cases share what is the same."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from tipdamp.engine.store import fingerprint
from tipdamp.hbm.errors import InputError
from tipdamp.stages.run import STAGES, all_needed, read_from, stages_needed
from tipdamp.study.view import Study
from tipdamp.sweep.cases import Case, study_of_case

LAST = "respond"  # stage that ends a case
# its keys that choose among curves, and change none
CHOICE = tuple(
    f"[respond] {key}" for key in ("levels", "harmonics", "tolerance", "search", "both_ways")
)


@dataclass(frozen=True)
class SweepStep:
    """One stage of one case or of several; key - of all that it follows from; needs - keys of the
    steps that its stage reads; levels - of the last stage: for each level a key of what its curves
    follow from, so that steps which have one in common have the same curves there."""

    stage: str
    key: str
    needs: tuple[str, ...]
    levels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Task:
    """What one process does at a time: steps that no other case has, or a single one that several
    share; before - steps whose products it needs; case - values of one that it belongs to;
    alike - keys of finished steps that have curves of its last one."""

    steps: tuple[SweepStep, ...]
    before: tuple[SweepStep, ...]
    case: Case
    alike: tuple[str, ...] = ()

    @property
    def last(self) -> SweepStep:
        """The step that it ends with."""
        return self.steps[-1]


@dataclass(frozen=True)
class Plan:
    """cases, with the key of the last step of each; tasks, each after those that it needs."""

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
        return {
            task.last.key: tuple(step.key for step in (*task.before, *task.steps))
            for task in self.tasks
            if task.last.stage == LAST
        }


def plan(path: Path, content: dict, cases: Sequence[Case]) -> Plan:
    """The steps of all cases of a study file with this content; InputError where one of them is no
    valid study."""
    chains = [
        chain(study_of_case(path, content, number, case)) for number, case in enumerate(cases, 1)
    ]
    last = [chain[-1].key for chain in chains]
    first = dict[str, int]()  # of cases that are the same
    for i, key in enumerate(last):
        first.setdefault(key, i)
    shared = Counter(step.key for i in first.values() for step in chains[i])
    tasks: dict[str, Task] = {}
    for i in first.values():
        own = [step for step in chains[i] if shared[step.key] == 1]
        for step in chains[i]:
            if shared[step.key] > 1 and step.key not in tasks:
                tasks[step.key] = Task((step,), _before([step], chains[i]), cases[i])
        if own:
            tasks[last[i]] = Task(tuple(own), _before(own, chains[i]), cases[i])
    return Plan(tuple(cases), tuple(last), tuple(tasks.values()))


def _before(steps: Sequence[SweepStep], chain: Sequence[SweepStep]) -> tuple[SweepStep, ...]:
    """Steps of a case that these need, directly or not, beside themselves."""
    needed = {key for step in steps for key in step.needs}
    for step in reversed(chain):
        if step.key in needed:
            needed |= set(step.needs)
    return tuple(step for step in chain if step.key in needed and step not in steps)


def chain(study: Study) -> list[SweepStep]:
    """Steps of a case in the order of a run."""
    last = STAGES[LAST]
    for missing in last.lacks(study):
        raise InputError(f"{study.path}: section {missing} is missing: a sweep is of responses")
    keys: dict[str, str] = {}
    steps = []
    for name in (*all_needed(last, study), LAST):
        needs = tuple(keys[need] for need in stages_needed(STAGES[name], study))
        values = read_from(name, study, _mark)
        keys[name] = fingerprint(name, values, needs)
        steps.append(
            SweepStep(name, keys[name], needs, _levels(values, needs) if name == LAST else ())
        )
    return steps


def _levels(values: dict[str, Any], needs: Sequence[str]) -> tuple[str, ...]:
    common = fingerprint({key: v for key, v in values.items() if key not in CHOICE}, needs)
    return tuple(f"{common} {level!r}" for level in values["[respond] levels"])


def _mark(value: Any) -> Any:
    """The value itself, and of a file, which all cases may name, a fingerprint."""
    if not isinstance(value, Path):
        return value
    found = value.stat()
    return _fingerprint(value, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=1000)
def _fingerprint(file: Path, *_: int) -> str:
    return fingerprint(file)
