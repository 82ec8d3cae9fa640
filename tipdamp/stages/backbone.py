"""Stage backbone: a nonlinear mode of the kept pairs over its amplitude, and the peaks that it
predicts for the levels of the study."""

import csv
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import scipy.linalg as la
from threadpoolctl import threadpool_limits

from tipdamp.engine.curves import Curves
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.continuation.settings import Settings
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.modes.backbone import REACHED, UNSEEN, NoFreeMotion
from tipdamp.hbm.modes.backbone import backbone as nonlinear_mode
from tipdamp.hbm.modes.result import Backbone
from tipdamp.hbm.modes.stuck_modes import StuckModalSystem, stuck_modes
from tipdamp.hbm.modes.synthesis import synthesis
from tipdamp.results.response_results import (
    BackboneResult,
    Peak,
    PredictedPeak,
    RespondResult,
    families,
)
from tipdamp.results.static_results import TuneResult
from tipdamp.stages.assembly import READS, assembled
from tipdamp.stages.response_doubts import LIMITS
from tipdamp.stages.stage import Stage
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.schema import named_orders
from tipdamp.study.view import Study

MOST_POINTS = 1000  # of a branch that folds again and again
HARMONICS = 5  # where the study leaves their number to be found
AROUND = 0.1, 1.1  # of the smallest and of the largest peak: range of amplitudes
# times the first amplitude of that range: where the peaks are of another mode it may be too large
LOWER = 1.0, 1e-1, 1e-2, 1e-3, 1e-6
NONE = "the backbone was not found"
FILES = "backbone.npz", "backbone.csv"  # where it was


# as in `respond`: sums are split by threads, and differ in the last bit
@threadpool_limits.wrap(limits=1, user_api="blas")
def backbone(study: Study, store: Store, tick: Tick) -> list[str]:
    """The mode that [backbone] asks for, with the kept pairs in the model."""
    curves = assembled(study, store, responded=True).curves
    patch = shown_patch(study)
    asked = study.backbone
    finest = families(RespondResult.load(store).responses)[-1]
    peaks = {one.Fe_N: one.patches[patch] for one in finest}
    modes, rest = stuck_modes(curves.problem), modes_at_rest(curves.problem)
    number = _number(study, store, modes, rest)
    shape = modes.shapes[:, number - 1]
    rows = _outputs(curves, patch, number, shape)
    follow = partial(_followed, study, curves, number, rows, tick)
    ranges = [asked.amplitudes] if asked.amplitudes else _ranges(list(peaks.values()))
    try:
        found = follow(asked.amplitudes) if asked.amplitudes else _first_found(follow, ranges)
    except InputError as error:
        raise InputError(f"[backbone] {error}") from None
    rest_hz = rest.hz[rest.most_like(shape)] if rest else None
    if found is None:
        BackboneResult(
            mode=number,
            stuck_hz=modes.frequencies[number - 1] / (2 * np.pi),
            rest_hz=rest_hz,
            response=patch,
            output=next(iter(rows)),
            points=0,
            complete=False,
            ended=_not_found(ranges),
            peaks=tuple(_computed(*peak, NONE) for peak in peaks.items()),
        ).save(store)
        return []
    with store.writing("backbone.npz") as path:
        found.save(path)
    with store.writing("backbone.csv") as path:
        write_csv(found, path)
    predicted = [
        _predicted(found, curves.problem, curves.force, level, peak)
        for level, peak in peaks.items()
    ]
    _result(found, patch, ranges[0], predicted, rest_hz).save(store)
    return list(FILES)


def _computed(level: float, peak: Peak, said: str = "") -> PredictedPeak:
    """The peak of the curve of a level, beside which none is predicted."""
    return PredictedPeak(Fe_N=level, peak_hz=peak.peak_hz, peak_m=peak.peak_m, said=said)


def _followed(
    study: Study,
    curves: Curves,
    number: int,
    rows: Mapping[str, np.ndarray],
    tick: Tick,
    amplitudes: Sequence[float],
) -> Backbone:
    """The mode of that number from the first amplitude to the last, m, of the first output."""
    way = np.log(amplitudes[-1] / amplitudes[0])
    orders = named_orders(study.respond.harmonics)

    def progress(amplitude: float, step: float, calls: int) -> None:
        share = float(np.log(amplitude / amplitudes[0]) / way)
        tick(share, f"{amplitude:.3g} m  {calls} calls")

    return nonlinear_mode(
        curves.problem,
        number,
        amplitudes,
        outputs=rows,
        harmonics=study.backbone.harmonics or max(orders, default=HARMONICS),
        samples=curves.samples,
        settings=Settings(max_points=MOST_POINTS),
        progress=progress,
    )


def shown_patch(study: Study) -> str:
    """Group of response nodes whose motion is shown."""
    return study.backbone.response or study.respond.patches[0]


@dataclass(frozen=True)
class ModesAtRest:
    """Those with the pairs stuck that are in contact at rest, and the others open: hz (r,), shapes
    (r, r) of unit modal mass; mass (r, r)."""

    hz: np.ndarray
    shapes: np.ndarray
    mass: np.ndarray

    def most_like(self, shape: np.ndarray) -> int:
        """Index of the one with the largest MAC with a shape (r,)."""
        return int(np.abs(self.shapes.T @ self.mass @ shape).argmax())


def modes_at_rest(problem: ContactProblem) -> ModesAtRest | None:
    """As [tune] has them; None where every pair is in contact at rest, so that they are the modes
    with every pair stuck."""
    closed = problem.contacts.preload > 0
    if closed.all():
        return None
    springs = problem.law.stuck_stiffness(problem.contacts) * closed[:, None]
    w2, shapes = la.eigh(problem.with_contact_springs(problem.stiffness, springs), problem.M)
    return ModesAtRest(np.sqrt(np.maximum(w2, 0.0)) / (2 * np.pi), shapes, problem.M)


def _number(study: Study, store: Store, modes: StuckModalSystem, rest: ModesAtRest | None) -> int:
    asked = study.backbone
    hz = modes.frequencies / (2 * np.pi)
    if asked.mode is None:
        near = asked.near_hz or TuneResult.load(store).stuck_hz.tuned
        if rest is None or asked.near_hz:
            return 1 + int(np.abs(hz - near).argmin())
        tracked = rest.mass @ rest.shapes[:, np.abs(rest.hz - near).argmin()]
        alike = (tracked @ modes.shapes[:, : len(hz)]) ** 2 / modes.mass[: len(hz)]
        return 1 + int(alike.argmax())
    if asked.mode > len(hz):
        raise InputError(
            f"[backbone] mode = {asked.mode}: there are {len(hz)} with every kept pair stuck, from "
            f"{hz[0]:.1f} to {hz[-1]:.1f} Hz"
        )
    return asked.mode


def _outputs(curves: Curves, patch: str, number: int, shape: np.ndarray) -> dict[str, np.ndarray]:
    """Those of a patch; the one that moves most in the stuck mode is the first."""
    mine = [n for n, here in zip(curves.rows, in_patch(curves.rows, patch), strict=True) if here]
    motion = {name: abs(float(curves.rows[name] @ shape)) for name in mine}
    if max(motion.values()) <= UNSEEN * np.abs(shape).max():
        raise InputError(
            f"[backbone] response: '{patch}' does not move along [respond] direction in mode "
            f"{number}; name another group, or another mode"
        )
    return {name: curves.rows[name] for name in sorted(mine, key=lambda name: -motion[name])}


def _ranges(peaks: Sequence[Peak]) -> list[tuple[float, float]]:
    """m, first and last amplitudes about the peaks, the first lower and lower; none without a
    peak."""
    known = [one.peak_m for one in peaks if one.peak_m]
    if not known:
        return []
    return [(lower * AROUND[0] * min(known), AROUND[1] * max(known)) for lower in LOWER]


def _first_found(
    followed: Callable[[Sequence[float]], Backbone], ranges: Sequence[Sequence[float]]
) -> Backbone | None:
    """The backbone over the first range that begins where there is a free motion."""
    for amplitudes in ranges:
        with suppress(NoFreeMotion):
            return followed(amplitudes)
    return None


def _predicted(
    found: Backbone, problem: ContactProblem, force: np.ndarray, level: float, peak: Peak
) -> PredictedPeak:
    """The peak of a level by the mode alone, beside that of its curve."""
    computed = _computed(level, peak)
    try:
        made = synthesis(found, problem, force, level)
    except InputError as error:
        return computed.model_copy(update={"said": str(error)})
    tops = [made.peak(name) for name in found.output_names.tolist()]
    hz, height = max(tops, key=lambda top: top[1])
    if not made.peak_reached:
        return computed.model_copy(update={"said": "the backbone does not reach its amplitude"})
    low, high = (1 - LIMITS.near) * found.frequency.min(), (1 + LIMITS.near) * found.frequency.max()
    of_mode = peak.peak_hz is None or low <= peak.peak_hz <= high
    said = made.said if of_mode else "the largest peak is that of another mode"
    return computed.model_copy(update={"predicted_hz": hz, "predicted_m": height, "said": said})


def _not_found(ranges: Sequence[Sequence[float]]) -> str:
    if not ranges:
        return "no curve has a peak to take its amplitudes from; set [backbone] amplitudes"
    return (
        f"no free motion exists at {ranges[0][0]:g} m, a tenth of the smallest peak, nor down to "
        f"{ranges[-1][0]:g} m; set [backbone] amplitudes"
    )


def _result(
    found: Backbone,
    patch: str,
    amplitudes: Sequence[float],
    peaks: Sequence[PredictedPeak],
    rest_hz: float | None,
) -> BackboneResult:
    most = int(found.damping_ratio.argmax())
    return BackboneResult(
        mode=found.mode,
        stuck_hz=found.stuck_frequency,
        rest_hz=rest_hz,
        stuck_zeta=found.stuck_damping_ratio,
        response=patch,
        output=str(found.output_names[0]),
        H=found.H,
        first_m=found.amplitude[0],
        last_m=amplitudes[-1],
        no_motion_m=amplitudes[0] if found.amplitude[0] < amplitudes[0] else None,
        reached_m=found.amplitude.max(),
        low_hz=found.frequency.min(),
        high_hz=found.frequency.max(),
        zeta=found.damping_ratio[most],
        zeta_at_m=found.amplitude[most],
        points=len(found.amplitude),
        complete=found.complete,
        ended=found.ended,
        peaks=tuple(peaks),
    )


def write_csv(found: Backbone, path: Path) -> None:
    """A row for each place: the amplitude of the first output at the frequency of the mode, half of
    peak-to-peak of the patch, frequency, damping ratio, and what the contacts do."""
    columns = {
        "amplitude_m": found.amplitude,
        "largest_m": found.largest(),
        "frequency_hz": found.frequency,
        "damping_ratio": found.damping_ratio,
        "slipping_or_open": (found.share_slip + found.share_open).mean(axis=1),
    }
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        table.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def line(store: Store) -> str:
    """The mode, and between what it moves."""
    found = BackboneResult.load(store)
    if not found.points:
        return f"mode {found.mode}: not found"
    return (
        f"mode {found.mode}: {found.high_hz:.1f} to {found.low_hz:.1f} Hz, damping up to "
        f"{100 * (found.zeta or 0.0):.3g} %, {found.points} points"
    )


def warnings(_: Study, store: Store) -> list[str]:
    """Where there is none, where it begins below the default amplitude, ends before the last one,
    or turns back on the way."""
    found = BackboneResult.load(store)
    mode = f"the backbone of mode {found.mode}"
    if not found.points:
        return [f"{mode} was not found: {found.ended}"]
    said = []
    if found.no_motion_m is not None:
        said.append(
            f"{mode} begins at {found.first_m:.6g} m: no free motion was found at "
            f"{found.no_motion_m:.6g} m, a tenth of the smallest peak (of another mode?); "
            "[backbone] amplitudes asks for others"
        )
    if not found.complete and not found.ended.startswith(REACHED):
        said.append(
            f"{mode} reaches {found.reached_m:.6g} m of {found.last_m:.6g} m: {found.ended}"
        )
    elif ";" in found.ended:
        said.append(f"{mode} reached the last amplitude{found.ended.removeprefix(REACHED)}")
    return said


STAGE = Stage(
    backbone,
    line,
    warnings=warnings,
    outputs=("backbone.json",),
    may_write=FILES,
    needs=("reduce", "tune", "respond"),
    requires=("backbone", "tune", "respond", "respond.levels"),
    reads=("backbone", *READS),
)
