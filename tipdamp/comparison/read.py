"""Studies that were run, read back to be set side by side, and why they cannot be."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from tipdamp.comparison.record import ComparedStudies, Computed, compared
from tipdamp.comparison.swept import check_own_case, swept_cases
from tipdamp.engine.store import Store, fingerprint
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import brief
from tipdamp.report.results import load_results
from tipdamp.stages.report import said
from tipdamp.stages.run import check_current, command, program_mark, stage_key
from tipdamp.study.study import load_study
from tipdamp.study.view import Study

# of [respond]: what the response is of, and to what
ALIKE = ("patches", "direction", "excitation", "amplitudes", "phase", "engine_order", "blade_count")


@dataclass(frozen=True)
class Source:
    """A study that was run to the end, or whose sweep was.

    mark - of all that a comparison reads of it, and of the program; load - reads what was computed;
    failed - (name, reason) of the cases of a sweep that failed
    """

    mark: str
    load: Callable[[], list[Computed]]
    failed: list[tuple[str, str]]


def source(study: Study, store: Store) -> Source:
    """Of a study with its results folder; nothing is read yet.

    Raises InputError where the study has no forced response or an old one, or its sweep has not
    finished."""
    if "sweep" in study:
        swept = swept_cases(study, store)
        mark = fingerprint(study.path.name, program_mark(True), swept.marks)
        return Source(mark, swept.computed, swept.failed)
    if store.record("respond") is None:
        raise InputError(
            f"{study.path}: its forced response is not there yet; run: "
            + command("run", study, store)
        )
    check_current("report", study, store)

    def load() -> list[Computed]:
        return [Computed(study.name, load_results(study, store, said(study, store)))]

    return Source(fingerprint(study.path.name, stage_key("report", study, store)), load, [])


def read(sources: Sequence[Source]) -> ComparedStudies:
    """What was computed of studies, side by side."""
    computed = [one for each in sources for one in each.load()]
    return compared(computed, [one for each in sources for one in each.failed])


def mark_of(sources: Sequence[Source]) -> str:
    """Fingerprint of all that a comparison of them shows."""
    return fingerprint([one.mark for one in sources])


def studies_of(paths: Sequence[str]) -> list[Study]:
    """The studies of files, and those that their sections [compare] name beside them."""
    found = [load_study(path) for path in paths]
    named = [one.file(name) for one in found if "compare" in one for name in one.compare.studies]
    for path in named:
        if path.resolve() not in [one.path.resolve() for one in found]:
            found.append(load_study(path))
    return found


def folder_of(studies: Sequence[Study]) -> Path:
    """Where the page goes: as the first [compare] says, else beside the first study; one alone is
    no comparison with another, and has a folder of its own name."""
    stated = [one.file(one.compare.out) for one in studies if "compare" in one and one.compare.out]
    own = "comparison" if len(studies) > 1 else f"comparison_{studies[0].name}"
    return next(iter(stated), studies[0].path.parent / "results" / own)


def refuse(studies: Sequence[Study]) -> None:
    """InputError where the studies cannot be compared, with what to do."""
    for study in studies:
        for section in ("tune", "respond"):
            if section not in study:
                raise InputError(
                    f"{study.path}: section [{section}] is missing, a comparison needs the forced "
                    "response of the kept pairs"
                )
        if "sweep" in study:
            check_own_case(study)
    for one, other in combinations(studies, 2):
        if one.name == other.name:
            raise InputError(
                f"{one.path} and {other.path}: both are named {one.name}, and the name tells "
                "studies apart; rename one of the files"
            )
        _refuse_unlike(one, other)


def _refuse_unlike(one: Study, other: Study) -> None:
    for key in ALIKE:
        mine, its = getattr(one.respond, key), getattr(other.respond, key)
        if mine != its:
            raise InputError(
                f"{other.path}: [respond] {key} = {brief(its)}, but {brief(mine)} in {one.path}: "
                "studies are compared by the same outputs under the same excitation; give both the "
                "same value"
            )
