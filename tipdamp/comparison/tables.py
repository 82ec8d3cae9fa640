"""Tables of a comparison: what was set side by side, the best pull, what happens along the curves,
every case."""

from collections.abc import Iterator, Sequence

import numpy as np

from tipdamp.comparison.doubts import error, height, stability
from tipdamp.comparison.events import drifts
from tipdamp.comparison.figures import in_words
from tipdamp.comparison.optimum import NEARBY, Optimum, envelope, lowest_at, within
from tipdamp.comparison.peaks import ComparedPeak, Phase, motion_beyond
from tipdamp.comparison.record import ComparedStudies
from tipdamp.hbm.contact import ContactTable
from tipdamp.report.drawing.table import Table
from tipdamp.report.results import Results
from tipdamp.report.subjects.amplitudes import orders_of
from tipdamp.report.text import NOTHING, hertz, listing, micro, number

Row = dict[str, str]


def studies(comparison: ComparedStudies) -> Iterator[Table]:
    """One column for each study: frequencies free and stuck, kept stations, friction,
    settings."""
    rows = [_column(comparison, name) for name in comparison.studies]
    yield Table(
        "The studies: pull, frequencies without damper and with all kept pairs stuck, and what the "
        "response was computed with.",
        [
            {"": name, **{of: row[name] for of, row in zip(comparison.names, rows, strict=True)}}
            for name in rows[0]
        ],
        left=tuple(range(len(rows) + 1)),  # words, which may be long, are broken
    )


def _column(comparison: ComparedStudies, name: str) -> Row:
    mine = [each.results.study for each in comparison.nominal if each.name == name]
    bands = dict.fromkeys("{:g} to {:g}".format(*study.respond.band) for study in mine)
    one = comparison.studies[name]
    tune, reduced, preload, respond = one.tune, one.reduce, one.preload, one.study.respond
    assert tune is not None and reduced is not None and preload is not None  # it has curves
    free = reduced.free_hz
    return {
        "title": one.study.title,
        "pull Fc (N)": listing(dict.fromkeys(f"{study.driver.pull:g}" for study in mine)),
        "without damper, out of phase (Hz)": hertz(free.get("out_of_phase")),
        "without damper, in phase (Hz)": hertz(free.get("in_phase")),
        "kept": tune.kept_in_words.replace("mm2", "mm²"),
        "stuck, whole area (Hz)": hertz(tune.stuck_hz.full_area),
        "stuck, whole line (Hz)": hertz(tune.stuck_hz.full_line),
        "stuck, kept, out of phase (Hz)": hertz(stuck_hz(one, "out_of_phase")),
        "stuck, kept, in phase (Hz)": hertz(stuck_hz(one, "in_phase")),
        "contact law": str(respond.law),
        "kn (N/µm per pair)": _stiffness(one.kept, "kn"),
        "kt (N/µm per pair)": _stiffness(one.kept, "kt"),
        "friction coefficient": _friction(one.kept),
        "largest preload at the first pull (N)": listing(
            number(s.max_N, 3) for s in preload.sides.values()
        ),
        "damping ratio": listing(f"{zeta:g}" for zeta in respond.damping_ratio),
        "band (Hz)": listing(bands),
        "harmonics": orders_of(one.finest),
    }


def _friction(kept: ContactTable | None) -> str:
    """Least and largest of the pairs that carry."""
    if kept is None or not kept.carrying.any():
        return NOTHING
    return _from_to(kept.mu[kept.carrying])


def _stiffness(kept: ContactTable | None, column: str) -> str:
    """Of the pairs that carry, side by side."""
    if kept is None:
        return NOTHING
    carrying = kept.select(kept.carrying)
    each = {s: 1e-6 * vars(carrying)[column][carrying.side == s] for s in carrying.sides}
    return listing(f"{side} {_from_to(values)}" for side, values in each.items()) or NOTHING


def _from_to(values: np.ndarray) -> str:
    return " to ".join(dict.fromkeys(f"{value:.3g}" for value in (values.min(), values.max())))


def best(comparison: ComparedStudies) -> Iterator[Table]:
    """One row for each phase and study that has one: where its curve is least, how flat it is, and
    rank."""
    if comparison.apart:
        whole = comparison.by_study
        yield Table(
            "Which study is best: as the next table, with one curve for each study, which at every "
            "Fc/Fe is that of its pull that is lowest there.",
            [row for phase in whole.phases for row in _best(whole, phase)],
            left=(0, 1),
        )
    rows = [row for phase in comparison.phases for row in _best(comparison, phase)]
    if rows:
        yield Table(
            "The best pull. Least: of the curve of the larger of both blades, over the computed "
            "levels. Flat: Fc/Fe within which it stays within 5 % of the least; open where that "
            "reaches the first or the last level. None: friction takes nothing at the least, every "
            "pair sticks there or slips freely. Any: every level is within 5 % of the least. Rank: "
            "by the least over the Fc/Fe that all studies reach, levels at which the damper rolls "
            "or slides among them; studies that are equal within the errors of their peaks, their "
            "scatter, of the same scatter case by case, or what a curve varies by that is flat "
            "over that range, are tied; open: its least there is only interpolated, between levels "
            f"farther than a factor of {NEARBY:.3g} from an end of that range; lowest: at how many "
            "of the levels in the range of all studies, of which each has one within that factor, "
            "its curve is the lowest. Paper: the rank that the study states as its "
            "reference.",
            rows,
            left=(0, 1),
        )


def _best(comparison: ComparedStudies, phase: Phase) -> Iterator[Row]:
    optima = comparison.optima(phase)
    rank, unknown = comparison.ranks(phase), comparison.interpolated(phase)
    lowest = lowest_at({name: envelope(comparison.of(name, phase)) for name in comparison.names})
    for name, results in comparison.studies.items():
        if name not in optima:
            continue
        one, stated = optima[name], results.study.reference.get(f"{phase}_rank")
        none = _no_best(one)
        first, common = lowest.get(name, (0, 0))
        yield {
            "phase": in_words(phase),
            "study": name,
            "best Fc/Fe": none or best_ratio(comparison, phase, name, one),
            "least (µm/N)": height(one.peak),
            "flat: Fc/Fe": NOTHING if one.idle else _flat(one),
            "pull for Fe = 10 N (N)": NOTHING
            if none
            else best_ratio(comparison, phase, name, one, 10),
            "rank": "open" if name in unknown else _rank(rank, name),
            "lowest": f"{first} of {common}" if common else NOTHING,
            "paper": NOTHING if stated is None else f"{stated:g}",
        }


def _no_best(one: Optimum) -> str:
    """The word in the place of a best Fc/Fe that is none; '' where there is one."""
    if one.idle:
        return "none"
    return "any" if one.flat else ""


def _rank(rank: dict[str, int], name: str) -> str:
    """'1 (tied)'; a dash where there is no Fc/Fe that all reach."""
    if name not in rank:
        return NOTHING
    return f"{rank[name]}" + " (tied)" * (list(rank.values()).count(rank[name]) > 1)


def best_ratio(
    comparison: ComparedStudies, phase: Phase, name: str, one: Optimum, force: float = 1.0
) -> str:
    """Fc/Fe of a least, times a force: '2.00 or less' where it may lie beyond the levels, but not
    where the damper rolls or slides there."""
    ends = motion_beyond(comparison.of(name, phase), one.ratio)
    return number(force * one.ratio, 3) + ("" if ends else one.beyond)


def _flat(one: Optimum) -> str:
    low = "" if one.at_end in ("low", "both") else number(one.low, 3)
    high = "" if one.at_end in ("high", "both") else number(one.high, 3)
    if low and high:
        return f"{low} to {high}"
    ends = f"{number(one.low, 3)} or less", f"{number(one.high, 3)} or more"
    return f"{low or ends[0]} to {high or ends[1]}"


def differences(comparison: ComparedStudies) -> Iterator[Table]:
    """Where a study ranks behind what it states, each study before it: whether that one is lower
    already where little slips, by its stiffness, or by what friction leaves of it."""
    rows = [row for phase in comparison.phases for row in _differences(comparison, phase)]
    if rows:
        yield Table(
            "Why studies rank behind their reference, with those before them: over the Fc/Fe that "
            "all reach the least response is that at the largest, where little slips, times the "
            "part that is left of it at the best pull. The former is a matter of stiffness and "
            "mode, the latter of friction. Lower by: each of the two that differs by a percent, "
            "over that of the study behind.",
            rows,
            left=(0, 1),
        )


def _differences(comparison: ComparedStudies, phase: Phase) -> Iterator[Row]:
    rank, common = comparison.ranks(phase), comparison.common(phase)
    if common is None:
        return
    curves = {name: within(envelope(comparison.of(name, phase)), *common) for name in rank}
    for name, results in comparison.studies.items():
        stated = results.study.reference.get(f"{phase}_rank")
        if stated is None or rank.get(name, 0) <= stated:
            continue
        ahead = [other for other in rank if rank[other] < rank[name]]
        for other in (name, *ahead):
            ratio, height = curves[other]
            yield {
                "phase": in_words(phase),
                "study": other,
                "rank": f"{rank[other]}",
                "stuck (Hz)": hertz(stuck_hz(comparison.studies[other], phase)),
                "largest Fc/Fe": number(ratio[-1], 3),
                "there (µm/N)": micro(height[-1]),
                "left of it at the best": number(height.min() / height[-1], 3),
                "lower by": NOTHING if other == name else _cause(curves[name][1], height),
            }


def _cause(mine: np.ndarray, its: np.ndarray) -> str:
    """Of a lower curve: 'stiffness (× 0.46), not friction (× 1.69)', without what rounds to 1; a
    dash where both do."""
    stiffness = its[-1] / mine[-1]
    every = {"stiffness": stiffness, "friction": its.min() / mine.min() / stiffness}
    factors = {name: one for name, one in every.items() if f"{one:.2f}" != "1.00"}
    lower = [f"{name} (× {one:.2f})" for name, one in factors.items() if one < 1]
    not_lower = [f"not {name} (× {one:.2f})" for name, one in factors.items() if one > 1]
    return ", ".join(filter(None, [" and ".join(lower), *not_lower])) or NOTHING


def stuck_hz(one: Results, phase: Phase) -> float | None:
    """Frequency of a phase with all kept pairs stuck."""
    if one.tune is None:
        return None
    other = {name: mode.hz for name, mode in one.tune.other_modes.items()}
    return {one.study.tune.follow: one.tune.stuck_hz.tuned, **other}.get(phase)


def events(comparison: ComparedStudies) -> Iterator[Table]:
    """What happens to the peaks along each curve; nothing where nothing does."""
    found = [
        (f"{name}, {in_words(phase)}", text)
        for phase in comparison.phases
        for name in comparison.names
        for text in told(comparison.of(name, phase, 1))
    ]
    found += [
        (f"{name}, {in_words(phase)}", f"no peaks: {why}")
        for name, phase, why in comparison.missing()
    ]
    found += comparison.failed
    if found:
        yield Table(
            "What happens to the peaks of blade 1 as Fc/Fe falls, and why a study has none.",
            [{"study": whose, "along its curve": text} for whose, text in found],
            left=(0, 1),
        )


def told(peaks: list[ComparedPeak]) -> Iterator[str]:
    """Of the peaks of one study, phase and blade: where they drift, change to another mode, merge,
    or are not reached, in words."""
    for first, last in drifts(peaks):
        yield (
            f"drifts from {hertz(first.hz)} to {hertz(last.hz)} Hz between Fc/Fe = "
            f"{number(first.ratio, 3)} and {number(last.ratio, 3)}"
        )
    for peak in sorted(peaks, key=lambda p: -p.ratio):
        at = f"at Fc/Fe = {number(peak.ratio, 3)}"
        if peak.of_another_mode:
            yield f"{at} the largest peak is that of another mode, at {hertz(peak.hz)} Hz"
        if peak.merged:
            yield (
                f"{at} there is no maximum of its own: it has merged with that of the other phase, "
                "or left the band"
            )
        if peak.at_least is not None:
            bound = f"at least {micro(peak.at_least)} µm/N; " if peak.at_least else ""
            yield f"{at} incomplete: {bound}{peak.why}"


def cases(comparison: ComparedStudies) -> Iterator[Table]:
    """Every case: both blades."""
    rows = []
    for name in comparison.names:
        for phase in comparison.phases:
            on = [comparison.of(name, phase, blade) for blade in comparison.blades]
            rows += [_case(name, phase, peaks) for peaks in zip(*on, strict=True)]
    yield Table(
        "Every case: largest FRF in µm/N at Hz on each blade, and the share of the kept pairs that "
        "slip or open at that of blade 1. Error by the harmonics left out, and stability of the "
        "motion: of the blade with the larger peak; a dash where it is not known.",
        rows,
        left=(0, 1),
    )


def _case(name: str, phase: Phase, peaks: Sequence[ComparedPeak]) -> Row:
    first, largest = peaks[0], max(peaks, key=lambda peak: peak.m_per_N or 0.0)
    return {
        "study": name,
        "phase": in_words(phase),
        "Fc/Fe": number(first.ratio, 4),
        "Fc (N)": number(first.pull),
        "Fe (N)": number(first.Fe),
        "H": f"{first.H}",
        **{f"blade {peak.blade}": _height(peak) for peak in peaks},
        "error": error(largest),
        "motion": stability(largest),
        "slip": NOTHING if first.slipping is None else f"{100 * first.slipping:.0f} %",
    }


def _height(peak: ComparedPeak) -> str:
    if peak.m_per_N is not None:
        return f"{micro(peak.m_per_N)} at {hertz(peak.hz)}"
    return f"at least {micro(peak.at_least)}" if peak.at_least else NOTHING
