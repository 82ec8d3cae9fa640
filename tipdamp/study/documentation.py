"""What a study file may hold, from its schema: as a text for readers, and as a JSON schema for
editors."""

from collections.abc import Sequence
from difflib import get_close_matches

import numpy as np

from tipdamp.hbm.errors import InputError, shown
from tipdamp.study.schema import (
    NAMED,
    NONE,
    REFERENCE,
    SECTIONS,
    UNITS,
    StudySection,
    Top,
)
from tipdamp.study.values import Key

FEW = 5  # keys named for one that there is not


def reference() -> str:
    """Markdown, one table per section."""
    lines = [
        "# Study files",
        "",
        "Made by `tipdamp keys` from the sections that the program reads study files with. "
        "`tipdamp keys --json-schema` writes the same as a JSON schema, with which an editor "
        "completes and checks a study while it is typed.",
        "",
        "A study is one TOML file. Every key that is not in these tables is refused. Units are "
        "stated once, in `[units]`; all lengths, forces, stresses and densities of the file, "
        "mesh coordinates included, are in them. Frequencies are in Hz.",
        "",
        "## [units]",
        "",
        "| key | choices (first: default) |",
        "|---|---|",
        *(f"| `{k}` | {', '.join(v)} |" for k, v in UNITS.items()),
        *_table("top of the file", Top),
    ]
    after = {
        "material": ("material", "other material"),
        "contact": ("contact", "side of the damper"),
        "rotation": ("loads", "further load case of the preload"),
        "respond": ("measured", "measured curve"),
    }
    for name, section in SECTIONS.items():
        lines += _table(f"[{name}]", section)
        if name in after:
            inner, what = after[name]
            lines += _table(f"[{inner}.NAME], one for each {what}", NAMED[inner])
    lines += [
        "",
        "## [reference]",
        "",
        "Measured or published values, set beside the computed ones in the report: "
        + ", ".join(f"`{k}`" for k in REFERENCE)
        + ".",
    ]
    return "\n".join(lines) + "\n"


def key_names() -> list[str]:
    """Dotted names of all keys, as `explain` takes them."""
    found = (f"{title}.{one}" for title, s in _sections().items() for one in s.data_sheets())
    return [name.removeprefix("top.") for name in found]


def explain(name: str) -> str:
    """What a key is, in every section that has it. name : 'kn', or in one section 'contact.kn' or
    'contact.left.kn'; a section, 'sweep', for all its keys.

    Raises InputError where no section has such a key.
    """
    section, _, key = name.rpartition(".")
    known = {
        (title, one): (where, sheet)
        for title, where in _sections().items()
        for one, sheet in where.data_sheets().items()
    }
    said = [
        _explained(title, one, where, sheet)
        for (title, one), (where, sheet) in known.items()
        if name == title
        or one == key
        and (section in ("", title, title.split(".")[0]) or _of_kind(section, title))
    ]
    if not said:
        names = [f"{title}.{one}".removeprefix("top.") for title, one in known]
        inside = [one for one in names if section and one.startswith(f"{section}.")]
        same = [one for one in names if one.rpartition(".")[2] == key]  # of another section
        close = _nearest_few(key, inside) or (same or inside)[:FEW] or _nearest_few(key, names)
        meant = f"did you mean {', '.join(close)}? " if close else ""
        raise InputError(f"no key '{shown(name)}' of a study; {meant}all: tipdamp keys")
    return "\n\n".join(said) + "\n"


def _of_kind(section: str, title: str) -> bool:
    """Whether a section such as 'contact.left' is of the kind 'contact.NAME'."""
    kind, dot, own = section.partition(".")
    return bool(dot and own) and title == f"{kind}.NAME"


def _nearest_few(key: str, names: Sequence[str]) -> list[str]:
    """Of the dotted names those whose key is the nearest one, of any section."""
    last = {name: name.rpartition(".")[2] for name in names}
    close = get_close_matches(key, dict.fromkeys(last.values()), n=1)
    return [name for name in names if last[name] in close][:FEW]


def _sections() -> dict[str, type[StudySection]]:
    """{title: section} of all tables of a study."""
    inner = {f"{name}.NAME": section for name, section in NAMED.items()}
    return {"top": Top, **SECTIONS, **inner}


def _explained(title: str, name: str, section: type[StudySection], key: Key) -> str:
    facts = {
        "kind": ", ".join(key.choices) or key.kind.shown,
        "unit": key.unit,
        "default": _default(section, name).strip("`"),
        "range": _range(key),
    }
    head = name if title == "top" else f"[{title}] {name}"
    lines = [head, f"  {key.text}", *(f"  {what}: {said}" for what, said in facts.items() if said)]
    return "\n".join(lines)


def json_schema() -> dict:
    """JSON schema of a whole study file, in its own units."""
    number = {"type": "number", "minimum": 0}
    sections = {name: _object(section) for name, section in SECTIONS.items()}
    for name, inner in NAMED.items():
        table = sections.setdefault(name, {"type": "object"})
        table["additionalProperties"] = _object(inner)
    units = {
        key: {"enum": list(names), "default": next(iter(names))} for key, names in UNITS.items()
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Study of tipdamp",
        **_object(Top),
        "properties": {
            **_object(Top)["properties"],
            "units": {"type": "object", "properties": units, "additionalProperties": False},
            **sections,
            "reference": {
                "type": "object",
                "properties": dict.fromkeys(REFERENCE, number),
                "additionalProperties": False,
            },
        },
    }


def _object(section: type[StudySection]) -> dict:
    """The section's own schema; an absent value has no form in TOML, so no default None."""
    schema = section.model_json_schema()
    for key in schema["properties"].values():
        if key.get("default", "") in (None, [], list(NONE)):
            del key["default"]
    return {k: v for k, v in schema.items() if k not in ("title", "$defs")}


def _table(title: str, section: type[StudySection]) -> list[str]:
    rows = [
        f"| `{name}` | {', '.join(key.choices) or key.kind.shown} | {key.unit} | "
        f"{_default(section, name)} | {_range(key)} | {key.text} |"
        for name, key in section.data_sheets().items()
    ]
    head = [
        "",
        f"## {title}",
        "",
        "| key | kind | unit | default | range | meaning |",
        "|---|---|---|---|---|---|",
    ]
    return head + rows


def _default(section: type[StudySection], name: str) -> str:
    field = section.model_fields[name]
    if field.is_required():
        return "required"
    return "" if field.default in (None, "", (), NONE) else f"`{field.default}`"


def _range(key: Key) -> str:
    low = ""
    if np.isfinite(key.low):
        low = f"{'>' if key.open_low else '≥'} {key.low:g}"
    high = f"≤ {key.high:g}" if np.isfinite(key.high) else ""
    return ", ".join(part for part in (low, high) if part)
