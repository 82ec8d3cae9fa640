"""Matrices from other codes: npz, npy, Matrix Market, MATLAB, Harwell-Boeing (Ansys HBMAT), Abaqus'
matrix text, Nastran's OUTPUT4 (.op4), punched DMIG (.pch) and, by pyNastran, OUTPUT2 (.op2).

    model = ReducedModel.from_files(M="mass.mtx", K="stiffness.mtx", dofs="dofs.csv")

The dof table is a CSV with a line per row of the matrices: body, node, direction (x, y, z,
rotations rx, ry, rz, or mode) and, where known,
x, y, z in m, a column `load NAME` in N for each load, a column `group NAME` (not empty on its
nodes) for each group of nodes, as `matrices_out` writes them; or the .mapping file that Ansys
writes beside its Harwell-Boeing matrices. Abaqus' text and punched DMIG name node and dof of each
entry themselves.
What `ReducedModel.save` or `matrices_out` wrote into an .npz or .mat holds the table already: with
M and K from such a file, `dofs` may be left out.
"""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError, library, nearest
from tipdamp.hbm.io.array_files import check_size, open_matlab, open_npz
from tipdamp.hbm.io.dof_table import check_labels, read_dofs, saved_table, table_of_labels
from tipdamp.hbm.io.op4 import fortran_floats, read_op4
from tipdamp.hbm.io.punch import read_punch
from tipdamp.hbm.memory import available_bytes

FORMATS = (".npz", ".npy", ".mtx", ".mat", ".hb", ".rb", ".matrix", ".op4", ".op2", ".pch")
NASTRAN = {"M": "M", "K": "K", "C": "B"}  # first letters of its names; the sets that follow them:
NASTRAN_SETS = ("AAX", "AA", "HH", "GG", "AX", "2GG", "2PP")


def read_model(
    M: str | Path,
    K: str | Path,
    C: str | Path | None = None,
    dofs: str | Path | None = None,
    body: str = "body",
    groups: dict | None = None,
    loads: dict | None = None,
) -> dict:
    """Keywords of ReducedModel.from_matrices from one file per matrix and a dof table.

    body : its name where the table has none; groups, loads : as in ReducedModel, beside those of
    the table
    Raises InputError where a file cannot be read, or the files do not fit each other.
    """
    labels = None
    matrices: dict = {}
    for name, path in (("M", M), ("K", K), ("C", C)):
        matrices[name], found = (None, None) if path is None else read_matrix(path, name)
        if found is not None and labels is not None and found != labels:
            raise InputError(f"{path}: its nodes and dofs are not those of {M}")
        labels = labels or found
    saved = saved_table(M)
    table = saved if dofs is None else read_dofs(dofs, body)
    if labels:
        table = table_of_labels(labels, body) if dofs is None else table
        check_labels(labels, table, dofs, M)
    for name, given in (("groups", groups), ("loads", loads)):
        table[name] = saved.get(name, {}) | table.get(name, {}) | (given or {})
    return (
        {"body": body} | table | matrices | {"provenance": {"M": str(M), "K": str(K), "C": str(C)}}
    )


def read_matrix(path: str | Path, name: str = "matrix") -> tuple[Any, Any]:
    """(matrix, labels): labels are ((node, dof), ...) where the file names them, else None.

    A file that holds one triangle only is taken as symmetric. `name` picks the variable of a file
    that holds several."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{name}: no such file: {path}")
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise InputError(f"{name}: format of {path} is unknown; {nearest(kind, FORMATS)}")
    labels = None
    try:
        check_size(path)
        _check_room(path, name, _stated_entries(path, kind))
        if kind == ".npy":
            matrix = np.load(path, allow_pickle=False)
        elif kind == ".npz":
            matrix = _npz(path, name)
        elif kind == ".mat":
            matrix = _matlab(path, name)
        elif kind in (".hb", ".rb", ".matrix"):
            matrix, labels = _ansys(path)
        elif kind in (".op4", ".op2", ".pch"):
            matrix, labels = _nastran(path, name, kind)
        elif _is_matrix_market(path):
            matrix = scipy.io.mmread(path)
        else:
            matrix, labels = abaqus_text(path)
    except InputError:
        raise
    except Exception as error:  # the readers of foreign formats raise what they like
        raise InputError(f"{name}: {path} cannot be read as {kind}: {error}") from None
    if np.ndim(matrix) != 2 or matrix.shape[0] != matrix.shape[1]:
        raise InputError(
            f"{name}: {path} holds an array of shape {np.shape(matrix)}, must be a square matrix"
        )
    _check_room(path, name, math.prod(matrix.shape))
    return _both_triangles(matrix), labels


def _stated_entries(path: Path, kind: str) -> int:
    """Numbers that a file says it holds, before they are read; 0 where only reading tells."""
    if kind == ".mtx" and _is_matrix_market(path):
        rows, columns, entries = scipy.io.mminfo(path)[:3]
        return max(rows * columns, entries)
    return 0


def _check_room(path: Path, name: str, entries: int) -> None:
    """InputError where so many numbers, and what is made of them, do not fit into the memory."""
    need, there = 3 * 8 * entries, available_bytes()
    if need > there:
        raise InputError(
            f"{name}: {path} needs {need / 1e9:.3g} GB of memory, {there / 1e9:.3g} GB are "
            "available; reduce the model where it comes from"
        )


def _is_matrix_market(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(14).lower() == b"%%matrixmarket"


def harwell_boeing(path: str | Path) -> sp.csc_matrix:
    """Assembled real Harwell-Boeing matrix, symmetric (RSA) or not (RUA); one triangle as it
    stands."""
    lines = Path(path).read_text().splitlines()
    counts = [int(lines[1][14 * k : 14 * k + 14] or 0) for k in range(5)]
    kind = lines[2][:3].upper()
    if kind not in ("RSA", "RUA"):
        raise InputError(
            f"{path}: Harwell-Boeing type {kind} is not supported, only RSA and RUA (real, "
            "assembled)"
        )
    rows, columns, entries = (int(lines[2][14 + 14 * k : 28 + 14 * k]) for k in range(3))
    formats = [lines[3][:16], lines[3][16:32], lines[3][32:52]]
    at = 5 if counts[4] else 4
    parts = []
    for layout, count, number in zip(
        formats, counts[1:4], (columns + 1, entries, entries), strict=True
    ):
        parts.append(_fields(lines[at : at + count], layout)[:number])
        if len(parts[-1]) != number:
            raise InputError(
                f"{path}: is cut off, {number} numbers expected where {len(parts[-1])} stand"
            )
        at += count
    pointer, index = (np.array(p, dtype=np.int64) - 1 for p in parts[:2])
    values = fortran_floats(parts[2])
    return sp.csc_matrix((values, index, pointer), shape=(rows, columns))


def _fields(lines: Sequence[str], layout: str) -> list[str]:
    """Texts of the numbers in lines of a Fortran format, as (4E20.12)."""
    field = re.search(r"[IDEFG](\d+)", layout.upper())
    if field is None:
        raise ValueError(f"format {layout} is unknown")
    width = int(field[1])
    texts = [line[k : k + width] for line in lines for k in range(0, len(line.rstrip()), width)]
    return [text for text in texts if text.strip()]


def abaqus_text(path: str | Path) -> tuple[Any, Any]:
    """(matrix, labels) of Abaqus' matrix text: 'node, dof, node, dof, value' or 'row, column,
    value' lines."""
    rows = _entries(path)
    values = fortran_floats(row[-1] for row in rows)
    if len(rows[0]) == 3:
        ij = np.array([r[:2] for r in rows], dtype=np.int64) - 1
        return sp.coo_matrix((values, ij.T), shape=(ij.max() + 1,) * 2), None
    pairs = np.array([r[:4] for r in rows], dtype=np.int64)
    labels, place = np.unique(np.vstack([pairs[:, :2], pairs[:, 2:]]), axis=0, return_inverse=True)
    K = sp.coo_matrix((values, place.reshape(2, -1)), shape=(len(labels),) * 2)
    return K.tocsr(), tuple((int(a), int(b)) for a, b in labels)


def _entries(path: str | Path) -> list[list[str]]:
    """Fields of each line, three or five of all; comments are left out."""
    rows: list[list[str]] = []
    for number, line in enumerate(Path(path).read_text().splitlines(), 1):
        line = line.strip()
        if not line or line.startswith("*"):
            continue
        fields = [f for f in re.split(r"[,\s]+", line) if f]
        if len(fields) not in (3, 5) or (rows and len(fields) != len(rows[0])):
            raise InputError(
                f"{path}, line {number}: 'node, dof, node, dof, value' or 'row, column, value' "
                "expected"
            )
        rows.append(fields)
    if not rows:
        raise InputError(f"{path}: holds no entries")
    return rows


def _ansys(path: Path) -> tuple[sp.spmatrix, tuple[tuple, ...] | None]:
    """(matrix, None) of Harwell-Boeing in the fixed columns of Ansys, or as loosely as scipy writes
    and reads it; under the same ending also Abaqus' text, with its labels."""
    text = path.read_text(errors="replace")
    if re.search(r"^[ \t]*\d+[ \t]*,", text, re.MULTILINE):
        return abaqus_text(path)
    try:
        return harwell_boeing(path), None
    except (ValueError, IndexError, TypeError) as ours:
        if isinstance(ours, InputError):
            raise
        try:
            return scipy.io.hb_read(path), None
        except Exception:  # it raises what it likes
            raise ours from None


def _nastran(path: Path, name: str, kind: str) -> tuple[sp.spmatrix, tuple[tuple, ...] | None]:
    """The matrix of that name, or the one that Nastran calls so: KAAX, KAA, KGG, ... for K."""
    if kind == ".pch":
        found, labels = read_punch(path)
    else:
        found, labels = read_op4(path) if kind == ".op4" else _op2(path), None
    usual = (NASTRAN.get(name, name) + of for of in NASTRAN_SETS)
    known = next((other for other in (name, *usual) if other in found), None)
    return (_pick(path, name, found) if known is None else found[known]), labels


def _op2(path: Path) -> dict[str, Any]:
    pyNastran = library("pyNastran.op2.op2", "a matrix from .op2")
    reader = pyNastran.OP2(mode="msc", debug=None)
    reader.read_op2(str(path), build_dataframe=False)
    return {name: matrix.data for name, matrix in reader.matrices.items()}


def _npz(path: Path, name: str) -> np.ndarray:
    with open_npz(path, packed=True) as z:
        if "format" in z.files:
            return sp.load_npz(path)
        return _pick(path, name, {k: z[k] for k in z.files})


def _matlab(path: Path, name: str) -> np.ndarray:
    content = open_matlab(path)
    return _pick(
        path, name, {k: v for k, v in content.items() if not k.startswith("__") and np.ndim(v) == 2}
    )


def _pick(path: Path, name: str, found: dict[str, sp.spmatrix | np.ndarray]) -> np.ndarray:
    if name in found:
        return found[name]
    other = next((k for k in found if k in ("M", "K", "C")), None)
    if name in ("M", "K", "C") and len(found) == 1 and other:
        raise InputError(f"{name}: {path} holds '{other}', not '{name}'; are the files swapped?")
    if len(found) == 1:
        return next(iter(found.values()))
    raise InputError(f"{path}: holds no '{name}'; {nearest(name, found)}")


def _both_triangles(matrix: sp.spmatrix | np.ndarray) -> np.ndarray:
    """The symmetric matrix whose one triangle is given; others are returned as they are."""
    matrix = sp.csr_matrix(matrix)
    upper, lower = sp.triu(matrix, 1), sp.tril(matrix, -1)
    if (upper.nnz == 0) != (lower.nnz == 0):
        matrix = matrix + (upper + lower).T
    return matrix.toarray()
