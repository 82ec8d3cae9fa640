"""Dof tables of reduced models in files: CSV, Ansys' .mapping, the labels of Abaqus' matrix text,
saved models."""

import json
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.array_files import open_matlab, open_npz
from tipdamp.hbm.io.csv_table import read_table
from tipdamp.hbm.points import ContactPoints

DIRECTIONS = ("x", "y", "z")
# of beams and shells, in rad: dofs like any other, that no contact touches
ROTATIONS = ("rx", "ry", "rz")
TABLE = ("body", "node", "direction", "position")  # columns of a dof table inside a file
ANSYS_DOFS = {"UX": "x", "UY": "y", "UZ": "z", "ROTX": "rx", "ROTY": "ry", "ROTZ": "rz"}
LABELLED_DOFS = dict(enumerate(("mode", *DIRECTIONS, *ROTATIONS)))  # 0: a scalar point of Nastran


def read_dofs(path: str | Path, body: str = "body") -> dict:
    """Columns body, node, direction, position and loads of a dof table, in the order of the
    matrices; and groups."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"dof table: no such file: {path}")
    if path.suffix.lower() == ".mapping":
        return _ansys_mapping(path, body)
    table = read_table(path, _kind)
    for column in ("node", "direction"):
        if column not in table.header or not table.rows:
            raise InputError(
                f"{path}: column '{column}' is missing; needed: node, direction; may be: body, x, "
                "y, z"
            )
    none = [np.nan] * len(table.rows)
    position = [table.numbers(k, empty=np.nan) if k in table.header else none for k in DIRECTIONS]
    node = table.numbers("node", int)
    bodies = table.texts("body") if "body" in table.header else [body] * len(table.rows)
    groups = {}
    for name, key in _named(table.header, "group "):
        marked = (n for n, mark in zip(node, table.texts(key), strict=True) if mark)
        groups[name] = list(dict.fromkeys(marked))
    return dict(
        body=np.array([name or body for name in bodies]),
        node=node,
        position=np.transpose(position).tolist(),
        direction=[text.lower() for text in table.texts("direction")],
        loads={name: table.numbers(key, empty=0.0) for name, key in _named(table.header, "load ")},
        groups=groups,
    )


def _kind(column: str) -> type:
    if column == "node":
        return int
    return float if column in DIRECTIONS or column.startswith("load ") else str


def read_npz(path: str | Path) -> dict:
    """Keywords of ReducedModel.from_matrices from an .npz with M and K, as ReducedModel.save writes
    it.

    Raises InputError where the file is not there, is damaged or holds no M and K.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"reduced model not found: {path}")
    found = _arrays(path)
    try:
        groups, provenance = (
            json.loads(str(found.get(name, absent)))
            for name, absent in (("groups", "{}"), ("provenance", json.dumps({"file": path.name})))
        )
    except ValueError as error:
        raise InputError(f"{path}: is damaged ({error})") from None
    loads, rigid = (
        {k.removeprefix(start): v for k, v in found.items() if k.startswith(start)}
        for start in ("load/", "rigid/")
    )
    given = {k: found[k] for k in ("M", "K", "C", *TABLE) if k in found}
    return given | {
        "groups": groups,
        "loads": loads,
        "provenance": provenance,
        "points": _points(path, found),
        "rigid": rigid,
    }


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """All of an .npz with M and K."""
    try:
        content = open_npz(path, packed=True)
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is not an .npz of plain arrays ({error})") from None
    if isinstance(content, np.ndarray):
        raise InputError(f"{path}: is a single array, an .npz with M and K is needed")
    with content as z:
        for key in ("M", "K"):
            if key not in z.files:
                raise InputError(f"{path}: holds no matrix '{key}', only {', '.join(z.files)}")
        try:
            return {k: z[k] for k in z.files}
        except (ValueError, OSError, EOFError, zlib.error, zipfile.BadZipFile) as error:
            raise InputError(f"{path}: is damaged ({error})") from None


def _points(path: Path, found: dict[str, np.ndarray]) -> dict[str, ContactPoints]:
    columns: dict[str, Any] = {}
    for key in found:
        if key.startswith("points/"):
            body, name = key.removeprefix("points/").rsplit("/", 1)
            columns.setdefault(body, {})[name] = found[key]
    try:
        return {body: ContactPoints.of_arrays(**arrays) for body, arrays in columns.items()}
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: the contact points are damaged ({error})") from None


def table_of_labels(labels: Sequence[tuple[int, int]], body: str) -> dict:
    """Columns body, node, direction of the (node, dof) labels of Abaqus' text or punched DMIG;
    InputError for other dofs."""
    wrong = [label for label in labels if label[1] not in LABELLED_DOFS]
    if wrong:
        node, dof = wrong[0]
        raise InputError(
            f"node {node}: dof {dof} is neither displacement (1, 2, 3) nor rotation (4, 5, 6): "
            "give a dof table (CSV) in which it is a row of direction 'mode'"
        )
    return dict(
        body=body, node=[n for n, _ in labels], direction=[LABELLED_DOFS[d] for _, d in labels]
    )


def check_labels(labels: Sequence[tuple[int, int]], table: dict, dofs: object, M: object) -> None:
    """The rows of labelled matrices stand in the order of node and dof numbers: a table must not
    say otherwise."""
    rows = list(zip(table["node"], table["direction"], strict=True))
    if len(rows) != len(labels):
        raise InputError(f"{dofs}: has {len(rows)} rows, {M} names {len(labels)} dofs")
    for i, ((node, dof), (listed, direction)) in enumerate(zip(labels, rows, strict=True)):
        meant = LABELLED_DOFS.get(dof, "mode")
        if (node, direction) not in ((listed, meant), (listed, "mode" if dof > 3 else meant)):
            raise InputError(
                f"{dofs}, row {i + 1}: is node {listed}, {direction}; {M} has node {node}, dof "
                f"{dof} there: order the table by node and dof number, or leave it out"
            )


def saved_table(path: str | Path) -> dict:
    """Columns, groups and loads in an .npz of ReducedModel.save or a .mat of `matrices_out`; empty
    for other files."""
    kind = Path(path).suffix.lower()
    if kind == ".npz":
        with open_npz(path, packed=True) as z:
            if not {"M", "K", "node", "direction"} <= set(z.files):
                return {}
        found = read_npz(path)
        return {name: found[name] for name in (*TABLE, "groups", "loads") if name in found}
    content = open_matlab(path) if kind == ".mat" else {}
    return _matlab_table(content) if {*TABLE} <= set(content) else {}


def _matlab_table(content: dict[str, Any]) -> dict:
    """Of the variables that `matrices_out` writes."""
    names = {
        key: ["".join(np.ravel(cell).tolist()) for cell in np.ravel(content.get(key, []))]
        for key in ("body", "direction", "group_names", "load_names")
    }
    groups = [np.ravel(nodes) for nodes in np.ravel(content.get("group_nodes", []))]
    return dict(
        body=names["body"],
        node=content["node"].ravel(),
        direction=names["direction"],
        position=content["position"],
        groups=dict(zip(names["group_names"], groups, strict=True)),
        loads=dict(zip(names["load_names"], content.get("loads", np.empty((0, 0))).T, strict=True)),
    )


def _ansys_mapping(path: Path, body: str) -> dict[str, list[int | str] | str]:
    found = [line.split() for line in Path(path).read_text(errors="replace").splitlines()]
    found = [f for f in found if len(f) >= 3 and f[0].isdigit() and f[1].isdigit()]
    for f in found:
        if f[2].upper() not in ANSYS_DOFS:
            raise InputError(
                f"{path}: equation {f[0]} is {f[2]} of node {f[1]}, must be "
                f"{', '.join(ANSYS_DOFS)}: condense the others out, or give a dof table (CSV) in "
                "which they are rows of direction 'mode'"
            )
    if not found:
        raise InputError(f"{path}: holds no lines 'equation node UX'")
    found.sort(key=lambda f: int(f[0]))
    return dict(
        body=body,
        node=[int(f[1]) for f in found],
        direction=[ANSYS_DOFS[f[2].upper()] for f in found],
    )


def _named(header: tuple[str, ...], prefix: str) -> list[tuple[str, str]]:
    return [(key.removeprefix(prefix), key) for key in header if key.startswith(prefix)]
