"""Stage measured: measured response curves to receptances, mean and band, peak and damping."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.measured.damping import circle_fit, half_power, highest_peak
from tipdamp.measured.frf import Frf, MeasuredCurve, average, write_band
from tipdamp.measured.read import read_measured
from tipdamp.results.response_results import MeasuredDamping, MeasuredFacts, MeasuredResult
from tipdamp.stages.stage import Stage, recorded
from tipdamp.study.view import Study


def measured(study: Study, store: Store, tick: Tick) -> list[str]:
    """Read every measured curve, and write its mean and band as CSV."""
    facts = {}
    said = []
    for k, (name, settings) in enumerate(study.measured.items()):
        tick(k / len(study.measured), name)
        try:
            repeats, more = read_measured([study.file(f) for f in settings.files], settings)
            curve = average(repeats)
            if any(study.respond.band):
                _check_overlap(curve, study.respond.band)
        except InputError as error:
            raise InputError(f"[measured.{name}]: {error}") from None
        facts[name] = _facts(name, settings.files, curve)
        said += [f"measured curve '{name}': {text}" for text in (*more, *_refusals(facts[name]))]
        with store.writing(facts[name].file) as path:
            write_band(path, curve, settings.scatter)
    MeasuredResult(curves=facts, warnings=tuple(said)).save(store)
    return [one.file for one in facts.values()]


def _check_overlap(curve: MeasuredCurve, band: tuple[float, float]) -> None:
    if curve.hz[-1] < band[0] or curve.hz[0] > band[1]:
        raise InputError(
            f"no overlap: measured {curve.hz[0]:g}..{curve.hz[-1]:g} Hz, computed {band[0]:g}.."
            f"{band[1]:g} Hz; change [respond] band"
        )


def _facts(name: str, files: Sequence[str], curve: MeasuredCurve) -> MeasuredFacts:
    peaks = np.array([_peak(one) for one in curve.repeats])
    mean, deviation = peaks.mean(axis=0), _deviation(peaks)
    return MeasuredFacts(
        file=f"measured/{name}.csv",
        files=tuple(files),
        level_N=float(np.mean([r.force_N for r in curve.repeats])),
        repeats=len(curve.repeats),
        points=len(curve.hz),
        band_hz=(float(curve.hz[0]), float(curve.hz[-1])),
        with_phase=all(r.with_phase for r in curve.repeats),
        peak_hz=mean[0],
        peak_m_per_N=mean[1],
        peak_hz_deviation=deviation[0],
        peak_m_per_N_deviation=deviation[1],
        half_power=identified(lambda r: half_power(r.hz, _whole(r).amplitude).zeta, curve.repeats),
        circle_fit=identified(lambda r: circle_fit(r.hz, _whole(r).response), curve.repeats),
    )


def _peak(frf: Frf) -> tuple[float, float]:
    try:
        return highest_peak(frf.hz, _whole(frf).amplitude)
    except InputError:
        return np.nan, np.nan


def _whole(frf: Frf) -> Frf:
    """InputError where the signal was clipped."""
    if frf.clipped:
        raise InputError(frf.clipped)
    return frf


def _deviation(values: np.ndarray) -> np.ndarray:
    return values.std(axis=0, ddof=1) if len(values) > 1 else np.full(values.shape[1:], np.nan)


def identified(method: Callable[[Frf], float], repeats: Sequence[Frf]) -> MeasuredDamping:
    """MeasuredDamping of each repeat by a method; refused for all where one is refused."""
    try:
        zeta = np.array([method(one) for one in repeats])
    except InputError as error:
        return MeasuredDamping(refused=str(error))
    return MeasuredDamping(zeta=zeta.mean(), deviation=float(_deviation(zeta)))


def _refusals(facts: MeasuredFacts) -> Iterator[str]:
    if facts.half_power.refused:
        yield f"no damping by half-power: {facts.half_power.refused}"
    if (
        facts.with_phase
        and facts.circle_fit.refused
        and facts.circle_fit.refused != facts.half_power.refused
    ):
        yield f"no damping by circle fit: {facts.circle_fit.refused}"


def line(store: Store) -> str:
    """Peak of each curve."""
    return "; ".join(
        f"{name}: "
        + (
            "no peak"
            if one.peak_hz is None or one.peak_m_per_N is None
            else f"{1e6 * one.peak_m_per_N:.4g} um/N at {one.peak_hz:.1f} Hz"
        )
        for name, one in MeasuredResult.load(store).curves.items()
    )


STAGE = Stage(
    measured,
    line,
    warnings=recorded(MeasuredResult),
    outputs=("measured.json",),
    may_write=("measured/*.csv",),
    requires=("measured", "respond"),
    reads=("measured", "respond.band"),
    reads_files=("measured",),
)
