"""Studies side by side: what was computed of them and the peaks of it."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

from tipdamp.comparison.optimum import (
    NEAR,
    Optimum,
    Spans,
    far_between,
    least_within,
    optimum,
    ranks,
    reach,
    tops,
)
from tipdamp.comparison.peaks import PHASES, ComparedPeak, Phase, peaks_of, why_missing
from tipdamp.report.results import Results

KEY = re.compile(r"(?:^|, )([\w.-]+) = ")  # in the words of a scatter


@dataclass(frozen=True)
class Computed:
    """What was computed of a study, or of one case of its sweep. name - of the study, with the pull
    where its pulls draw a curve each; scatter - in words, what this case has otherwise than the
    study; empty in the study itself; apart - why its pulls draw a curve each; empty where they do
    not."""

    name: str
    results: Results
    scatter: str = ""
    apart: str = ""

    @property
    def of(self) -> str:
        """The study, all its pulls together."""
        return self.results.study.name if self.apart else self.name


@dataclass(frozen=True)
class ComparedStudies:
    """computed - in the order given; peaks - of all of them; failed - (name, reason) of cases
    without a result."""

    computed: tuple[Computed, ...]
    peaks: tuple[ComparedPeak, ...]
    failed: tuple[tuple[str, str], ...] = ()

    @property
    def names(self) -> list[str]:
        """Of the studies, each once."""
        return list(dict.fromkeys(one.name for one in self.computed))

    @property
    def nominal(self) -> list[Computed]:
        """What has the values of its study."""
        return [one for one in self.computed if not one.scatter]

    @property
    def studies(self) -> dict[str, Results]:
        """{name: the first that was computed of it}."""
        first = {one.name: one.results for one in reversed(self.nominal)}
        return {name: first[name] for name in self.names if name in first}

    @property
    def phases(self) -> list[Phase]:
        """Those that a study has computed."""
        return [phase for phase in PHASES if any(peak.phase == phase for peak in self.peaks)]

    @property
    def blades(self) -> list[int]:
        """1, 2, as far as the studies have patches."""
        return sorted({peak.blade for peak in self.peaks})

    def of(self, name: str, phase: Phase, blade: int | None = None) -> list[ComparedPeak]:
        """The peaks of one study and phase, on one blade or on all, ascending in Fc/Fe; those of
        its scatter not among them."""
        mine = [
            peak
            for peak in self.peaks
            if (peak.study, peak.phase) == (name, phase) and blade in (None, peak.blade)
            if not peak.scatter
        ]
        return sorted(mine, key=lambda peak: (peak.ratio, peak.blade))

    def spread(self, peak: ComparedPeak) -> tuple[float, float]:
        """(m/N, m/N): from the least to the largest of a peak and of the same in its scatter."""
        heights = [other.m_per_N for other in self._alike(peak) if other.m_per_N is not None]
        return min(heights), max(heights)

    def _alike(self, peak: ComparedPeak) -> list[ComparedPeak]:
        """A peak and the same in its scatter."""
        return [one for one in self.peaks if one.place == peak.place and one.m_per_N is not None]

    def scattered(self, name: str) -> list[str]:
        """Keys that vary in the scatter of a study."""
        said = [one.scatter for one in self.computed if one.name == name]
        return list(dict.fromkeys(key for text in said for key in KEY.findall(text)))

    def optima(self, phase: Phase) -> dict[str, Optimum]:
        """{study: its optimum} of those that have one, the lowest first."""
        found = {name: optimum(self.of(name, phase)) for name in self.names}
        known = {name: one for name, one in found.items() if one is not None}
        return dict(sorted(known.items(), key=lambda item: item[1].m_per_N))

    def common(self, phase: Phase) -> tuple[float, float] | None:
        """(Fc/Fe, Fc/Fe) which all studies with an optimum reach; None where there is none."""
        reached = [reach(self.of(name, phase)) for name in self.optima(phase)]
        if not reached:
            return None
        low, high = max(a for a, _ in reached), min(b for _, b in reached)
        return (low, high) if low <= high * (1 + NEAR) else None

    def is_cut(self, phase: Phase) -> bool:
        """Whether the least of a study lies at an Fc/Fe that not all reach."""
        common = self.common(phase)
        if common is None:
            return False
        low, high = common[0] * (1 - NEAR), common[1] * (1 + NEAR)
        return not all(low <= one.ratio <= high for one in self.optima(phase).values())

    @property
    def apart(self) -> dict[str, str]:
        """{study: why its pulls draw a curve each} of those whose do."""
        return {one.of: one.apart for one in self.computed if one.apart}

    @property
    def several_pulls(self) -> set[str]:
        """The studies with several pulls."""
        pulls = {(one.name, one.results.study.driver.pull) for one in self.computed}
        return {name for name, count in Counter(name for name, _ in pulls).items() if count > 1}

    @cached_property
    def by_study(self) -> "ComparedStudies":
        """The same with one curve for each study: where its pulls draw a curve each, at every Fc/Fe
        that of the pull which is lowest there."""
        if not self.apart:
            return self
        of = {one.name: one.of for one in self.computed}
        whole = [replace(peak, study=of[peak.study]) for peak in self.peaks]
        return ComparedStudies(
            tuple(Computed(one.of, one.results, one.scatter) for one in self.computed),
            lowest_pulls(whole),
            self.failed,
        )

    def interpolated(self, phase: Phase) -> dict[str, tuple[float, float]]:
        """{study: (m/N, m/N) between which its least over the Fc/Fe that all reach lies} of those
        without a level near an end of that range, of which the least is only interpolated: they
        have no rank."""
        common = self.common(phase)
        if common is None:
            return {}
        found = {}
        for name in self.optima(phase):
            every = tops(self.of(name, phase))
            if far_between(every, *common):
                heights = [peak.m_per_N or 0.0 for peak in least_within(every, *common)]
                found[name] = min(heights), max(heights)
        return found

    def ranks(self, phase: Phase) -> dict[str, int]:
        """{study: place by its least over the Fc/Fe that all reach}, 1 of the lowest; those that
        are equal within their errors, their scatter and what a flat curve varies by share a place:
        of the same scatter case by case. Empty where there is no such Fc/Fe; without those of
        which the least is only interpolated."""
        common = self.common(phase)
        if common is None:
            return {}
        spans: dict[str, Spans] = {}
        unknown = self.interpolated(phase)
        for name in (name for name in self.optima(phase) if name not in unknown):
            mine = spans.setdefault(name, {})
            least = least_within(tops(self.of(name, phase)), *common)
            for peak in (one for each in least for one in self._alike(each)):
                low, high = mine.get(peak.scatter, peak.span)
                mine[peak.scatter] = min(low, peak.span[0]), max(high, peak.span[1])
        return ranks(spans)

    def missing(self) -> Iterator[tuple[str, Phase, str]]:
        """(study, phase, why it has no peaks of it)."""
        for name, phase in product(self.names, PHASES):
            mine = [one.results for one in self.nominal if one.name == name]
            if mine and not self.of(name, phase):
                yield name, phase, "; ".join(dict.fromkeys(why_missing(r, phase) for r in mine))


def compared(
    computed: Iterable[Computed], failed: Iterable[tuple[str, str]] = ()
) -> ComparedStudies:
    """The comparison of what was computed."""
    computed = tuple(computed)
    peaks = [peak for one in computed for peak in peaks_of(one.results, one.name, one.scatter)]
    return ComparedStudies(computed, finest(peaks), tuple(failed))


def finest(peaks: Sequence[ComparedPeak]) -> tuple[ComparedPeak, ...]:
    """Those of the most harmonics, of what is otherwise the same."""
    most: dict[tuple, int] = {}
    for one in peaks:
        most[one.place, one.scatter] = max(one.H, most.get((one.place, one.scatter), 0))
    return tuple(one for one in peaks if one.H == most[one.place, one.scatter])


def lowest_pulls(peaks: Sequence[ComparedPeak]) -> tuple[ComparedPeak, ...]:
    """Of several pulls of a study at one Fc/Fe in one phase that of which the larger blade is
    lowest, with its scatter; one that has a peak is before one that has none."""
    heights: dict[tuple, dict[float, float]] = {}
    for one in peaks:
        if not one.scatter:
            mine = heights.setdefault((one.study, one.phase, one.ratio), {})
            height = math.inf if one.m_per_N is None else one.m_per_N
            mine[one.pull] = max(height, mine.get(one.pull, 0.0))
    lowest = {place: min(mine, key=lambda pull: mine[pull]) for place, mine in heights.items()}
    return tuple(
        one for one in peaks if lowest.get((one.study, one.phase, one.ratio), one.pull) == one.pull
    )
