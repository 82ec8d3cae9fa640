"""Matrices in Nastran's OUTPUT4 files, text and binary.

Layout: MSC Nastran, DMAP Programmer's Guide, OUTPUT4. A file holds named matrices, a column at a
time: dense from the first row that is not zero on, or as strings of rows, whose header packs row
and length into one number, or gives both where a matrix has more than 65535 rows ("BIGMAT").
pyNastran reads text of type 1 in single precision, whatever digits stand there, and its writer of
binary files fails: hence these lines.
"""

import struct
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError

PACKED = 65536  # times length + 1 of a string, plus its first row
WORDS = {1: 1, 2: 2, 3: 1, 4: 2}  # of 4 bytes for a real number, by type; 3 and 4 are complex
SQUARE, RECTANGULAR, SYMMETRIC = 1, 2, 6
PER_LINE, WIDTH = 3, 24  # numbers of the text that is written


def read_op4(path: str | Path) -> dict[str, sp.csc_matrix]:
    """{name: matrix} of a file, in double precision.

    Raises InputError where it is no such file, is cut off, or has words of 8 bytes.
    """
    content = Path(path).read_bytes()
    try:
        reader: Any = (
            _Text(content.decode("ascii"))
            if content[:4].strip(b" 0123456789") == b""
            else _Binary(content)
        )
        found = {}
        while not reader.finished():
            name, shape, kind = reader.header()
            found[name] = _matrix(reader, shape, kind)
    except (ValueError, IndexError, KeyError, struct.error) as error:
        raise InputError(f"{path}: is no OUTPUT4 file, or is cut off ({error})") from None
    return found


def write_op4(path: str | Path, matrices: Mapping[str, Any]) -> None:
    """Real matrices {name: (n, m)} as text, with all digits of a double.

    Raises InputError for a name that Nastran does not take.
    """
    lines = []
    for name, given in matrices.items():
        if not (name.isascii() and name.isalnum() and name[0].isalpha() and len(name) <= 8):
            raise InputError(f"OUTPUT4: name '{name}': must be 1 to 8 letters and digits")
        matrix = np.asarray(given.toarray() if sp.issparse(given) else given, dtype=float)
        rows, columns = matrix.shape
        square = SYMMETRIC if np.array_equal(matrix, matrix.T) else SQUARE
        form = square if rows == columns else RECTANGULAR
        lines.append(
            f"{columns:8d}{rows:8d}{form:8d}{2:8d}{name.upper():8s}1P,{PER_LINE}E{WIDTH}.16"
        )
        for j, column in enumerate(matrix.T, 1):
            (held,) = np.nonzero(column)
            if held.size:
                first, last = held[0], held[-1] + 1
                lines += [f"{j:8d}{first + 1:8d}{last - first:8d}", *_written(column[first:last])]
        lines += [f"{columns + 1:8d}{1:8d}{1:8d}", *_written([1.0])]
    Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")


def _written(values: Iterable[float]) -> list[str]:
    texts = [f"{value:{WIDTH}.16E}" for value in values]
    return ["".join(texts[k : k + PER_LINE]) for k in range(0, len(texts), PER_LINE)]


def _matrix(reader: "_Text", shape: tuple[int, int], kind: int) -> sp.spmatrix:
    """The matrix whose header was read: (columns, rows), rows negative where it is BIGMAT."""
    columns, rows = shape
    i, j, values = [], [], []
    while True:
        column, row, words = reader.column(WORDS[kind])
        if column > columns:
            reader.end()
            break
        while words > 0:
            length = words
            if row == 0 and rows < 0:
                (length, first), words = reader.integers(2), words - 2
                length -= 1
            elif row == 0:
                (packed,), words = reader.integers(1), words - 1
                length, first = packed // PACKED - 1, packed % PACKED
            else:
                first = row
            if not 0 < length <= words:
                raise ValueError(f"column {column}: a string of {length} words of {words}")
            part, words = reader.reals(length, WORDS[kind]), words - length
            part = part[::2] + 1j * part[1::2] if kind > 2 else part
            i.append(first - 1 + np.arange(len(part)))
            j.append(np.full(len(part), column - 1))
            values.append(part)
    if not values:
        return sp.csc_matrix((abs(rows), columns))
    places = np.concatenate(i), np.concatenate(j)
    return sp.csc_matrix((np.concatenate(values), places), shape=(abs(rows), columns))


def fortran_floats(texts: Iterable[str]) -> np.ndarray:
    """(n,) of texts whose exponents may begin with D."""
    return np.array([text.upper().replace("D", "E") for text in texts], dtype=float)


def _counts(line: str, number: int) -> list[int]:
    """So many whole numbers, of 8 columns each."""
    return [int(line[8 * k : 8 * k + 8]) for k in range(number)]


class _Text:
    """A text file, read on line by line; numbers in fixed columns."""

    def __init__(self, text: str) -> None:
        self.lines, self.at = text.splitlines(), 0

    def finished(self) -> bool:
        return not any(line.strip() for line in self.lines[self.at : self.at + 1])

    def header(self) -> tuple[str, tuple[int, int], int]:
        line = self.lines[self.at]
        columns, rows, _, kind = _counts(line, 4)
        per_line, _, digits = line[40:].upper().partition(",")[2].partition("E")
        self.per_line, self.width = int(per_line), int(digits.partition(".")[0])
        self.at += 1
        return line[32:40].strip().upper(), (columns, rows), kind

    def column(self, words: int) -> tuple[int, int, int]:
        """Number, first row (0: strings), words; a dense column counts numbers."""
        line = self.lines[self.at]
        self.at += 1
        number, row, count = _counts(line, 3)
        return number, row, count * words if row else count

    def end(self) -> None:
        """The mark of the end has a number, in a format of its own."""
        self.at += 1

    def integers(self, _: int) -> list[int]:
        self.at += 1
        return [int(text) for text in self.lines[self.at - 1].split()]

    def reals(self, words: int, each: int) -> np.ndarray:
        count = words // each
        end = self.at - (-count // self.per_line)
        texts = [
            line[k : k + self.width]
            for line in self.lines[self.at : end]
            for k in range(0, len(line.rstrip()), self.width)
        ]
        self.at = end
        if len(texts) != count or any(len(text) != self.width for text in texts):
            raise ValueError(f"line {end}: {count} numbers expected")
        return fortran_floats(texts)


class _Binary:
    """A file of Fortran records of 4-byte words, of either order of bytes."""

    def __init__(self, content: Any) -> None:
        self.content, self.at = content, 0
        self.order: Any = "<" if content[:4] == struct.pack("<i", 24) else ">"

    def finished(self) -> bool:
        return self.at >= len(self.content)

    def header(self) -> tuple[str, tuple[int, int], int]:
        (length,) = struct.unpack_from(f"{self.order}i", self.content, self.at)
        if length != 24:
            raise ValueError(
                "a header of 24 bytes expected; files with words of 8 bytes: write them FORMATTED"
            )
        columns, rows, _, kind = self._take("i4", 1, 4)
        name = self.content[self.at : self.at + 8].decode("ascii")
        self.at += 12
        return name.strip().upper(), (int(columns), int(rows)), int(kind)

    def column(self, _: int) -> tuple[int, int, int]:
        length, number, row, words = (int(k) for k in self._take("i4", 0, 4))
        self.until = self.at + length - 12
        return number, row, words

    def end(self) -> None:
        self.at = self.until + 4

    def integers(self, count: int) -> list[int]:
        return [int(k) for k in self._take("i4", 0, count)]

    def reals(self, words: int, each: int) -> np.ndarray:
        found = self._take(f"f{4 * each}", 0, words // each).astype(float)
        self.at += 4 * (self.at == self.until)  # the length again, at the end of a record
        return found

    def _take(self, kind: str, skipped: int, count: int) -> np.ndarray:
        """Numbers from here on, after so many words; read on behind them."""
        found = np.frombuffer(
            self.content, np.dtype(kind).newbyteorder(self.order), count, self.at + 4 * skipped
        )
        self.at += 4 * skipped + found.nbytes
        return found
