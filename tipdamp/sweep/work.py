"""What a process does for a sweep: steps in a folder of its own, each packed into one file of the
store when it is finished."""

import json
import os
import threading
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from tempfile import TemporaryDirectory

from tipdamp.engine.store import Store
from tipdamp.engine.workers import Report
from tipdamp.hbm.errors import InputError
from tipdamp.stages.run import STAGES, run_stage
from tipdamp.study.own_law import code_allowed
from tipdamp.study.study import study_of
from tipdamp.sweep.cases import content_of, in_words
from tipdamp.sweep.plan import CURVES, SweepStep, Task

MADE, WORKING = "made", "working"  # folders in that of a sweep
RUNS = "runs"  # file in the folder of a process: what it does now
RECORDS = "Fe_*.json"  # of the curves of a step
ONE_AT_A_TIME = threading.Lock()  # a worker of a cluster may have several threads
THREADS_OF_BLAS = 1  # the same sums, in the same order, wherever a step is made


@dataclass(frozen=True)
class SweepWork:
    """What all tasks of a sweep have in common: the study file with its content as it was when the
    sweep began, and the folder of the sweep, which all processes see."""

    path: Path
    content: dict
    folder: Path
    allow_code: bool = False  # of laws in files


def product(folder: Path, key: str) -> Path:
    """File of a finished step."""
    return folder / MADE / key[:2] / f"{key}.zip"


def warned(stage: str) -> str:
    """File in a finished step: the warnings of its stage, a JSON list."""
    return f".stages/{stage}.said"


def products(folder: Path) -> set[str]:
    """Keys of all finished steps."""
    found: set[str] = set()
    for part in (folder / MADE).glob("??"):
        found |= {name[:-4] for name in os.listdir(part) if name.endswith(".zip")}
    return found


def at_work(folder: Path) -> list[str]:
    """What the processes of a sweep do now, wherever they run: 'tune of damper.pull = 20'."""
    found = []
    for file in (folder / WORKING).glob(f"*/{RUNS}"):
        with suppress(OSError):  # it ends meanwhile
            found.append(file.read_text("utf-8"))
    return sorted(filter(None, found))


def work(common: SweepWork, task: Task, _: Report) -> None:
    """Make the steps of a task that are not there yet; what is finished is in the store, whatever
    becomes of the rest."""
    from threadpoolctl import threadpool_limits

    limits = {"limits": THREADS_OF_BLAS, "user_api": "blas"}
    home = common.folder / WORKING
    try:
        home.mkdir(parents=True, exist_ok=True)
        with (
            ONE_AT_A_TIME,
            threadpool_limits(**limits),
            code_allowed(common.allow_code),
            TemporaryDirectory(dir=home) as scratch,
        ):
            _make(common, task, Store(Path(scratch)))
    except OSError as error:
        error.filename = error.filename or str(common.folder)  # a full disk is told without one
        raise


def _make(common: SweepWork, task: Task, store: Store) -> None:
    """The steps of a task in a results folder of its own."""
    study = study_of(common.path, content_of(common.content, task.case))
    for step in task.before:
        unpack(common.folder, step, store)
    for step in task.steps:
        store.path(RUNS).write_text(f"{step.stage} of {in_words(task.case)}", encoding="utf-8")
        if product(common.folder, step.key).is_file():
            unpack(common.folder, step, store)
            continue
        if step.stage == CURVES:
            for key in task.alike:
                _unpack_curves(common.folder, key, store)
        try:
            run_stage(step.stage, study, store, quiet=True, locked=True)
            said = list(STAGES[step.stage].warnings(study, store))
        except Exception as error:
            error.add_note(f"in the stage '{step.stage}'")
            raise
        store.path(warned(step.stage)).write_text(json.dumps(said), encoding="utf-8")
        _pack(common.folder, step, store)


def _pack(folder: Path, step: SweepStep, store: Store) -> None:
    """Files of a finished step as one, which has its name only when it is whole."""
    final, whole = product(folder, step.key), store.path(f"{step.key}.zip")
    final.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(whole, "w") as packed:
        for file in _files(step, store):
            packed.write(store.path(file), file)
    os.replace(whole, final)


def _files(step: SweepStep, store: Store) -> list[str]:
    records = (f".stages/{step.stage}.json", f".stages/{step.stage}.from", warned(step.stage))
    curves = [f".stages/{path.name}" for path in sorted(store.path(".stages").glob(RECORDS))]
    return [*records, *(curves if step.stage == CURVES else ()), *store.outputs(step.stage)]


def _unpack_curves(folder: Path, key: str, store: Store) -> None:
    """Curves of a finished step with their records, for a step that has some of them, and removes
    the others; one that is gone or damaged has none."""
    with suppress(OSError, zipfile.BadZipFile), zipfile.ZipFile(product(folder, key)) as packed:
        for name in packed.namelist():
            if fnmatch(name, f".stages/{RECORDS}") or name.startswith("responses/"):
                packed.extract(name, store.folder)


def unpack(folder: Path, step: SweepStep, store: Store) -> None:
    """Files of a finished step, into a results folder; InputError where it is damaged."""
    file = product(folder, step.key)
    try:
        with zipfile.ZipFile(file) as packed:
            packed.extractall(store.folder)
    except zipfile.BadZipFile as error:
        raise InputError(
            f"{file} is damaged ({error}): remove it, and run again with --retry"
        ) from None


def read_member(folder: Path, key: str, name: str) -> bytes:
    """A file of a finished step."""
    with zipfile.ZipFile(product(folder, key)) as packed:
        return packed.read(name)
