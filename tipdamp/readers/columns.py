"""Columns of numbers from text (CSV) and MATLAB files, by their meaning."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.io.array_files import open_matlab
from tipdamp.readers.content import decode

MEANINGS = (
    "frequency_hz",
    "frequency_rad_s",
    "amplitude",
    "complex",
    "real",
    "imaginary",
    "phase_deg",
    "phase_rad",
    "force",
)
IGNORED = "-"
NUMBER = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?|[-+]?(nan|inf(inity)?)", re.IGNORECASE
)
DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Columns:
    """values {meaning: (n,)}; places (n,) - where each row stands, such as 'line 7'; source - of
    the numbers."""

    values: dict[str, np.ndarray]
    places: tuple[str, ...]
    source: str


def parse_meanings(columns: Sequence[str]) -> list[tuple[str, str]]:
    """[(meaning, name in the file or '')] of 'meaning' or 'meaning:name'.

    Raises ValueError with what is allowed.
    """
    parsed = [(meaning, name) for meaning, _, name in (column.partition(":") for column in columns)]
    known = [meaning for meaning, _ in parsed if meaning != IGNORED]
    for meaning in known:
        if meaning not in MEANINGS:
            raise ValueError(nearest(meaning, (*MEANINGS, IGNORED)))
        if known.count(meaning) > 1:
            raise ValueError(f"{meaning} stands twice")
    one_of = (("frequency_hz", "frequency_rad_s"), ("amplitude", "real", "complex"))
    for group in one_of:
        if len(set(group) & set(known)) != 1:
            raise ValueError(f"needs one of {', '.join(group)}")
    if ("real" in known) != ("imaginary" in known):
        raise ValueError("real and imaginary go together")
    phases = {"phase_deg", "phase_rad"} & set(known)
    if len(phases) > 1 or phases and "amplitude" not in known:
        raise ValueError("one phase, beside an amplitude")
    return parsed


def from_text(path: Path, columns: Sequence[str]) -> list[Columns]:
    """One measurement from a text file: columns parted by commas, semicolons, tabs or blanks; lines
    before the first number and those that start with # or % are skipped. A column is found by its
    name in the header where one is given, else by its position.

    Raises InputError with the line.
    """
    before, lines = _lines(path)
    part = next((p for p in (";", "\t", ",") if p in lines[0][1]), None)
    header = [field.strip(' "') for field in before.split(part)] if before else []
    parsed = parse_meanings(columns)
    if "complex" in dict(parsed):
        raise InputError(
            f"{path}: complex: only variables of a MATLAB file are; use real and imaginary"
        )
    width = len(header) if any(name for _, name in parsed) else len(columns)
    places = {
        meaning: _position(path, name, i, header)
        for i, (meaning, name) in enumerate(parsed)
        if meaning != IGNORED
    }
    values: dict[str, list[float]] = {meaning: [] for meaning in places}
    for k, line in lines:
        row = _fields(path, k, line.split(part), width)
        for meaning, at in places.items():
            values[meaning].append(_number(path, k, row[at]))
    where = tuple(f"line {k}" for k, _ in lines)
    return [Columns({m: np.array(v) for m, v in values.items()}, where, str(path))]


def _fields(path: Path, line: int, words: Sequence[str], width: int) -> list[str]:
    """Of a line, which must be so many."""
    if len(words) != width:
        raise InputError(
            f"{path}: line {line}: {len(words)} columns, expected {width}; '{IGNORED}' stands for "
            "a column that is not used, and decimals need a point"
        )
    return [word.strip() for word in words]


def _lines(path: Path) -> tuple[str, list[tuple[int, str]]]:
    """The numbered lines from the first that begins with a number on, and the one before them, ''
    where there is none."""
    lines = [(k, line.strip()) for k, line in enumerate(decode(path.read_bytes()).splitlines(), 1)]
    lines = [(k, line) for k, line in lines if line and line[0] not in "#%"]
    first = next((i for i, (_, line) in enumerate(lines) if _begins_with_number(line)), None)
    if first is None:
        raise InputError(f"{path}: no row of numbers")
    return lines[first - 1][1] if first else "", lines[first:]


def from_matlab(path: Path, columns: Sequence[str]) -> list[Columns]:
    """Measurements from the variables of a MATLAB file (up to version 7.2): a matrix with one
    column for each frequency-long vector holds repeats.

    Raises InputError naming the variable.
    """
    parsed = [(m, name) for m, name in parse_meanings(columns) if m != IGNORED]
    unnamed = [meaning for meaning, name in parsed if not name]
    if unnamed:
        raise InputError(
            f"{path}: columns: {unnamed[0]} needs the name of its variable, '{unnamed[0]}:NAME'"
        )
    content = _variables(path)
    arrays = {
        meaning: _variable(path, content, name, meaning == "complex") for meaning, name in parsed
    }
    frequency = next(arrays[m] for m in ("frequency_hz", "frequency_rad_s") if m in arrays)
    n = frequency.size
    repeats = max(a.size for a in arrays.values()) // max(n, 1)
    for (meaning, name), array in zip(parsed, arrays.values(), strict=True):
        if array.size != n and array.shape != (n, repeats):
            raise InputError(
                f"{path}: {name} ({meaning}) is {' x '.join(map(str, array.shape))}, expected {n} "
                "rows"
            )
    places = tuple(f"row {k}" for k in range(1, n + 1))
    return [
        Columns(
            {m: a.ravel() if a.size == n else a[:, r] for m, a in arrays.items()},
            places,
            f"{path} (column {r + 1})" if repeats > 1 else str(path),
        )
        for r in range(repeats)
    ]


def _variables(path: Path) -> Mapping[str, Any]:
    try:
        return open_matlab(path)
    except InputError:
        raise
    except Exception as error:  # damaged files end in errors of zlib, struct and numpy
        raise InputError(f"{path}: not a MATLAB file: {error}") from None


def _variable(
    path: Path, content: Mapping[str, Any], name: str, may_be_complex: bool
) -> np.ndarray:
    names = [key for key in content if not key.startswith("__")]
    if name not in names:
        raise InputError(f"{path}: no variable '{name}'; {nearest(name, names)}")
    if np.iscomplexobj(content[name]) and not may_be_complex:
        raise InputError(f"{path}: {name} is complex; columns: 'complex:{name}'")
    try:
        return np.asarray(content[name], dtype=complex if may_be_complex else float)
    except (TypeError, ValueError):
        raise InputError(f"{path}: {name} is not an array of real numbers") from None


def _begins_with_number(line: str) -> bool:
    return bool(re.match(rf"({NUMBER.pattern})\s*([;,\t ]|$)", line, re.IGNORECASE))


def _position(path: Path, name: str, i: int, header: Sequence[str]) -> int:
    if not name:
        return i
    if name not in header:
        raise InputError(
            f"{path}: no column '{name}' in the header; {nearest(name, header)}"
            if header
            else f"{path}: no header, so no column '{name}'"
        )
    if header.count(name) > 1:
        raise InputError(
            f"{path}: column '{name}' is in the header {header.count(name)} times; take the "
            "others out"
        )
    return header.index(name)


def _number(path: Path, line: int, text: str) -> float:
    if NUMBER.fullmatch(text):
        return float(text.lower().replace("d", "e"))
    if DECIMAL_COMMA.fullmatch(text):
        raise InputError(f"{path}: line {line}: {text} has a decimal comma; write a point")
    raise InputError(f"{path}: line {line}: {text[:30]!r} is not a number")
