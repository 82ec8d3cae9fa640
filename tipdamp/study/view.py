"""A checked study, and the view of it that a stage gets: what it has declared, so that its key
follows from that."""

from collections.abc import Iterable, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from pydantic import BaseModel

from tipdamp.study import schema


class Study:
    """A checked study in SI units, read by attribute: `study.damper.pull`. `"tune" in study` asks
    for a section.

    Sections that the file does not have are not there, except [free] and [preload], whose keys all
    have defaults. sides, materials, loads, measured - [contact.NAME], [material.NAME],
    [loads.NAME], [measured.NAME] in the order of the file; measured only where there is one
    driver - the section with axis, pull and pull_direction: [damper] with meshes, [model] with
    matrices length_unit - m, of the coordinates of the meshes
    """

    path: Path
    title: str
    results: Path
    length_unit: float
    material: schema.MaterialSection
    blades: schema.Blades
    damper: schema.Damper
    model: schema.Model
    driver: schema.Damper | schema.Model
    contact: schema.ContactSection
    rotation: schema.RotationSection
    preload: schema.PreloadSection
    tune: schema.Tune
    free: schema.Free
    respond: schema.Respond
    fit: schema.Fit
    backbone: schema.BackboneSection
    sweep: schema.Sweep
    compare: schema.CompareSection
    sides: dict[str, schema.SideSection]
    materials: dict[str, schema.OtherMaterial]
    loads: dict[str, schema.LoadCase]
    measured: dict[str, schema.Measured]
    reference: dict[str, float]

    def __init__(self, **parts: object) -> None:
        vars(self).update(parts)

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a study is not changed: {name}")

    def __contains__(self, part: str) -> bool:
        return part in vars(self)

    def shows(self, part: str) -> bool:
        """As `part in study`; False also where the stage that looks does not read the part in this
        study."""
        return part in vars(self)

    @property
    def name(self) -> str:
        """Name of the file without its ending."""
        return self.path.stem

    def file(self, relative: str) -> Path:
        """A file named in the study, relative to the study's own folder."""
        return self.path.parent / relative

    def holds(self, path: Path) -> bool:
        """Whether a path lies in the study's own folder."""
        return path.resolve().is_relative_to(self.path.parent.resolve())

    def inputs(self, *sections: str) -> dict[str, Path]:
        """{key: file} that the study names, of all or of these sections: meshes or matrices, pairs,
        measured curves."""
        named = [
            (section, f"[{section}] {key}", (vars(vars(self)[section])[key],))
            for section, key in FILES
            if section in vars(self)
        ]
        named += [
            ("measured", f"[measured.{name}] files", one.files)
            for name, one in vars(self).get("measured", {}).items()
        ]
        if "respond" in vars(self):
            named.append(("respond", "[respond] law", (vars(self)["respond"].law.file,)))
        return {
            key if len(files) == 1 else f"{key} {k}": self.file(file)
            for section, key, files in named
            for k, file in enumerate(files, 1)
            if file and (not sections or section in sections)
        }


FILES = (
    ("model", "matrices"),
    ("blades", "mesh"),
    ("damper", "mesh"),
    ("contact", "pairs"),
    ("tune", "kept"),
    ("sweep", "cases"),
)  # (section, key)
# all that can be declared
PARTS = tuple(name for name in Study.__annotations__ if name not in ("path", "results"))


SECTION_OF = {
    "driver": "damper or model",
    "sides": "contact",
    "materials": "material",
    "loads": "loads",
    "measured": "measured",
}


class Undeclared(AttributeError):
    """A stage reads what its declaration does not name: a bug."""


class _Keys:
    """Some keys of a section, by attribute."""

    def __init__(self, owner: str, section: object, keys: Iterable[str]) -> None:
        vars(self).update({"_owner": owner, **{key: attrgetter(key)(section) for key in keys}})

    def __getattr__(self, name: str) -> NoReturn:
        raise Undeclared(f"{vars(self)['_owner']}.{name} is read, but not declared")


Value = float | str | None
Part: TypeAlias = BaseModel | _Keys | dict[str, Any] | tuple[Any, ...] | Value


class View(Study):
    """A study cut down to `reads`: names of parts, such as 'contact' or 'sides', and of keys, such
    as 'respond.patches' or 'sides.blade' (of every side). Where the file is, is always known."""

    def __init__(self, study: Study, stage: str, reads: Iterable[str]) -> None:
        wanted: dict[str, list[str]] = {}
        for name in reads:
            part, _, key = name.partition(".")
            wanted.setdefault(part, []).append(key)
        found = {
            part: _cut(f"stage '{stage}': {part}", vars(study)[part], keys)
            for part, keys in wanted.items()
            if part in study
        }
        super().__init__(
            path=study.path,
            results=study.results,
            _stage=stage,
            _declared=frozenset(wanted),
            **found,
        )

    def __getattr__(self, name: str) -> NoReturn:
        stage = vars(self).get("_stage")
        raise Undeclared(
            f"stage '{stage}': {name} is read, but "
            + (
                "the study does not have it"
                if name in vars(self).get("_declared", ())
                else "not declared"
            )
        )

    def __contains__(self, part: str) -> bool:
        if part not in vars(self)["_declared"]:
            raise Undeclared(
                f"stage '{vars(self)['_stage']}': {part} is asked for, but not declared"
            )
        return part in vars(self)

    def values(self) -> dict[str, Any]:
        """What was declared as plain values: the study's share in the key of the stage."""
        return {
            part: _plain(vars(self)[part])
            for part in sorted(vars(self)["_declared"])
            if part in self
        }

    def keys(self) -> dict[str, Any]:
        """{'[section] key': plain value} of what was declared."""
        found: dict[str, Any] = {}
        for part, value in self.values().items():
            tables = value if isinstance(value, list) and part in SECTION_OF else [["", value]]
            for name, table in tables:
                section = ".".join(filter(None, (SECTION_OF.get(part, part), name)))
                found |= (
                    {f"[{section}] {key}": v for key, v in table.items()}
                    if isinstance(table, dict)
                    else {section: table}
                )
            if len(tables) > 1:
                found[f"the order of [{SECTION_OF[part]}.NAME]"] = [name for name, _ in tables]
        return found


def every_key(section: str, but: Iterable[str]) -> list[str]:
    """The keys of a section without some of them, as names for a declaration."""
    return [f"{section}.{key}" for key in schema.SECTIONS[section].model_fields if key not in but]


def _cut(owner: str, part: Part, keys: Sequence[str]) -> Part:
    if "" in keys:
        return part
    if isinstance(part, dict):
        return {name: _Keys(f"{owner}.{name}", section, keys) for name, section in part.items()}
    return _Keys(owner, part, keys)


def _plain(part: Part) -> dict[str, Any] | list[Any] | Value:
    if isinstance(part, dict):
        return [[name, _plain(value)] for name, value in part.items()]  # their order counts
    if isinstance(part, BaseModel):
        return part.model_dump()
    if isinstance(part, tuple):
        return [_plain(value) for value in part]
    return (
        {k: _plain(v) for k, v in vars(part).items() if k != "_owner"}
        if isinstance(part, _Keys)
        else part
    )
