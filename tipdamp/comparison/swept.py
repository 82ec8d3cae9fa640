"""What the sweep of a study has computed: one record for each case."""

import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.comparison.record import Computed
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.report.results import load_results
from tipdamp.report.text import listing
from tipdamp.stages.run import command
from tipdamp.study.schema import SECTIONS
from tipdamp.study.toml_file import read_toml
from tipdamp.study.view import Study
from tipdamp.sweep.cases import Case, cases_of, content_of, in_words, sheet, study_of_case
from tipdamp.sweep.index import Index
from tipdamp.sweep.plan import SweepStep, chain
from tipdamp.sweep.run import folder_of
from tipdamp.sweep.work import products, unpack, warned

# keys by which cases stand at different places of a comparison; others make its scatter
PLACES = ("damper.pull", "model.pull", "respond.levels", "respond.band", "respond.harmonics")
# laws whose forces double with all motions and preloads
DOUBLE = ("Jenkins1D", "DryFriction1T", "DryFriction2T", "UnilateralSpring", "IsotropicFriction")
OF_PAIRS = ("mu", "kn", "kt")  # in the table of pairs
ALIKE = 1e-6  # of the largest preload or stiffness
# why the response per newton depends on more than Fc/Fe: columns of the kept pairs
UNLIKE = {
    "the stiffness of their kept pairs is not the same, as that of a round side follows its load, "
    "or their kept parts differ": ("kn", "kt", "weight"),
    "the preload of their kept pairs is not in proportion to the pull, as with gaps": ("preload",),
}


@dataclass(frozen=True)
class SweptCases:
    """Of a finished sweep: content of the study file; own - with the values that it has unwritten,
    see `_own_content`; folder of the sweep; done - the cases with
    their steps; failed - (name, reason) of the others."""

    study: Study
    content: dict
    own: dict
    folder: Path
    done: list[tuple[Case, list[SweepStep]]]
    failed: list[tuple[str, str]]

    @property
    def marks(self) -> list:
        """By which what was computed is known."""
        return [self.content, [steps[-1].key for _, steps in self.done], self.failed]

    def computed(self) -> list[Computed]:
        """What was computed of every case."""
        return _with_pulls(list(_loaded(self)))


def swept_cases(study: Study, store: Store) -> SweptCases:
    """The cases of a sweep and what came of them.

    Raises InputError where the sweep has not finished, or none of its cases has the values of the
    study itself."""
    folder, content, cases = folder_of(store), read_toml(study.path), cases_of(study)
    every = [
        (case, chain(study_of_case(study.path, content, number, case)))
        for number, case in enumerate(cases, 1)
    ]
    there = products(folder)
    how = command("sweep", study, store)
    with Index(folder, how=how) as index:
        reasons = {one.key: one.reason for one in index.cases() if one.state == "failed"}
    missing = [steps for _, steps in every if steps[-1].key not in there | reasons.keys()]
    if missing:
        raise InputError(
            f"{study.path}: {len(missing)} of the {len(cases)} cases of its sweep are not there "
            f"yet; run: {how}"
        )
    done = [(case, steps) for case, steps in every if steps[-1].key in there]
    failed = [
        (f"{study.name}: {in_words(case)}", reasons[steps[-1].key])
        for case, steps in every
        if steps[-1].key not in there
    ]
    check_own_case(study)
    own = _own_content(study, content, cases)
    if all(scatter_of(own, case) for case, _ in done):
        raise InputError(
            f"{study.path}: [sweep] no case with the study's own values, about which the others "
            "scatter, has succeeded: " + listing(dict.fromkeys(reason for _, reason in failed))
        )
    return SweptCases(study, content, own, folder, done, failed)


def check_own_case(study: Study) -> None:
    """InputError where no case of the sweep has the values of the study itself."""
    if lacking := lacks_own_case(study):
        raise InputError(f"{study.path}: [sweep] {lacking}")


def lacks_own_case(study: Study) -> str:
    """What a comparison lacks where no case of the sweep has the values of the study itself, in
    words; '' where one has."""
    cases = cases_of(study)
    own = _own_content(study, read_toml(study.path), cases)
    others = [_others(own, case) for case in cases]
    if not all(others):
        return ""
    keys = [key for key in cases[0] if any(key in case for case in others)]
    never = [key for key in keys if all(key in case for case in others)]
    said = (
        f"{key} = {listing(value)}" if (value := _at(own, key)) else f"an empty cell for {key}"
        for key in never or keys
    )
    return (
        "no case has the study's own values, about which the others scatter; add one with "
        f"{listing(said)}"
    )


def _loaded(swept: SweptCases) -> Iterator[Computed]:
    """Steps that several cases share are unpacked once."""
    study, folder = swept.study, swept.folder
    with tempfile.TemporaryDirectory() as scratch:
        store, unpacked = Store(Path(scratch)), dict[str, str]()
        for number, (case, steps) in enumerate(swept.done, 1):
            for step in steps:
                if unpacked.get(step.stage) != step.key:
                    unpack(folder, step, store)
                    unpacked[step.stage] = step.key
            one = study_of_case(study.path, swept.content, number, case)
            said = {step.stage: _said(store, step.stage) for step in steps}
            results = load_results(one, store, said)
            yield Computed(study.name, results, scatter_of(swept.own, case))


def _said(store: Store, stage: str) -> list[str]:
    return [str(text) for text in json.loads(store.path(warned(stage)).read_text("utf-8"))]


def scatter_of(content: dict, case: Case) -> str:
    """What a case has otherwise than the study file with this content, beside its place in the
    comparison, in words: 'contact.mu = 0.5'."""
    return in_words(_others(content, case))


def _others(content: dict, case: Case) -> Case:
    """The values of a case that are others than those of the content, beside its place."""
    its = content_of(content, case)
    return {
        key: value
        for key, value in case.items()
        if key not in PLACES and _at(content, key) != _at(its, key)
    }


def _own_content(study: Study, content: dict, cases: Sequence[Case]) -> dict:
    """Content of the study file with what the keys of the cases are in it without being written:
    the value that all pairs of its table have, or the default."""
    lacking = [key for key in cases[0] if not _at(content, key)]
    return content_of(content, {key: _unwritten(study, key) for key in lacking})


def _unwritten(study: Study, key: str) -> Any:
    """None where there is no single value."""
    section, *side, name = key.split(".")
    if section == "contact" and name in OF_PAIRS and study.contact.pairs:
        pairs = ContactTable.load(study.file(study.contact.pairs))
        mine = np.isin(pairs.side, side) if side else np.ones(len(pairs), bool)
        values = np.unique(vars(pairs)[name][mine])
        return float(values[0]) if len(values) == 1 else None
    known = sheet(key)
    if known is None or known.unit or side:
        return None
    default = SECTIONS[section].model_fields[name].default
    return default if isinstance(default, bool | int | float | str) else None


def _at(content: Any, key: str) -> list:
    """The value of a dotted key, a single one as a list; [] without one."""
    for name in key.split("."):
        content = content.get(name, []) if isinstance(content, dict) else []
    return content if isinstance(content, list) else [content]


def _with_pulls(found: list[Computed]) -> list[Computed]:
    """Named with their pulls, where these are several and draw curves of their own."""
    several = len({one.results.study.driver.pull for one in found}) > 1
    if not several or not (why := why_apart(found)):
        return found
    return [
        Computed(f"{one.name}, {one.results.study.driver.pull:g} N", one.results, one.scatter, why)
        for one in found
    ]


def why_apart(found: Sequence[Computed]) -> str:
    """Why the pulls of a study draw a curve each, in words. '' where the response per newton
    depends on Fc/Fe alone, so that all draw one: the law doubles its forces with the motion, the
    kept pairs are as many and as stiff, and their preload is in proportion to the pull, which gaps
    prevent."""
    first: dict[str, ContactTable] = {}
    for one in found:
        study, kept = one.results.study, one.results.kept
        if study.respond.law.name not in DOUBLE:
            return f"the forces of its law, {study.respond.law}, do not double with the motion"
        if kept is None:
            return "their kept pairs are not known"
        each = kept.replace(preload=kept.preload / study.driver.pull)
        before = first.setdefault(one.scatter, each)
        if len(each) != len(before):
            return "they keep different numbers of pairs"
        for said, columns in UNLIKE.items():
            if not all(_alike(vars(each)[name], vars(before)[name]) for name in columns):
                return said
    return ""


def _alike(one: np.ndarray, other: np.ndarray) -> bool:
    return np.allclose(one, other, rtol=0.0, atol=ALIKE * np.abs(other).max(initial=0.0))
