"""The results folder read back for the report: records of the stages, contact tables, curves and
shapes."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from tipdamp.checks import pairs as pair_checks
from tipdamp.engine.curves import CurveCase
from tipdamp.engine.store import Store
from tipdamp.fields import surface
from tipdamp.fields.surface import OuterSurface
from tipdamp.fields.visualization import Shapes
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.drawing.branches import named_amplitudes
from tipdamp.hbm.io.array_files import open_npz
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.modes.result import Backbone
from tipdamp.hbm.result import MOVES, ForcedResponse
from tipdamp.measured.frf import load_band
from tipdamp.results.loops import Loops, load_loops
from tipdamp.results.record import Result
from tipdamp.results.response_results import (
    AgreementResult,
    BackboneResult,
    CurveResult,
    CyclesResult,
    FitResult,
    MeasuredResult,
    PeakCycle,
    RespondResult,
    StressResult,
    families,
)
from tipdamp.results.static_results import (
    FullResult,
    InspectResult,
    PreloadResult,
    ReduceResult,
    TuneResult,
)
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.view import Study

T = TypeVar("T")
# of the stages whose results are fields of Results
RECORDS: tuple[type[Result], ...] = (
    InspectResult,
    ReduceResult,
    PreloadResult,
    TuneResult,
    RespondResult,
    MeasuredResult,
    AgreementResult,
    CyclesResult,
    StressResult,
    FitResult,
    BackboneResult,
)


@dataclass(frozen=True)
class ReportedCurve:
    """One curve with its figures, and those that were found beside it; back - the same followed
    from the other end of the band, None where it was not."""

    facts: CurveResult
    curve: ForcedResponse
    beside: tuple[ForcedResponse, ...] = ()
    back: ForcedResponse | None = None

    @property
    def Fe(self) -> float:
        """N, amplitude of the excitation."""
        return self.facts.Fe_N

    @property
    def H(self) -> int:
        """Highest harmonic order."""
        return self.facts.H

    @property
    def has_peak(self) -> bool:
        """Whether its largest value is a peak: the curve reached the end of the band, and no gap
        borders the value."""
        return self.facts.peak_m is not None

    @property
    def is_bound(self) -> bool:
        """Whether its largest value is only what the vibration is at least: it has no peak, or
        holes beside it, in which a solution may be higher."""
        failed = self.curve.frequency[~self.curve.converged]
        return self.facts.is_bound or any(self.facts.is_beside(hz, hz) for hz in failed)

    @property
    def peak_per_newton(self) -> float | None:
        """m/N."""
        return None if self.facts.peak_m is None else self.facts.peak_m / self.Fe

    @property
    def at_least_per_newton(self) -> float | None:
        """m/N, largest amplitude that was solved of a curve without a peak."""
        return None if self.facts.at_least_m is None else self.facts.at_least_m / self.Fe

    @property
    def moving_at_peak(self) -> int:
        """Number of pairs that slip or open at the solved point of the peak; of those that stay
        open all along the curve none counts."""
        off = abs(self.curve.frequency / self.facts.peak_hz - 1)  # the peak is next to that point
        off = off + abs(self.curve.amplitude() / self.facts.peak_m - 1).min(axis=1)
        at, mine = np.nanargmin(off), self.curve.slipping_pairs
        moves = self.curve.share_slip[at, mine] + self.curve.share_open[at, mine] > MOVES
        return int(moves.sum())

    def error_of_top(self, name: str) -> np.ndarray | None:
        """(n,) m, estimated error of the largest amplitude of `patch` by the orders left out, as
        that of one harmonic; None where the curve holds none."""
        if not self.curve.truncation.size:
            return None
        error = np.sqrt(2) * self.curve.truncation[:, in_patch(self.curve.output_names, name)]
        largest = self.patch(name).argmax(axis=1)
        return np.take_along_axis(error, largest[:, None], axis=1)[:, 0]

    def patch(self, name: str) -> np.ndarray:
        """(n, k) m, half of peak-to-peak of the k nodes of a patch; NaN where a point failed."""
        return self.curve.amplitude()[:, in_patch(self.curve.output_names, name)]

    def named(self, name: str) -> np.ndarray:
        """(c, k) m, the same at the c named points of the curve."""
        return named_amplitudes(self.curve)[:, in_patch(self.curve.output_names, name)]


@dataclass(frozen=True)
class StuckResponse:
    """Linear response with all kept pairs stuck: hz (n,), m_per_N (n, k) of the k nodes of the
    first patch."""

    hz: np.ndarray
    m_per_N: np.ndarray


@dataclass(frozen=True)
class MeasuredBand:
    """Mean of a measured curve with its band: hz, mean, low, high (n,) Hz and m/N."""

    hz: np.ndarray
    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Results:
    """What a study has computed; None or empty where a stage has not run or does not apply.

    whole, kept - contact tables of the whole patch and after `tune`; loads {case: table of the
    whole patch} loops {file of cycles.json: one period of the contacts}; bands {name: measured
    curve}
    mode - the backbone; cases - the curves, family by family; stuck - their linear limit
    said {stage: its warnings} of the stages that the study asks for; seconds {stage: s} of those
    that have run model - the reduced one; surfaces {body: Surface}, empty without meshes; shapes -
    modes, stuck ones first"""

    study: Study
    inspect: InspectResult | None = None
    reduce: ReduceResult | None = None
    preload: PreloadResult | None = None
    tune: TuneResult | None = None
    respond: RespondResult | None = None
    measured: MeasuredResult | None = None
    agreement: AgreementResult | None = None
    cycles: CyclesResult | None = None
    stress: StressResult | None = None
    fit: FitResult | None = None
    backbone: BackboneResult | None = None
    mode: Backbone | None = None
    full: FullResult | None = None
    loops: dict[str, Loops] = field(default_factory=dict)
    bands: dict[str, MeasuredBand] = field(default_factory=dict)
    whole: ContactTable | None = None
    kept: ContactTable | None = None
    loads: dict[str, ContactTable] = field(default_factory=dict)
    cases: tuple[ReportedCurve, ...] = ()
    stuck: StuckResponse | None = None
    said: dict[str, list[str]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    model: ReducedModel | None = None
    surfaces: dict[str, OuterSurface] = field(default_factory=dict)
    shapes: tuple[Shapes, ...] = ()

    @property
    def first_patch(self) -> str:
        """Response patch of blade 1."""
        return self.study.respond.patches[0]

    @property
    def families(self) -> list[list[ReportedCurve]]:
        """The curves in sets of one for each level, as `response_results.families`."""
        case_of = {case.facts.file: case for case in self.cases}
        found = families([case.facts for case in self.cases])
        return [[case_of[one.file] for one in family] for family in found]

    @property
    def finest(self) -> list[ReportedCurve]:
        """The curves of most harmonics, ascending in Fe."""
        return self.families[-1] if self.cases else []

    @property
    def solved(self) -> list[ReportedCurve]:
        """Those of the finest with a solved point."""
        return [case for case in self.finest if not case.facts.solved_nothing]

    @property
    def periods(self) -> list[PeakCycle]:
        """The periods at the peaks of the curves of most harmonics that have one."""
        every = self.cycles.curves if self.cycles is not None else ()
        for family in reversed(self.families):
            mine = {(case.Fe, case.H) for case in family}
            found = [one for one in every if (one.Fe_N, one.H) in mine]
            if found:
                return sorted(found, key=lambda one: one.Fe_N)
        return []

    def is_bound(self, Fe: float, H: int) -> bool:
        """Whether the largest value of a curve is only what its vibration is at least."""
        return any(case.is_bound for case in self.cases if (case.Fe, case.H) == (Fe, H))

    def beside_paper(self, words: str) -> str:
        """A sentence on the figures of the seed paper where the study states its values as
        [reference], else ''."""
        return f" {words} of Zucca, Berruti and Cosi (2016)." if self.study.reference else ""

    @property
    def axis(self) -> np.ndarray:
        """(3,) direction along the damper."""
        return np.array(self.study.driver.axis)

    def places(self, pairs: ContactTable) -> dict[str, np.ndarray]:
        """{"blades", "damper": (P, 3) m} of the two nodes of each pair; without a model the place
        in the table."""
        return pair_checks.places_in(self.model, pairs)

    def along(self, pairs: ContactTable) -> np.ndarray:
        """(P,) mm, coordinate along the axis of the damper."""
        return 1e3 * pairs.position @ self.axis


def load_results(study: Study, store: Store, said: dict[str, list[str]]) -> Results:
    """Read what is there of the stages that `said` {stage: warnings} names; InputError where a file
    is damaged."""
    records = {stage: store.record(stage) for stage in said}
    found = Results(
        study,
        **_records(store, said),
        said=said,
        seconds={stage: record.seconds for stage, record in records.items() if record},
        full=_full(store),
        mode=_there(store, "backbone.npz", Backbone.load) if "backbone" in said else None,
        model=_there(store, "model.npz", ReducedModel.load),
        surfaces=_there(store, "surface.npz", surface.load) or {},
    )
    cycles, measured, preload = found.cycles, found.measured, found.preload
    return replace(
        found,
        loops={
            one.file: load_loops(store.path(one.file)) for one in (cycles.curves if cycles else ())
        },
        bands={
            name: MeasuredBand(*load_band(store.path(one.file)))
            for name, one in (measured.curves if measured else {}).items()
        },
        whole=ContactTable.load(store.path("preload.csv")) if preload else None,
        kept=ContactTable.load(store.path("kept.csv")) if found.tune else None,
        loads={
            case: ContactTable.load(store.path(c.file))
            for case, c in (preload.cases if preload else {}).items()
        },
        cases=tuple(_curves(store, found.respond)) if found.respond else (),
        stuck=_stuck(study, store) if found.respond else None,
        shapes=tuple(
            Shapes.load(store.path(name))
            for result, name in ((found.tune, "stuck_modes.npz"), (found.reduce, "free_modes.npz"))
            if result and store.path(name).is_file()
        ),
    )


def _records(store: Store, stages: Collection[str]) -> dict[str, Any]:
    """{stage: its result} of those that have left one."""
    kinds = {kind.file.removesuffix(".json"): kind for kind in RECORDS}
    return {
        stage: kind.load(store)
        for stage, kind in kinds.items()
        if stage in stages and store.path(kind.file).is_file()
    }


def _curves(store: Store, respond: RespondResult) -> Iterator[ReportedCurve]:
    """Family by family."""
    for one in (one for family in families(respond.responses) for one in family):
        beside = (ForcedResponse.load(store.path(other.file)) for other in one.beside)
        downwards = CurveCase(one.Fe_N, one.H, (1.0, 0.0)).file
        back = None if one.back is None else _there(store, downwards, ForcedResponse.load)
        yield ReportedCurve(one, ForcedResponse.load(store.path(one.file)), tuple(beside), back)


def _there(store: Store, name: str, load: Callable[[Path], T]) -> T | None:
    """A file that may be there."""
    path = store.path(name)
    return load(path) if path.is_file() else None


def _full(store: Store) -> FullResult | None:
    """The preload on the full model, where it was made for the preload that is there."""
    found = FullResult.load(store) if store.path(FullResult.file).is_file() else None
    return found if found and found.of == store.outputs("preload").get("preload.csv") else None


def _stuck(study: Study, store: Store) -> StuckResponse | None:
    path = store.path("stuck.npz")
    if not path.is_file():
        return None
    with open_npz(path) as z:
        mine = in_patch(z["output_names"], study.respond.patches[0])
        return StuckResponse(z["frequency"], np.abs(z["response"][:, mine]))
