"""Stage preload: static contact of the whole patch under the pull and in further load cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tipdamp.bodies import DAMPER, loads, stiffness
from tipdamp.bodies.gaps import check_gaps
from tipdamp.bodies.pieces import check_loaded
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
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.contact.slide_at_rest import SlideAtRest
from tipdamp.statics import cases as statics
from tipdamp.statics import friction_history, whole_body
from tipdamp.statics.model_inputs import (
    balance_error,
    equilibrium,
    preload_map,
    round_sides,
    side_sums,
)
from tipdamp.study.view import Study


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
    bodies = statics.static_bodies(study, model, reduced.reduction)
    check_loaded(study, bodies.model)
    pairs, made, said = _with_stiffness(study, store, model, bodies, reduced.side_materials)
    tick(0.2, f"{len(pairs)} pairs on {bodies.model.size} dofs")
    contact = statics.static_contact(study, bodies, pairs)
    rest = (
        _with_friction(study, store, bodies, contact, pairs)
        if study.preload.friction
        else _frictionless(study, contact)
    )
    found = rest.solution
    pulled = preload_map(found, pairs)
    with store.writing("preload.csv") as path:
        pulled.save(path)
    cases = {name: load_case(study, store, bodies, contact, pairs, name) for name in study.loads}
    doubts = [one.doubt for one in contact.held if one.doubt]
    rounds = round_sides(study, bodies.model, pairs)
    slides = rounds.slides(found.displacement, found.force)
    reactions = {
        "the pull": rest.facts.get("reactions", {}),
        **{f"[loads.{name}]": case.reactions for name, case in cases.items()},
    }
    PreloadResult(
        sides=side_forces(found.pairs, rest.forces, rest.balance),
        slide_m={name: one.slide for name, one in slides.items()},
        gap_at_rest_m=tuple(found.pairs.gap.tolist()) if rounds.names else (),
        residual=found.residual,
        iterations=found.iterations,
        **rest.facts,
        stiffness=made,
        cases=cases,
        warnings=(
            *said,
            *doubts,
            *_closure(study, pulled, made),
            *_slides(study, bodies, pulled, slides),
            *hole_warnings(_lines(study, pulled, made), pulled.preload),
            *jamming(pairs, np.array(study.driver.pull_direction)),
            *reaction_warnings(reactions),
        ),
        kn_kt_N_per_m={
            s: (pairs.kn[pairs.side == s].mean(), pairs.kt[pairs.side == s].mean())
            for s in pairs.sides
        },
    ).save(store)
    files = ["preload_friction.csv"] if study.preload.friction else []
    files += [case.file for case in cases.values()]
    if study.preload.stress:
        files += _stress(study, store, bodies, pairs, found, tick)
    tables = {name: ContactTable.load(store.path(case.file)) for name, case in cases.items()}
    return [*files, *_drawn(study, store, {"pull": pulled, **tables}, made)]


def _stress(
    study: Study,
    store: Store,
    bodies: statics.StaticBodies,
    pairs: ContactTable,
    found: Preload | FrictionState,
    tick: Tick,
) -> list[str]:
    none = np.zeros((len(pairs), 2))
    tangential = found.tangential if isinstance(found, FrictionState) else none
    force = np.column_stack([tangential, found.force])
    shapes = bodies.shapes(whole_body.Rest(found.displacement, pairs, force))
    return whole_body.keep_stress(study, store, shapes, tick)


def _lines(
    study: Study, pulled: ContactTable, made: Mapping[str, SideStiffness]
) -> list[LineContact]:
    E_star = {name: one.E_star_Pa for name, one in made.items()}
    return narrow_lines(pulled, np.array(study.driver.axis), stiffness.radii(study), E_star)


def _drawn(
    study: Study,
    store: Store,
    tables: dict[str, ContactTable],
    made: Mapping[str, SideStiffness],
) -> list[str]:
    """preload.vtu of {load case: table}, the pull first."""
    lines = _lines(study, tables["pull"], made)
    return keep_preload(store, tables, study.contact.normal == "hard", lines)


def _with_stiffness(
    study: Study,
    store: Store,
    model: ReducedModel,
    bodies: statics.StaticBodies,
    materials: dict[str, Moduli],
) -> tuple[ContactTable, dict[str, SideStiffness], list[str]]:
    """The pairs with kn, kt, mu and gap, what the stiffness of each side was made from, and
    warnings of a fit."""
    pairs = ContactTable.load(store.path("pairs.csv"))
    pull = loads.force_at_rest(study, model)
    fitted = 1.0
    said: list[str] = []
    if study.contact.fit_hz is not None:
        fitted, said = fit_factor(
            study, model, bodies, lambda f: stiffness.with_values(study, pairs, materials, pull, f)
        )
    sides = stiffness.side_stiffness(study, pairs, materials, pull, fitted)
    made = stiffness.facts(study, pairs, sides, materials, fitted)
    pairs = stiffness.with_values(study, pairs, materials, pull, fitted)
    check_gaps(study, pairs, model.position[(model.body == DAMPER) & model.moves])
    return pairs, made, said


def _closure(study: Study, pulled: ContactTable, made: Mapping[str, SideStiffness]) -> list[str]:
    """Warnings of springs that are far too soft for the preload, or for one another."""
    if study.contact.normal == "hard":
        return []
    doubts = [*tangential_doubts(pulled), *uneven_doubts(pulled)]
    smooth = {
        name: one.nodes * way.kn_N_per_m
        for name, one in made.items()
        for way in one.ways
        if way.way == "smooth half-spaces"
    }
    return [*closure_doubts(pulled, smooth), *doubts]


def _slides(
    study: Study,
    bodies: statics.StaticBodies,
    pulled: ContactTable,
    slides: Mapping[str, SlideAtRest],
) -> Iterator[str]:
    """Warnings of round sides; with friction their sums do not follow from normals alone."""
    sums, wanted = {}, {}
    if slides and not study.preload.friction:
        load, held = loads.force_at_rest(study, bodies.model), loads.held_directions(study, pulled)
        sums, wanted = side_sums(pulled), balance_at_rest(pulled, slides, load, held)
    return slide_warnings(slides, sums, wanted)


def _frictionless(study: Study, contact: StaticContact) -> PatchAtRest:
    result = statics.solve_at_rest(study, contact, loads.at_rest(study, contact.model))
    motions = [
        FreeMotion(name=name, unit=m.unit, load=m.load)
        for name, m in zip(only_friction.directed(contact.motions), result.motions, strict=True)
    ]
    return PatchAtRest(
        result,
        equilibrium(study, contact.model, result.pairs.replace(gap=contact.pairs.gap)),
        result.balance,
        {
            "method": result.method,
            "free_motions": motions,
            "reactions": result.reactions,
            "held": result.held,
        },
    )


def _with_friction(
    study: Study,
    store: Store,
    bodies: statics.StaticBodies,
    contact: StaticContact,
    pairs: ContactTable,
) -> PatchAtRest:
    """The state at the end of the history; writes preload_friction.csv."""
    state = friction_history.solve(
        study, bodies, contact.pairs, friction_history.history(study, bodies.model)
    )
    with store.writing("preload_friction.csv") as path:
        friction_history.save(path, pairs, state.tangential, state.slider, state.slips)
    balance = balance_error(
        study, state.pairs, loads.force_at_rest(study, bodies.model), state.tangential
    )
    unmoved = state.pairs.replace(gap=pairs.gap)
    facts = friction_history.facts(state, equilibrium(study, bodies.model, unmoved))
    return PatchAtRest(
        state,
        side_sums(state.pairs),
        balance,
        {
            "method": "friction",
            "friction": facts,
            "held": spring_forces(contact.held, state.displacement),
        },
    )


def load_case(
    study: Study,
    store: Store,
    bodies: statics.StaticBodies,
    contact: StaticContact,
    pairs: ContactTable,
    name: str,
) -> LoadCasePreload:
    """Preload map of one further load case, in a file of its own."""
    load = loads.total(study, name, bodies.model)
    result: Preload | FrictionState
    balance: float | None
    reactions: dict[str, float] = {}
    try:
        if study.preload.friction:
            result = friction_history.solve(study, bodies, contact.pairs, [load])
            resultant = loads.resultant(bodies.model, load)
            balance = balance_error(study, result.pairs, resultant, result.tangential)
        else:
            result = statics.solve_at_rest(study, contact, load)
            balance, reactions = result.balance, result.reactions
    except InputError as error:
        raise InputError(f"{study.path}: [loads.{name}]: {error}") from None
    file = f"loads/{name}.csv"
    with store.writing(file) as path:
        preload_map(result, pairs).save(path)
    sides = {
        s: SideLoad(
            sum_N=result.force[pairs.side == s].sum(),
            max_N=result.force[pairs.side == s].max(),
            detached=(result.force[(pairs.side == s) & pairs.carrying] <= 0).sum(),
        )
        for s in pairs.sides
    }
    return LoadCasePreload(
        file=file,
        sides=sides,
        residual=result.residual,
        balance_error=balance,
        reactions=reactions,
        held=spring_forces(contact.held, result.displacement),
    )


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
