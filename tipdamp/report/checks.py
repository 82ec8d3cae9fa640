"""Warnings: what a reader must know before trusting the results, each as one sentence."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tipdamp.checks.pairs import pair_names
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.influence import lacking
from tipdamp.report.text import NEGLIGIBLE, force_along, moment, names_of_pairs, number, sentence
from tipdamp.results.static_results import SideForces, TuneResult, TuneStep
from tipdamp.study.view import Study


@dataclass(frozen=True)
class Limits:
    """What passes without a warning."""

    reduction: float = 1e-3  # largest error of a stuck frequency of the reduced model
    reference: float = 0.03  # deviation from a reference frequency
    seen: float = 1.5  # times the end of the band: modes farther above hardly take part
    # preload on the full model against the condensed one, of the largest force
    full_model: float = 1e-6
    # half of what one pair is worth near the target [Zucca 2016, section 8: 35 Hz]
    target: float = 0.0125
    balance: float = 1e-6  # contact forces against the load; residual of the static contact
    stuck_curve: float = 1e-6  # curve without slip against the linear response
    stuck_peak: float = 0.003  # its peak against the stuck frequency
    both_ways: float = 1e-3  # peaks of the two ways through the band
    moment_Nm: float = 1e-6  # left by the redistribution of the preload


LIMITS = Limits()


def warnings_of(results: Results) -> list[str]:
    """Sentences in the order of the stages, those of a stage itself among them; empty when there is
    nothing to say."""
    found: list[str] = []
    for stage, said in results.said.items():
        found += _BEFORE.get(stage, _nothing)(results)
        found += map(sentence, said)
        found += _AFTER.get(stage, _nothing)(results)
    return found


def _nothing(_: Results) -> Iterator[str]:
    yield from ()


def _not_read(results: Results) -> Iterator[str]:
    for name, body in (results.inspect.bodies if results.inspect else {}).items():
        if body.not_read:
            yield f"Not taken over from the mesh of the {name}: {', '.join(body.not_read)}."


def _free(results: Results) -> Iterator[str]:
    reference = results.study.reference
    for name, hz in (results.reduce.free_hz if results.reduce else {}).items():
        yield from _off_reference(
            f"The free {name.replace('_', '-')} frequency", hz, reference.get(f"{name}_hz")
        )


def _preload(results: Results) -> Iterator[str]:
    found = results.preload
    if found is None:
        return
    yield from _balance("the preload of the whole patch", found.sides)
    if found.residual > LIMITS.balance:
        yield f"The static contact is solved only to a residual of {found.residual:.1e}."
    if results.full is not None and results.full.difference > LIMITS.full_model:
        yield (
            "The preload on the full model differs from preload.csv by "
            f"{results.full.difference:.1e} of the largest force."
        )


def _stuck(results: Results) -> Iterator[str]:
    tune, reference = results.tune, results.study.reference
    if tune is None:
        return
    stuck = tune.stuck_hz
    for key, hz, where in (
        ("full_area_hz", stuck.full_area, "on the whole area"),
        ("full_line_hz", stuck.full_line, "on the whole line"),
        ("tuned_hz", stuck.tuned, f"on the {tune.kept_name}"),
    ):
        yield from _off_reference(f"The stuck frequency {where}", hz, reference.get(key))


def _tune(results: Results) -> Iterator[str]:
    tune, reference = results.tune, results.study.reference
    if tune is None or results.reduce is None or results.kept is None:
        return
    kept = tune.tuned_pairs
    given = tuple(reference.get(end) for end in ("front", "back"))
    if not tune.area and None not in given and (kept.front, kept.back) != given:
        yield (
            f"The study keeps {kept.front} + {kept.back} stations, the reference is "
            f"{reference['front']:g} + {reference['back']:g}."
        )
    missed = tune.stuck_hz.tuned / tune.target_hz - 1 if tune.target_hz else 0.0
    if abs(missed) > LIMITS.target:
        yield (
            f"The stuck frequency on the {tune.kept_name} misses the target of {tune.target_hz:g} "
            f"Hz by {100 * missed:+.1f} %."
        )
    yield from _monotone(tune.history)
    more = "raise [contact] tractions" if results.reduce.reduction.tractions else "keep more modes"
    yield from _reduced(results.study, tune, more)
    yield from _redistributed(results, tune, results.kept.select(results.kept.carrying))


def _reduced(study: Study, tune: TuneResult, more: str) -> Iterator[str]:
    """Modes that the band sees: those inside it and not far above, or around the tracked one."""
    band = study.respond.band[1] if "respond" in study else 0.0
    band = band or tune.stuck_hz.tuned
    errors = [
        (abs(reduced / full - 1), i + 1, reduced, name.replace("_", " "))
        for name, check in tune.full_model_check.items()
        for i, (reduced, full) in enumerate(zip(check.reduced_hz, check.full_hz, strict=True))
        if reduced and full and full < LIMITS.seen * band
    ]
    worst, mode, hz, where = max(errors, key=lambda e: e[0], default=(0.0, 0, 0.0, ""))
    if worst > LIMITS.reduction:
        yield (
            f"Reduced against full model: the frequency of stuck mode {mode} ({where}), "
            f"{hz:.0f} Hz, is off by {100 * worst:.2g} %, more than "
            f"{100 * LIMITS.reduction:g} %: {more}."
        )


def _monotone(history: tuple[TuneStep, ...]) -> Iterator[str]:
    """From the middle outwards, with even ends: very uneven ones may meet other modes."""
    steps = sorted(
        (s for s in history if s.front - s.back in (0, 1)), key=lambda s: s.front + s.back
    )
    rises = [b for a, b in zip(steps, steps[1:], strict=False) if b.hz < a.hz]
    if rises:
        yield (
            f"Detachment is not monotone: with {rises[0].front} + {rises[0].back} stations the "
            "frequency is below that of the next smaller set."
        )


def _redistributed(results: Results, tune: TuneResult, kept: ContactTable) -> Iterator[str]:
    done = tune.redistribution
    yield from _balance(f"the preload of the {tune.kept_name}", tune.preload_kept)
    if np.abs([done.moment_Nm or 0.0, *(done.moments_Nm or ())]).max() > LIMITS.moment_Nm:
        why = (
            "What is detached"
            if tune.area or tune.line_is_whole
            else "Moving the force of each station to its kept row"
        )
        yield (
            f"{why} leaves a moment of {moment(done, results.axis)}; it is balanced by a "
            "constraint in the static solution."
        )
    for motion, load in done.reactions.items():
        if abs(load) > NEGLIGIBLE:
            yield (
                f"A load of {force_along(motion, load)}, which no contact resists, is balanced by "
                "a constraint in the static solution."
            )
    opened = pair_names(kept, kept.preload <= 0)
    if opened:
        yield f"{len(opened)} of {len(kept)} kept pairs are open at rest: {names_of_pairs(opened)}."


def _balance(what: str, sides: Mapping[str, SideForces]) -> Iterator[str]:
    largest = max((abs(s.equilibrium_N) for s in sides.values()), default=0.0)
    for side, s in sides.items():
        if abs(s.sum_N - s.equilibrium_N) > LIMITS.balance * largest:
            yield (
                f"The sum of {what} on side '{side}' is {number(s.sum_N)} N, not the "
                f"{number(s.equilibrium_N)} N of equilibrium."
            )
    worst = max((s.balance_error or 0.0 for s in sides.values()), default=0.0)
    if worst > LIMITS.balance:
        yield f"Loads and {what} are not in equilibrium: {worst:.1e} of the load is unbalanced."


def _respond(results: Results) -> Iterator[str]:
    for case in results.cases:
        yield from _both_ways(case)
        yield from _no_slip(results, case)
    if results.study.respond.derivatives and (without := lacking(results)):
        yield f"[respond] derivatives.{without}"
    at_rest = set[str]()
    if results.kept is not None:
        at_rest = set(pair_names(results.kept, results.kept.preload <= 0))
    if results.cases and all(
        set(c.facts.slipping_pairs) - at_rest for c in results.cases if c.Fe == results.cases[0].Fe
    ):
        yield (
            f"Pairs already slip at the lowest level, {results.cases[0].Fe:g} N: a damping ratio "
            "identified at this level counts friction twice."
        )


def _name(case: ReportedCurve) -> str:
    return f"Fe = {case.Fe:g} N, H = {case.H}"


def _both_ways(case: ReportedCurve) -> Iterator[str]:
    facts, back = case.facts, case.facts.back
    if back is None:
        return
    amplitude = _off(back.peak_m, facts.peak_m)
    frequency = _off(back.peak_hz, facts.peak_hz)
    if max(abs(amplitude), abs(frequency)) > LIMITS.both_ways:
        yield (
            f"Upward and downward sweeps give different peaks of {_name(case)}: "
            f"{100 * amplitude:+.2g} % in amplitude, {100 * frequency:+.2g} % in frequency; there "
            "may be two branches."
        )


def _off(value: float | None, other: float | None) -> float:
    return 0.0 if value is None or other is None else value / other - 1


def _no_slip(results: Results, case: ReportedCurve) -> Iterator[str]:
    if case.facts.slipping_pairs:
        return
    differences = results.respond.stuck_difference if results.respond is not None else {}
    difference = differences.get(case.facts.file)
    if difference is not None and difference > LIMITS.stuck_curve:
        yield (
            f"No pair slips at {_name(case)}, yet the curve differs from the linear response by "
            f"{difference:.1e}."
        )
    if results.tune is not None and case.facts.peak_hz is not None:
        k, hz = _nearest_stuck(results.tune, case.facts.peak_hz)
        off = case.facts.peak_hz / hz - 1
        if abs(off) > LIMITS.stuck_peak:
            yield (
                f"No pair slips at {_name(case)}, yet the peak lies {100 * off:+.2f} % from the "
                + (f"nearest stuck mode {k}, {hz:.1f} Hz" if k else "stuck frequency")
                + ": another mode is near."
            )


def _nearest_stuck(tune: TuneResult, hz: float) -> tuple[int, float]:
    """(number, Hz) of the stuck mode nearest to a frequency; 0 for that of the tracked one."""
    tuned, modes = tune.stuck_hz.tuned, np.array([*tune.stuck_modes_hz.tuned, np.inf])
    i = int(np.abs(modes - hz).argmin())
    is_tracked = abs(hz - tuned) <= abs(modes[i] - hz) * (1 + LIMITS.stuck_peak)
    return (0, tuned) if is_tracked else (i + 1, float(modes[i]))


def _off_reference(what: str, hz: float, reference: float | None) -> Iterator[str]:
    if reference and abs(hz / reference - 1) > LIMITS.reference:
        yield (
            f"{what} is {hz:.0f} Hz, {100 * (hz / reference - 1):+.1f} % from the reference "
            f"{reference:g} Hz."
        )


# checks of the report that stand before and after the warnings of a stage, which need none
_BEFORE = {"inspect": _not_read, "reduce": _free, "tune": _stuck}
_AFTER = {"preload": _preload, "tune": _tune, "respond": _respond}
