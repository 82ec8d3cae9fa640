"""The language of study files as a text: every section and key with kind, unit, default, range and meaning."""

import numpy as np

from tipdamp.study.schema import LOAD, OTHER_MATERIAL, REFERENCE, REQUIRED, SECTIONS, SIDE, STUDY, UNITS

_KINDS = {"texts": "list of texts", "one_or_more": "text or list of texts", "numbers": "list of numbers",
          "ratios": "number or list", "counts": "whole number or list", "stations": "[front, back] or 'all'",
          "count": "whole number", "vector": "[x, y, z]",
          "triple": "[x, y, z]", "group_values": "[[body, group, value], ...]",
          "group_vectors": "[[body, group, x, y, z], ...]", "band": "[first, last]",
          "flag": "true or false", "table": "[[coordinate, value], ...]", "roll": "'from_flat' or number"}


def reference() -> str:
    """Markdown, one table per section."""
    lines = ["# Study files", "",
             "Made by `tipdamp keys` from the tables that the program reads study files with.", "",
             "A study is one TOML file. Every key that is not in these tables is refused. Units are stated once, in "
             "`[units]`; all lengths, forces, stresses and densities of the file, mesh coordinates included, are in "
             "them. Frequencies are in Hz.", "", "## [units]", "", "| key | choices (first: default) |", "|---|---|",
             *(f"| `{k}` | {', '.join(v)} |" for k, v in UNITS.items())]
    tables = {"top of the file": STUDY, **{f"[{k}]": v for k, v in SECTIONS.items()}}
    for title, keys in tables.items():
        lines += _table(title, keys)
        if title == "[material]":
            lines += _table("[material.NAME], one for each other material", OTHER_MATERIAL)
        if title == "[contact]":
            lines += _table("[contact.NAME], one for each side of the damper", SIDE)
        if title == "[rotation]":
            lines += _table("[loads.NAME], one for each further load case of the preload", LOAD)
    lines += ["", "## [reference]", "", "Measured or published values, set beside the computed ones in the report: "
              + ", ".join(f"`{k}`" for k in REFERENCE) + "."]
    return "\n".join(lines) + "\n"


def _table(title, keys):
    rows = [f"| `{k}` | {', '.join(s.choices) or _KINDS.get(s.kind, s.kind)} | {s.unit or ''} | {_default(s)} | "
            f"{_range(s)} | {s.text} |"
            for k, s in keys.items()]
    head = ["", f"## {title}", "", "| key | kind | unit | default | range | meaning |", "|---|---|---|---|---|---|"]
    return head + rows


def _default(spec):
    if spec.default is REQUIRED:
        return "required"
    return "" if spec.default in (None, "", ()) else f"`{spec.default}`"


def _range(spec):
    low = f"{'>' if spec.open_low else '≥'} {spec.low:g}" if np.isfinite(spec.low) else ""
    high = f"≤ {spec.high:g}" if np.isfinite(spec.high) else ""
    return ", ".join(part for part in (low, high) if part)
