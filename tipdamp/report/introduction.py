"""The first paragraphs of the report: what was computed, in a few sentences."""

from collections.abc import Iterator

from tipdamp.bodies.free_modes import LOWEST_MAC, SURE_MAC, words_of
from tipdamp.report.results import ReportedCurve, Results
from tipdamp.report.subjects.amplitudes import reason
from tipdamp.report.text import hertz, listing, micro, number
from tipdamp.results.static_results import ReduceResult, TuneResult


def introduction(results: Results) -> list[str]:
    """One paragraph on model, preload and kept stations, one on the response."""
    model = _model(results.reduce) if results.reduce is not None else ()
    return [" ".join([*model, *_preload(results), *_kept(results)]), *_response(results)]


def _model(found: ReduceResult) -> Iterator[str]:
    size, free = found.reduction, found.free_hz
    yield (
        f"Two blades with a friction damper pressed between them: a model of {size.dofs} dofs, "
        f"reduced to {size.in_words}."
    )
    if free:
        yield (
            f"Without damper the blades vibrate out of phase at {hertz(free['out_of_phase'])} Hz "
            f"and in phase at {hertz(free['in_phase'])} Hz."
        )


def _preload(results: Results) -> Iterator[str]:
    if results.preload is not None:
        case = results.study.preload.case
        load = f"The load case '{case}'" if case else f"The pull of {results.study.driver.pull:g} N"
        forces = listing(
            f"{number(s.sum_N)} N on side '{name}'" for name, s in results.preload.sides.items()
        )
        yield f"{load} presses the damper against the blades with {forces}."


def _what_keeps(tune: TuneResult) -> str:
    if tune.table:
        return f"its table {tune.table} keeps"
    if not tune.target_hz:
        return "the study keeps"
    detached = "area" if tune.area else "stations"
    return f"detaching {detached} (target {tune.target_hz:g} Hz) leaves"


def _kept(results: Results) -> Iterator[str]:
    tune = results.tune
    if tune is not None:
        whole, kept = _likest(tune, words_of(results.study.tune.follow))
        yield (
            f"With all pairs stuck {whole} at {hertz(tune.stuck_hz.full_area)} Hz; "
            f"{_what_keeps(tune)} {tune.kept_in_words.replace('mm2', 'mm²')}, with which {kept} at "
            f"{hertz(tune.stuck_hz.tuned)} Hz."
        )


def _likest(tune: TuneResult, free: str) -> tuple[str, str]:
    """What lies at the two frequencies, with its MAC where it is not plainly the free mode."""
    whole, kept = tune.mac.full_area, tune.mac.tuned
    if min(whole, kept) >= SURE_MAC:
        return "the tracked mode lies", "it lies"
    found = (
        f"the mode most like the free {free} one (MAC {whole:.2f}) lies"
        if whole >= LOWEST_MAC
        else f"no mode resembles the free {free} one, the nearest (MAC {whole:.2f}) lies"
    )
    return found, f"the one most like it (MAC {kept:.2f}) lies"


def _response(results: Results) -> Iterator[str]:
    cases = [c for c in results.finest if c.has_peak]
    if cases:
        yield _peaks(cases[0], cases[-1])
    for c in results.finest:
        if c.facts.solved_nothing:
            yield f"At {c.Fe:g} N the curve has no solved point: {reason(c)}; see the warnings."
        elif not c.has_peak:
            yield (
                f"At {c.Fe:g} N the curve has no peak: at least {micro(c.at_least_per_newton)} "
                f"µm/N at {hertz(c.facts.at_least_hz)} Hz, {c.facts.ended}."
            )


def _least(case: ReportedCurve) -> str:
    return "at least " * case.is_bound


def _peaks(low: ReportedCurve, high: ReportedCurve) -> str:
    text = (
        f"At {low.Fe:g} N the peak of blade 1 is {_least(low)}{micro(low.peak_per_newton)} µm/N at "
        f"{hertz(low.facts.peak_hz)} Hz (H = {low.H})"
    )
    if low is not high:
        text += (
            f", at {high.Fe:g} N {_least(high)}{micro(high.peak_per_newton)} µm/N at "
            f"{hertz(high.facts.peak_hz)} Hz, where {high.moving_at_peak} of "
            f"{high.curve.share_slip.shape[1]} pairs slip or open at the peak; anywhere on the "
            f"curve {len(high.facts.slipping_pairs)} do"
            + f", and {len(high.facts.lift_off_pairs)} lift off"
            * bool(high.facts.lift_off_pairs)
        )
    return text + "."
