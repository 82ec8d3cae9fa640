"""How far the peaks of a comparison are to be relied on: their digits, and what was warned of."""

import math
from collections import Counter
from collections.abc import Iterator

from tipdamp.comparison.peaks import ABOVE, ComparedPeak
from tipdamp.comparison.record import ComparedStudies
from tipdamp.hbm.result import DOUBTFUL
from tipdamp.report.text import MICRO, NOTHING, listing, number, sentence
from tipdamp.sweep.summary import alike

DIGITS = 4  # at most
ROUNDING = 1e-9  # errors below it, relative


def warnings(comparison: ComparedStudies) -> list[str]:
    """Sentences: for each study what of its peaks is in doubt, then what the stages of all warned
    of, each warning once."""
    return [
        *(text for name in comparison.names for text in _of_peaks(comparison, name)),
        *_of_stages(comparison),
    ]


def _of_peaks(comparison: ComparedStudies, name: str) -> Iterator[str]:
    mine = [one for one in comparison.peaks if one.study == name and one.m_per_N is not None]
    doubted = [one for one in mine if one.doubts]
    if not doubted:
        return
    count = Counter(text for one in doubted for text in one.doubts)
    errors = [one.error or 0.0 for one in doubted if not one.error_unknown]
    largest = f" (up to {number(max(errors), 2, 100)} %)" if errors else ""
    said = (f"{text} {times}" + largest * (text == ABOVE) for text, times in sorted(count.items()))
    yield (
        f"{name}: {len(doubted)} of {len(mine)} peaks, with those of its scatter, are in doubt: "
        f"{listing(said)}."
    )


def _of_stages(comparison: ComparedStudies) -> Iterator[str]:
    every = [one.results for one in comparison.computed]
    cases = Counter(one.study.name for one in every)
    said = {
        k: [text for texts in results.said.values() for text in texts]
        for k, results in enumerate(every)
    }
    for text, found in alike(said):
        mine = Counter(every[k].study.name for k in sorted(found))
        whose = listing(
            name + f" ({mine[name]} of {cases[name]} cases)" * (cases[name] > 1) for name in mine
        )
        yield f"{whose}: {sentence(text)}"


def height(peak: ComparedPeak, unit: str = "") -> str:
    """µm/N with the digits that its error leaves: '0.5288', '0.53 ± 3 % (unstable)'."""
    told = number(peak.m_per_N, _digits(peak), MICRO) + f" {unit}" * bool(unit)
    if not peak.error_unknown and _digits(peak) < DIGITS:
        told += f" ± {number(peak.error, 1, 100)} %"
    said = [text for text in peak.doubts if text != ABOVE]
    return told + f" ({', '.join(said)})" * bool(said)


def _digits(peak: ComparedPeak) -> int:
    """Significant ones, of which the last is about as large as the error: 2 of 3 %, 3 of 0.3 %."""
    if peak.error_unknown:
        return 2
    error = max(peak.error or 0.0, 0.1**DIGITS)
    return min(DIGITS, math.floor(-math.log10(2 * error)) + 1)


def error(peak: ComparedPeak) -> str:
    """In percent: '2.7 %'."""
    if peak.m_per_N is None:
        return NOTHING
    if peak.error_unknown:
        return "not known" if peak.error is None else f"over {100 * DOUBTFUL:g} %"
    return f"{number(0.0 if (peak.error or 0.0) < ROUNDING else peak.error, 2, 100)} %"


def stability(peak: ComparedPeak) -> str:
    """'stable', 'unstable'; a dash where it is not known."""
    return {True: "stable", False: "unstable", None: NOTHING}[peak.stable]
