"""Stage respond: forced response of the kept pairs at every level and number of harmonics."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from warnings import warn

import numpy as np
from threadpoolctl import threadpool_limits

from tipdamp.bodies.interface import (
    FILES,
    doubts,
    facts_of,
    in_words,
    keep_shapes,
    kept_shapes,
    shapes_of,
)
from tipdamp.bodies.loads import damper_hold
from tipdamp.checks import only_friction
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
from tipdamp.hbm.balance.open_damping import OpenModes, open_modes
from tipdamp.hbm.balance.problem import doubted_problem
from tipdamp.hbm.balance.receptance import linear_response, linear_response_with_peaks
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.curve.enough_harmonics import not_met
from tipdamp.hbm.curve.trace import SLIDES
from tipdamp.hbm.hold import spring
from tipdamp.hbm.hold.spring import HeldMotion
from tipdamp.hbm.interface import InterfaceReduction
from tipdamp.hbm.io.array_files import save_npz
from tipdamp.hbm.model import ReducedModel
from tipdamp.hbm.result import ForcedResponse
from tipdamp.results.response_results import BackCurve, CurveResult, Peak, RespondResult, families
from tipdamp.results.static_results import PreloadResult, ReduceResult, TuneResult
from tipdamp.stages.adrift import adrift, held_in
from tipdamp.stages.curve_facts import curve_result, peak_shape, with_macs
from tipdamp.stages.levels import LevelCurves, level_of
from tipdamp.stages.stage import Stage
from tipdamp.static_contact.tuning.roll_springs import with_springs
from tipdamp.statics import friction_history
from tipdamp.statics.model_inputs import (
    declared_springs,
    excitation,
    outputs,
    peak_groups,
    ratio,
)
from tipdamp.study.checks import check_sliders
from tipdamp.study.schema import Respond
from tipdamp.study.view import Study, every_key

# of `assembled`
READS = (
    *every_key("respond", but=("animate", "compare", "stress")),
    "sides",
    "preload.friction",
    "driver.hold",
    "model.hold",
)
# of the linear response: laws with fewer have another one where nothing slips
ALL_SPRINGS = ("t1", "t2", "n")


@dataclass(frozen=True)
class ResponseLimits:
    """What is warned of, and how finely the linear response is drawn."""

    balanced: float = 1e-6  # of the input: larger errors of the energy balance
    small: float = 1e-2  # of the size of the bodies: larger motions are no small displacements
    near: float = 0.03  # of the frequency, up to which a peak is that of the tracked mode
    softened: float = 0.1  # the same, where no other stuck mode is nearer
    points: int = 801  # of the linear stuck response
    damped: int = 1500  # dofs up to which the damping of open contacts is looked at, in seconds


LIMITS = ResponseLimits()
SHOWN = 8  # levels of one warning


@dataclass(frozen=True)
class Assembly:
    """What vibrates: the model with its roll springs, the kept pairs, their forces at rest (P, 3) N
    along t1, t2, n, the curves of the study, and the shapes that the response is in, None for all
    dofs."""

    model: ReducedModel
    kept: ContactTable
    rest: np.ndarray
    curves: Curves
    interface: InterfaceReduction | None

    @property
    def vibrating(self) -> ReducedModel:
        """The model on the dofs that the response is in, with the springs on what is held."""
        return (
            self.model
            if self.interface is None
            else _on_springs(self.interface.model, self.interface.held)
        )

    @cached_property
    def open_modes(self) -> OpenModes | None:
        """Those that leave open what is open at rest."""
        return open_modes(self.curves.problem, LIMITS.damped)

    def linear(self, settings: Respond, hz: np.ndarray, level: float) -> np.ndarray:
        """(n, outputs) m: response with all kept pairs stuck that are in contact at rest."""
        return linear_response(*self._stuck(settings, hz, level))

    def drawn(self, settings: Respond) -> tuple[np.ndarray, np.ndarray]:
        """(Hz (n,), (n, outputs) m per newton): `linear` over the band, with its peaks."""
        hz = np.linspace(*settings.band, LIMITS.points)
        return linear_response_with_peaks(*self._stuck(settings, hz, 1.0))

    def _stuck(
        self, settings: Respond, hz: np.ndarray, level: float
    ) -> tuple[
        ReducedModel,
        ContactTable,
        np.ndarray,
        np.ndarray,
        float | np.ndarray,
        dict[str, np.ndarray],
    ]:
        closed = self.kept.select(self.kept.preload > 0)
        force, zeta = level * self.curves.force, ratio(settings.damping_ratio)
        if self.open_modes is not None and len(self.open_modes.own) == self.vibrating.size:
            zeta = self.open_modes.own
        return self.vibrating, closed, force, hz, zeta, self.curves.rows


# as in the processes that work side by side: sums are split by threads, and differ in the last bit
@threadpool_limits.wrap(limits=1, user_api="blas")
def respond(study: Study, store: Store, tick: Ticker, workers: Workers) -> list[str]:
    """Forced response of the kept pairs at every excitation level and every number of harmonics."""
    settings, assembly = study.respond, assembled(study, store)
    contact = assembly.vibrating, assembly.kept
    for text in adrift(
        study, PreloadResult.load(store).free_motions, contact, assembly.curves.force
    ):
        # before the curves: the first point may not be found
        logging.getLogger("tipdamp").warning(text)
    levels = _make(settings, assembly.curves, tick, workers)
    found, shapes, difference = list[CurveResult](), [], {}
    files = [assembly.curves.files(case) for level in levels for case in level.forward]
    for k, level in product(range(len(levels[0].wanted)), levels):
        there, *back = level.wanted[k]
        curve, *others = map(assembly.curves.load, (there, *back))
        beside = assembly.curves.beside(there)
        files += [assembly.curves.files(case) for case in (there, *back)]
        made = assembly.kept, assembly.curves.problem
        one = curve_result(settings, *made, there, (curve, *others), beside)
        found.append(
            one.model_copy(update={"tried": level.tried, "within_tolerance": level.within})
        )
        shapes.append(peak_shape(curve, found[-1]))
        # the damping is that of all kept pairs stuck: the linear response is the same where none is
        # open at rest
        alike = (
            assembly.curves.problem.law.components == ALL_SPRINGS
            and (assembly.kept.preload > 0).all()
        )
        if not found[-1].slipping_pairs and alike and curve.converged.any():
            difference[there.file] = stuck_difference(settings, assembly, curve, there.Fe_N)
    with store.writing("stuck.npz") as path:
        hz, response = assembly.drawn(settings)
        save_npz(
            path,
            frequency=hz,
            response=response,
            output_names=np.array(list(assembly.curves.rows)),
        )
    RespondResult(
        responses=tuple(with_macs(found, shapes)),
        law=settings.law,
        zeta=settings.damping_ratio,
        tolerance=settings.tolerance,
        stuck_difference=difference,
        interface=facts_of(
            study, assembly.interface, found, pair_names(assembly.kept, slice(None))
        ),
        size_m=_size(assembly.model),
        open_damping=_open_damping(assembly.open_modes),
    ).save(store)
    own = dict.fromkeys(file for of_case in files for file in of_case)
    return [*own, *keep_shapes(store, assembly.interface)]


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
    with ExitStack() as all_bars:
        bars: dict[int, tuple[ExitStack, Ticker]] = {}
        shares: dict[int, float] = {}

        def show() -> None:
            done = len(kept) + sum(share == 1.0 for share in shares.values())
            known = len(kept) + len(missing)
            # an undecided level has its curve before it
            total = known + sum(not level.wanted for level in levels.values())
            tick((len(kept) + sum(shares.values())) / total, f"{done} of {known} curves")

        def report(i: int, share: float, figures: str) -> None:
            if i not in bars:
                bar = all_bars.enter_context(ExitStack())
                bars[i] = bar, bar.enter_context(tick.beside(missing[i].title))
            bars[i][1](share, figures)
            # it may have passed the end, and its peaks are to be solved
            shares[i] = min(max(share, 0.0), 0.99)
            show()

        for i in workers.spread(make_curve, curves, missing, report):
            shares[i] = 1.0
            level = levels[missing[i].Fe_N] = level_of(settings, curves, missing[i].Fe_N)
            further = [case for case in level.cases if case not in [*kept, *missing]]
            busy = [case for k, case in enumerate(missing) if shares.get(k) != 1.0]
            if further:
                check_room(curves, [*busy, *further], workers.jobs)
                missing += further
            show()
            if i in bars:
                if not curves.load(missing[i]).converged.any():
                    bars[i][1](1.0, "no point solved")
                bars[i][0].close()
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
    total, done = len(branches) + len(following), 0
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


def assembled(study: Study, store: Store, responded: bool = False) -> Assembly:
    """What the stages before have left, put together for the forced response; responded - the
    shapes that it is in are there."""
    model = ReducedModel.load(store.path("model.npz"))
    table = ContactTable.load(store.path("kept.csv"))
    model = with_springs(model, table, declared_springs(study, table, table.preload > 0))
    kept = table.select(table.carrying)
    static = None
    start = None
    law = study.respond.law.make()
    force = excitation(study, model)
    tangential = np.zeros((len(kept), 2))
    if study.preload.friction:
        check_sliders("[respond]", study.respond, law)
        tangential = friction_history.load(store.path("kept_friction.csv"), table)[table.carrying]
        # a tangent that the law does not know carries no friction
        tangential[:, law.sliders :] = 0.0
        static, sliders = friction_history.start(model, kept, tangential)
        start = sliders[:, : law.sliders]
    rows, held = outputs(study, model), damper_hold(study).on(model, kept)
    largest = max(study.respond.levels) * force
    shapes = (
        kept_shapes(store, held)
        if responded
        else shapes_of(study, model, kept, [largest] if static is None else [largest, static], held)
    )
    small, there = model, held
    if shapes is not None:
        small, force, rows = (
            shapes.model,
            force @ shapes.basis,
            {name: r @ shapes.basis for name, r in rows.items()},
        )
        static, there = None if static is None else static @ shapes.basis, shapes.held
    problem, _, doubts = doubted_problem(
        small, kept, law, ("preloaded", static, ratio(study.respond.damping_ratio), ())
    )
    for doubt in doubts:  # those of the table itself: where it was read
        warn(doubt, stacklevel=2)
    curves = Curves(
        replace(problem, held=there),
        force,
        rows,
        start,
        store,
        study.respond.samples,
        peak_groups(study, rows),
        study.respond.stability,
        study.respond.derivatives,
    )
    rest = np.column_stack([tangential, np.maximum(kept.preload, 0.0)])
    return Assembly(_on_springs(model, held), kept, rest, curves, shapes)


def _on_springs(model: ReducedModel, held: Sequence[HeldMotion]) -> ReducedModel:
    return model.with_stiffness(spring.with_springs(model.K, [one for one in held if not one.mean]))


def stuck_difference(
    settings: Respond, assembly: Assembly, curve: ForcedResponse, level: float
) -> float:
    """Largest |curve - linear stuck response| over the largest response."""
    good = curve.converged
    x = assembly.linear(settings, curve.frequency[good], level)
    return float(np.abs(curve.harmonics[good, :, 1] - x).max() / np.abs(x).max())


def incomplete(found: RespondResult) -> tuple[int, int]:
    """(curves that do not reach the end of the band or have failed points, all curves); each way
    counts as one."""
    curves = _both_ways(found)
    return sum(not c.complete or c.failed_points > 0 for c in curves), len(curves)


def without_peak(found: RespondResult) -> int:
    """Curves that have no peak, since they stopped or have a gap at their highest point."""
    return sum(c.peak_m is None for c in _both_ways(found))


def solved_nothing(found: RespondResult) -> int:
    """Curves without a single solved point."""
    return sum(c.solved_nothing for c in _both_ways(found))


def _both_ways(found: RespondResult) -> list[CurveResult | BackCurve]:
    return [*found.responses, *(c.back for c in found.responses if c.back)]


def line(store: Store) -> str:
    """Numbers of curves, of their points, and of what is missing."""
    found = RespondResult.load(store)
    (partial, curves), points = incomplete(found), sum(c.points for c in found.responses)
    failed = sum(c.failed_points for c in _both_ways(found))
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
            f"{only_friction.remedy(free, held_in(study))}; "
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
    tune, free = TuneResult.load(store), ReduceResult.load(store).free_hz
    ends = [tune.stuck_hz.tuned, *(hz for name, hz in free.items() if name not in tune.other_modes)]
    low, high = (1 - LIMITS.near) * min(ends), (1 + LIMITS.near) * max(ends)
    modes, tuned = np.array(tune.stuck_modes_hz.tuned), tune.stuck_hz.tuned

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
