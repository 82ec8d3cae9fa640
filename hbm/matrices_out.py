"""A reduced model for other codes: matrices and the dof table, as `tipdamp.hbm.io.matrices_in`
reads them back.

write_model(model, "folder", "mtx")    # M.mtx, K.mtx, C.mtx, dofs.csv
ReducedModel.from_files(M="folder/M.mtx", K="folder/K.mtx", dofs="folder/dofs.csv")
"""

import csv
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.hbm.io.dof_table import DIRECTIONS, LABELLED_DOFS
from tipdamp.hbm.io.op4 import write_op4
from tipdamp.hbm.io.punch import write_punch
from tipdamp.hbm.model import ReducedModel

KINDS = ("npz", "mat", "mtx", "op4", "pch")
NASTRAN = {"M": "MAAX", "K": "KAAX", "C": "BAAX"}


def write_model(model: ReducedModel, folder: str | Path, kind: str) -> list[Path]:
    """model.npz; or model.mat with M, K (and C), or M.mtx, K.mtx (and C.mtx), or model.op4 or .pch
    of Nastran with MAAX, KAAX (and BAAX); and dofs.csv. Returns what was written.

    model.mat holds the dof table too: body, node, direction, position, load_names and loads (r, k),
    group_names and group_nodes. model.pch has 10 digits, and rows by node and dof, in which order
    dofs.csv then stands too; modes are scalar points there, numbered above the nodes where their
    own numbers are taken. `from_files` needs dofs.csv beside Matrix Market and OUTPUT4 alone.
    The dof table has a line per row of the matrices: body, node, direction, x, y, z (m), a column
    `load NAME` (N) for each load and a column `group NAME`, 1 on its nodes. Raises InputError for
    another kind, and where the model has contact points or names, empty or with blanks at an end,
    which npz alone holds.

    >>> model, _ = two_blades()
    >>> [path.name for path in write_model(model, ".", "mtx")]
    ['M.mtx', 'K.mtx', 'dofs.csv']
    """
    if kind not in KINDS:
        raise InputError(
            f"export to '{kind}' is unknown; {nearest(kind, KINDS)}; responses of a study: unv"
        )
    if model.points and kind != "npz":
        count = sum(len(points.number) for points in model.points.values())
        raise InputError(
            f"export to '{kind}': the model has {count} contact points, whose motions {kind} does "
            "not hold; export to 'npz'"
        )
    if kind != "npz":
        _check_names(model, kind)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if kind == "npz":
        return [model.save(folder / "model.npz")]
    matrices = {
        name: A for name, A in (("M", model.M), ("K", model.K), ("C", model.C)) if A is not None
    }
    if kind == "mat":
        written = [folder / "model.mat"]
        scipy.io.savemat(written[0], matrices | _table(model))
    elif kind in ("op4", "pch"):
        return _write_nastran(model, folder / f"model.{kind}", matrices)
    else:
        written = [folder / f"{name}.mtx" for name in matrices]
        for path, A in zip(written, matrices.values(), strict=True):
            scipy.io.mmwrite(path, sp.coo_matrix(A), symmetry="symmetric", precision=17)
    return [*written, _write_dofs(model, folder / "dofs.csv")]


def _write_nastran(model: ReducedModel, path: Path, matrices: dict[str, np.ndarray]) -> list[Path]:
    named = {NASTRAN[name]: A for name, A in matrices.items()}
    if path.suffix == ".op4":
        write_op4(path, named)
        return [path, _write_dofs(model, path.parent / "dofs.csv")]
    model = _scalar_points(model)
    number = {direction: dof for dof, direction in LABELLED_DOFS.items()}
    labels = [
        (node, number[direction])
        for node, direction in zip(model.node.tolist(), model.direction.tolist(), strict=True)
    ]
    if len(set(labels)) < len(labels):
        raise InputError(
            "export to 'pch': two bodies have nodes of one number, which DMIG cannot tell apart; "
            "renumber them, or export to 'op4'"
        )
    order = sorted(range(len(labels)), key=labels.__getitem__)
    write_punch(path, named, labels)
    return [path, _write_dofs(model, path.parent / "dofs.csv", order)]


def _scalar_points(model: ReducedModel) -> ReducedModel:
    """With numbers of modes that neither a node nor another mode has: Nastran counts grids and
    scalar points together."""
    modes = model.direction == "mode"
    own = model.node[modes]
    if len(set(own)) == len(own) and not np.isin(own, model.node[~modes]).any():
        return model
    node = model.node.copy()
    node[modes] = model.node.max() + 1 + np.arange(len(own))
    return replace(model, node=node)


def _check_names(model: ReducedModel, kind: str) -> None:
    """InputError for a name of which the dof table would lose something."""
    named = {"body": model.body.tolist(), "load": model.loads, "group": model.groups}
    for of, names in named.items():
        for name in dict.fromkeys(names):
            if not name or name != name.strip():
                raise InputError(
                    f"export to '{kind}': {of} '{shown(name)}' is empty or has blanks at an end, "
                    "which a dof table does not keep; name it anew, or export to 'npz'"
                )


def _table(model: ReducedModel) -> dict[str, np.ndarray]:
    """The dof table, loads and groups as MATLAB variables; names are cells, as they may hold any
    character."""

    def cells(values: Sequence) -> np.ndarray:
        out = np.empty((len(values), 1), dtype=object)
        out[:, 0] = values
        return out

    table = {
        "body": cells(model.body.tolist()),
        "node": model.node[:, None],
        "position": model.position,
        "direction": cells(model.direction.tolist()),
    }
    if model.loads:
        table |= {
            "load_names": cells(list(model.loads)),
            "loads": np.column_stack(list(model.loads.values())),
        }
    if model.groups:
        nodes = np.empty((len(model.groups), 1), dtype=object)
        for i, members in enumerate(model.groups.values()):
            nodes[i, 0] = members[:, None]
        table |= {"group_names": cells(list(model.groups)), "group_nodes": nodes}
    return table


def _write_dofs(model: ReducedModel, path: Path, order: Sequence[int] | None = None) -> Path:
    columns: dict[str, Any] = {"body": model.body, "node": model.node, "direction": model.direction}
    columns |= {axis: _numbers(model.position[:, k]) for k, axis in enumerate(DIRECTIONS)}
    columns |= {f"load {name}": _numbers(load) for name, load in model.loads.items()}
    for name, nodes in model.groups.items():
        mine = (
            (model.body == name.split("/")[0])
            & (model.direction != "mode")
            & np.isin(model.node, nodes)
        )
        columns[f"group {name}"] = np.where(mine, "1", "")
    with open(path, "w", newline="", encoding="utf-8") as f:
        table = csv.writer(f)
        table.writerow(columns)
        rows = list(zip(*columns.values(), strict=True))
        table.writerows(rows if order is None else [rows[k] for k in order])
    return path


def _numbers(values: np.ndarray) -> list[str]:
    return ["" if np.isnan(v) else f"{v:.17g}" for v in values]
