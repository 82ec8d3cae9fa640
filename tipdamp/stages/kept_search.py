"""Which pairs of the line are kept: by stations or by area, to a target or as the study gives
them."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from tipdamp.checks import kept_table
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.results import static_results as results
from tipdamp.results.response_results import MeasuredResult
from tipdamp.stages import kept_area
from tipdamp.stages.kept_preload import (
    WholeAtRest,
    moment_within,
)
from tipdamp.static_contact.tuning.redistribution import carried
from tipdamp.static_contact.tuning.station_detachment import (
    Detachment,
    DetachmentOptions,
    NotReachable,
    Step,
    detach_until,
    keep_stations,
    keep_weights,
)
from tipdamp.static_contact.tuning.stuck_assembly import StuckAssembly
from tipdamp.statics import model_inputs as inputs
from tipdamp.study.view import Study

DEVIATIONS = 2  # of the peak frequency over the repeats: scatter of a measured target


@dataclass(frozen=True)
class Target:
    """hz - the frequency that the kept stations must meet; scatter_hz - what it is known to."""

    hz: float
    scatter_hz: float = 0.0


def target(study: Study, store: Store) -> Target | None:
    """What the kept stations must meet; None where the study says which they are. Raises InputError
    where the measured curve that it names has no peak."""
    hz = study.tune.target_hz
    scatter = study.tune.scatter_hz
    name = study.tune.target_from
    if name:
        curve = MeasuredResult.load(store).curves[name]
        if curve.peak_hz is None:
            raise InputError(
                f"[tune] target_from = '{name}': the measured curve has no peak that can be trusted"
            )
        hz = curve.peak_hz
        spread = DEVIATIONS * (curve.peak_hz_deviation or 0.0)
        scatter = spread if scatter is None else scatter
    return None if hz is None else Target(hz, scatter or 0.0)


def detachment(
    study: Study, whole: WholeAtRest, line: ContactTable, goal: Target | None
) -> DetachmentOptions:
    """How pairs of the line are detached; a scaled preload must not leave a moment."""
    scaled = study.tune.preload == "scaled"
    return DetachmentOptions(
        springs=lambda pairs: inputs.declared_springs(study, pairs),
        load=carried(whole.pairs, line),
        order="least_loaded" if study.tune.order == "least_loaded" else "from_middle",
        graded=study.tune.graded,
        conserve=inputs.conserves(study),
        scatter_hz=goal.scatter_hz if goal else 0.0,
        allowed=(lambda weight: moment_within(whole, line.replace(weight=weight)))
        if scaled
        else None,
    )


@dataclass(frozen=True)
class KeptSearch:
    """For the pairs of the line that are kept, by the goal or as the study gives them."""

    study: Study
    assembly: StuckAssembly
    line: ContactTable
    goal: Target | None
    options: DetachmentOptions

    def kept(
        self, follow: np.ndarray, others: Mapping[str, np.ndarray], tick: Tick
    ) -> tuple[ContactTable, dict]:
        """They, and the fields of TuneResult on how they were found. InputError where none meets
        the target, with the name of another free mode {name: shape} that does."""
        try:
            return self._kept(follow, tick)
        except NotReachable as error:
            more = inputs.out_of_reach(self.study, error.above, self._reaching(others))
            raise InputError(f"[tune] {error}{more}") from None

    # hundreds of small factors, in which threads wait for each other: 9.4 s for 0.1 s beside other
    # work
    @threadpool_limits.wrap(limits=1, user_api="blas")
    def _kept(self, follow: np.ndarray, tick: Tick) -> tuple[ContactTable, dict]:
        """NotReachable where none meets the target."""

        def report(step: Step, share: float) -> None:
            tick(0.8 * share, f"{step.front} + {step.back} stations  {step.hz:.0f} Hz")

        study = self.study
        assembly = self.assembly
        line = self.line
        options = self.options
        hz = self.goal.hz if self.goal else None
        if study.tune.kept:
            found = self._of_table(follow)
        elif study.tune.by != "station":
            return kept_area.keep(study, assembly, line, follow, hz, options, tick)
        elif hz is None:
            found = keep_stations(assembly, line, inputs.ends_kept(study, line), follow, options)
        else:
            found = detach_until(assembly, line, hz, follow, options, report)
        return found.pairs, _by_station(found, line.position @ study.driver.axis)

    def _of_table(self, follow: np.ndarray) -> Detachment:
        """The pairs of the user's own table."""
        own = kept_table.read(self.study, self.line)
        touching = self.options.load
        if self.study.tune.preload == "table":
            touching = own.preload
        whole = own.replace(weight=np.where(own.weight > 0, 1.0, self.line.weight))
        options = replace(self.options, load=touching, conserve=False)
        return keep_weights(self.assembly, whole, own.weight, follow, options)

    def _reaching(self, others: Mapping[str, np.ndarray]) -> str:
        """The free mode that meets the target where it is followed; "" where none does."""
        for name, shape in others.items():
            with suppress(InputError):
                self._kept(shape, lambda *_: None)
                return name
        return ""


def _place(pairs: ContactTable, along: np.ndarray, station: int) -> float:
    """m along the axis of a station of the damper; a stop of the same number may lie elsewhere."""
    here = pairs.station == station
    between = here & ~pairs.stops
    return float(along[between if between.any() else here].mean())


def _by_station(found: Detachment, along: np.ndarray) -> dict:
    """Fields of TuneResult; along (P,) m: the pairs along the axis."""
    worth = [
        results.PlacedWorth(**vars(w), position_m=_place(found.pairs, along, w.station))
        for w in found.worth
    ]
    return {
        "tuned_pairs": results.Stations(front=found.chosen.front, back=found.chosen.back),
        "history": found.history,
        "equivalent": found.equivalent,
        "graded": found.graded,
        "kept_stations": found.stations,
        "station_worth": worth,
        "passed_over": found.passed_over,
    }
