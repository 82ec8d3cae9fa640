"""What the index holds of a finished step: the peaks of its curves, the stress at them."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tipdamp.results.response_results import RespondResult, StressResult
from tipdamp.results.static_results import TuneResult
from tipdamp.sweep.plan import CURVES, STRESS, SweepStep
from tipdamp.sweep.work import read_member


@dataclass(frozen=True)
class CurveRow:
    """One curve on one patch: as in `results.response_results`, of the step with the key; stuck_hz
    - of the tracked mode on the kept pairs."""

    key: str
    patch: str
    Fe_N: float
    H: int
    peak_m: float | None
    peak_hz: float | None
    at_least_m: float | None
    at_least_hz: float | None
    truncation: float | None
    complete: bool
    unstable: bool
    slipping_pairs: int
    kept_pairs: int
    stuck_hz: float | None
    ended: str


@dataclass(frozen=True)
class StressRow:
    """Stress at the peak of one curve, of the step with the key: the largest alternating stress
    with the mean there and its body, '' where no node has any; the least safety by Goodman with its
    body, None and '' without limits of the material."""

    key: str
    Fe_N: float
    H: int
    alternating_Pa: float | None
    mean_Pa: float | None
    alternating_body: str
    safety: float | None
    safety_body: str


Row = CurveRow | StressRow


def rows_of(folder: Path, step: SweepStep) -> Iterator[Row]:
    """Of a finished step in the folder of a sweep; none of a step without curves or stress."""
    if step.stage == CURVES:
        yield from _curves(folder, step)
    if step.stage == STRESS:
        yield from _stresses(folder, step)


def _curves(folder: Path, step: SweepStep) -> Iterator[CurveRow]:
    """A row for each curve and each patch."""
    found = RespondResult.model_validate_json(read_member(folder, step.key, RespondResult.file))
    tune = TuneResult.model_validate_json(read_member(folder, step.needs[-1], TuneResult.file))
    for one in found.responses:
        for patch, peak in one.patches.items():
            yield CurveRow(
                key=step.key,
                patch=patch,
                Fe_N=one.Fe_N,
                H=one.H,
                peak_m=peak.peak_m,
                peak_hz=peak.peak_hz,
                at_least_m=peak.at_least_m,
                at_least_hz=peak.at_least_hz,
                truncation=peak.truncation,
                complete=one.complete,
                unstable=one.unstable,
                slipping_pairs=len(one.slipping_pairs),
                kept_pairs=tune.kept_pairs,
                stuck_hz=tune.stuck_hz.tuned,
                ended=one.ended,
            )


def _stresses(folder: Path, step: SweepStep) -> Iterator[StressRow]:
    found = StressResult.model_validate_json(read_member(folder, step.key, StressResult.file))
    for one in found.curves:
        top, weakest = one.top, one.weakest
        yield StressRow(
            key=step.key,
            Fe_N=one.Fe_N,
            H=one.H,
            alternating_Pa=top.alternating_Pa if top else None,
            mean_Pa=top.mean_Pa if top else None,
            alternating_body=top.body if top else "",
            safety=weakest.safety if weakest else None,
            safety_body=weakest.body if weakest else "",
        )
