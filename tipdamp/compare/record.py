"""Studies that were run, read back to be set side by side."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from tipdamp.compare.optimum import Optimum, optimum
from tipdamp.compare.peaks import PHASES, ComparedPeak, Phase, peaks_of
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.validation import brief
from tipdamp.report.results import Results, load_results
from tipdamp.stages.report import said
from tipdamp.stages.run import check_current
from tipdamp.study.view import Study

# of [respond]: what the response is of, and to what
ALIKE = ("patches", "direction", "excitation", "amplitudes", "phase", "engine_order", "blade_count")


@dataclass(frozen=True)
class Comparison:
    """studies - what each has computed, in the order given; peaks - of all of them."""

    studies: tuple[Results, ...]
    peaks: tuple[ComparedPeak, ...]

    @property
    def names(self) -> list[str]:
        """Of the studies."""
        return [one.study.name for one in self.studies]

    @property
    def phases(self) -> list[Phase]:
        """Those that a study has computed."""
        return [phase for phase in PHASES if any(peak.phase == phase for peak in self.peaks)]

    @property
    def blades(self) -> list[int]:
        """1, 2, as far as the studies have patches."""
        return sorted({peak.blade for peak in self.peaks})

    def of(self, study: str, phase: Phase, blade: int | None = None) -> list[ComparedPeak]:
        """The peaks of one study and phase, on one blade or on all, ascending in Fc/Fe."""
        mine = [
            peak
            for peak in self.peaks
            if (peak.study, peak.phase) == (study, phase) and blade in (None, peak.blade)
        ]
        return sorted(mine, key=lambda peak: (peak.ratio, peak.blade))

    def optima(self, phase: Phase) -> dict[str, Optimum]:
        """{study: its optimum} of those that have one."""
        found = {name: optimum(self.of(name, phase)) for name in self.names}
        return {name: one for name, one in found.items() if one is not None}


def read(studies: Sequence[tuple[Study, Store]]) -> Comparison:
    """Studies that were run to the end, with the store of each.

    Raises InputError where two have one name, a study has no forced response or an old one, or
    they are not of the same outputs and excitation."""
    refuse(studies)
    found = tuple(load_results(study, store, said(study, store)) for study, store in studies)
    return Comparison(found, tuple(peak for one in found for peak in peaks_of(one)))


def refuse(studies: Sequence[tuple[Study, Store]]) -> None:
    """InputError where the studies cannot be compared, with what to do."""
    for study, _ in studies:
        for section in ("tune", "respond"):
            if section not in study:
                raise InputError(
                    f"{study.path}: section [{section}] is missing, a comparison needs the forced "
                    "response of the kept pairs"
                )
    for (one, _), (other, _) in combinations(studies, 2):
        if one.name == other.name:
            raise InputError(
                f"{one.path} and {other.path}: both are named {one.name}, and the name tells "
                "studies apart; rename one of the files"
            )
        _refuse_unlike(one, other)
    for study, store in studies:
        if store.record("respond") is None:
            raise InputError(
                f"{study.path}: its forced response is not there yet; run: tipdamp run {study.path}"
            )
        check_current("report", study, store)


def _refuse_unlike(one: Study, other: Study) -> None:
    for key in ALIKE:
        mine, its = getattr(one.respond, key), getattr(other.respond, key)
        if mine != its:
            raise InputError(
                f"{other.path}: [respond] {key} = {brief(its)}, but {brief(mine)} in {one.path}: "
                "studies are compared by the same outputs under the same excitation; give both the "
                "same value"
            )
