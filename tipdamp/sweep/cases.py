"""The cases of a sweep: the values that keys of the study take, and the study of each."""

import csv
import tomllib
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

from tipdamp.hbm.errors import InputError, shown
from tipdamp.study.schema import (
    SECTIONS,
    LoadCase,
    Measured,
    OtherMaterial,
    SideSection,
    StudySection,
)
from tipdamp.study.study import study_of
from tipdamp.study.values import COLUMNS, NUMBERS, PHASE, TEXTS, Key
from tipdamp.study.view import Study

MOST = 1_000_000  # cases of a sweep
FIXED = ("sweep", "compare", "units", "reference")  # sections that no case changes
OF_MESHES = ("material", "blades", "damper")  # sections that a study with matrices does not have
NAMED: dict[str, type[StudySection]] = {
    "contact": SideSection,
    "material": OtherMaterial,
    "loads": LoadCase,
    "measured": Measured,
}
Case = dict[str, Any]  # {dotted key: value as in a study file}


def cases_of(study: Study) -> list[Case]:
    """All cases in their order: the product of the lists of [sweep], the first varying slowest,
    with the rows of its table and the samples."""
    if "sweep" not in study:
        raise InputError(
            f"{study.path}: section [sweep] is missing: which keys vary, such as [sweep.over] "
            "damper.pull = [20, 50, 113]"
        )
    where, sweep = f"{study.path}: [sweep]", study.sweep
    if bool(sweep.sample) != bool(sweep.samples):
        raise InputError(f"{where} samples and [sweep.sample] need each other")
    parts: list[Sequence[Case]] = [[{one.key: v} for v in one.values] for one in sweep.over]
    if sweep.cases:
        parts.append(list(_rows(study.file(sweep.cases))))
    if sweep.sample:
        parts.append(_samples(study))
    if not parts:
        raise InputError(f"{where} names no case: give [sweep.over], cases or [sweep.sample]")
    count = 1
    for part in parts:
        count *= len(part)
    if count > MOST:
        raise InputError(f"{where} makes {count} cases, at most {MOST} are computed in one sweep")
    keys = [key for part in parts for key in part[0]]
    for key in keys:
        _check_key(where, key, study)
        if keys.count(key) > 1:
            raise InputError(f"{where} {key} stands in it twice")
    return [{k: v for one in chosen for k, v in one.items()} for chosen in product(*parts)]


def _check_key(where: str, key: str, study: Study) -> None:
    section, _, inside = key.partition(".")
    if "model" in study and section in OF_MESHES:
        there = f": model.{inside}" * (inside in SECTIONS["model"].model_fields)
        raise InputError(
            f"{where} {shown(key)}: the study has matrices and no [{section}]{shown(there)}"
        )
    if not inside or section in FIXED:
        raise InputError(
            f"{where} {shown(key)}: is no key of a section of the study, such as damper.pull or "
            "contact.left.kn"
        )
    name, _, of_side = inside.partition(".")
    if section == "contact" and of_side and name not in study.sides:
        there = f"there are {', '.join(study.sides)}" if study.sides else "there is none"
        raise InputError(
            f"{where} {shown(key)}: no section [contact.{shown(name)}]; {there}. A side of a table "
            "of pairs needs one with its shape, such as shape = 'flat', so that its values can vary"
            if study.contact.pairs
            else f"{where} {shown(key)}: no side {shown(name)!r}; {there}"
        )


def _rows(path: Path) -> Iterator[Case]:
    """Rows of a CSV of cases; one of empty cells is the study itself, a blank line is none."""
    if not path.is_file():
        raise InputError(f"[sweep] cases: file not found: {path}")
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.reader(file))
    first = next((i for i, row in enumerate(rows) if any(map(str.strip, row))), len(rows))
    header, *lines = rows[first:] or [[]]
    lines = [row for row in lines if len(row) > 1 or any(map(str.strip, row))]
    keys = [cell.strip() for cell in header]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{path}: {shown(key)} stands in its first line twice")
    if not lines:
        raise InputError(f"{path}: holds no case: dotted keys in the first line, one case a line")
    for number, row in enumerate(lines, 1):
        if len(row) != len(keys):
            remedy = "; cells are parted by commas, decimals are points" * (";" in "".join(header))
            raise InputError(
                f"{path}: case {number} has {len(row)} cells, the header {len(keys)}{remedy}"
            )
    # every row has every key: a data set has them as columns
    for row in lines:
        yield {key: _cell(cell.strip()) for key, cell in zip(keys, row, strict=True)}


def _cell(text: str) -> Any:
    """A value as TOML writes it; what is none is a text, nothing is None: as in the study."""
    if not text:
        return None
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _samples(study: Study) -> list[Case]:
    """Latin hypercube: in each key every one of equal parts of its range has one sample.
    [McKay, Beckman, Conover 1979]"""
    from scipy.stats import qmc

    sweep = study.sweep
    share = qmc.LatinHypercube(d=len(sweep.sample), seed=sweep.seed).random(sweep.samples)
    columns = [one.at(share[:, i]).tolist() for i, one in enumerate(sweep.sample)]
    keys = [one.key for one in sweep.sample]
    return [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]


@lru_cache(maxsize=1000)
def sheet(key: str) -> Key | None:
    """Data sheet of a dotted key, None where there is no such key."""
    section, *inside = key.split(".")
    schema = (NAMED if len(inside) == 2 else SECTIONS).get(section)
    return schema.data_sheets().get(inside[-1]) if schema and inside else None


def content_of(content: dict, case: Case) -> dict:
    """Content of the study file with the values of a case, without its [sweep]."""
    found = {name: part for name, part in content.items() if name != "sweep"}
    for key, value in case.items():
        *sections, last = key.split(".")
        place = found
        for name in sections:
            inside = place.get(name, {})
            if not isinstance(inside, dict):
                raise InputError(f"{shown(key)}: {shown(name)} is no section")
            place[name] = dict(inside)  # the content itself stays as it is
            place = place[name]
        if value is not None:
            place[last] = _listed(key, value)
    return found


def _listed(key: str, value: Any) -> Any:
    """A single value of a key that takes a list is a list of one."""
    known = sheet(key)
    if known is None or isinstance(value, list):
        return value
    number = isinstance(value, int | float)
    lists = known.kind in (NUMBERS, TEXTS, COLUMNS) or known.kind is PHASE and number
    return [value] if lists else value


def study_of_case(
    path: Path, content: dict, number: int, case: Case, checked: dict | None = None
) -> Study:
    """The study of a case, whose files are there; InputError names the case, counted from 1.

    checked - as in `study_of`, of all cases"""
    try:
        study = study_of(path, content_of(content, case), checked)
        _check_files(study)
        return study
    except InputError as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise InputError(
            f"{path}: [sweep] case {number} ({shown(in_words(case), 200)}): {reason}"
        ) from None


def _check_files(study: Study) -> None:
    for key, file in study.inputs().items():
        if not file.is_file():
            raise InputError(f"{study.path}: {key}: file not found: {file}")


def in_words(case: Case) -> str:
    """'damper.pull = 20, contact.mu = 0.3'"""
    return ", ".join(f"{key} = {_short(value)}" for key, value in case.items() if value is not None)


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
