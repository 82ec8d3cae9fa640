"""A first study that runs: two blade tips with a damper between them, as matrices, with a commented
study file to change."""

from pathlib import Path

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.example import STOP, two_blades
from tipdamp.hbm.matrices_out import write_model
from tipdamp.hbm.model import ReducedModel

STATIONS = 5
FIXTURE = 5e4  # N/m in each direction between the blades
EXCITED, PATCHES = 3, ((2, 3, 4), (7, 8, 9))  # nodes of the blades
STUDY = """\
# A first study: change a value, then `tipdamp run study.toml` again; what depends on it is
# made anew.
# `tipdamp explain KEY` says what a key is, `tipdamp keys` lists all.
# With your own meshes instead of matrices: tipdamp inspect blades.inp damper.inp

title = "Two blade tips and a damper"

[model]
matrices = "model.npz"       # M, K and a table of the dofs, as ReducedModel.save writes it
pull = 60                    # N, that presses the damper into the V of the two blades
pull_direction = [0, 0, 1]
axis = [1, 0, 0]             # of the damper
hold = { motion = "x", mean = true }  # its slide along its axis, which no contact resists

[contact]
pairs = "pairs.csv"          # nodes, normals, kn, kt and mu of each pair; opens in a spreadsheet

[tune]
stations = "all"             # every pair is kept; target_hz = 1285 detaches until that is met

[respond]
levels = [2, 10, 20]         # N at the excited node: stuck, slipping at the peak, slipping more
band = [1000, 1700]          # Hz
damping_ratio = 0.01         # of the modes with every contact stuck
direction = [0, 1, 0]        # of the force and of the response
harmonics = 5                # or "auto": as many as the tolerance needs
tolerance = 0.05             # accepted error by harmonics, beyond which a warning comes

[backbone]                   # the mode itself: frequency and damping ratio over its amplitude
harmonics = 5
"""


def write_first_study(folder: Path) -> Path:
    """The study file, with model.npz and pairs.csv beside it, and M.mtx, K.mtx and dofs.csv, of
    which a model is made: for those of one's own to take their place.

    Raises InputError where one of them is there already.
    """
    names = ("study.toml", "model.npz", "pairs.csv", "M.mtx", "K.mtx", "dofs.csv")
    files = {name: folder / name for name in names}
    for path in files.values():
        if path.exists():
            raise InputError(f"{path}: is there already; name another folder: tipdamp init FOLDER")
    folder.mkdir(parents=True, exist_ok=True)
    model, pairs = _as_study(*two_blades(STATIONS))
    model.save(files["model.npz"])
    write_model(model, folder, "mtx")
    pairs.save(files["pairs.csv"])
    files["study.toml"].write_text(STUDY, encoding="utf-8")
    return files["study.toml"]


def _as_study(model: ReducedModel, pairs: ContactTable) -> tuple[ReducedModel, ContactTable]:
    """Both blades as one body, as a study has them, with the groups of its response."""
    second = STATIONS * (model.body == "blade2")
    slides = (model.body == DAMPER) & (model.direction == "x")
    groups = {f"{BLADES}/excitation": [EXCITED]}
    groups |= {f"{BLADES}/patch_{k + 1}": list(nodes) for k, nodes in enumerate(PATCHES)}
    apart = np.kron([1.0, -1.0, 0.0], np.eye(3 * STATIONS))
    whole = ReducedModel.from_matrices(
        model.M,
        # without what a study holds itself
        model.K + FIXTURE / STATIONS * apart.T @ apart - np.diag(slides * STOP / STATIONS),
        body=np.where(model.body == DAMPER, DAMPER, BLADES),
        node=model.node + second,
        direction=model.direction,
        position=model.position,
        groups=groups,
        loads=model.loads,
    )
    on_second = STATIONS * (pairs.blade_body == "blade2")
    blades = np.full(len(pairs), BLADES)
    return whole, pairs.replace(blade_body=blades, blade_node=pairs.blade_node + on_second)
