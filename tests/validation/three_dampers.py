"""Three dampers on the rig of 70 mm, out of phase: the largest FRF over Fc/Fe."""

import re
import tempfile
from pathlib import Path

from tests.validation import Subject, row
from tipdamp.meshes.two_blade_rig import main as write_meshes
from tipdamp.results.response_results import RespondResult
from tipdamp.stages.run import results_folder, run_stage
from tipdamp.study.study import load_study

FOLDER = Path(__file__).parents[2] / "docs" / "studies" / "three_dampers"
PULL = 113.0  # N
RATIOS = (113, 19, 11.3, 7, 5.65, 4, 3, 2)  # Fc/Fe
PEAKS = {  # um/N on blade 1
    "asymmetric": (0.665, 0.688, 0.585, 0.459, 0.421, 0.392, 0.401, 0.701),
    "cylindrical": (0.308, 0.331, 0.370, 0.417, 0.406),  # where it does not roll
    "wedge": (1.087, 1.087, 1.022, 0.956, 0.889, 0.739, 0.620, 0.533),
}


def peaks(damper: str, ratios: tuple[float, ...]) -> list[float | None]:
    """um/N, largest of blade 1's patch at these Fc/Fe; None where there is no peak."""
    with tempfile.TemporaryDirectory() as folder:
        write_meshes(["--damper", damper, "--out", f"{folder}/meshes"])
        text = (FOLDER / f"{damper}.toml").read_text(encoding="utf-8")
        text = re.sub(
            r"^levels = .*", f"levels = {[PULL / one for one in ratios]}", text, flags=re.M
        )
        text = text.split("\n[sweep]\n")[0]
        (Path(folder) / "study.toml").write_text(text, encoding="utf-8")
        study = load_study(Path(folder) / "study.toml")
        store = results_folder(study, None)
        for stage in ("reduce", "preload", "tune", "respond"):
            run_stage(stage, study, store, quiet=True)
        found = RespondResult.load(store).responses
    return [None if one.peak_m is None else 1e6 * one.peak_m / one.Fe_N for one in found]


def rows():
    for damper, references in PEAKS.items():
        ratios = RATIOS[: len(references)]
        for ratio, ours, reference in zip(ratios, peaks(damper, ratios), references, strict=True):
            case = f"{damper}, Fc/Fe = {ratio:g}"
            yield row(f"{case}, um/N", ours or 0.0, reference, "an earlier tracer")


SUBJECT = Subject(
    "Three dampers on the rig of 70 mm",
    "docs/studies/three_dampers, out of phase, H = 3, Fc = 113 N, the stations that the asymmetric "
    "damper was tuned to: largest FRF of blade 1. Reference: the same rig, stations and stiffness "
    "by the tracer of commit 9c81754, three digits. The cylindrical "
    "damper rolls beyond the ratios that are listed.",
    rows,
    {"an earlier tracer": 1e-2},
)
