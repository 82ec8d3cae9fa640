"""Matrices as Nastran punches them: DMIG entries, whose rows and columns are named by node and dof.

As PARAM,EXTOUT,DMIGPCH or EXTSEOUT(DMIGPCH) leave them: a header, then a DMIG* entry a column
with a line a row, in fields of 16. Layout: MSC Nastran, Quick Reference Guide, DMIG.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError

LARGEST = 99_999_999  # number of a node
SYMMETRIC, SQUARE_FORMS, REAL_DOUBLE = 6, (1, 6), 2
EXPONENT = re.compile(r"(?<=[\d.])[dD]?(?=[+-])")  # 1.5D+02 and 1.5+2 are 1.5E+2

Label = tuple[int, int]  # node and dof: 1 to 6, 0 of a scalar point


def read_punch(path: str | Path) -> tuple[dict[str, sp.csr_matrix], tuple[Label, ...]]:
    """({name: matrix}, labels) of the square real matrices of a file, all in the order of one list
    of labels (node, dof).

    Other entries are left out. Raises InputError with the line that is none.
    """
    found = _Entries()
    for number, line in enumerate(Path(path).read_text(errors="replace").splitlines(), 1):
        try:
            found.read(line)
        except (ValueError, KeyError) as error:
            raise InputError(f"{path}, line {number}: no DMIG as it is punched ({error})") from None
    forms = found.forms
    square = {name: found.entries[name] for name, form in forms.items() if form in SQUARE_FORMS}
    labels = tuple(sorted({end for rows in square.values() for row in rows for end in row[:2]}))
    place = {label: k for k, label in enumerate(labels)}
    return {
        name: _matrix(rows, place, forms[name] == SYMMETRIC) for name, rows in square.items()
    }, labels


class _Entries:
    """What the lines of a file hold, one after the other.

    forms : {name: form of the matrix}; entries : {name: [(label of the row, of the column, value)]}
    """

    def __init__(self) -> None:
        self.forms: dict[str, int] = {}
        self.entries: dict[str, list] = {}
        self.name, self.column = "", (0, 0)  # to which a line with a star belongs

    def read(self, line: str) -> None:
        """The next line; ValueError or KeyError where it is none."""
        if line.startswith("DMIG*"):
            self.name, self.column = line[8:24].strip(), _label(line[24:56])
        elif line.startswith("DMIG ") and line[16:24].strip() == "0":
            self.forms[line[8:16].strip()] = int(line[24:32])
            self.entries[line[8:16].strip()] = []
        elif line.startswith("*") and self.name:
            entry = _label(line[8:40]), self.column, _number(line[40:56])
            self.entries[self.name].append(entry)
        elif line.startswith("DMIG"):
            raise ValueError("a header, or an entry DMIG* in fields of 16, expected")
        elif not line.startswith("$"):
            self.name = ""  # continues another entry


def write_punch(path: str | Path, matrices: Mapping[str, Any], labels: Sequence[Label]) -> None:
    """Symmetric matrices {name: (r, r)} with the labels (node, dof) of their rows.

    Numbers have the 10 digits that a field of 16 columns holds; a line each for up to r (r + 1) / 2
    entries, 57 bytes long. Raises InputError for a node of more than 8 digits.
    """
    large = next((node for node, _ in labels if node > LARGEST), None)
    if large is not None:
        raise InputError(f"node {large}: DMIG names nodes of at most 8 digits; write OUTPUT4 (op4)")
    lines = []
    for name, given in matrices.items():
        lower = np.tril(given.toarray() if sp.issparse(given) else np.asarray(given, dtype=float))
        lines.append(f"DMIG    {name:8s}{0:8d}{SYMMETRIC:8d}{REAL_DOUBLE:8d}{0:8d}")
        for j, (node, dof) in enumerate(labels):
            (rows,) = np.nonzero(lower[:, j])
            if rows.size:
                lines.append(f"DMIG*   {name:16s}{node:16d}{dof:16d}")
            for i in rows:
                lines.append(f"*       {labels[i][0]:16d}{labels[i][1]:16d}{_field(lower[i, j])}")
    Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")


def _label(fields: str) -> tuple[int, int]:
    return int(fields[:16]), int(fields[16:32] or 0)


def _field(value: float) -> str:
    """16 columns; an exponent of three digits leaves no room for its letter."""
    text = f"{value:16.9E}"
    return text.replace("E", "D" if len(text) == 16 else "")


def _number(field: str) -> float:
    return float(EXPONENT.sub("E", field.strip()))


def _matrix(
    rows: Sequence[tuple[Any, ...]], place: dict[tuple[int, int], int], symmetric: bool
) -> sp.spmatrix:
    i, j = (np.array([place[row[k]] for row in rows], dtype=int) for k in (0, 1))
    values = np.array([row[2] for row in rows], dtype=float)
    matrix = sp.coo_matrix((values, (i, j)), shape=(len(place),) * 2).tocsr()
    if not symmetric:
        return matrix
    return matrix + matrix.T - sp.diags(matrix.diagonal())
