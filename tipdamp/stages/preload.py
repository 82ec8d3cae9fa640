"""Stage preload: static contact of the whole patch under the pull and in further load cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tipdamp.bodies import DAMPER, stiffness
from tipdamp.bodies.balance import side_sums
from tipdamp.bodies.gaps import check_gaps
from tipdamp.bodies.loads import resultant
from tipdamp.bodies.read import BODY_READS
from tipdamp.bodies.stiffness import Moduli
from tipdamp.checks import only_friction
from tipdamp.checks.pairs import jamming
from tipdamp.checks.slide_at_rest import balance_at_rest, slide_warnings
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.fields.line_contact import LineContact, hole_warnings, narrow_lines
from tipdamp.fields.visualization import keep_preload
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.contact_doubts import closure_doubts, tangential_doubts, uneven_doubts
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.spring import spring_forces
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import (
    FreeMotion,
    LoadCasePreload,
    PreloadResult,
    ReduceResult,
    SideForces,
    SideLoad,
    SideStiffness,
)
from tipdamp.stages import fitted_stiffness
from tipdamp.stages.fitted_stiffness import fit_factor
from tipdamp.stages.stage import Stage, recorded
from tipdamp.static_contact.contact.contact_forces import Preload
from tipdamp.static_contact.contact.frictional_preload import FrictionState
from tipdamp.static_contact.contact.slide_at_rest import SlideAtRest
from tipdamp.statics import cases as statics
from tipdamp.statics import friction_history, whole_body
from tipdamp.statics.at_rest import ContactAtRest, DamperAtRest, Friction, damper_at_rest
from tipdamp.statics.model_inputs import preload_map
from tipdamp.study.view import Study


@dataclass(frozen=True)
class WholePatch:
    """The whole patch: made {side: what its stiffness was made from}; doubts - warnings of a
    fit."""

    contact: ContactAtRest
    made: dict[str, SideStiffness]
    doubts: list[str]

    def lines(self, pulled: ContactTable) -> list[LineContact]:
        """The cylinders that touch along a line under the preload of these pairs."""
        damper = self.contact.damper
        E_star = {n: one.E_star_Pa for n, one in self.made.items()}
        return narrow_lines(pulled, damper.axis, damper.radius, E_star)


@dataclass(frozen=True)
class PatchAtRest:
    """State of the whole patch at rest: the static solution, with or without friction, with the
    gaps of the position reached; forces {side: N} that balance the load; facts - of
    PreloadResult."""

    solution: Preload | FrictionState
    forces: dict[str, float]
    balance: float | None
    facts: dict[str, Any]


def preload(study: Study, store: Store, tick: Tick) -> list[str]:
    """Unilateral static contact of the whole patch under the pull, or the case in its place: the
    preload map."""
    model = ReducedModel.load(store.path("model.npz"))
    reduced = ReduceResult.load(store)
    damper = damper_at_rest(study, model, reduced.reduction)
    pairs, made, doubts = _with_stiffness(study, store, model, damper, reduced.side_materials)
    tick(0.2, f"{len(pairs)} pairs on {damper.bodies.model.size} dofs")
    patch = WholePatch(ContactAtRest(damper, pairs), made, doubts)
    found = _solved(store, patch.contact)
    cases = _load_cases(store, patch.contact)
    _result(patch, found, cases).save(store)
    files = ["preload_friction.csv"] if damper.friction else []
    files += [case.file for case in cases.values()]
    if study.preload.stress:
        files += _stress(store, patch.contact, found.solution, tick)
    return [*files, *_drawn(store, patch, cases)]


def _with_stiffness(
    study: Study,
    store: Store,
    model: ReducedModel,
    damper: DamperAtRest,
    materials: dict[str, Moduli],
) -> tuple[ContactTable, dict[str, SideStiffness], list[str]]:
    """The pairs with kn, kt, mu and gap, what the stiffness of each side was made from, and
    warnings of a fit."""
    pairs = ContactTable.load(store.path("pairs.csv"))
    balance = damper.loads.balance
    fitted = 1.0
    doubts: list[str] = []

    def scaled(factor: float) -> ContactTable:
        return stiffness.with_values(study, pairs, materials, balance, factor)

    if study.contact.fit_hz is not None:
        fitted, doubts = fit_factor(study, model, damper, scaled)
    sides = stiffness.side_stiffness(study, pairs, materials, balance, fitted)
    made = stiffness.facts(study, pairs, sides, materials, fitted)
    found = stiffness.with_sides(study, pairs, sides)
    check_gaps(study, found, model.position[(model.body == DAMPER) & model.moves])
    return found, made, doubts


def _solved(store: Store, contact: ContactAtRest) -> PatchAtRest:
    """The patch under the load at rest; writes preload.csv."""
    friction = contact.damper.friction
    found = _with_friction(store, contact, friction) if friction else _frictionless(contact)
    with store.writing("preload.csv") as path:
        preload_map(found.solution, contact.pairs).save(path)
    return found


def _result(
    patch: WholePatch, rest: PatchAtRest, cases: dict[str, LoadCasePreload]
) -> PreloadResult:
    contact = patch.contact
    found = rest.solution
    pairs = contact.pairs
    pulled = preload_map(found, contact.pairs)
    slides = contact.rounds.slides(found.displacement, found.force)
    reactions = {
        "the pull": rest.facts.get("reactions", {}),
        **{f"[loads.{name}]": case.reactions for name, case in cases.items()},
    }
    return PreloadResult(
        sides=side_forces(found.pairs, rest.forces, rest.balance),
        slide_m={name: one.slide for name, one in slides.items()},
        gap_at_rest_m=tuple(found.pairs.gap.tolist()) if contact.rounds.names else (),
        residual=found.residual,
        iterations=found.iterations,
        **rest.facts,
        stiffness=patch.made,
        cases=cases,
        warnings=(*_warnings(patch, pulled, slides), *reaction_warnings(reactions)),
        kn_kt_N_per_m={
            s: (pairs.kn[pairs.side == s].mean(), pairs.kt[pairs.side == s].mean())
            for s in pairs.sides
        },
    )


def _warnings(
    patch: WholePatch, pulled: ContactTable, slides: Mapping[str, SlideAtRest]
) -> Iterator[str]:
    """Of the fit, what holds the damper, the springs, and where and how the sides touch."""
    contact = patch.contact
    yield from patch.doubts
    yield from (one.doubt for one in contact.frictionless.held if one.doubt)
    if not contact.damper.hard:
        yield from _closure(pulled, patch.made)
    yield from _slides(contact.damper, pulled, slides)
    yield from hole_warnings(patch.lines(pulled), pulled.preload)
    yield from jamming(contact.pairs, contact.damper.loads.direction)


def _drawn(store: Store, patch: WholePatch, cases: Mapping[str, LoadCasePreload]) -> list[str]:
    """preload.vtu of the pull and the load cases."""
    files = {"pull": "preload.csv", **{name: case.file for name, case in cases.items()}}
    tables = {name: ContactTable.load(store.path(file)) for name, file in files.items()}
    return keep_preload(store, tables, patch.contact.damper.hard, patch.lines(tables["pull"]))


def _frictionless(contact: ContactAtRest) -> PatchAtRest:
    damper = contact.damper
    result = contact.solve(damper.loads.at_rest)
    names = only_friction.directed(contact.frictionless.motions)
    motions = [
        FreeMotion(name=name, unit=m.unit, load=m.load)
        for name, m in zip(names, result.motions, strict=True)
    ]
    return PatchAtRest(
        result,
        damper.loads.balance.equilibrium(result.pairs.replace(gap=contact.pairs.gap)),
        result.balance,
        {
            "method": result.method,
            "free_motions": motions,
            "reactions": result.reactions,
            "held": result.held,
        },
    )


def _with_friction(store: Store, contact: ContactAtRest, friction: Friction) -> PatchAtRest:
    """The state at the end of the history; writes preload_friction.csv."""
    damper = contact.damper
    pairs = contact.pairs
    state = friction_history.solve(contact, friction, damper.loads.history)
    with store.writing("preload_friction.csv") as path:
        friction_history.save(path, pairs, state.tangential, state.slider, state.slips)
    unmoved = state.pairs.replace(gap=pairs.gap)
    return PatchAtRest(
        state,
        side_sums(state.pairs),
        damper.loads.balance.error(state.pairs, state.tangential),
        {
            "method": "friction",
            "friction": friction_history.figures(state, damper.loads.balance.equilibrium(unmoved)),
            "held": spring_forces(contact.frictionless.held, state.displacement),
        },
    )


def _load_cases(store: Store, contact: ContactAtRest) -> dict[str, LoadCasePreload]:
    """{load case: its preload}; writes loads/NAME.csv of each."""
    found = {}
    for name, load in contact.damper.loads.cases.items():
        try:
            result, balance, reactions = _in_case(contact, load)
        except InputError as error:
            raise InputError(f"[loads.{name}]: {error}") from None
        file = f"loads/{name}.csv"
        with store.writing(file) as path:
            preload_map(result, contact.pairs).save(path)
        found[name] = LoadCasePreload(
            file=file,
            sides=_side_loads(contact.pairs, result.force),
            residual=result.residual,
            balance_error=balance,
            reactions=reactions,
            held=spring_forces(contact.frictionless.held, result.displacement),
        )
    return found


def _side_loads(pairs: ContactTable, force: np.ndarray) -> dict[str, SideLoad]:
    """{side: figures of the forces (P,) N of its pairs}"""
    return {
        s: SideLoad(
            sum_N=force[pairs.side == s].sum(),
            max_N=force[pairs.side == s].max(),
            detached=(force[(pairs.side == s) & pairs.carrying] <= 0).sum(),
        )
        for s in pairs.sides
    }


def _in_case(
    contact: ContactAtRest, load: np.ndarray
) -> tuple[Preload | FrictionState, float | None, dict[str, float]]:
    """The state under a load (r,) N, what of the load is not balanced, and constraint reactions."""
    damper = contact.damper
    if damper.friction is None:
        result = contact.solve(load)
        return result, result.balance, result.reactions
    state = friction_history.solve(contact, damper.friction, [("the load", load)])
    balance = replace(damper.loads.balance, force=resultant(damper.bodies.model, load))
    return state, balance.error(state.pairs, state.tangential), {}


def _stress(
    store: Store, contact: ContactAtRest, found: Preload | FrictionState, tick: Tick
) -> list[str]:
    """stress_*.vtu of the whole bodies."""
    none = np.zeros((len(contact.pairs), 2))
    tangential = found.tangential if isinstance(found, FrictionState) else none
    force = np.column_stack([tangential, found.force])
    damper = contact.damper
    rest = whole_body.Rest(damper.loads.rest, found.displacement, contact.pairs, force)
    return whole_body.keep_stress(store, damper.bodies.shapes(rest), rest.load, tick)


def _closure(pulled: ContactTable, made: Mapping[str, SideStiffness]) -> list[str]:
    """Warnings of springs that are far too soft for the preload, or for one another."""
    smooth = {
        name: one.nodes * way.kn_N_per_m
        for name, one in made.items()
        for way in one.ways
        if way.way == "smooth half-spaces"
    }
    doubts = [*tangential_doubts(pulled), *uneven_doubts(pulled)]
    return [*closure_doubts(pulled, smooth), *doubts]


def _slides(
    damper: DamperAtRest, pulled: ContactTable, slides: Mapping[str, SlideAtRest]
) -> Iterator[str]:
    """Warnings of round sides; with friction their sums do not follow from normals alone."""
    if not slides or damper.friction:
        return slide_warnings(slides, {}, {})
    wanted = balance_at_rest(pulled, slides, damper.loads.balance)
    return slide_warnings(slides, side_sums(pulled), wanted)


def reaction_warnings(cases: dict[str, dict[str, float]]) -> list[str]:
    """Sentences about constraint reactions; cases - {load: {motion: amount in N, of rolls in N
    m}}."""
    return [
        f"{load} has a component of {abs(amount):.2g} "
        f"{'N m' if motion.startswith('roll') else 'N'} along the {motion}, which no contact "
        "resists (inexact coordinates): a constraint reaction balances it"
        for load, reactions in cases.items()
        for motion, amount in reactions.items()
    ]


def side_forces(
    pairs: ContactTable, forces: dict[str, float], balance: float | None
) -> dict[str, SideForces]:
    """{side: figures of its preload} beside the forces {side: N} of equilibrium."""
    figures = {}
    for side in pairs.sides:
        p = pairs.preload[(pairs.side == side) & pairs.carrying]
        closed = p[p > 0]
        figures[side] = SideForces(
            sum_N=closed.sum(),
            min_N=closed.min() if len(closed) else 0.0,
            max_N=closed.max(initial=0.0),
            detached=(p <= 0).sum(),
            equilibrium_N=forces[side],
            balance_error=balance,
        )
    return figures


def line(store: Store) -> str:
    """Sum and range of the preload of the closed pairs of each side, and what nothing but friction
    holds."""
    found = PreloadResult.load(store)
    sides = "; ".join(
        f"{side}: {s.sum_N:z.2f} N, {s.min_N:z.2f}..{s.max_N:z.2f} N, {s.detached} open"
        for side, s in found.sides.items()
    )
    return "; ".join(
        filter(None, (sides, only_friction.said(one.name for one in found.free_motions)))
    )


def _reads_more(study: Study) -> tuple[str, ...]:
    return (
        BODY_READS * study.preload.stress
        + statics.reads(study)
        + friction_history.READS * study.preload.friction
        + fitted_stiffness.READS * (study.contact.fit_hz is not None)
    )


STAGE = Stage(
    preload,
    line,
    warnings=recorded(PreloadResult),
    outputs=("preload.csv", "preload.json"),
    may_write=("preload_friction.csv", "loads/*.csv", "stress_*.vtu", "preload.vtu"),
    needs=("reduce",),
    reads=("length_unit", "driver", "contact", "sides", "preload", "loads", "model.matrices"),
    reads_more=_reads_more,
    reads_files=statics.READS_FILES,
)
