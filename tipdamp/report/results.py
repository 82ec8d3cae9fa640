"""What the stages left in the results folder, read back for the report."""

from dataclasses import dataclass, field

import numpy as np

from hbm.contact import ContactTable
from hbm.model import ReducedModel
from hbm.result import ForcedResponse
from tipdamp import pair_checks, surface
from tipdamp.visualization import Shapes

BEFORE = ("inspect", "reduce", "preload", "tune", "respond")


@dataclass(frozen=True)
class Case:
    """One curve: `facts` are its figures in respond.json."""

    facts: dict
    curve: ForcedResponse

    @property
    def Fe(self) -> float:
        return self.facts["Fe_N"]

    @property
    def H(self) -> int:
        return self.facts["H"]

    @property
    def has_peak(self) -> bool:
        """The whole band was followed: its largest value is a peak, and not just as far as the curve came."""
        return bool(self.facts["complete"]) and self.facts["peak_m"] is not None

    def patch(self, name: str) -> np.ndarray:
        """(n, k) m, half of peak-to-peak of the k nodes of a patch; NaN where a point failed."""
        return self.curve.amplitude()[:, in_patch(self.curve.output_names, name)]


@dataclass(frozen=True)
class Results:
    """`found` {stage: content of its json file}; a stage that the study has no section for is not in it.

    whole, kept - contact tables of the whole patch and after tuning, or None; cases - the curves, H by H, levels
    ascending; stuck - {"hz": (n,), "m_per_N": (n, k) of the patch of blade 1} or None; seconds {stage: s}
    loads {case: ContactTable} - preload of the further load cases; model - the reduced one, None where it is gone
    surfaces {body: Surface}, empty without meshes; shapes - modes to look at, stuck ones first
    """

    study: object
    found: dict
    whole: ContactTable | None
    kept: ContactTable | None
    cases: tuple
    stuck: dict | None
    seconds: dict
    loads: dict = field(default_factory=dict)
    model: ReducedModel | None = None
    surfaces: dict = field(default_factory=dict)
    shapes: tuple = ()

    def __contains__(self, stage: str) -> bool:
        return stage in self.found

    def __getitem__(self, stage: str) -> dict:
        return self.found[stage]

    @property
    def first_patch(self) -> str:
        return self.study.respond.patches[0]

    @property
    def orders(self) -> list[int]:
        """Numbers of harmonics, ascending."""
        return sorted({case.H for case in self.cases})

    def of_order(self, H: int) -> list[Case]:
        return [case for case in self.cases if case.H == H]

    def beside_paper(self, words: str) -> str:
        """A sentence on the seed paper's figures, where the study has its values as [reference]; else nothing."""
        return f" {words} of Zucca, Berruti and Cosi (2016)." if self.study.reference else ""

    @property
    def axis(self) -> np.ndarray:
        """(3,) of the damper."""
        return np.array(self.study.driver.axis)

    def places(self, pairs: ContactTable) -> dict:
        """{"blades", "damper": (P, 3) m} of the two nodes of each pair; where the table has them without a model."""
        return pair_checks.places_in(self.model, pairs)

    def along(self, pairs: ContactTable) -> np.ndarray:
        """(P,) mm, coordinate along the damper's axis."""
        return 1e3 * pairs.position @ self.axis


def load_results(study, store) -> Results:
    """All that is there and that the study still asks for."""
    asked = BEFORE if "tune" in study and "respond" in study else BEFORE[:3]
    found = {stage: store.read_json(f"{stage}.json") for stage in asked if store.path(f"{stage}.json").is_file()}
    whole = ContactTable.load(store.path("preload.csv")) if "preload" in found else None
    kept = ContactTable.load(store.path("kept.csv")) if "tune" in found else None
    cases = [Case(facts, ForcedResponse.load(store.path(facts["file"])))
             for facts in found.get("respond", {}).get("responses", [])]
    loads = {case: ContactTable.load(store.path(facts["file"]))
             for case, facts in found.get("preload", {}).get("cases", {}).items()}
    kept_modes = (("stuck_modes.npz", "tune"), ("free_modes.npz", "reduce"))
    shapes = [Shapes.load(store.path(name)) for name, stage in kept_modes
              if stage in found and store.path(name).is_file()]
    records = {stage: store.record(stage) for stage in BEFORE}
    seconds = {stage: record["seconds"] for stage, record in records.items() if record and stage in found}
    return Results(study, found, whole, kept, tuple(sorted(cases, key=lambda c: (c.H, c.Fe))),
                   _stuck(study, store) if "respond" in found else None, seconds, loads,
                   ReducedModel.load(store.path("model.npz")) if store.path("model.npz").is_file() else None,
                   surface.load(store.path("surface.npz")) if store.path("surface.npz").is_file() else {},
                   tuple(shapes))


def _stuck(study, store):
    if not store.path("stuck.npz").is_file():
        return None
    with np.load(store.path("stuck.npz"), allow_pickle=False) as z:
        mine = in_patch(z["output_names"], study.respond.patches[0])
        return {"hz": z["frequency"], "m_per_N": np.abs(z["response"][:, mine])}


def in_patch(output_names, patch: str) -> np.ndarray:
    """(m,) bool - outputs named 'patch:node' that belong to the patch."""
    return np.array([name.rpartition(":")[0] == patch for name in output_names.tolist()])
