"""Stage cycles: inside of the contacts at the peak of every curve, hysteresis loops, friction work,
energy balance; on demand the peaks beside time integration."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.checks.pairs import Slide, pair_names, slides
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields import surface
from tipdamp.fields.animation import keep_motion
from tipdamp.hbm.balance.problem import ContactProblem
from tipdamp.hbm.comparison import compare_point
from tipdamp.hbm.curve.cycles import ContactCycles, contact_cycles, whole_motion
from tipdamp.hbm.curve.energy import EnergyBalance
from tipdamp.hbm.curve.solutions import points_at
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.result import ForcedResponse
from tipdamp.results.loops import save_loops
from tipdamp.results.response_results import (
    CurveResult,
    CyclesResult,
    Integration,
    PeakCycle,
    RespondResult,
    families,
)
from tipdamp.results.static_results import PreloadResult
from tipdamp.stages.assembly import READS, Assembly, assembled
from tipdamp.stages.stage import Stage, recorded
from tipdamp.study.view import Study

MORE_DAMPED = 1.5  # times the largest damping ratio: more is told
SAMPLES = 256  # a period: the loops are drawn with them, the energies do not depend on them


def cycles(study: Study, store: Store, tick: Tick) -> list[str]:
    """One period of all contacts at the highest solved point of every curve, and its energies."""
    assembly = assembled(study, store, responded=True)
    respond = RespondResult.load(store)
    names = pair_names(assembly.kept, slice(None))
    half_widths = {
        name: one.half_width_m for name, one in PreloadResult.load(store).stiffness.items()
    }
    found = list[PeakCycle]()
    said = list[str]()
    slid: list[tuple[Slide, CurveResult]] = []
    files: list[str] = []
    finest = families(respond.responses)[-1]
    for case, curve, point, cycle in _periods(store, assembly, respond.responses, tick, said):
        on_sides = slides(assembly.kept, cycle.motion, cycle.components, half_widths)
        slid += [(one, case) for one in on_sides]
        facts = _facts(case, curve, point, cycle.energy, names)
        if study.respond.compare and case in finest:
            beside = _integrated(curve, assembly.curves.problem, point)
            facts = facts.model_copy(update={"integration": beside})
            if not (beside.agrees and beside.stable):
                said.append(f"Fe = {case.Fe_N:g} N, H = {case.H}: {beside.said}")
        found.append(facts)
        motion = motion_of_bodies(assembly, curve, point)
        with store.writing(facts.file) as path:
            save_loops(path, cycle, names, motion[assembly.model.body == DAMPER])
        if study.respond.animate and case in finest:
            files += _animated(store, assembly, case, motion, cycle)
    said += [*_too_far(slid), *_otherwise_damped(found, max(study.respond.damping_ratio))]
    CyclesResult(curves=tuple(found), pairs=tuple(names), warnings=tuple(said)).save(store)
    return [*(one.file for one in found), *files]


class Period(NamedTuple):
    """One of the contacts, at a point of a curve."""

    case: CurveResult
    curve: ForcedResponse
    point: int
    cycle: ContactCycles


def _periods(
    store: Store, assembly: Assembly, cases: Sequence[CurveResult], tick: Tick, said: list[str]
) -> Iterator[Period]:
    """Of every curve that has a solved point; a sentence is added to `said` where there is none."""
    for k, case in enumerate(cases):
        tick(k / len(cases), _of(case))
        curve = ForcedResponse.load(store.path(case.file))
        point = highest_point(case, curve)
        if point is None:
            continue
        try:
            cycle = contact_cycles(curve, assembly.curves.problem, point, SAMPLES)
        except InputError as error:
            said.append(f"no hysteresis loops at {_of(case)}: {error}")
            continue
        yield Period(case, curve, point, cycle)


def _of(case: CurveResult) -> str:
    return f"Fe = {case.Fe_N:g} N, H = {case.H}"


def _too_far(slid: list[tuple[Slide, CurveResult]]) -> Iterator[str]:
    """The slide that is the largest share of its contact, where it leaves it."""
    farthest, case = max(slid, key=lambda one: one[0].share, default=(None, None))
    if farthest is not None and case is not None and farthest.share > 1:
        yield (
            f"{_of(case)}: {farthest.said}: the model keeps the partners "
            "and the stiffness of the place at rest, so the figures hold less and less from "
            "there on; check the level, its unit and the damping"
        )


def _otherwise_damped(found: Sequence[PeakCycle], asked: float) -> Iterator[str]:
    """The peak at which the structure itself is damped most beyond the ratio of its modes with
    every pair closed."""
    most = max(found, key=lambda one: one.damping_ratio, default=None)
    if most is not None and most.damping_ratio > MORE_DAMPED * asked > 0:
        yield (
            f"the damping ratio {asked:.4g} is that of modes with every kept pair closed; at the "
            f"peak of Fe = {most.Fe_N:g} N, {most.hz:.4g} Hz, where pairs slip or are open, the "
            f"structure itself is damped by {most.damping_ratio:.4g}, friction left out: the peak "
            "is lower by that; where it matters give the damping ratio that fits this motion"
        )


def motion_of_bodies(assembly: Assembly, curve: ForcedResponse, point: int) -> np.ndarray:
    """(r, H+1) m: Fourier coefficients of the dofs of the model."""
    motion = whole_motion(curve, assembly.curves.problem, point)
    return motion if assembly.interface is None else assembly.interface.basis @ motion


def _animated(
    store: Store, assembly: Assembly, case: CurveResult, motion: np.ndarray, cycle: ContactCycles
) -> list[str]:
    """The period of the bodies whose surfaces are known."""
    if not store.path("surface.npz").is_file():
        return []
    surfaces = surface.load(store.path("surface.npz"))
    surfaces = {name: surfaces[name] for name in (BLADES, DAMPER) if name in surfaces}
    of_bodies = {body: motion[assembly.model.body == body] for body in surfaces}
    stem = case.file.rpartition("/")[2].removesuffix(".npz")
    return keep_motion(store, stem, surfaces, of_bodies, (assembly.kept, cycle))


def highest_point(case: CurveResult, curve: ForcedResponse) -> int | None:
    """The solved point at the peak, or at the largest amplitude of a curve without one."""
    hz = case.at_least_hz if case.peak_hz is None else case.peak_hz
    if hz is None:
        return None
    solved = np.flatnonzero(curve.converged)
    near = solved[np.isclose(curve.frequency[solved], hz, rtol=1e-9)]
    return int(near[0] if len(near) else solved[np.abs(curve.frequency[solved] - hz).argmin()])


def _integrated(curve: ForcedResponse, problem: ContactProblem, point: int) -> Integration:
    """The point beside time integration."""
    balance, there = points_at(curve, problem, float(curve.frequency[point]))
    mine = min(there, key=lambda one: np.linalg.norm(one.x - curve.unknowns[point]))
    found = compare_point(balance, mine, curve.output_rows)
    return Integration(
        difference=found.difference, agrees=found.agrees, stable=found.stable, said=found.said
    )


def _facts(
    case: CurveResult,
    curve: ForcedResponse,
    point: int,
    energy: EnergyBalance,
    names: Sequence[str],
) -> PeakCycle:
    return PeakCycle(
        file=f"cycles/{case.file.rpartition('/')[2]}",
        Fe_N=case.Fe_N,
        H=case.H,
        hz=float(curve.frequency[point]),
        input_J=energy.input,
        damping_J=energy.damping,
        friction_J=dict(zip(names, map(float, energy.friction), strict=True)),
        error=energy.error,
        damping_ratio=energy.damping_ratio,
    )


def line(store: Store) -> str:
    """Largest share of the input that friction takes."""
    found = CyclesResult.load(store).curves
    if not found:
        return "no solved point"
    most = max(found, key=lambda one: one.friction_share)
    worst = max(one.error for one in found)
    return (
        f"friction takes up to {100 * most.friction_share:.0f} % of the input (Fe = {most.Fe_N:g} "
        f"N, H = {most.H}); energy balanced to {worst:.0e}"
    )


STAGE = Stage(
    cycles,
    line,
    warnings=recorded(CyclesResult),
    outputs=("cycles.json",),
    may_write=("cycles/*.npz", "motion_*.pvd", "motion_*.vtu"),
    needs=("reduce", "preload", "tune", "respond"),
    requires=("tune", "respond", "respond.levels"),
    reads=(*READS, "respond.animate", "respond.compare"),
)
