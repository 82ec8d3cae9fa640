"""Study files: one TOML that names the meshes, the contact, the pull and the excitation.

`language.py` is what may stand in it. Anything else in a file is refused with the nearest valid name; a value out of
range is answered with file, key, value and range.
"""

import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from hbm.errors import InputError, nearest
from tipdamp.stiffness import is_given
from tipdamp.study.checks import (
    check_contact,
    check_history,
    check_modes,
    check_respond,
    check_side,
    check_tune,
    refuse_beside_pairs,
)
from tipdamp.study.schema import (
    CONTACT,
    FREE,
    LOAD,
    OTHER_MATERIAL,
    POINTS,
    PRELOAD,
    REFERENCE,
    REQUIRED,
    RESPOND,
    SECTIONS,
    SIDE,
    STUDY,
    UNITS,
    Key,
)
from tipdamp.study.values import number, read


@dataclass(frozen=True)
class Study:
    """A checked study in SI units. `sections` {name: {key: value}}; sides and materials in the order of the file."""

    path: Path
    title: str
    results: Path
    sections: dict
    sides: dict
    reference: dict
    length_unit: float
    materials: dict
    loads: dict = field(default_factory=dict)    # {case: {key: value}}

    @property
    def name(self) -> str:
        return self.path.stem

    def __getitem__(self, section: str) -> dict:
        return self.sections[section]

    def __contains__(self, section: str) -> bool:
        return section in self.sections

    @property
    def driver(self) -> dict:
        """Section that holds axis, pull and pull_direction: [damper] with meshes, [model] with matrices."""
        return self.sections["model"] if "model" in self.sections else self.sections["damper"]

    def part(self, name: str):
        """A section or one of these: what a stage may depend on.

        'points', 'groups' - nodes that [respond] and the contact sides name; 'damper_body', 'model_body' - [damper] and
        [model] without the size of the pull; 'driver' - axis and pull; 'wanted_error' - the springs of the contact
        where [blades] or [damper] asks for an error of the stuck frequencies; 'sides', 'loads', 'materials', 'title',
        'reference'.
        """
        points = {k: v for k, v in self.sections.get("respond", {}).items() if RESPOND[k].kind in POINTS}
        groups = [{k: side[k] for k in ("blade", "damper")} | {"given": is_given(side)} for side in self.sides.values()]
        contact = {k: self.sections["contact"][k] for k in ("pairs", "tolerance", "distance", "stiffness")}
        own = {"sides": self.sides, "title": self.title, "reference": self.reference, "points": points,
               "materials": self.materials, "loads": self.loads,
               "groups": [list(self.sides), groups, contact], "driver": self.driver,
               "wanted_error": [self.driver, self.sides, self.sections["contact"]]
               if any(self.sections.get(b, {}).get("error") for b in ("blades", "damper")) else None,
               "damper_body": _without_pull(self.sections.get("damper")),
               "model_body": _without_pull(self.sections.get("model"))}
        return own[name] if name in own else self.sections.get(name)

    def group_name(self, section: str, key: str) -> str:
        """The node group that a key names, such as ('contact.left', 'blade') or ('respond', 'patches[0]')."""
        part, _, name = section.partition(".")
        table = {"contact": self.sides, "material": self.materials}[part][name] if name else self[section]
        key, _, index = key.partition("[")
        return table[key][int(index.rstrip("]"))] if index else table[key]

    def input_files(self) -> list[Path]:
        """Files that the study names: meshes, or matrices and pairs."""
        names = [("model", "matrices"), ("contact", "pairs"), ("blades", "mesh"), ("damper", "mesh")]
        return [self.file(self[s][k]) for s, k in names if s in self and self[s][k]]

    def file(self, relative: str) -> Path:
        """A file named in the study, relative to the study's own folder."""
        return self.path.parent / relative


def _without_pull(section):
    return {k: v for k, v in section.items() if k != "pull"} if section else None


def load_study(path) -> Study:
    """Read and check a study file; InputError names file, section, key, value and what is allowed."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"study file not found: {path} (looked for it as {path.absolute()})")
    try:
        raw = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a valid TOML file: {error}") from None
    known = [*STUDY, "units", *SECTIONS, "loads", "reference"]
    for key in raw:
        if key not in known:
            raise InputError(f"{path}: unknown key '{key}'; {nearest(key, known)}")
    factors = _units(path, raw.pop("units", {}))
    top = _section(path, "", {k: raw.pop(k) for k in STUDY if k in raw}, STUDY, factors)
    sides, materials = (_named(raw, section) for section in ("contact", "material"))
    _require(path, raw, sides)
    sections = {name: _section(path, name, raw[name], SECTIONS[name], factors) for name in SECTIONS if name in raw}
    if not _own_pairs(raw) and sections["contact"]["mu"] is None:
        raise InputError(f"{path}: [contact] mu is missing: {CONTACT['mu'].text}")
    if "model" in raw and not _own_pairs(raw):
        raise InputError(f"{path}: [contact] pairs is missing: with [model] the pairs come from a CSV")
    for name in ("blades", "damper"):
        check_modes(f"{path}: [{name}]", raw.get(name, {}))
    if "tune" in sections:
        check_tune(f"{path}: [tune]", sections["tune"])
    if _own_pairs(raw):
        refuse_beside_pairs(path, raw["contact"], sides)
    else:
        check_contact(f"{path}: [contact]", raw["contact"])
    if "respond" in sections:
        check_respond(f"{path}: [respond]", sections["respond"])
    sections.setdefault("free", _section(path, "free", {}, FREE, factors))
    sections.setdefault("preload", _section(path, "preload", {}, PRELOAD, factors))
    sides = {k: _side(path, k, v, factors, sections["contact"]) for k, v in sides.items()}
    materials = {k: _section(path, f"material.{k}", v, OTHER_MATERIAL, factors) for k, v in materials.items()}
    loads = {k: _load(path, k, v, factors, "model" in raw) for k, v in _table_of_cases(path, raw).items()}
    check_history(f"{path}: [preload]", sections["preload"], list(loads))
    reference = raw.get("reference", {})
    for key, value in reference.items():
        if key not in REFERENCE:
            raise InputError(f"{path}: [reference] unknown key '{key}'; {nearest(key, REFERENCE)}")
        number(f"{path}: [reference] {key} = {value!r}", value, Key("number", "", low=0))
    results = path.parent / (top["results"] or Path("results") / path.stem)
    return Study(path, top["title"] or path.stem, results, sections, sides, reference, factors["length"],
                 materials, loads)


def _named(raw, section):
    """Tables inside a section, such as [contact.left] or [material.tip], taken out of it."""
    table = raw.get(section)
    return {k: table.pop(k) for k in list(table) if isinstance(table[k], dict)} if isinstance(table, dict) else {}


def _require(path, raw, sides):
    meshed = [name for name in ("material", "blades", "damper") if name in raw]
    if "model" in raw and meshed:
        raise InputError(f"{path}: [model] and [{meshed[0]}] exclude each other: matrices or meshes")
    for name in ["model", "contact"] if "model" in raw else ["material", "blades", "damper", "contact"]:
        if name not in raw:
            raise InputError(f"{path}: section [{name}] is missing")
    if not _own_pairs(raw) and len(sides) < 2:
        raise InputError(f"{path}: {len(sides)} contact sides; a free damper needs two, such as [contact.left] and "
                         "[contact.right]")


def _own_pairs(raw) -> bool:
    """With a table of one's own the pairs are not matched between the meshes: sides only add what it lacks."""
    return isinstance(raw["contact"], dict) and bool(raw["contact"].get("pairs"))


def _units(path, given):
    factors = {}
    for key in given:
        if key not in UNITS:
            raise InputError(f"{path}: [units] unknown key '{key}'; {nearest(key, UNITS)}")
    for key, allowed in UNITS.items():
        name = given.get(key, next(iter(allowed)))
        if name not in allowed:
            raise InputError(f"{path}: [units] {key} = {name!r}: {nearest(name, allowed)}")
        factors[key] = allowed[name]
    factors["force/length"] = factors["force"] / factors["length"]
    factors[""] = 1.0
    return factors


def _side(path, name, given, factors, contact):
    side = _section(path, f"contact.{name}", given, SIDE, factors)
    check_side(f"{path}: [contact.{name}]", side, contact)
    return side


def _table_of_cases(path, raw):
    cases = raw.get("loads", {})
    if not isinstance(cases, dict) or not all(isinstance(v, dict) for v in cases.values()):
        raise InputError(f"{path}: [loads] must hold load cases such as [loads.takeoff]")
    for name in cases:
        if name == "pull" or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
            raise InputError(f"{path}: [loads.{name}]: a case is named by letters, digits, - and _, and not 'pull'")
    return cases


def _load(path, name, given, factors, matrices):
    case = _section(path, f"loads.{name}", given, LOAD, factors)
    extra = [key for key in given if key != "pull"]
    if matrices and extra:
        raise InputError(f"{path}: [loads.{name}] {extra[0]}: with [model] the case is the load '{name}' of its "
                         "matrices; only pull may be stated")
    return case


def _section(path, name, given, keys, factors):
    where = f"{path}: [{name}]" if name else f"{path}:"
    if not isinstance(given, dict):
        raise InputError(f"{where} must be a section, got {given!r}")
    for key in given:
        if key not in keys:
            raise InputError(f"{where} unknown key '{key}'; {nearest(key, keys)}")
    out = {}
    for key, spec in keys.items():
        if key not in given:
            if spec.default is REQUIRED:
                raise InputError(f"{where} {key} is missing: {spec.text}")
            out[key] = None if spec.kind == "roll" and spec.default == "from_flat" else spec.default
        else:
            out[key] = read(f"{where} {key} = {given[key]!r}", given[key], spec, factors[spec.unit])
    return out
