"""A wedge under blade platforms that slides through along its axis at 3 N: its peak on soft springs
along the axis."""

import shutil
import tempfile
from pathlib import Path

import numpy as np

from tests.validation import Subject, row
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.hold.spring import Hold
from tipdamp.hbm.laws import DryFriction2T
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.response import forced_response
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.statics.model_inputs import excitation, outputs
from tipdamp.study.study import load_study

FOLDER = Path(__file__).parents[1] / "reference" / "platform-wedge"
BAND = (812, 832)  # every pair slides along the axis


HOLDS = {
    "1e2 N/m": Hold("y", 1e2),
    "default": Hold("y"),
    "1e4 N/m": Hold("y", 1e4),
    "mean alone": Hold("y", mean=True),
}


def rows(holds=tuple(HOLDS)):
    with tempfile.TemporaryDirectory() as folder:
        for name in ("coarse.toml", "coarse_blades.msh", "coarse_damper.msh"):
            shutil.copy(FOLDER / name, folder)
        study = load_study(Path(folder) / "coarse.toml")
        store = results_folder(study, None)
        for name in ("reduce", "preload", "tune"):
            run_stage(name, study, store, quiet=True)
        model = ReducedModel.load(store.path("model.npz"))
        pairs = ContactTable.load(store.path("kept.csv"))
    force, patch = 3 * excitation(study, model), outputs(study, model)
    patch = {name: patch[name] for name in patch if name.startswith("tipL")}
    found = {}
    for name in holds:
        curve = forced_response(
            model,
            pairs,
            DryFriction2T(),
            force,
            BAND,
            damping_ratio=0.005,
            harmonics=1,
            outputs=patch,
            hold=HOLDS[name],
            truncation=False,
        )
        peak = max((curve.peak(node) for node in patch), key=lambda p: p[1])
        at = int(np.abs(curve.frequency - peak[0]).argmin())
        found[name] = peak[1], curve.reaction[at, 0, 0].real
        yield row(f"{name}, complete curve", float(curve.complete), 1.0, "complete curve")
        yield row(f"{name}, um/N", 1e6 * peak[1] / 3, 1042.6, "springs on the nodes of the damper")
        yield row(f"{name}, Hz", peak[0], 823.6, "springs on the nodes of the damper")
    peaks, forces = np.transpose(list(found.values()))
    for (name, _), peak, reaction in zip(found.items(), peaks, forces, strict=True):
        yield row(f"{name}, m", peak, peaks[-1], "peak whose mean alone is held")
        yield row(f"{name}, N", reaction, forces[-1], "force where the mean alone is held")


SUBJECT = Subject(
    "A damper that is held",
    "Wedge damper under blade platforms (tests/reference/platform-wedge) at 3 N, H = 1: largest "
    "peak of the patch and the mean force on what holds the wedge along y, over a hundredfold "
    "range of stiffness and where the mean alone is held. Reference: 1042.6 um/N at 823.6 Hz "
    "with springs on all nodes of the wedge, 1e4 N/m in all.",
    rows,
    {
        "complete curve": 0.0,
        "springs on the nodes of the damper": 1e-3,
        "peak whose mean alone is held": 4e-10,
        "force where the mean alone is held": 1e-3,
    },
    quick=lambda: rows(("1e2 N/m", "mean alone")),
)
