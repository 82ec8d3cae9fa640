"""Stage fit: damping ratios, and on demand friction and stiffness of the contacts, with which the
computed response is as the measured one."""

import warnings as python_warnings
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from threadpoolctl import threadpool_limits

from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.errors import Doubt, InputError, nearest
from tipdamp.hbm.fitting.fit import fit_damping
from tipdamp.hbm.fitting.result import DampingFit, MeasuredResponse
from tipdamp.measured.frf import load_band
from tipdamp.results.response_results import (
    FitResult,
    FittedCurve,
    FittedValue,
    MeasuredFacts,
    MeasuredResult,
)
from tipdamp.stages.assembly import READS, assembled
from tipdamp.stages.stage import Stage, recorded
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.schema import named_orders
from tipdamp.study.view import Study

HARMONICS = 3  # where the study leaves their number to be found


# as in `respond`: sums are split by threads, and differ in the last bit
@threadpool_limits.wrap(limits=1, user_api="blas")
def fit(study: Study, store: Store, tick: Tick) -> list[str]:
    """Fit what [fit] asks for to its measured curves, with the kept pairs in the model."""
    settings = study.fit
    facts = MeasuredResult.load(store).curves
    names = settings.curves or tuple(facts)
    for name in names:
        _check_fits(study, name, facts)
    curves = assembled(study, store, responded=True).curves
    runs = []
    for name in names:
        hz, mean, *_ = load_band(store.path(facts[name].file))
        level = facts[name].level_N
        rows = _rows(study, name, curves.rows)
        runs.append(MeasuredResponse(hz, level * mean, rows, level))
    tick(None, f"{len(names)} curves")
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", Doubt)  # `warnings` tells them
        found = fit_damping(
            curves.problem,
            curves.force,
            runs,
            modes=settings.modes or None,
            mu=settings.mu,
            stiffness=settings.stiffness,
            scatter=settings.scatter,
            band=settings.band or study.respond.band,
            harmonics=max(named_orders(study.respond.harmonics), default=HARMONICS),
            start="zero_slider" if curves.start is None else curves.start,
            samples=curves.samples,
            progress=False,  # the stage says how far it is
        )
    result(found, names, [facts[name] for name in names]).save(store)
    return []


def _check_fits(study: Study, name: str, facts: Mapping[str, MeasuredFacts]) -> None:
    """InputError where there is no such measured curve, or it is of another amplitude."""
    if name not in facts:
        raise InputError(f"[fit] curves: no [measured.{name}]; {nearest(name, list(facts))}")
    if study.measured[name].amplitude != "fundamental":
        raise InputError(
            f"[fit] curves: [measured.{name}] amplitude = '{study.measured[name].amplitude}': "
            "a fit is of amplitudes at the frequency of the force, 'fundamental'"
        )


def result(found: DampingFit, names: Sequence[str], facts: Sequence[MeasuredFacts]) -> FitResult:
    """The record of a fit to measured curves."""
    said = {"mu": "factor on mu", "stiffness": "factor on kn and kt"}
    for k, name in enumerate(names):
        for of in ("amplitude", "frequency"):
            said[f"{of} of measured curve {k + 1}"] = f"factor on {of} of {name}"
    values = zip(found.names, found.values, found.low, found.high, found.start, strict=True)
    return FitResult(
        values=tuple(
            FittedValue(name=said.get(name, name), value=value, low=low, high=high, start=start)
            for name, value, low, high, start in values
        ),
        curves=tuple(
            FittedCurve(
                measured=name,
                level_N=one.level_N,
                misfit=misfit,
                half_power=one.half_power,
                hz=tuple(run.hz.tolist()),
                m_per_N=tuple((np.abs(amplitude) / one.level_N).tolist()),
            )
            for name, one, misfit, run, amplitude in zip(
                names, facts, found.misfit, found.measured, found.computed, strict=True
            )
        ),
        iterations=found.iterations,
        warnings=found.doubts,
    )


def _rows(study: Study, name: str, rows: Mapping[str, np.ndarray]) -> np.ndarray:
    """(m, r) outputs at the place that was measured."""
    place = study.measured[name].response or study.respond.patches[0]
    names = list(rows)
    mine = in_patch(names, place) | (np.array(names) == place)
    if not mine.any():
        raise InputError(f"[measured.{name}] response = '{place}': {nearest(place, names)}")
    return np.array([rows[one] for one, here in zip(names, mine, strict=True) if here])


def line(store: Store) -> str:
    """What was found."""
    return "; ".join(_said(FitResult.load(store)))


def _said(found: FitResult) -> Iterator[str]:
    for one in found.values:
        value, low, high = (f"{x:.{one.digits}g}" for x in (one.value, one.low, one.high))
        yield f"{one.name} {value} ({low} to {high})"


STAGE = Stage(
    fit,
    line,
    warnings=recorded(FitResult),
    outputs=("fit.json",),
    needs=("reduce", "measured", "tune", "respond"),
    requires=("fit", "measured", "tune", "respond", "respond.levels"),
    reads=("fit", "measured", *READS),
)
