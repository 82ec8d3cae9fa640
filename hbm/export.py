"""A ReducedModel as files for other codes: .npz, MATLAB .mat, Matrix Market, with the dof table as a CSV beside them.

`files.model_from_files` reads matrices and dof table back; groups, loads and provenance stay in the .npz alone, and
loads go into the .mat as well.
"""

import csv
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from hbm.errors import InputError, nearest
from hbm.model import DIRECTIONS, ReducedModel

FORMATS = (".npz", ".mat", ".mtx")


def export(model: ReducedModel, path) -> list[Path]:
    """Write the model in the format of the suffix and return the files, matrices first and the dof table last.

    model.npz holds all; model.mat the variables M, K (and C, load_NAME); model.mtx becomes model_M.mtx, model_K.mtx
    (and model_C.mtx). The dof table is model_dofs.csv. Numbers are written in full, so that they come back bit by bit.
    """
    path = Path(path)
    matrices = {k: getattr(model, k) for k in ("M", "K", "C") if getattr(model, k) is not None}
    if path.suffix == ".npz":
        written = [model.save(path)]
    elif path.suffix == ".mat":
        loads = {f"load_{k}": v[:, None] for k, v in model.loads.items()}
        scipy.io.savemat(path, {**matrices, **loads}, long_field_names=True)
        written = [path]
    elif path.suffix == ".mtx":
        written = [path.with_name(f"{path.stem}_{name}.mtx") for name in matrices]
        for file, matrix in zip(written, matrices.values(), strict=True):
            scipy.io.mmwrite(file, sp.coo_matrix(np.tril(matrix)), symmetry="symmetric", precision=17)
    else:
        raise InputError(f"export: format of {path} is unknown; {nearest(path.suffix, FORMATS)}")
    return [*written, write_dofs(model, path.with_name(f"{path.stem}_dofs.csv"))]


def write_dofs(model: ReducedModel, path) -> Path:
    """The dof table: body, node, direction, x, y, z in m; a mode has no place, its coordinates stay empty."""
    path = Path(path)
    with open(path, "w", newline="", encoding="utf-8") as f:
        writer = csv.writer(f)
        writer.writerow(["body", "node", "direction", *DIRECTIONS])
        for i in range(model.size):
            place = ["" if np.isnan(x) else repr(float(x)) for x in model.position[i]]
            writer.writerow([model.body[i], model.node[i], model.direction[i], *place])
    return path
