"""The curves of one level: of the numbers of harmonics that the study names, or with harmonics =
"auto" of as many as the points of one with few need to meet the tolerance. Which ones follows from
the curves that the store has: a study that was interrupted, or has another tolerance, goes on from
there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tipdamp.engine.curves import CurveCase, Curves
from tipdamp.hbm.curve.enough_harmonics import error_of, first_orders
from tipdamp.results.response_results import TriedHarmonics
from tipdamp.study.schema import Respond, named_orders


@dataclass(frozen=True)
class LevelCurves:
    """tried - with harmonics = 'auto', with their errors; within - whether one meets the tolerance,
    the last; without it the last complete curve is taken; forward - the curves of these, and one
    that is still to be made and judged; wanted - for each H of the result its curve and, where
    that may be another, the one from the other end; empty while H is not known; effort - of the
    search beside the curve of the largest H, in evaluations of its own."""

    tried: tuple[TriedHarmonics, ...]
    within: bool | None
    forward: tuple[CurveCase, ...]
    wanted: tuple[tuple[CurveCase, ...], ...]
    effort: float = 0.0

    @property
    def cases(self) -> list[CurveCase]:
        """All of them."""
        return [*self.forward, *(case for ways in self.wanted for case in ways)]

    @property
    def finest(self) -> CurveCase:
        """The curve of the largest H."""
        return max((ways[0] for ways in self.wanted), key=lambda case: case.H)

    def searched(self, key: str) -> "LevelCurves":
        """With the key of the search beside the curve of the largest H."""
        finest = self.finest
        wanted = (
            (replace(ways[0], search=key) if ways[0] == finest else ways[0], *ways[1:])
            for ways in self.wanted
        )
        return replace(self, wanted=tuple(wanted))


def level_of(settings: Respond, curves: Curves, Fe: float) -> LevelCurves:
    """What a level of Fe N consists of, as far as the finished curves tell."""
    if orders := named_orders(settings.harmonics):
        every = tuple(_ways(settings, curves, CurveCase(Fe, H, settings.band)) for H in orders)
        return LevelCurves((), None, (), every, _effort(settings, orders))
    tried, cases, within = _tried(settings, curves, Fe)
    if len(tried) < len(cases):
        return LevelCurves(tried, None, cases, ())
    H = ([one.H for one in tried if one.complete] or [tried[0].H])[-1]
    chosen = CurveCase(Fe, H, settings.band, tolerance=settings.tolerance)
    wanted = _ways(settings, curves, chosen)
    effort = _effort(settings, [one.H for one in tried])
    return LevelCurves(tried, within, cases, (wanted,), effort)


def _tried(
    settings: Respond, curves: Curves, Fe: float
) -> tuple[tuple[TriedHarmonics, ...], tuple[CurveCase, ...], bool]:
    """What the finished curves of more and more harmonics came to; all curves, of which the last
    may have to be made; whether the last meets the tolerance."""
    tried = list[TriedHarmonics]()
    cases = list[CurveCase]()
    within = False
    further: int | None = first_orders()
    while further is not None:
        case = CurveCase(Fe, further, settings.band, tolerance=settings.tolerance)
        cases.append(case)
        if not curves.finished(case):
            break
        curve = curves.load(case)
        tried.append(TriedHarmonics(H=further, error=error_of(curve), complete=curve.complete))
        within = curve.complete and error_of(curve) <= settings.tolerance
        if within or not curve.complete:
            break
        further = curves.more_harmonics(case)
    return tuple(tried), tuple(cases), within


def _ways(settings: Respond, curves: Curves, case: CurveCase) -> tuple[CurveCase, ...]:
    """The curve and, once it is finished and may be another one from there, that from the other end
    of the band."""
    if not settings.both_ways or not curves.finished(case) or curves.load(case).alike_backwards:
        return (case,)
    return case, replace(case, band=case.band[::-1], tolerance=0.0)


def _effort(settings: Respond, made: Sequence[int]) -> float:
    """Effort of the search beside the curve of the largest H, in evaluations of its own: the share
    of those of the curves of a level, their H in `made`; an evaluation costs in proportion to the
    unknowns."""
    return settings.search * sum((2 * H + 1) / (2 * max(made) + 1) for H in made)
