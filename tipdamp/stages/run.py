"""The stages of a run: what each needs, depends on and leaves behind; and how they are run one after the other."""

import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import hbm
import modal
import static_contact
import tipdamp
from hbm.errors import InputError
from tipdamp.progress import progress
from tipdamp.stages.preload import preload
from tipdamp.stages.reduce import inspect, reduce
from tipdamp.stages.respond import respond
from tipdamp.stages.tune import tune
from tipdamp.store import Store, fingerprint
from tipdamp.study.study import Study


@dataclass(frozen=True)
class Stage:
    """needs - stages whose files it reads; requires - sections without which it has nothing to do
    sections - parts of the study that it depends on; outputs - its files, beside those that the job returns."""

    name: str
    text: str
    job: Callable
    needs: tuple
    sections: tuple
    outputs: tuple
    requires: tuple = ()
    reads_meshes: bool = False


def _report(study, store, tick):
    from tipdamp.report.page import write_report

    return write_report(study, store, tick)


_BODIES = ("material", "materials", "blades", "damper_body", "model_body", "groups")
STAGES = {stage.name: stage for stage in (
    Stage("inspect", "what is in the meshes: groups, counts, masses, rigid modes", inspect, (),
          (*_BODIES, "points"), ("inspect.json",), reads_meshes=True),
    Stage("reduce", "meshes to a reduced model and contact pairs; modes without damper", reduce, (),
          (*_BODIES, "points", "free", "rotation", "loads", "wanted_error"),
          ("model.npz", "pairs.csv", "reduce.json"), reads_meshes=True),
    Stage("preload", "unilateral static contact under the pull: the preload map", preload, ("reduce",),
          ("material", "driver", "contact", "sides", "preload", "loads"), ("preload.csv", "preload.json")),
    Stage("tune", "detach pairs from the middle until the stuck frequency meets the target", tune,
          ("reduce", "preload"), ("tune", "sides", "points", "driver", "preload", "loads"), ("kept.csv", "tune.json"),
          requires=("tune", "respond"), reads_meshes=True),
    Stage("respond", "forced response at every level and number of harmonics", respond, ("reduce", "tune"),
          ("respond", "sides", "preload"), ("respond.json", "stuck.npz"), requires=("tune", "respond")),
    Stage("report", "the HTML page, the figures and summary.json", _report,
          ("inspect", "reduce", "preload", "tune", "respond"), ("title", "reference"),
          ("report.html", "summary.json")),
)}


def run_stage(name: str, study: Study, store: Store, *, force: bool = False, quiet: bool = False) -> str:
    """Run one stage, or skip it when nothing that it depends on has changed: "done" or "skipped".

    Raises InputError when the study lacks a section for it, or a stage that it needs is absent or out of date.
    """
    stage = STAGES[name]
    for section in missing_sections(name, study):
        raise InputError(f"{study.path}: section [{section}] is missing, the stage '{name}' needs it")
    needs = [n for n in stage.needs if applies(n, study)]
    for need in needs:
        _need_stage(stage, STAGES[need], study, store)
    for touched in [*needs, name]:
        _check_untouched(touched, store, force and touched == name)
    key = stage_key(stage, study, store)
    if not force and store.is_current(name, key):
        return "skipped"
    began = time.perf_counter()
    with store.running(name) as before, _named(study):
        with progress(name, quiet=quiet) as tick:
            more = stage.job(study, store, tick) or ()
        store.finish(name, key, [*stage.outputs, *more], time.perf_counter() - began, before)
    return "done"


@contextmanager
def _named(study):
    """Every complaint names the study that it is about."""
    try:
        yield
    except InputError as error:
        if str(study.path) in str(error):
            raise
        raise InputError(f"{study.path}: {error}") from None


def applies(name: str, study: Study) -> bool:
    """Whether the study has the sections that the stage works on."""
    return not missing_sections(name, study)


def missing_sections(name: str, study: Study) -> list[str]:
    """Sections that the stage works on and the study lacks."""
    return [section for section in STAGES[name].requires if section not in study]


def stage_key(stage: Stage, study: Study, store: Store) -> str:
    """Fingerprint of all that the stage depends on: program, study values, mesh files, outputs of earlier stages."""
    values = {s: study.part(s) for s in stage.sections}
    files = [f for f in study.input_files() if stage.reads_meshes and f.is_file()]
    before = {need: (store.record(need) or {}).get("outputs") for need in stage.needs if applies(need, study)}
    return fingerprint(stage.name, program_mark(stage.name in ("inspect", "report")), values, *files, before)


@cache
def program_mark(with_report: bool) -> str:
    """Fingerprint of the program's own sources: another version computes anew."""
    folders = [Path(package.__file__).parent for package in (tipdamp, hbm, modal, static_contact)]
    kinds = (".py", ".csv", ".css", ".js")
    return fingerprint(*sorted(f for folder in folders for f in folder.rglob("*") if f.suffix in kinds
                               and (with_report or f.parent.name != "report")))


def _need_stage(stage, need, study, store):
    command = f"run: tipdamp {need.name} {study.path}"
    if store.record(need.name) is None:
        raise InputError(f"'{stage.name}' needs the stage '{need.name}', which has not been run; {command}")
    if not store.is_current(need.name, stage_key(need, study, store)):
        raise InputError(f"'{stage.name}' needs the stage '{need.name}', which is out of date (the study, a mesh "
                         f"or the program has changed, or a file is gone); {command}")


def _check_untouched(name, store, overwrite):
    """A table that a person has edited is neither used unseen nor overwritten."""
    edited = store.edited(name)
    if edited and not overwrite:
        own = "to use it, name a copy of it in the study ([contact] pairs); " if edited[0] == "pairs.csv" else ""
        raise InputError(f"{store.path(edited[0])} was changed after the stage '{name}' wrote it; {own}to write it "
                         f"anew: tipdamp {name} --force")


def results_folder(study: Study, out: str | None) -> Store:
    folder = Path(out) if out else study.results
    if folder.exists() and not folder.is_dir():
        raise InputError(f"results folder {folder}: is a file")
    return Store(folder)
