"""Stage agreement: computed curves beside the measured ones."""

from collections.abc import Sequence

import numpy as np

from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.result import ForcedResponse
from tipdamp.measured.agreement import at_place, computed_amplitude, drawn, share_inside, values_at
from tipdamp.measured.damping import half_power
from tipdamp.measured.frf import load_band
from tipdamp.results.response_results import (
    Agreement,
    AgreementResult,
    CurveResult,
    MeasuredDamping,
    MeasuredFacts,
    MeasuredResult,
    RespondResult,
)
from tipdamp.results.static_results import TuneResult
from tipdamp.stages.curve_facts import peak_of
from tipdamp.stages.stage import Stage, recorded
from tipdamp.study.schema import Measured
from tipdamp.study.view import Study

SAME_LEVEL = 0.02  # relative difference of two forces that count as one level


def agreement(study: Study, store: Store, tick: Tick) -> list[str]:
    """Each measured curve beside the computed curves of its level."""
    computed = RespondResult.load(store)
    found: list[Agreement] = []
    said: list[str] = []
    for name, facts in MeasuredResult.load(store).curves.items():
        tick(len(found) / max(len(computed.responses), 1), name)
        beside = [c for c in computed.responses if abs(c.Fe_N / facts.level_N - 1) <= SAME_LEVEL]
        if not beside:
            levels = ", ".join(f"{Fe:g}" for Fe in sorted({c.Fe_N for c in computed.responses}))
            said.append(
                f"measured curve '{name}' has no computed curve at its level of {facts.level_N:g} "
                f"N (levels: {levels} N)"
            )
        for case in beside:
            curve = ForcedResponse.load(store.path(case.file))
            found.append(
                _agreement(
                    name,
                    study.measured[name],
                    study.respond.patches[0],
                    facts,
                    case,
                    curve,
                    load_band(store.path(facts.file)),
                )
            )
    AgreementResult(curves=tuple(found), zeta=_zeta(study, store), warnings=tuple(said)).save(store)
    return []


def _agreement(
    name: str,
    settings: Measured,
    patch: str,
    facts: MeasuredFacts,
    case: CurveResult,
    curve: ForcedResponse,
    band: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> Agreement:
    hz, _, low, high = band
    amplitude = computed_amplitude(curve, settings, patch) / case.Fe_N
    top = peak_of(curve, at_place(curve, settings, patch))
    peak = (None, None) if top.peak_m is None else (top.peak_hz, top.peak_m / case.Fe_N)
    path = drawn(curve.frequency, amplitude)
    if settings.amplitude == "fundamental" and top.peak_m is not None:
        peak = _highest(*path)
    off = [
        None if a is None or b is None else a / b - 1
        for a, b in ((peak[1], facts.peak_m_per_N), (peak[0], facts.peak_hz))
    ]
    return Agreement(
        measured=name,
        computed=case.file,
        Fe_N=case.Fe_N,
        H=case.H,
        peak=off[0],
        frequency=off[1],
        share_inside=share_inside(hz, low, high, curve.frequency, amplitude),
        half_power=_half_power(hz, values_at(hz, *path)),
    )


def _highest(hz: np.ndarray, amplitude: np.ndarray) -> tuple[float, float]:
    """(Hz, m/N) of the highest point of the drawn curve: that of the fundamental is not among the
    solved peaks."""
    k = int(np.nanargmax(amplitude))
    return float(hz[k]), float(amplitude[k])


def _half_power(hz: np.ndarray, values: Sequence[np.ndarray]) -> MeasuredDamping:
    """As for a measured curve: by the values of the computed curve at the measured frequencies."""
    if any(len(v) > 1 and np.ptp(v) > 1e-9 * v.max() for v in values):
        return MeasuredDamping(refused="the computed curve folds")
    covered = np.array([len(v) > 0 for v in values])
    try:
        return MeasuredDamping(
            zeta=half_power(hz[covered], np.array([v[0] for v in values if len(v)])).zeta
        )
    except (InputError, ValueError) as error:
        return MeasuredDamping(refused=str(error))


def _zeta(study: Study, store: Store) -> float:
    """MeasuredDamping ratio of the stuck mode nearest to the tracked frequency."""
    zeta = study.respond.damping_ratio
    tune = TuneResult.load(store)
    mode = int(np.abs(np.array(tune.stuck_modes_hz.tuned) - tune.stuck_hz.tuned).argmin())
    return zeta[min(mode, len(zeta) - 1)]


def line(store: Store) -> str:
    """Share of the band inside, of each pair of curves."""
    return (
        "; ".join(
            f"{one.measured} and H = {one.H}: "
            + (
                "no common frequency"
                if one.share_inside is None
                else f"{100 * one.share_inside:.0f} % inside"
            )
            for one in AgreementResult.load(store).curves
        )
        or "nothing to compare"
    )


STAGE = Stage(
    agreement,
    line,
    warnings=recorded(AgreementResult),
    outputs=("agreement.json",),
    needs=("measured", "tune", "respond"),
    requires=("measured", "tune", "respond", "respond.levels"),
    reads=("measured", "respond.patches", "respond.damping_ratio"),
)
