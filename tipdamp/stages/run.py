"""How stages are run, one after the other; `run_stage` is where a stage is skipped."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from tipdamp import results
from tipdamp.engine.progress import progress
from tipdamp.engine.sources import packages, sources
from tipdamp.engine.store import Store, fingerprint
from tipdamp.engine.workers import Workers
from tipdamp.hbm.errors import InputError
from tipdamp.readers.includes import included_files
from tipdamp.stages.stage import Stage, load_stage
from tipdamp.study.view import Study, View

STAGES: dict[str, Stage] = {name: load_stage(name) for name in results.STAGES}
ON_REQUEST: dict[str, Stage] = {name: load_stage(name) for name in results.ON_REQUEST}
FROM = ".stages/{}.from"  # of a finished stage: what it was made from
# names and patterns of all that the program writes into a results folder
WRITTEN = (
    ".stages/*",
    "export/*",
    *(
        file
        for stage in (*STAGES.values(), *ON_REQUEST.values())
        for file in (*stage.outputs, *stage.may_write)
    ),
)


def stage_of(name: str) -> Stage:
    """The stage of that name, of a run or on request."""
    return STAGES[name] if name in STAGES else ON_REQUEST[name]


def run_stage(
    name: str,
    study: Study,
    store: Store,
    *,
    force: bool = False,
    quiet: bool = False,
    workers: Workers | None = None,
    locked: bool = False,
) -> str:
    """Run one stage, or skip it when nothing that it depends on has changed: "done" or "skipped".

    workers - processes that it may use; None: this one alone; locked - whether this process holds
    the results folder

    Raises InputError when the study lacks a section for it, or a stage that it needs is absent or
    out of date."""
    stage = stage_of(name)
    refuse_overwriting(study, store)
    for missing in stage.lacks(study):
        raise InputError(
            f"{study.path}: {'section ' * missing.endswith(']')}{missing} is missing, the stage "
            f"'{name}' needs it"
        )
    needs = stages_needed(stage, study)
    check_current(name, study, store)
    for touched in [*needs, name]:
        _check_untouched(touched, study, store, force and touched == name)
    with nullcontext() if locked else store.lock():
        sweep_unfinished(store)
        key = stage_key(name, study, store)
        if not force and store.is_current(name, key):
            return "skipped"
        if force:
            stage.forget(store)
        began = time.perf_counter()
        processes = (workers or Workers(),) * stage.parallel
        with store.running(name) as before, _named(study):
            with progress(name, quiet=quiet) as tick:
                more = stage.work(_view(name, study), store, tick, *processes)
            own = {output: mark for output, mark in before.items() if stage.writes(output)}
            store.finish(name, key, [*stage.outputs, *more], time.perf_counter() - began, own)
            store.write_json(FROM.format(name), made_from(name, study, store))
    return "done"


def stage_key(name: str, study: Study, store: Store) -> str:
    """Fingerprint of all that the stage depends on."""
    return fingerprint(name, made_from(name, study, store))


def made_from(name: str, study: Study, store: Store) -> dict[str, str]:
    """{what the stage depends on: fingerprint}: program, declared keys of the study, files that it
    names, and outputs of the stages that it needs."""
    stage = stage_of(name)
    return {
        **read_from(name, study),
        **{
            f"what '{need}' wrote": fingerprint(store.outputs(need))
            for need in (*stages_needed(stage, study), *stage.uses)
        },
    }


def read_from(name: str, study: Study, mark: Callable[[Any], Any] = fingerprint) -> dict[str, Any]:
    """As `made_from`, without the outputs of other stages; mark - of a value or a file."""
    stage = stage_of(name)
    files = study.inputs(*stage.reads_files) if stage.reads_files else {}
    contents = {key: file for key, file in files.items() if file.is_file()}
    for key, file in list(contents.items()):
        contents |= {f"{key}, {one.name}": one for one in included_files(file)}
    return {
        "the program": program_mark(name in ("inspect", "report")),
        **{key: mark(value) for key, value in _view(name, study).keys().items()},
        **{f"the contents of {key}": mark(file) for key, file in contents.items()},
    }


def changed(name: str, study: Study, store: Store) -> list[str]:
    """What the stage depends on and has changed since it last finished; [] where it has not, or
    where that is not known."""
    try:
        before = store.read_json(FROM.format(name))
    except InputError:
        return []
    now = made_from(name, study, store)
    return [key for key in dict.fromkeys((*now, *before)) if now.get(key) != before.get(key)]


def stages_needed(stage: Stage, study: Study) -> list[str]:
    """Stages of this study whose files the stage reads."""
    return [need for need in (*stage.needs, *stage.needs_more(study)) if applies(need, study)]


def _view(name: str, study: Study) -> View:
    """What the stage sees of the study: what it has declared."""
    return View(study, name, (*stage_of(name).reads, *stage_of(name).reads_more(study)))


@contextmanager
def _named(study: Study) -> Iterator[None]:
    """Every complaint names the study that it is about."""
    try:
        yield
    except InputError as error:
        if str(study.path) in str(error):
            raise
        raise type(error)(f"{study.path}: {error}") from None


def applies(name: str, study: Study) -> bool:
    """Whether the study has the sections that the stage works on."""
    return not STAGES[name].lacks(study)


@cache
def program_mark(with_report: bool) -> str:
    """Fingerprint of the program's own sources: another version computes anew."""
    return fingerprint(*sources(packages(), with_report))


def check_current(name: str, study: Study, store: Store) -> None:
    """InputError where stages that the stage of that name needs, or that those need, are absent or
    out of date: all of them, and what makes them."""
    needed = all_needed(stage_of(name), study)
    absent = [need for need in needed if store.record(need) is None]
    stale = [
        need
        for need in needed
        if need not in absent and not store.is_current(need, stage_key(need, study, store))
    ]
    if not absent and not stale:
        return
    found = [f"{_listed(absent)} not been run"] if absent else []
    found += (
        [
            f"{_listed(stale, 'is', 'are')} out of date (the study, a mesh or the program has "
            "changed, or a file is missing)"
        ]
        if stale
        else []
    )
    one = [*absent, *stale][0] if len([*absent, *stale]) == 1 else "run"
    raise InputError(f"'{name}' needs {', and '.join(found)}; run: {command(one, study, store)}")


def command(verb: str, study: Study, store: Store) -> str:
    """As one types it: 'tipdamp sweep study.toml --out folder', with the folder where it is not the
    study's own."""
    out = "" if store.folder == study.results else f" --out {store.folder}"
    return f"tipdamp {verb} {study.path}{out}"


def all_needed(stage: Stage, study: Study) -> list[str]:
    """Stages that the stage needs and those that they need, in the order of a run."""
    direct = stages_needed(stage, study)
    found = {*direct, *(more for need in direct for more in all_needed(STAGES[need], study))}
    return [name for name in STAGES if name in found]


def _listed(stages: Sequence[str], one: str = "has", several: str = "have") -> str:
    *others, last = (f"'{stage}'" for stage in stages)
    return (
        f"the stages {', '.join(others)} and {last}, which {several}"
        if others
        else f"the stage {last}, which {one}"
    )


def _check_untouched(name: str, study: Study, store: Store, overwrite: bool) -> None:
    """A table that a person has edited is neither used unseen nor overwritten."""
    edited = store.edited(name)
    if edited and not overwrite:
        key = {"pairs.csv": "[contact] pairs", "kept.csv": "[tune] kept"}.get(edited[0])
        own = f"to use it, name a copy of it in the study ({key}); " if key else ""
        raise InputError(
            f"{store.path(edited[0])} was changed after the stage '{name}' wrote it; {own}to "
            f"write it anew: tipdamp {name} {study.path} --force"
        )


def sweep_unfinished(store: Store) -> None:
    """Remove the temporary files of runs that were killed: whoever holds the folder is the only one
    that writes."""
    for pattern in WRITTEN:
        folder, _, file = pattern.rpartition("/")
        for path in store.path(folder).glob(f".tmp-[0-9]*-{file}"):
            if path.is_file() or path.is_symlink():
                path.unlink()


def results_folder(study: Study, out: str | None, allow_outside: bool = False) -> Store:
    """The results folder of a study, or the one that is given.

    A study may come from somebody else: that its results lead out of its own folder must be
    allowed.
    """
    folder = Path(out) if out else study.results
    if not out and not allow_outside and not study.holds(folder):
        raise InputError(
            f"{study.path}: its results lead out of its own folder, to {folder.resolve()}; name a "
            "folder with --out, or allow it with --allow-outside"
        )
    if folder.exists() and not folder.is_dir():
        raise InputError(f"results folder {folder}: is a file")
    store = Store(folder)
    refuse_overwriting(study, store)
    return store


def refuse_overwriting(study: Study, store: Store) -> None:
    """InputError where the study or a file that it names has the name of a result in the results
    folder."""
    for key, path in {"the study itself": study.path, **study.inputs()}.items():
        for place in (path.parent.resolve() / path.name, path.resolve()):
            for pattern in map(store.folder.joinpath, WRITTEN):
                if pattern.parent.resolve() == place.parent and fnmatchcase(
                    place.name, pattern.name
                ):
                    raise InputError(
                        f"{study.path}: {key}, {path}, would be overwritten by results in "
                        f"{store.folder}; choose a results folder of its own (key `results` or "
                        "--out)"
                    )
