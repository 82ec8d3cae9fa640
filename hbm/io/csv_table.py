"""Tables in CSV that a person may have edited: every row as long as its header, no column twice,
nothing guessed.

Columns are separated by commas or tabs; where spreadsheets write decimal commas, by semicolons, and
both are read. A decimal comma in a row separated by commas is one field too many, which would move
all that follow.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from operator import and_
from pathlib import Path

from tipdamp.hbm.errors import InputError, shown

DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
DECIMAL_POINT = re.compile(r"[-+]?\d*\.\d+([eE][-+]?\d+)?")
Kind = Callable[[str], type]  # of a column, by its name: str, int or float


@dataclass(frozen=True)
class CsvTable:
    """path; header (m,) - names of the columns; lines (n,) - where each row stands; rows (n,) of m
    texts."""

    path: Path
    header: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]

    def texts(self, name: str) -> list[str]:
        """(n,) of a column."""
        at = self.header.index(name)
        return [row[at] for row in self.rows]

    def numbers(self, name: str, kind: type = float, empty: float | None = None) -> list:
        """(n,) of a column; empty : what an empty cell stands for. Raises InputError with line,
        column and value."""
        found = []
        for line, text in zip(self.lines, self.texts(name), strict=True):
            try:
                if "_" in text:  # 1_000 is a number in Python alone
                    raise ValueError
                found.append(empty if not text and empty is not None else kind(text))
            except ValueError:
                what, remedy = "whole number" if kind is int else "number", ""
                if DECIMAL_COMMA.fullmatch(text):
                    remedy = ": write a decimal point"
                raise InputError(
                    f"{self.path}, line {line}: {name} = '{shown(text)}' is not a {what}{remedy}"
                ) from None
        return found


def read_table(path: Path, kind: Kind) -> CsvTable:
    """The rows of a table; empty ones are left out. kind : of a column by its name, to say which
    decimal comma moves a row. Raises InputError with line and column."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
        first = next((line for line in text.splitlines() if line.strip()), "")
        mark = next((m for m in (";", "\t") if m in first and "," not in first), ",")
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark)
        lines = [
            (reader.line_num, [field.strip() for field in row])
            for row in reader
            if any(map(str.strip, row))
        ]
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"{path}: is not a CSV text in UTF-8 ({error}); save it as 'CSV UTF-8'"
        ) from None
    if not lines:
        raise InputError(f"{path}: is empty")
    header, width = _header(path, *lines[0]), len(lines[0][1])
    rows = [
        (line, _fitted(f"{path}, line {line}", (header, width), row, kind))
        for line, row in lines[1:]
    ]
    if mark != ",":
        rows = _with_points(path, header, rows, kind)
    return CsvTable(path, header, tuple(line for line, _ in rows), tuple(row for _, row in rows))


def _header(path: Path, line: int, names: Sequence[str]) -> tuple[str, ...]:
    while names and not names[-1]:  # a spreadsheet writes columns that are empty
        names = names[:-1]
    twice = [name for name, times in Counter(names).items() if times > 1]
    if twice:
        raise InputError(
            f"{path}, line {line}: column '{shown(twice[0])}' is there twice; take one of the two "
            "out"
        )
    return tuple(names)


def _fitted(
    where: str, columns: tuple[tuple[str, ...], int], row: Sequence[str], kind: Callable
) -> tuple[str, ...]:
    """The row with as many fields as the header has; columns : the header, and its width with
    columns that are empty. An empty field too many moves the others as well, where the last column
    of the row is empty."""
    header, width = columns
    if any(row[len(header) :]) or len(row) > width:
        commas = [f"{name} = '{value}'" for name, value in _decimal_commas(header, row, kind)]
        cause = (
            f"is {' or '.join(commas[:2])} meant? write a decimal point"
            if commas
            else "numbers need a decimal point, names with a comma quotation marks"
        )
        raise InputError(
            f"{where}: has {len(row)} fields, {len(row) - len(header)} more than the header has "
            f"columns (the last is '{header[-1]}'): {cause}"
        )
    if len(row) < len(header):
        raise InputError(
            f"{where}: has {len(row)} fields, the header {len(header)} columns: column "
            f"'{header[len(row)]}' is missing"
        )
    return tuple(row[: len(header)])


def _decimal_commas(
    header: Sequence[str], row: Sequence[str], kind: Callable
) -> Iterator[tuple[str, str]]:
    """(column, value) of the decimal comma that a row with one field too many may have: every
    column can be read where two neighbouring fields are taken as one number."""
    if len(row) != len(header) + 1:
        return
    kinds = [kind(name) for name in header]
    before = [True, *accumulate(map(_readable, row, kinds), and_)]  # up to column j
    # from column j, moved by one
    after = [True, *accumulate(map(_readable, row[:0:-1], kinds[::-1]), and_)][::-1]
    for j, name in enumerate(header):
        joined = f"{row[j]},{row[j + 1]}"
        if (
            kinds[j] is float
            and row[j]
            and DECIMAL_COMMA.fullmatch(joined)
            and before[j]
            and after[j + 1]
        ):
            yield name, joined


def _readable(text: str, kind: Callable) -> bool:
    try:
        return not text or kind(text) is not None
    except ValueError:
        return False


def _with_points(
    path: Path, header: Sequence[str], rows: list[tuple[int, tuple[str, ...]]], kind: Callable
) -> list[tuple[int, tuple[str, ...]]]:
    """Rows without decimal commas; InputError where some numbers have them and others points, which
    may part thousands."""
    seen: dict[bool, str] = {}
    found = []
    for line, row in rows:
        cells = []
        for name, text in zip(header, row, strict=True):
            comma = kind(name) is not str and DECIMAL_COMMA.fullmatch(text) is not None
            if comma or kind(name) is not str and DECIMAL_POINT.fullmatch(text):
                seen.setdefault(comma, f"line {line}: {name} = '{shown(text)}'")
            cells.append(text.replace(",", ".") if comma else text)
        found.append((line, tuple(cells)))
    if len(seen) == 2:
        raise InputError(
            f"{path}: has decimal commas ({seen[True]}) and decimal points ({seen[False]}): write "
            "one of them throughout"
        )
    return found
