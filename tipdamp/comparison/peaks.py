"""Peaks of a study by phase and blade: largest FRF of the motions in which the blades move in
phase, and of those out of phase."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tipdamp.hbm.amplitude import local_maxima, parabola_top
from tipdamp.hbm.curve.trace import NO_PERIOD, ROLLS
from tipdamp.hbm.result import DOUBTFUL, ForcedResponse
from tipdamp.hbm.ties import SAME
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.results.response_results import SAME_MODE
from tipdamp.statics.model_inputs import in_patch
from tipdamp.study.schema import Respond

Phase = Literal["in_phase", "out_of_phase"]
PHASES: tuple[Phase, ...] = ("in_phase", "out_of_phase")
IDLE = 1e-3  # of the power of the force: friction that takes no more takes nothing
UNSTABLE, UNKNOWN, ABOVE = "unstable", "error not known", "error above the tolerance"  # doubts
MARGIN = 0.15  # of free and stuck frequency of a phase, between which its peaks are looked for


@dataclass(frozen=True, kw_only=True)
class ComparedPeak:
    """Largest peak of one phase on one blade in one case, half of peak-to-peak per newton.

    study - name; scatter - what the case has otherwise than the study, in words; phase; blade - 1
    or 2; pull, Fe - N; H - harmonics
    hz, m_per_N - of the peak; None where the curve has none of this phase: at_least - m/N, the
    largest that was solved, where the curve does not cover the range of the phase, else the phase
    has no maximum of its own; error - of m_per_N by the harmonics left out, relative to it, None
    without an estimate; tolerance - what the study allows it; stable - whether disturbances of the
    motion there die out, None where that is not known
    slipping - share of the kept pairs that slip or open there; friction_W - W, power of friction in
    each of them
    mac - of the outputs with those at the peak of the next lower level; None at the first
    complete - whether the curve covers the range of the phase, this way or followed the other way
    ended - why it ends, see ForcedResponse
    """

    study: str
    scatter: str = ""
    phase: Phase
    blade: int
    pull: float
    Fe: float
    H: int
    hz: float | None = None
    m_per_N: float | None = None
    error: float | None = None
    tolerance: float
    stable: bool | None = None
    at_least: float | None = None
    slipping: float | None = None
    friction_W: tuple[float, ...] = ()
    mac: float | None = None
    complete: bool
    ended: str

    @property
    def place(self) -> tuple[str, Phase, int, float, float]:
        """What a peak and those of its scatter have in common."""
        return self.study, self.phase, self.blade, self.pull, self.Fe

    @property
    def ratio(self) -> float:
        """Fc/Fe."""
        return self.pull / self.Fe

    @property
    def idle(self) -> bool:
        """Whether friction takes nothing at the peak: of the power of the force, taken to be in
        phase with the velocity of the patch."""
        if self.hz is None or self.m_per_N is None:
            return False
        power = np.pi * self.hz * self.Fe**2 * self.m_per_N
        return sum(self.friction_W) <= IDLE * power

    @property
    def span(self) -> tuple[float, float]:
        """(m/N, m/N): the peak less and more its error."""
        height, error = self.m_per_N or 0.0, max(self.error or 0.0, SAME)
        return height * (1 - error), height * (1 + error)

    @property
    def doubts(self) -> list[str]:
        """Why the height of the peak is not to be relied on, in words."""
        if self.m_per_N is None:
            return []
        found = [UNSTABLE] if self.stable is False else []
        if self.error_unknown:
            return [*found, UNKNOWN]
        return [*found, ABOVE] if (self.error or 0.0) > self.tolerance else found

    @property
    def error_unknown(self) -> bool:
        """Whether there is no estimate of its error, or one too large to be one."""
        return self.error is None or self.error >= DOUBTFUL

    @property
    def of_another_mode(self) -> bool:
        """Whether it is not of the mode of the peak at the next lower level."""
        return self.mac is not None and self.mac < SAME_MODE

    @property
    def motion(self) -> str:
        """The rigid motion of the damper that ends the curve, since no periodic motion exists
        there: 'the damper rolls', 'the damper slides'; empty where another cause does."""
        if self.complete or NO_PERIOD not in self.ended:
            return ""
        return ROLLS if ROLLS in self.ended else "the damper slides"

    @property
    def why(self) -> str:
        """Why the curve is not whole, without the advice that follows."""
        first, *more = self.ended.split(";")
        place = first.split(":")[0]
        if self.motion:
            return f"{place}: {self.motion}, no periodic motion there"
        return re.sub(":.*", "", f"{place};{more[0]}" if more else place)

    @property
    def merged(self) -> bool:
        """Whether the curve covers the range of the phase and has no maximum in it."""
        return self.m_per_N is None and self.at_least is None


def motion_beyond(peaks: Sequence[ComparedPeak], ratio: float) -> str:
    """The rigid motion of the damper that ends the curve of the next level below this Fc/Fe; ''
    where none does."""
    below = [peak for peak in peaks if peak.ratio < ratio]
    nearest = max((peak.ratio for peak in below), default=0.0)
    return next((peak.motion for peak in below if peak.ratio == nearest and peak.motion), "")


def peaks_of(results: Results, name: str = "", scatter: str = "") -> list[ComparedPeak]:
    """Of the curves of most harmonics of a study, each phase whose range the band meets and of
    which a curve holds anything, each blade; ascending in Fe. name, scatter - see ComparedPeak;
    by default the name of the study."""
    found = []
    for phase, window in windows(results).items():
        mine = []
        for blade in range(1, len(results.study.respond.patches) + 1):
            shape = None
            for case in results.finest:
                peak, there = _peak(results, case, phase, window, blade, shape)
                mine.append(replace(peak, study=name or peak.study, scatter=scatter))
                shape = shape if there is None else there
        found += mine if any(peak.m_per_N or peak.at_least for peak in mine) else []
    return found


def windows(results: Results) -> dict[Phase, tuple[float, float]]:
    """{phase: (Hz, Hz)}: a mode that slips lies between its free and its stuck frequency; those
    that the band of the study meets.

    Where the modes without damper are not told apart, it is the whole band for both.
    """
    low, high = results.study.respond.band
    ranges = dict(_ranges(results)) or dict.fromkeys(PHASES, (low, high))
    return {
        phase: (max(low, a), min(high, b))
        for phase, (a, b) in ranges.items()
        if a < high and b > low
    }


def why_missing(results: Results, phase: Phase) -> str:
    """Why a study has no peaks of a phase."""
    ranges, (low, high) = dict(_ranges(results)), results.study.respond.band
    if ranges and phase not in ranges:
        return "its mode was not found without damper and with all kept pairs stuck"
    if ranges and phase not in windows(results):
        a, b = ranges[phase]
        return f"the band {low:g} to {high:g} Hz does not meet its range, {a:.0f} to {b:.0f} Hz"
    return f"no curve from {low:g} to {high:g} Hz has a motion of this phase"


def _ranges(results: Results) -> Iterator[tuple[Phase, tuple[float, float]]]:
    tune, reduced = results.tune, results.reduce
    assert tune is not None and reduced is not None  # of a study with curves
    free = reduced.free_hz
    stuck: dict[str, float] = {results.study.tune.follow: tune.stuck_hz.tuned}
    stuck |= {name: mode.hz for name, mode in tune.other_modes.items()}
    for phase in PHASES:
        if phase in free and phase in stuck:
            ends = free[phase], stuck[phase]
            yield phase, ((1 - MARGIN) * min(ends), (1 + MARGIN) * max(ends))


def _peak(
    results: Results,
    case: ReportedCurve,
    phase: Phase,
    window: tuple[float, float],
    blade: int,
    before: np.ndarray | None,
) -> tuple[ComparedPeak, np.ndarray | None]:
    """The peak, and the outputs there, None without one; of the curve, or followed the other way
    where only that covers the window. before - outputs at the peak of the next lower level."""
    respond = results.study.respond
    mine = np.flatnonzero(in_patch(case.curve.output_names, respond.patches[blade - 1]))
    ways = [(case.curve, respond.band)]
    ways += [(case.back, respond.band[::-1])] if case.back is not None else []
    whole = [curve for curve, band in ways if not has_gap(curve, window, band)]
    peak = ComparedPeak(
        study=results.study.name,
        phase=phase,
        blade=blade,
        pull=results.study.driver.pull,
        Fe=case.Fe,
        H=case.H,
        tolerance=respond.tolerance,
        complete=bool(whole),
        ended=(whole[0] if whole else case.curve).ended,
    )
    if not whole:
        least = (_largest(curve, _inside(curve, respond, phase, window), mine) for curve, _ in ways)
        return replace(peak, at_least=max(least) / case.Fe), None
    curve = whole[0]
    tops = list(_tops(curve, mine, _inside(curve, respond, phase, window)))
    if not tops:
        return peak, None
    place, height, at, output = max(tops, key=lambda top: top[1])
    outputs = curve.harmonics[at, :, 1]
    found = replace(
        peak,
        hz=place,
        m_per_N=height / case.Fe,
        error=_error(curve, at, output),
        stable=_stable(curve, at),
        slipping=slipping(curve, at),
        friction_W=tuple((curve.dissipated[at] * curve.frequency[at]).tolist()),
        mac=None if before is None else _mac(before, outputs),
    )
    return found, outputs


def _tops(
    curve: ForcedResponse, mine: np.ndarray, inside: np.ndarray
) -> Iterator[tuple[float, float, int, int]]:
    """(Hz, m, point, output) of the maxima of some outputs at the points (n,) inside."""
    amplitude = curve.amplitude()
    for j in mine:
        for i in local_maxima(amplitude[:, j], curve.jumps):
            if inside[i]:
                yield *_top(curve, amplitude[:, j], i), i, j


def _inside(
    curve: ForcedResponse, respond: Respond, phase: Phase, window: tuple[float, float]
) -> np.ndarray:
    hz = curve.frequency
    return (hz >= window[0]) & (hz <= window[1]) & of_phase(curve, respond.patches, phase)


def _largest(curve: ForcedResponse, inside: np.ndarray, mine: np.ndarray) -> float:
    return float(curve.amplitude()[inside][:, mine].max(initial=0.0))


def of_phase(curve: ForcedResponse, patches: tuple[str, ...], phase: Phase) -> np.ndarray:
    """(n,) bool: points at which the patches of two blades move with this phase: their mean motions
    at the frequency of the force within 90 degrees of each other, or not. Of one patch all are."""
    if len(patches) < 2:
        return curve.converged
    first, second = (
        curve.harmonics[:, in_patch(curve.output_names, patch), 1].mean(axis=1)
        for patch in patches[:2]
    )
    together = (first * second.conj()).real > 0
    return curve.converged & (together == (phase == "in_phase"))


def has_gap(curve: ForcedResponse, window: tuple[float, float], band: tuple[float, float]) -> bool:
    """Whether a part of the window (Hz, Hz) is not covered: failed points, where the branch was
    left and taken up again, or where the curve stopped before the end of the band.

    band : from where to where it was followed, upwards or down"""
    hz, (start, end) = curve.frequency, band
    solved = np.r_[start, hz[curve.converged], *([end] if curve.reached_end else [])]
    missing = [
        (solved[solved < f].max(initial=min(band)), solved[solved > f].min(initial=max(band)))
        for f in hz[~curve.converged]
    ]
    missing += [tuple(sorted(pair)) for pair in curve.restarts]
    if not curve.reached_end:
        missing.append((solved.max(), end) if start < end else (end, solved.min()))
    return any(low < window[1] and high > window[0] for low, high in missing)


def slipping(curve: ForcedResponse, at: int) -> float:
    """Share of the pairs that slip or open at a point."""
    return float(((curve.share_slip + curve.share_open)[at] > 1e-6).mean())


def _top(curve: ForcedResponse, a: np.ndarray, i: int) -> tuple[float, float]:
    """(Hz, m) of the maximum at point i: the point where it is solved, else the parabola."""
    f = curve.frequency[i - 1 : i + 2]
    if (curve.peak_points.size and curve.peak_points[i].any()) or len(set(f)) < 3:
        return float(f[1]), float(a[i])
    return parabola_top(f, a[i - 1 : i + 2])


def _error(curve: ForcedResponse, at: int, output: int) -> float | None:
    """Of a point by the harmonics left out, relative to its vibration; at most that beyond which
    the estimate is none."""
    if not curve.truncation.size:
        return None
    error = curve.truncation[at, output] / curve.amplitude("rms")[at, output]
    return float(min(error, DOUBTFUL))


def _stable(curve: ForcedResponse, at: int) -> bool | None:
    return bool(curve.stable[at]) if curve.stable[at] or curve.unstable[at] else None


def _mac(a: np.ndarray, b: np.ndarray) -> float:
    return float(abs(np.vdot(a, b)) ** 2 / (np.vdot(a, a).real * np.vdot(b, b).real))
