"""What the stages left in the results folder, read back for the report."""

from dataclasses import dataclass

import numpy as np

from hbm.contact import ContactTable
from hbm.response import ForcedResponse

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
    """

    study: object
    found: dict
    whole: ContactTable | None
    kept: ContactTable | None
    cases: tuple
    stuck: dict | None
    seconds: dict

    def __contains__(self, stage: str) -> bool:
        return stage in self.found

    def __getitem__(self, stage: str) -> dict:
        return self.found[stage]

    @property
    def first_patch(self) -> str:
        return self.study["respond"]["patches"][0]

    @property
    def orders(self) -> list[int]:
        """Numbers of harmonics, ascending."""
        return sorted({case.H for case in self.cases})

    def of_order(self, H: int) -> list[Case]:
        return [case for case in self.cases if case.H == H]

    def beside_paper(self, words: str) -> str:
        """A sentence on the seed paper's figures, where the study has its values as [reference]; else nothing."""
        return f" {words} of Zucca, Berruti and Cosi (2016)." if self.study.reference else ""

    def along(self, pairs: ContactTable) -> np.ndarray:
        """(P,) mm, coordinate along the damper's axis."""
        return 1e3 * pairs.position @ np.array(self.study.driver["axis"])


def load_results(study, store) -> Results:
    """All that is there and that the study still asks for."""
    from tipdamp.stages import applies  # stages imports the report when it runs it

    found = {stage: store.read_json(f"{stage}.json") for stage in BEFORE
             if applies(stage, study) and store.path(f"{stage}.json").is_file()}
    whole = ContactTable.load(store.path("preload.csv")) if "preload" in found else None
    kept = ContactTable.load(store.path("kept.csv")) if "tune" in found else None
    cases = [Case(facts, ForcedResponse.load(store.path(facts["file"])))
             for facts in found.get("respond", {}).get("responses", [])]
    records = {stage: store.record(stage) for stage in BEFORE}
    seconds = {stage: record["seconds"] for stage, record in records.items() if record and stage in found}
    return Results(study, found, whole, kept, tuple(sorted(cases, key=lambda c: (c.H, c.Fe))),
                   _stuck(study, store) if "respond" in found else None, seconds)


def _stuck(study, store):
    if not store.path("stuck.npz").is_file():
        return None
    with np.load(store.path("stuck.npz"), allow_pickle=False) as z:
        mine = in_patch(z["output_names"], study["respond"]["patches"][0])
        return {"hz": z["frequency"], "m_per_N": np.abs(z["response"][:, mine])}


def in_patch(output_names, patch: str) -> np.ndarray:
    """(m,) bool - outputs named 'patch:node' that belong to the patch."""
    return np.array([name.rpartition(":")[0] == patch for name in output_names.tolist()])
