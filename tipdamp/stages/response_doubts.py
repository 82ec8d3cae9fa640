"""What is missing in a forced response, and its warnings."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tipdamp.bodies.interface import doubts
from tipdamp.bodies.loads import damper_hold
from tipdamp.checks import only_friction
from tipdamp.engine.store import Store
from tipdamp.hbm.curve.enough_harmonics import not_met
from tipdamp.hbm.curve.trace import SLIDES
from tipdamp.results.response_results import (
    CurveResult,
    FollowedWay,
    Peak,
    RespondResult,
    families,
)
from tipdamp.results.static_results import PreloadResult, ReduceResult, TuneResult
from tipdamp.study.view import Study


@dataclass(frozen=True)
class ResponseLimits:
    """What is warned of."""

    balanced: float = 1e-6  # of the input: larger errors of the energy balance
    small: float = 1e-2  # of the size of the bodies: larger motions are no small displacements
    near: float = 0.03  # of the frequency, up to which a peak is that of the tracked mode
    softened: float = 0.1  # the same, where no other stuck mode is nearer


LIMITS = ResponseLimits()
SHOWN = 8  # levels of one warning


def incomplete(found: RespondResult) -> tuple[int, int]:
    """(curves that do not reach the end of the band or have failed points, all curves); each way
    counts as one."""
    curves = both_ways(found)
    return sum(not c.complete or c.failed_points > 0 for c in curves), len(curves)


def without_peak(found: RespondResult) -> int:
    """Curves that have no peak, since they stopped or have a gap at their highest point."""
    return sum(c.peak_m is None for c in both_ways(found))


def solved_nothing(found: RespondResult) -> int:
    """Curves without a single solved point."""
    return sum(c.solved_nothing for c in both_ways(found))


def both_ways(found: RespondResult) -> list[FollowedWay]:
    """The curves, and those from the other end of the band."""
    return [*found.responses, *(c.back for c in found.responses if c.back)]


def warnings(study: Study, store: Store) -> list[str]:
    """One sentence for each curve that is incomplete: its peak or what it is at least, and why it
    ends, or what to hold where it has no solved point and nothing but friction holds the damper;
    for each that is largest at an end of the band, or whose peak is not solved; for each that does
    not hold all solutions known at the end of its band; and for each on which what holds a motion
    is not soft."""
    whole = RespondResult.load(store)
    found = whole.responses
    stuck = TuneResult.load(store).stuck_modes_hz.tuned if any(map(_at_an_end, found)) else ()
    hold = _to_hold(study, store) if solved_nothing(whole) else ""
    return [
        *(text for c in found for text in _incomplete(c, hold)),
        *(
            text
            for kind in (_unsolved, _left_out, _further, _hold)
            for c in found
            for text in kind(c)
        ),
        *doubts(whole.interface),
        *filter(None, [whole.open_damping]),
        *_unbalanced(found),
        *_truncated(found, whole.tolerance),
        *(text for c in found for text in _unstable(c)),
        *(text for c in found for text in _beside(c)),
        *_another_mode(found),
        *_not_the_tracked(found, store),
        *_too_far(found, whole.size_m),
        *(text for c in found for text in _without_resonance(c, stuck)),
    ]


def _to_hold(study: Study, store: Store) -> str:
    """What to try first where not even a first point was found, '' where no motion is free."""
    free = [motion.name for motion in PreloadResult.load(store).free_motions]
    return (
        (
            f"{only_friction.said(free)}: first hold its mean position, the vibration stays free: "
            f"{only_friction.remedy(free, damper_hold(study).section)}; "
        )
        if free and not study.driver.hold
        else ""
    )


def _unbalanced(found: Sequence[CurveResult]) -> Iterator[str]:
    errors = [
        (one.energy_error or 0.0, case)
        for case in found
        for one in (case, case.back)
        if one is not None
    ]
    worst, case = max(errors, key=lambda e: e[0])
    if worst > LIMITS.balanced:
        yield (
            f"the energy of a period is balanced to {worst:.1e} of the input only (worst at Fe = "
            f"{case.Fe_N:g} N, H = {case.H}; above {LIMITS.balanced:g} on "
            f"{sum(e > LIMITS.balanced for e, _ in errors)} of {len(errors)} curves): the contact "
            "law takes more or less along its slip than its harmonics say; give [respond] "
            "samples, or more of them, where the law is sampled"
        )


def _truncated(found: Sequence[CurveResult], tolerance: float) -> Iterator[str]:
    """Levels at which harmonics = 'auto' does not meet the tolerance; otherwise those at which the
    most harmonics are too few for it, in one sentence."""
    finest = families(found)[-1]
    for case in finest:
        if case.within_tolerance is False and case.complete:
            tried = [(one.H, one.size) for one in case.tried if one.complete]
            cut = [f"; the curve with H = {one.H} is incomplete" for one in case.tried[-1:]]
            yield (
                f"harmonics = 'auto': {not_met(tried, tolerance, f' at Fe = {case.Fe_N:g} N')}"
                + "".join(cut) * (not case.tried[-1].complete)
            )
    missed = [case for case in finest if not case.tried and case.least_known[0] > tolerance]
    if missed:
        at = [f"{case.Fe_N:g} N ({_of_worst_patch(case)})" for case in missed]
        more = f" and {len(at) - SHOWN} more levels" * (len(at) > SHOWN)
        yield (
            f"with H = {missed[0].H} the estimated error of the peak is above the tolerance "
            f"{tolerance:g} at Fe = {', '.join(at[:SHOWN])}{more}: set [respond] harmonics = "
            '"auto", or accept it with a larger tolerance'
        )


def _of_worst_patch(case: CurveResult) -> str:
    """Error of its peak, with its name where there are several."""
    error, patch = case.least_known
    return f"{error:.1e}" + f" on {patch}" * (len(case.patches) > 1)


def _unstable(case: CurveResult) -> Iterator[str]:
    if case.unstable:
        yield (
            f"the largest amplitude at Fe = {case.Fe_N:g} N, H = {case.H} is that of an unstable "
            "motion: any disturbance grows, and what the blades do instead is not on this curve"
        )


def _beside(case: CurveResult) -> Iterator[str]:
    highest = max(case.beside, key=lambda one: one.highest_m, default=None)
    if highest is None:
        return
    n = len(case.beside)
    curves = (
        f"a further curve, {highest.ends}" if n == 1 else f"{n} further curves, one {highest.ends}"
    )
    times = highest.highest_m / case.largest_m
    yield (
        f"beside the curve Fe = {case.Fe_N:g} N, H = {case.H} lies {curves}, with up to "
        f"{_micro(highest.highest_m, highest.highest_hz)}, {times:.3g} times the "
        f"largest amplitude of the curve{', unstable there' * highest.unstable}: which of the "
        "motions is met depends on how the blades come there"
    )


def _at_an_end(case: CurveResult) -> bool:
    return case.complete and not case.failed_points and case.peak_m is None


def _without_resonance(case: CurveResult, stuck_hz: Sequence[float]) -> Iterator[str]:
    end = case.at_least_hz
    if not _at_an_end(case) or end is None:
        return
    nearest = (
        f"; the nearest stuck mode has {min(stuck_hz, key=lambda f: abs(f - end)):.1f} Hz"
        if stuck_hz
        else ""
    )
    peak = (
        "has no peak inside the band: it"
        if case.inside_m is None
        else f"has a local maximum inside the band, {_micro(case.inside_m, case.inside_hz)}, but"
    )
    yield (
        f"the curve Fe = {case.Fe_N:g} N, H = {case.H} {peak} is largest at the end, "
        f"{_micro(case.at_least_m, case.at_least_hz)}{nearest}; widen [respond] band"
    )


def _further(case: CurveResult) -> Iterator[str]:
    """Not where the curve from the other end is complete, and knows of no further solution."""
    back = case.back
    if case.further and not (back is not None and back.complete and not back.further):
        yield f"the curve Fe = {case.Fe_N:g} N, H = {case.H}: {case.further}"


def _unsolved(case: CurveResult) -> Iterator[str]:
    for way, one in (("", case), (" followed from the other end", case.back)):
        if one is not None and one.unsolved:
            yield (
                f"the peak of the curve Fe = {case.Fe_N:g} N, H = {case.H}{way}, "
                f"{_micro(one.peak_m, one.peak_hz)}: {one.unsolved}"
            )


def _left_out(case: CurveResult) -> Iterator[str]:
    if case.left_out:
        places = ", ".join(f"{low:.1f} and {high:.1f} Hz" for low, high in case.left_out)
        highest = _micro(case.largest_m, case.peak_hz or case.at_least_hz)
        yield (
            f"the curve Fe = {case.Fe_N:g} N, H = {case.H} is not one branch: it folds again and "
            f"again between {places}, was left there and taken up behind; a solution there may be "
            f"higher than {highest}"
        )


def _another_mode(found: Sequence[CurveResult]) -> Iterator[str]:
    for family in families(found):
        for below, one in pairwise(family):
            if one.of_another_mode:
                at = _micro(one.peak_m, one.peak_hz)
                yield (
                    f"the peak at Fe = {one.Fe_N:g} N, H = {one.H}, {at}, is that of another mode "
                    f"than at {below.Fe_N:g} N, {_micro(below.peak_m, below.peak_hz)}: the MAC of "
                    f"their shapes is {one.mac:.2f}; heights and frequencies of the two are no "
                    "trend"
                )


def _not_the_tracked(found: Sequence[CurveResult], store: Store) -> Iterator[str]:
    """Where the largest peak lies beyond the frequencies between which the tracked mode moves, free
    to stuck: the level at which that is first so."""
    if store.record("tune") is None or store.record("reduce") is None:
        return
    tune = TuneResult.load(store)
    free = ReduceResult.load(store).free_hz
    ends = [tune.stuck_hz.tuned, *(hz for name, hz in free.items() if name not in tune.other_modes)]
    low, high = (1 - LIMITS.near) * min(ends), (1 + LIMITS.near) * max(ends)
    modes = np.array(tune.stuck_modes_hz.tuned)
    tuned = tune.stuck_hz.tuned

    def is_of_it(hz: float) -> bool:
        """Between its ends, or softened by slip and still nearer to it than to another one."""
        if low <= hz <= high or not 0 < tuned - hz <= LIMITS.softened * tuned:
            return low <= hz <= high
        return abs(modes[np.abs(modes - hz).argmin()] - tuned) <= 1e-3 * tuned

    off = [one for one in found if one.peak_hz is not None and not is_of_it(one.peak_hz)]
    if off:
        one = min(off, key=lambda c: (c.Fe_N, c.H))
        nearest = int(np.abs(modes - one.peak_hz).argmin())
        yield (
            f"the largest amplitude, {_micro(one.peak_m, one.peak_hz)} at Fe = {one.Fe_N:g} N, H = "
            f"{one.H}, is not that of the tracked mode, which sticks at {tune.stuck_hz.tuned:.1f} "
            f"Hz: nearest is stuck mode {nearest + 1}, {modes[nearest]:.1f} Hz "
            f"({len(off)} of {len(found)} curves)"
        )


def _too_far(found: Sequence[CurveResult], size: float | None) -> Iterator[str]:
    """The largest motion of all, beside the bodies that make it."""
    one = max(found, key=lambda one: one.largest_m)
    most = one.largest_m
    if size and most > LIMITS.small * size:
        yield (
            f"the largest amplitude, {1e3 * most:.3g} mm at Fe = {one.Fe_N:g} N, H = {one.H}, is "
            f"{100 * most / size:.2g} % of the extent of the nodes of the model, "
            f"{1e3 * size:.4g} mm: it is one of small displacements, in which contact points keep "
            "their partners; check the level, its unit and the damping"
        )


def _hold(case: CurveResult) -> Iterator[str]:
    for doubt in case.hold_doubts:
        yield f"the curve Fe = {case.Fe_N:g} N, H = {case.H}: {doubt}"


def _incomplete(case: CurveResult, hold: str) -> Iterator[str]:
    ways = (("", case, case.back), (" followed from the other end", case.back, case))
    for way, one, other in ways:
        if one is None or one.complete and not one.failed_points:
            continue
        failed = f", {one.failed_points} points failed" if one.failed_points else ""
        known = f"no peak, {at_least(one)}; " if one.peak_m is None else ""
        advice = hold if one.solved_nothing and not one.ended.startswith(SLIDES) else ""
        whole = (
            f"; followed the other way it has a peak, {_micro(other.peak_m, other.peak_hz)}"
            if known and other is not None and other.peak_m is not None
            else ""
        )
        yield (
            f"the curve Fe = {case.Fe_N:g} N, H = {case.H}{way} is incomplete{failed}: "
            f"{known}{advice}{one.ended}{whole}"
        )


def at_least(peak: Peak) -> str:
    """What is known of a peak that was not reached: 'at least 926.5 um at 809.4 Hz'."""
    reached = _micro(peak.at_least_m, peak.at_least_hz)
    return f"at least {reached}" if reached else "no point solved"


def _micro(m: float | None, hz: float | None) -> str:
    """'926.5 um at 809.4 Hz', '' of what is not known."""
    return "" if m is None or hz is None else f"{1e6 * m:.4g} um at {hz:.1f} Hz"
