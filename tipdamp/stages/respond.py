"""Stage respond: forced response of the kept pairs at every level and number of harmonics."""

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field

import numpy as np
from threadpoolctl import threadpool_limits

from tipdamp.bodies.interface import (
    FILES,
    facts_of,
    in_words,
    keep_shapes,
)
from tipdamp.checks.pairs import pair_names
from tipdamp.checks.room import acting, check_room
from tipdamp.engine.curves import CurveCase, Curves, forget, sweep
from tipdamp.engine.further import (
    cross_levels,
    follow_further,
    level_branches,
    level_search,
)
from tipdamp.engine.progress import Ticker
from tipdamp.engine.store import Store
from tipdamp.engine.workers import Workers
from tipdamp.hbm.balance.open_damping import OpenModes
from tipdamp.hbm.io.array_files import save_npz
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.results.response_results import CurveResult, RespondResult
from tipdamp.results.static_results import PreloadResult
from tipdamp.stages.adrift import adrift
from tipdamp.stages.assembly import ALL_SPRINGS, READS, Assembly, assembled
from tipdamp.stages.curve_facts import curve_result, peak_shape, with_macs
from tipdamp.stages.levels import LevelCurves, level_of
from tipdamp.stages.response_doubts import (
    both_ways,
    incomplete,
    solved_nothing,
    warnings,
    without_peak,
)
from tipdamp.stages.stage import Stage
from tipdamp.study.schema import Respond
from tipdamp.study.view import Study


# as in the processes that work side by side: sums are split by threads, and differ in the last bit
@threadpool_limits.wrap(limits=1, user_api="blas")
def respond(study: Study, store: Store, tick: Ticker, workers: Workers) -> list[str]:
    """Forced response of the kept pairs at every excitation level and every number of harmonics."""
    settings = study.respond
    assembly = assembled(study, store)
    curves = assembly.curves
    kept = assembly.kept
    free = PreloadResult.load(store).free_motions
    for text in adrift(study, free, (assembly.vibrating, kept), curves.force):
        # before the curves: the first point may not be found
        logging.getLogger("tipdamp").warning(text)
    levels = _make(settings, curves, tick, workers)
    asked = [(level, level.wanted[k]) for k in range(len(levels[0].wanted)) for level in levels]
    found, difference = _judged(settings, assembly, asked)
    _keep_linear(store, settings, assembly)
    RespondResult(
        responses=tuple(found),
        law=settings.law,
        zeta=settings.damping_ratio,
        tolerance=settings.tolerance,
        stuck_difference=difference,
        interface=facts_of(study, assembly.interface, found, pair_names(kept, slice(None))),
        size_m=_size(assembly.model),
        open_damping=_open_damping(assembly.open_modes),
    ).save(store)
    made = [case for level in levels for case in level.forward]
    made += [case for _, cases in asked for case in cases]
    own = dict.fromkeys(file for case in made for file in curves.files(case))
    return [*own, *keep_shapes(store, assembly.interface)]


def _judged(
    settings: Respond,
    assembly: Assembly,
    asked: Sequence[tuple[LevelCurves, Sequence[CurveCase]]],
) -> tuple[list[CurveResult], dict[str, float]]:
    """The results of the curves, each with its ways, and {file: how far it is off the linear
    response} of those on which nothing slips."""
    curves = assembly.curves
    kept = assembly.kept
    found = list[CurveResult]()
    shapes = []
    difference = {}
    # the damping is that of all kept pairs stuck: the linear response is the same where none is
    # open at rest
    alike = curves.problem.law.components == ALL_SPRINGS and (kept.preload > 0).all()
    for level, cases in asked:
        there = cases[0]
        curve = curves.load(cases[0])
        ways = curve, *map(curves.load, cases[1:])
        one = curve_result(settings, kept, curves.problem, there, ways, curves.beside(there))
        one = one.model_copy(update={"tried": level.tried, "within_tolerance": level.within})
        found.append(one)
        shapes.append(peak_shape(curve, one))
        if not one.slipping_pairs and alike and curve.converged.any():
            difference[there.file] = stuck_difference(settings, assembly, curve, there.Fe_N)
    return with_macs(found, shapes), difference


def _keep_linear(store: Store, settings: Respond, assembly: Assembly) -> None:
    """stuck.npz: the response with all pairs stuck that are in contact at rest."""
    hz, response = assembly.drawn(settings)
    names = np.array(list(assembly.curves.rows))
    with store.writing("stuck.npz") as path:
        save_npz(path, frequency=hz, response=response, output_names=names)


def acting_pairs(study: Study, store: Store) -> tuple[int, ...]:
    """Numbers of pairs that slip or lift at the levels of a study."""
    settings = study.respond
    found = acting(assembled(study, store).curves, settings.levels, settings.band)
    return tuple(found[Fe].contacts for Fe in settings.levels)


def _size(model: ReducedModel) -> float | None:
    """Largest extent of its nodes, m; None where it has no places."""
    placed = model.position[np.isfinite(model.position).all(axis=1)]
    return float(np.ptp(placed, axis=0).max()) if len(placed) else None


def _open_damping(found: OpenModes | None) -> str:
    """A sentence where pairs that are open at rest give a mode another damping ratio."""
    other = found.farthest if found else None
    if other is None:
        return ""
    return (
        f"the damping ratio {other.asked:.4g} is that of modes with every kept pair closed; with "
        f"those open that are open at rest mode {other.mode}, {other.hz:.4g} Hz, has "
        f"{other.own:.4g}, without friction, as the linear stuck response is drawn; [respond] "
        f"damping_ratio = {other.asked**2 / other.own:.4g} would give it {other.asked:.4g}"
    )


@dataclass(frozen=True)
class _LevelBars:
    """How far the curves are: a bar for each that is under way, beside that of them all; kept -
    their number that were there; missing - those that are made."""

    tick: Ticker
    levels: Mapping[float, LevelCurves]
    kept: int
    missing: Sequence[CurveCase]
    open: ExitStack
    bars: dict[int, tuple[ExitStack, Ticker]] = field(default_factory=dict)
    shares: dict[int, float] = field(default_factory=dict)

    def report(self, i: int, share: float, figures: str) -> None:
        """Of a missing curve that is under way."""
        if i not in self.bars:
            bar = self.open.enter_context(ExitStack())
            self.bars[i] = bar, bar.enter_context(self.tick.beside(self.missing[i].title))
        self.bars[i][1](share, figures)
        # it may have passed the end, and its peaks are to be solved
        self.shares[i] = min(max(share, 0.0), 0.99)
        self.show()

    def show(self) -> None:
        """All of them."""
        done = self.kept + sum(share == 1.0 for share in self.shares.values())
        known = self.kept + len(self.missing)
        # an undecided level has its curve before it
        total = known + sum(not level.wanted for level in self.levels.values())
        self.tick((self.kept + sum(self.shares.values())) / total, f"{done} of {known} curves")

    def close(self, i: int, solved: bool) -> None:
        """That of a finished curve."""
        bar, tick = self.bars[i]
        if not solved:
            tick(1.0, "no point solved")
        bar.close()


def _make(settings: Respond, curves: Curves, tick: Ticker, workers: Workers) -> list[LevelCurves]:
    """Make the curves of every level that the store does not have, each with a bar of its own; the
    longest first. A curve that is finished may tell what its level needs next."""
    levels = {Fe: level_of(settings, curves, Fe) for Fe in settings.levels}
    kept = [case for level in levels.values() for case in level.cases if curves.finished(case)]
    missing = sorted(
        (case for level in levels.values() for case in level.cases if case not in kept),
        key=lambda case: (-case.H, -case.Fe_N),
    )
    check_room(curves, missing, workers.jobs)
    if missing and not curves.problem.reducible:
        curves.problem.receptance()  # once for all curves and processes
    with ExitStack() as stack:
        bars = _LevelBars(tick, levels, len(kept), missing, stack)
        for i in workers.spread(make_curve, curves, missing, bars.report):
            bars.shares[i] = 1.0
            level = levels[missing[i].Fe_N] = level_of(settings, curves, missing[i].Fe_N)
            further = [case for case in level.cases if case not in [*kept, *missing]]
            if further:
                busy = [case for k, case in enumerate(missing) if bars.shares.get(k) != 1.0]
                check_room(curves, [*busy, *further], workers.jobs)
                missing += further
            bars.show()
            if i in bars.bars:
                bars.close(i, bool(curves.load(missing[i]).converged.any()))
    made = _look_beside(curves, list(levels.values()), tick, workers)
    sweep(curves.store, [case for level in made for case in level.cases])
    return made


def _look_beside(
    curves: Curves, levels: list[LevelCurves], tick: Ticker, workers: Workers
) -> list[LevelCurves]:
    """Look for further curves beside those of the largest H, of all levels at once."""
    if not any(level.effort for level in levels):
        return levels
    search = level_search(
        curves, [level.finest for level in levels], [level.effort for level in levels]
    )
    missing = [case for case in search.cases if not curves.finished(case)]
    branches = level_branches(curves, search) if missing else []
    following = [(case, branches) for case in missing]
    total = len(branches) + len(following)
    done = 0
    for work, tasks in ((cross_levels, branches), (follow_further, following)):
        before = done

        def report(i: int, share: float, figures: str, before: int = before) -> None:
            tick((before + share) / total, f"further curves: {figures}")

        for _ in workers.spread(work, curves, tasks, report):
            done += 1
            tick(done / total, "further curves")
    return [level.searched(search.cases[0].search) for level in levels]


def make_curve(curves: Curves, case: CurveCase, report: Callable[[float, str], None]) -> None:
    """Work of one process: one curve into the store."""
    begin, end = case.band
    furthest = 0.0

    def progress(hz: float, step: float, iterations: int) -> None:
        nonlocal furthest
        furthest = max(furthest, (hz - begin) / (end - begin))
        figures = f"{hz:.1f} Hz  step {step:.2g}  {iterations} it"
        if hz == end and not step:
            figures = f"{hz:.1f} Hz reached: peaks, errors, branches  {iterations} calls"
        report(furthest, figures)

    curves.make(case, progress)


def stuck_difference(
    settings: Respond, assembly: Assembly, curve: ForcedResponse, level: float
) -> float:
    """Largest |curve - linear stuck response| over the largest response."""
    good = curve.converged
    x = assembly.linear(settings, curve.frequency[good], level)
    return float(np.abs(curve.harmonics[good, :, 1] - x).max() / np.abs(x).max())


def line(store: Store) -> str:
    """Numbers of curves, of their points, and of what is missing."""
    found = RespondResult.load(store)
    partial, curves = incomplete(found)
    points = sum(c.points for c in found.responses)
    failed = sum(c.failed_points for c in both_ways(found))
    back = f" ({curves} with those followed back)" if curves > len(found.responses) else ""
    missing = f", {peakless} without a peak" if (peakless := without_peak(found)) else ""
    missing += f", {nothing} without a solved point" if (nothing := solved_nothing(found)) else ""
    lacking = [f"{failed} points failed"] * (failed > 0) + [
        f"{partial} curves incomplete{missing}"
    ] * (partial > 0)
    return (
        f"{len(found.responses)} curves{back}, {points} points, "
        f"{', '.join(lacking) or 'all complete'}" + in_words(found.interface)
    )


def _reads_more(study: Study) -> tuple[str, ...]:
    """Measured curves only where one names a node, whose peak is then solved too."""
    at_nodes = "measured" in study and any(":" in one.response for one in study.measured.values())
    return ("measured.response",) if at_nodes else ()


STAGE = Stage(
    respond,
    line,
    warnings=warnings,
    outputs=("respond.json", "stuck.npz"),
    may_write=("responses/*.npz", "responses/*_beside.json", *FILES),
    needs=("reduce", "tune"),
    requires=("tune", "respond", "respond.levels"),
    reads=READS,
    reads_more=_reads_more,
    parallel=True,
    forget=forget,
)
