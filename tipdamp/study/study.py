"""Study files: one TOML that names the meshes, the contact, the pull and the excitation.

`schema.py` is what may stand in it. Anything else in a file is refused with the nearest valid name;
a value out of range is answered with file, section, key, value and range.
"""

import json
import re
from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.study import checks
from tipdamp.study.schema import (
    NAMED,
    REFERENCE,
    SECTIONS,
    UNITS,
    Respond,
    StudySection,
    Top,
)
from tipdamp.study.toml_file import read_toml
from tipdamp.study.values import NUMBER, Key, in_toml, number
from tipdamp.study.view import SECTION_OF, Study

S = TypeVar("S", bound=StudySection)
# sections of tables with names of their own
TABLES = {"loads": "[loads.takeoff]", "measured": "[measured.run_1]"}


def load_study(path: str | Path) -> Study:
    """Read and check a study file; InputError names file, section, key, value and what is
    allowed.

    >>> from pathlib import Path
    >>> written = Path("study.toml").write_text('''
    ... [units]
    ... length = "mm"
    ... [model]
    ... matrices = "model.npz"
    ... axis = [1, 0, 0]
    ... pull = 60
    ... [contact]
    ... pairs = "pairs.csv"
    ... [contact.left]
    ... shape = "cylinder"
    ... [contact.right]
    ... shape = "cylinder"
    ... ''')
    >>> study = load_study("study.toml")
    >>> study.title, study.model.pull, sorted(study.sides)
    ('study', 60.0, ['left', 'right'])
    """
    return study_of(path, read_toml(Path(path)))


def study_of(path: str | Path, content: dict, checked: dict | None = None) -> Study:
    """As `load_study`, of the content of a file that stands, or would stand, at the path; checked -
    what was found in order in studies at this path, which those with the same content share."""
    path, checked = Path(path), {} if checked is None else checked
    raw = {key: dict(part) if isinstance(part, dict) else part for key, part in content.items()}
    named = {section: _named(raw, section) for section in ("contact", "material")}
    named |= {section: _named_tables(path, raw, section) for section in TABLES}
    _refuse_unknown(path, raw, named)
    factors = _units(path, raw.pop("units", {}))
    read = partial(_read, factors=factors, checked=checked)
    top = read(Top, f"{path}:", {k: raw.pop(k) for k in Top.model_fields if k in raw})
    checks.require_sections(path, raw, named["contact"])
    sections = _sections(path, raw, read)
    study = Study(
        path=path,
        title=top.title or path.stem,
        length_unit=factors["length"],
        results=path.parent / (top.results or Path("results") / path.stem),
        driver=sections["model" if "model" in sections else "damper"],
        reference=_reference(path, raw.get("reference", {})),
        **sections,
        **{
            part: {
                name: read(NAMED[section], f"{path}: [{section}.{name}]", values)
                for name, values in named[section].items()
            }
            for part, section in SECTION_OF.items()
            if section in named and (section != "measured" or section in raw)
        },
    )
    files = tuple(study.inputs().items())
    if files not in checked:
        checks.check_files(study)
        checked[files] = True
    checks.check_study(study)
    return study


def _sections(path: Path, raw: dict[str, Any], read: Callable) -> dict[str, Any]:
    """{section: its record} of those that the file has, and of those whose keys all have
    defaults."""
    given = {"free": {}, "preload": {}, **raw}
    found = {
        name: read(section, f"{path}: [{name}]", given[name])
        for name, section in SECTIONS.items()
        if name in given
    }
    if "respond" in found:
        found["respond"] = _with_law(path, found["respond"])
    return found


def _refuse_unknown(
    path: Path,
    raw: dict[str, dict[str, Any] | str],
    named: dict[str, dict[str, dict[str, Any]]],
) -> None:
    """All unknown keys of a file in one InputError; named {section: tables with names of their
    own}."""
    tables = [
        ("", raw, (*Top.model_fields, "units", *SECTIONS, *TABLES, "reference")),
        ("[units] ", raw.get("units"), UNITS),
        ("[reference] ", raw.get("reference"), REFERENCE),
    ]
    tables += [
        (f"[{name}] ", raw.get(name), section.model_fields) for name, section in SECTIONS.items()
    ]
    for section, given in named.items():
        keys = NAMED[section].model_fields
        tables += [(f"[{section}.{shown(name)}] ", table, keys) for name, table in given.items()]
    found = [
        where + _in_words(unknown, allowed)
        for where, table, allowed in tables
        if isinstance(table, dict) and (unknown := [key for key in table if key not in allowed])
    ]
    if found:
        raise InputError(f"{path}: {'; '.join(found)}")


def _in_words(unknown: Sequence[str], allowed: Collection[str]) -> str:
    if len(unknown) == 1:
        return f"unknown key '{shown(unknown[0])}'; {nearest(unknown[0], allowed)}"
    hints = [(shown(key), nearest(key, allowed).partition("valid: ")[0].strip()) for key in unknown]
    listed = ", ".join(f"'{key}'" + f" ({hint})" * bool(hint) for key, hint in hints)
    return f"unknown keys {listed}; valid: {', '.join(allowed)}"


def _units(path: Path, given: dict[str, str]) -> dict[str, float]:
    """{unit: factor to SI}"""
    if not isinstance(given, dict):
        raise InputError(f"{path}: [units] must be a section, got {in_toml(given)}")
    factors = {}
    for key, allowed in UNITS.items():
        name = given.get(key, next(iter(allowed)))
        if not isinstance(name, str) or name not in allowed:
            raise InputError(
                f"{path}: [units] {key} = {in_toml(name)}: {nearest(str(name), allowed)}"
            )
        factors[key] = allowed[name]
    return {
        **factors,
        "force/length": factors["force"] / factors["length"],
        "force/length3": factors["force"] / factors["length"] ** 3,
    }


def _named(raw: dict[str, dict[str, Any] | str], section: str) -> dict[str, dict[str, Any]]:
    """Tables inside a section, such as [contact.left] or [material.tip], taken out of it; a table
    in the place of one of its keys stays, to be refused as a value of that key."""
    table, keys = raw.get(section), SECTIONS[section].model_fields
    if not isinstance(table, dict):
        return {}
    return {k: table.pop(k) for k in list(table) if isinstance(table[k], dict) and k not in keys}


def _named_tables(
    path: Path, raw: dict[str, dict[str, Any] | str], section: str
) -> dict[str, dict[str, Any]]:
    tables = raw.get(section, {})
    if not isinstance(tables, dict) or not all(isinstance(v, dict) for v in tables.values()):
        raise InputError(f"{path}: [{section}] must hold tables such as {TABLES[section]}")
    for name in tables:
        if name == "pull" or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
            raise InputError(
                f"{path}: [{section}.{shown(name)}]: is named by letters, digits, - and _, and "
                "not 'pull'"
            )
    return tables


def _reference(path: Path, given: dict[str, int]) -> dict[str, int]:
    if not isinstance(given, dict):
        raise InputError(f"{path}: [reference] must be a section, got {in_toml(given)}")
    for key, value in given.items():
        try:
            number(value, Key(NUMBER, "", low=0))
        except ValueError as error:
            raise InputError(f"{path}: [reference] {key} = {in_toml(value)}: {error}") from None
    return given


def _with_law(path: Path, respond: Respond) -> Respond:
    """[respond] with the content of the file of a law of one's own."""
    try:
        law = respond.law.beside(path)
    except InputError as error:
        raise InputError(f"{path}: [respond] law = '{respond.law}': {error}") from None
    return respond if law is respond.law else respond.model_copy(update={"law": law})


def _read(section: type[S], where: str, given: Any, factors: dict, checked: dict) -> S:
    """One section in SI units, where it is not among those `checked`; the first thing that is wrong
    with it as an InputError."""
    if not isinstance(given, dict):
        raise InputError(f"{where} must be a section, got {in_toml(given)}")
    seen = where, json.dumps(given, default=repr), *factors.values()
    try:
        if seen not in checked:
            checked[seen] = section.model_validate(given, context=factors)
        return checked[seen]
    except ValidationError as error:
        wrong = error.errors(include_url=False)[0]
    key = str(wrong["loc"][0])
    if wrong["type"] == "missing":
        raise InputError(f"{where} {key} is missing: {section.data_sheets()[key].text}")
    raise InputError(f"{where} {key} = {in_toml(given[key])}: {wrong['ctx']['error']}")
