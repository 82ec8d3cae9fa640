"""What a stage declares."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from importlib import import_module
from operator import attrgetter

from tipdamp.engine.store import Store
from tipdamp.results.record import Result
from tipdamp.study.view import Study

SWITCHES = ("stress",)  # keys that a stage may require to be true


def _nothing(*_: object) -> tuple[str, ...]:
    return ()


def recorded(kind: type[Result]) -> Callable[[Study, Store], Sequence[str]]:
    """The warnings that the record of a stage holds."""
    return lambda _, store: kind.load(store).warnings


@dataclass(frozen=True)
class Stage:
    """One stage of a run.

    work - of the study (what it reads of it), the results folder and the progress; returns the
    files that it wrote beside its `outputs`. Its results are in its files.
    outputs - files that it always writes; may_write - those that it writes beside them, such as
    'loads/*.csv' line, warnings - of a finished stage for the command line; they see the whole
    study, since they are made anew reads, reads_more - parts and keys of the study (see `View`),
    always or where the study asks for them reads_files - sections of the study whose files count
    with their content
    needs, needs_more - stages whose files it reads, always or where the study asks for them
    uses - stages whose files it reads where they are
    requires - sections, keys such as 'respond.levels' and switches, without which it has nothing
    to do
    parallel - whether its work is also given the processes that it may use
    forget - drops what it keeps of earlier runs beside its files, where it is to be run in any case
    """

    work: Callable[..., list[str]]
    line: Callable[[Store], str]
    outputs: tuple[str, ...]
    reads: tuple[str, ...]
    may_write: tuple[str, ...] = ()
    warnings: Callable[[Study, Store], Sequence[str]] = _nothing
    reads_more: Callable[[Study], tuple[str, ...]] = _nothing
    reads_files: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    needs_more: Callable[[Study], tuple[str, ...]] = _nothing
    uses: tuple[str, ...] = ()
    requires: tuple[str, ...] = ()
    parallel: bool = False
    forget: Callable[[Store], object] = _nothing

    def lacks(self, study: Study) -> list[str]:
        """What the study lacks of what the stage requires, as it is written: '[tune]', '[respond]
        levels', '[respond] stress = true'."""
        split = [part.partition(".") for part in self.requires]
        return [
            " ".join((f"[{section}]", key + " = true" * (key in SWITCHES))).strip()
            for section, _, key in split
            if section not in study or key and not attrgetter(f"{section}.{key}")(study)
        ]

    def writes(self, name: str) -> bool:
        """Whether a file of this name in the results folder is one of the stage."""
        folder, _, file = name.rpartition("/")
        declared = (pattern.rpartition("/") for pattern in (*self.outputs, *self.may_write))
        return any(folder == its and fnmatchcase(file, files) for its, _, files in declared)


def load_stage(name: str) -> Stage:
    """The stage in the file of its name."""
    return import_module(f"tipdamp.stages.{name}").STAGE
