"""Facts of a curve: its peaks over the patches, the forces on what holds motions, what is
missing."""

import warnings as python_warnings
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from tipdamp.checks.pairs import pair_names
from tipdamp.engine.curves import CurveCase
from tipdamp.hbm import fourier
from tipdamp.hbm.amplitude import local_maxima
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.continuation.branch import ENDS
from tipdamp.hbm.curve.hold_check import hold_in_words
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.named_point import NamedPoint
from tipdamp.hbm.result import SOLVED, ForcedResponse
from tipdamp.hbm.ties import first_largest
from tipdamp.results.record import Number
from tipdamp.results.response_results import (
    BesideCurve,
    CurveResult,
    FollowedWay,
    HeldForce,
    NamedPlace,
    Peak,
    Trust,
    families,
)
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.schema import Respond


def curve_result(
    settings: Respond,
    kept: ContactTable,
    problem: ContactProblem,
    case: CurveCase,
    ways: Sequence[ForcedResponse],
    beside: Mapping[str, ForcedResponse] = MappingProxyType({}),
) -> CurveResult:
    """Peaks over the patches (the first blade's on top), half of peak-to-peak along the force;
    counts.

    ways : the curve, and where it was followed back, that too; beside : {file: curve} found beside
    it
    """
    curve, *back = ways
    held = problem.held
    patches = {
        patch: peak_of(curve, in_patch(curve.output_names, patch)) for patch in settings.patches
    }
    first = in_patch(curve.output_names, settings.patches[0])
    return CurveResult(
        file=case.file,
        Fe_N=case.Fe_N,
        H=case.H,
        **dict(_way(curve, patches[settings.patches[0]], held, first)),
        **dict(_trust(curve, kept, first)),
        patches=patches,
        points=len(curve.frequency),
        slipping_pairs=tuple(pair_names(kept, curve.slipping_pairs)),
        lift_off_pairs=tuple(
            pair_names(kept, [i for i in curve.opening_pairs if kept.preload[i] > 0])
        ),
        residual_calls=curve.residual_calls,
        searched=curve.searched,
        beside=tuple(_beside(file, one, kept, first) for file, one in beside.items()),
        left_out=tuple((float(low), float(high)) for low, high in np.sort(curve.restarts, axis=1)),
        origin=curve.origin,
        start=curve.start,
        alike_backwards=curve.alike_backwards,
        back=_way(back[0], peak_of(back[0], first), held, first) if back else None,
        held_change=curve.held_change,
        held_reaction_change=curve.held_reaction_change,
        hold_doubts=tuple(hold_in_words(curve, problem)),
    )


def _way(
    curve: ForcedResponse, peak: Peak, held: Sequence[HeldMotion], outputs: np.ndarray
) -> FollowedWay:
    return FollowedWay(
        **dict(peak),
        complete=curve.complete,
        ended=curve.ended,
        further=curve.further,
        failed_points=(~curve.converged).sum(),
        seconds=curve.seconds,
        held=held_forces(curve, held, outputs),
        energy_error=worst(curve.energy_error),
    )


def _beside(
    file: str, curve: ForcedResponse, kept: ContactTable, outputs: np.ndarray
) -> BesideCurve:
    i = _largest(curve, outputs)
    return BesideCurve(
        **dict(_trust(curve, kept, outputs)),
        file=file,
        from_hz=curve.frequency.min(),
        to_hz=curve.frequency.max(),
        highest_hz=curve.frequency[i],
        highest_m=curve.amplitude()[i, outputs].max(),
        closed=curve.ended.startswith(ENDS["round"]),
        complete=curve.complete,
        ended=curve.ended,
    )


def _trust(curve: ForcedResponse, kept: ContactTable, outputs: np.ndarray) -> Trust:
    known = (curve.stable | curve.unstable).any()
    return Trust(
        unstable=bool(curve.unstable[_largest(curve, outputs)]),
        unstable_points=int(curve.unstable.sum()) if known else None,
        worst_truncation=worst(curve.relative_truncation),
        named=tuple(_named(one, kept, outputs) for one in curve.named_points),
    )


def _named(one: NamedPoint, kept: ContactTable, outputs: np.ndarray) -> NamedPlace:
    passing = one.multiplier
    return NamedPlace(
        kind=one.kind,
        hz=one.frequency,
        within_hz=one.within,
        pair="" if one.contact < 0 else pair_names(kept, [one.contact])[0],
        multiplier=(None, None) if passing is None else (passing.real, passing.imag),
        largest_m=np.array(one.amplitudes)[outputs].max(),
    )


def _largest(curve: ForcedResponse, outputs: np.ndarray) -> int:
    """Index of the point at which the outputs, a mask (m,), move most."""
    a = curve.amplitude()[:, outputs].max(axis=1)
    return int(np.argmax(np.where(np.isfinite(a), a, -np.inf)))


def peak_shape(curve: ForcedResponse, case: CurveResult) -> np.ndarray:
    """(m,) complex, m: the outputs at the peak, their part at the frequency of the force; empty
    without a peak."""
    if case.peak_hz is None:
        return np.empty(0)
    solved = np.flatnonzero(curve.converged)
    at = solved[np.abs(curve.frequency[solved] - case.peak_hz) <= 1e-9 * case.peak_hz]
    if not len(at):
        return np.empty(0)
    return curve.harmonics[at[curve.amplitude()[at].max(axis=1).argmax()], :, 1]


def with_macs(found: Sequence[CurveResult], shapes: Sequence[np.ndarray]) -> list[CurveResult]:
    """The curves with the MAC of the shape at their peak and that at the next lower level of their
    family."""
    done = list(found)
    index = {one.file: i for i, one in enumerate(found)}
    for family in families(found):
        order = [index[one.file] for one in family]
        for before, i in zip(order, order[1:], strict=False):
            a, b = shapes[before], shapes[i]
            if len(a) and len(b):
                mac = abs(np.vdot(a, b)) ** 2 / max(
                    np.vdot(a, a).real * np.vdot(b, b).real, np.finfo(float).tiny
                )
                done[i] = done[i].model_copy(update={"mac": float(mac)})
    return done


def worst(errors: np.ndarray) -> float:
    """Largest of the errors (n,) that are known; NaN where none is."""
    return (
        float(np.max(errors, where=np.isfinite(errors), initial=0.0))
        if np.isfinite(errors).any()
        else float("nan")
    )


def held_forces(
    curve: ForcedResponse, held: Sequence[HeldMotion], outputs: np.ndarray
) -> dict[str, HeldForce]:
    """{motion: force on what holds it} at the point where the outputs, a mask (m,), move most."""
    hz = max((curve.at_least(n) for n in curve.output_names[outputs]), key=lambda p: p[1])[0]
    X = (
        curve.reaction[np.flatnonzero(curve.frequency == hz)[0]]
        if np.isfinite(hz)
        else np.full((len(held), 1), np.nan)
    )
    return {
        one.name: HeldForce(
            unit=one.unit,
            hz=hz,
            mean=x[0].real,
            amplitude=float(fourier.half_peak_to_peak(x)),
            spring=not one.mean,
            moved=None if one.mean else x[0].real / one.stiffness,
        )
        for one, x in zip(held, X, strict=True)
    }


def peak_of(curve: ForcedResponse, outputs: np.ndarray) -> Peak:
    """Largest peak of the outputs, a mask (m,), with its frequency, and the smallest of their
    peaks; where one has none, or the largest is that of an end of the band, the largest amplitude
    that was solved."""
    names = curve.output_names[outputs].tolist()
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore")  # `warnings` tells them
        peaks = np.array([curve.peak(n) for n in names])
    if np.isfinite(peaks).all():
        most = _first_solved(curve, names, peaks[:, 1])
        hz, top = peaks[most]
        largest = names[most]
        if not curve.at_border(largest):
            return Peak(
                peak_hz=hz,
                peak_m=top,
                min_peak_m=peaks[:, 1].min(),
                truncation=curve.peak_truncation(largest),
                unsolved=curve.why_unsolved(largest),
            )
    reached = [curve.at_least(n) for n in names]
    hz, least = reached[first_largest([amplitude for _, amplitude in reached])]
    inside = largest_inside(curve, outputs) if np.isfinite(peaks).all() else (None, None)
    return Peak(
        peak_hz=None,
        peak_m=None,
        min_peak_m=None,
        at_least_hz=hz,
        at_least_m=least,
        truncation=curve.peak_truncation(names[first_largest([a for _, a in reached])]),
        inside_hz=inside[0],
        inside_m=inside[1],
    )


def _first_solved(curve: ForcedResponse, names: list[str], heights: np.ndarray) -> int:
    """Place of the highest peak; of those alike by rounding, of which one alone was solved, of
    that."""
    first = first_largest(heights)
    alike = np.flatnonzero(heights >= (1 - SOLVED) * heights[first])
    return next((int(k) for k in [first, *alike] if not curve.why_unsolved(names[k])), first)


def largest_inside(curve: ForcedResponse, outputs: np.ndarray) -> tuple[Number, Number]:
    """(Hz, m) of the highest point of the local maxima of the outputs, a mask (m,); (None, None)
    without any."""
    a = curve.amplitude()
    found = [
        (curve.frequency[i], a[i, j])
        for j in np.flatnonzero(outputs)
        for i in local_maxima(a[:, j], curve.jumps)
    ]
    return found[first_largest([height for _, height in found])] if found else (None, None)
