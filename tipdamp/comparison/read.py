"""Studies that were run, read back to be set side by side, and why they cannot be."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

from tipdamp.comparison.record import ComparedStudies, Computed, compared
from tipdamp.comparison.swept import computed_of_sweep
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import brief
from tipdamp.report.results import Results, load_results
from tipdamp.stages.report import said
from tipdamp.stages.run import check_current
from tipdamp.study.study import load_study
from tipdamp.study.view import Study

# of [respond]: what the response is of, and to what
ALIKE = ("patches", "direction", "excitation", "amplitudes", "phase", "engine_order", "blade_count")


def read(studies: Sequence[tuple[Study, Store]]) -> ComparedStudies:
    """Studies that were run to the end, with the store of each; of one with a [sweep] its cases.

    Raises InputError where a study has no forced response or an old one, or a sweep has not
    finished."""
    computed, failed = list[Computed](), list[tuple[str, str]]()
    for study, store in studies:
        if "sweep" in study:
            cases, without = computed_of_sweep(study, store)
            computed += cases
            failed += without
        else:
            computed.append(Computed(study.name, _results(study, store)))
    return compared(computed, failed)


def _results(study: Study, store: Store) -> Results:
    if store.record("respond") is None:
        raise InputError(
            f"{study.path}: its forced response is not there yet; run: tipdamp run {study.path}"
        )
    check_current("report", study, store)
    return load_results(study, store, said(study, store))


def studies_of(paths: Sequence[str]) -> list[Study]:
    """The studies of files, and those that their sections [compare] name beside them."""
    found = [load_study(path) for path in paths]
    named = [one.file(name) for one in found if "compare" in one for name in one.compare.studies]
    for path in named:
        if path.resolve() not in [one.path.resolve() for one in found]:
            found.append(load_study(path))
    return found


def folder_of(studies: Sequence[Study]) -> Path:
    """Where the page goes: as the first [compare] says, else beside the first study."""
    stated = [one.file(one.compare.out) for one in studies if "compare" in one and one.compare.out]
    return next(iter(stated), studies[0].path.parent / "results" / "comparison")


def refuse(studies: Sequence[Study]) -> None:
    """InputError where the studies cannot be compared, with what to do."""
    for study in studies:
        for section in ("tune", "respond"):
            if section not in study:
                raise InputError(
                    f"{study.path}: section [{section}] is missing, a comparison needs the forced "
                    "response of the kept pairs"
                )
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
