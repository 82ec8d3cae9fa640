"""The preload of the kept pairs, and what they carry in further load cases."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tipdamp.bodies import loads
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.hold.rigid_motion import parse_motion
from tipdamp.hbm.model import ReducedModel
from tipdamp.results import static_results as results
from tipdamp.static_contact.contact.equilibrium import beside
from tipdamp.static_contact.contact.preload import StaticContact
from tipdamp.static_contact.tuning.redistribution import (
    MOMENT,
    Redistribution,
    balancing_forces,
    contact_length,
    redistribute,
    redistribute_friction,
)
from tipdamp.statics import friction_history
from tipdamp.statics import model_inputs as inputs
from tipdamp.statics.cases import StaticBodies, solve_at_rest, static_bodies, static_contact
from tipdamp.study.view import Study

UNBALANCED = 0.1  # of the load: preload that was measured is hardly known better


@dataclass(frozen=True)
class KeptPreload:
    """pairs - the full table, weight 0 on detached pairs, with the preload of the kept ones; facts
    - how it came there forces {side: N} of equilibrium; balance - unbalanced part; tangential (P,
    2) N with friction, else None."""

    pairs: ContactTable
    facts: results.RedistributionFacts
    forces: dict[str, float]
    balance: float | None
    tangential: np.ndarray | None = None


@dataclass(frozen=True)
class KeptContact:
    """The static problem of the kept pairs (those of `pairs` that carry), set up where it is asked
    for and once."""

    study: Study
    model: ReducedModel
    reduction: results.ReductionFacts
    pairs: ContactTable

    @cached_property
    def bodies(self) -> StaticBodies:
        """What it is solved on."""
        return static_bodies(self.study, self.model, self.reduction)

    @cached_property
    def statics(self) -> StaticContact:
        """The problem without friction."""
        return static_contact(self.study, self.bodies, self.pairs)


def kept_preload(
    study: Study, store: Store, whole: ContactTable, contact: KeptContact
) -> KeptPreload:
    """The preload of the kept pairs, by the way that the study asks for; 0 N on the others, so that
    the column sums to what the sides carry wherever it is read."""
    model = contact.model
    line = contact.pairs.replace(
        preload=np.where(contact.pairs.carrying, contact.pairs.preload, 0.0)
    )
    tangential = (
        friction_history.load(store.path("preload_friction.csv"), whole)
        if study.preload.friction
        else None
    )
    if study.tune.preload == "table":
        return _of_table(study, model, whole, line)
    kept = (
        _resolved(study, contact, whole)
        if study.tune.preload == "resolved"
        else _scaled(study, model, whole, line, tangential)
    )
    share = _moment_share(study, model, whole, kept.facts)
    _check_moment(study, kept.facts, share)
    facts = kept.facts.model_copy(update={"moment_share": share})
    if facts.scale and share > MOMENT.compared:
        facts = facts.model_copy(update={"resolved": _solved_again(study, contact, whole)})
    return replace(kept, facts=facts)


def moment_within(
    study: Study, store: Store, model: ReducedModel, whole: ContactTable, kept: ContactTable
) -> bool:
    """Whether the preload of such kept pairs (those that carry) leaves no more than a small
    moment."""
    if study.tune.preload != "scaled":
        return True
    tangential = (
        friction_history.load(store.path("preload_friction.csv"), whole)
        if study.preload.friction
        else None
    )
    try:
        facts = _scaled(study, model, whole, kept, tangential).facts
    except InputError:
        return False
    return _moment_share(study, model, whole, facts) <= MOMENT.refused


def _moment_share(
    study: Study, model: ReducedModel, whole: ContactTable, facts: results.RedistributionFacts
) -> float:
    """Of the load at rest times the length of the contact: the moment left, beside what the study
    holds."""
    rolls = np.array([value for name, value in facts.reactions.items() if name.startswith("roll")])
    moment = np.array(facts.moments_Nm) if facts.moments_Nm is not None else np.append(rolls, 0.0)
    if len(moment) == 3 and facts.moments_Nm is not None:
        held = np.array([parse_motion(one.motion)[2][3:] for one in study.driver.hold]).reshape(
            -1, 3
        )
        moment = beside(held[held.any(axis=1)], moment)
    load = np.linalg.norm(loads.force_at_rest(study, model))
    length = contact_length(whole, study.driver.axis)
    # one station has no length that a moment could be compared with
    return float(np.linalg.norm(moment) / (load * length)) if length else 0.0


def _check_moment(study: Study, facts: results.RedistributionFacts, share: float) -> None:
    """InputError where what is kept leaves more than a small moment: the damper would stand
    otherwise."""
    if share <= MOMENT.refused:
        return
    amount = {
        name: value for name, value in facts.reactions.items() if name.startswith("roll")
    } or {f"about {way}": value for way, value in zip("xyz", facts.moments_Nm or (), strict=False)}
    said = ", ".join(f"{value:.3g} N m {name}" for name, value in amount.items())
    rows = 'rows = "all" in the [contact.NAME] that keeps its edge alone, ' * any(
        side.rows == "edge" for side in study.sides.values()
    )
    even = "like parts on both sides of the middle (stations = [n, n]), " * (
        study.tune.by == "station"
    )
    other = ' or preload = "resolved"' * bool(facts.scale)
    raise InputError(
        f"{study.path}: [tune] what is kept of the contact leaves a moment of {said}: "
        f"{share:.1%} of the load at rest times the length of the contact, allowed "
        f"are {MOMENT.refused:.0%}; keep {rows}{even}more of it{other}"
    )


def _solved_again(study: Study, contact: KeptContact, whole: ContactTable) -> results.KeptCase:
    """Static contact solved again on what is kept, to stand beside the scaled map."""
    try:
        found = _resolved(study, contact, whole)
    except InputError as error:
        return results.KeptCase(refused=str(error))
    kept = found.pairs.select(found.pairs.carrying)
    return results.KeptCase(
        sides=side_loads(kept, kept.preload),
        reactions=found.facts.reactions,
        residual=found.facts.residual,
    )


def side_loads(pairs: ContactTable, force: np.ndarray) -> dict[str, results.SideLoad]:
    """{side: sum and largest of the forces (P,) N of the pairs that carry, and how many are
    open}"""
    of_side = {s: force[(pairs.side == s) & pairs.carrying] for s in pairs.sides}
    return {
        s: results.SideLoad(
            sum_N=np.maximum(f, 0).sum(), max_N=f.max(initial=0.0), detached=(f <= 0).sum()
        )
        for s, f in of_side.items()
    }


def _of_table(
    study: Study, model: ReducedModel, whole: ContactTable, line: ContactTable
) -> KeptPreload:
    """As the user's own table states it, balanced or not."""
    if study.preload.friction:
        raise InputError(
            "[tune] preload = 'table': the table has no friction forces, and [preload] friction "
            "= true; set [tune] preload = 'scaled' or 'resolved'"
        )
    kept, load = line.select(line.carrying), loads.force_at_rest(study, model)
    _check_held(study, kept, load)
    return KeptPreload(
        line,
        results.RedistributionFacts(),
        inputs.equilibrium(study, model, whole),
        inputs.balance_error(study, kept, load),
    )


def _check_held(study: Study, kept: ContactTable, load: np.ndarray) -> None:
    """InputError where no friction within its limit balances the preload of a table and the
    load."""
    loose, held = inputs.imbalance(study, kept, load)
    if loose > held + UNBALANCED * np.linalg.norm(load):
        raise InputError(
            f"{study.file(study.tune.kept)}: preload: its forces leave {loose:.4g} N beside the "
            f"load of {np.linalg.norm(load):.4g} N on the damper, friction can hold {held:.4g} N: "
            "scale it to the load, or leave it to [tune] preload = 'scaled' or 'resolved'"
        )


def _resolved(study: Study, contact: KeptContact, whole: ContactTable) -> KeptPreload:
    """Static contact solved again on the kept pairs alone."""
    bodies, line = contact.bodies, contact.pairs
    if not study.preload.friction:
        load = loads.at_rest(study, bodies.model)
        result = solve_at_rest(study, contact.statics, load, constrain=True)
        facts = results.RedistributionFacts(reactions=result.reactions, residual=result.residual)
        forces = inputs.equilibrium(study, bodies.model, whole)
        return KeptPreload(inputs.preload_map(result, line), facts, forces, result.balance)
    state = friction_history.solve(
        study, bodies, contact.statics.pairs, friction_history.history(study, bodies.model)
    )
    kept = inputs.preload_map(state, line)
    facts = results.RedistributionFacts(
        friction=friction_history.facts(state), residual=state.residual
    )
    balance = inputs.balance_error(
        study,
        kept.select(kept.carrying),
        loads.force_at_rest(study, bodies.model),
        state.tangential[kept.carrying],
    )
    return KeptPreload(kept, facts, inputs.side_sums(state.pairs), balance, state.tangential)


def _scaled(
    study: Study,
    model: ReducedModel,
    whole: ContactTable,
    line: ContactTable,
    tangential: np.ndarray | None,
) -> KeptPreload:
    """The whole map's part on the kept stations, scaled to the side forces of equilibrium."""
    carrying = np.flatnonzero(line.carrying)
    load = loads.force_at_rest(study, model)
    axis = np.array(study.driver.axis)
    kept = line.select(carrying)
    if tangential is None:
        forces = inputs.equilibrium(study, model, whole)
    else:
        forces = balancing_forces(whole, kept, tangential, load, axis)
    done = redistribute(whole, kept, forces)
    preload = line.preload.copy()
    preload[carrying] = done.pairs.preload
    if tangential is None:
        return KeptPreload(
            line.replace(preload=preload),
            _scaled_facts(done, done.moment, axis),
            forces,
            inputs.balance_error(study, done.pairs, load),
        )
    moved = np.zeros_like(tangential)
    moved[carrying] = redistribute_friction(whole, tangential, done)
    facts = _scaled_facts(done, done.with_friction(whole, tangential, moved[carrying]), axis)
    return KeptPreload(
        line.replace(preload=preload),
        facts,
        forces,
        inputs.balance_error(study, done.pairs, load, moved[carrying]),
        moved,
    )


def _scaled_facts(
    done: Redistribution, moment: np.ndarray, axis: np.ndarray
) -> results.RedistributionFacts:
    return results.RedistributionFacts(
        scale=done.scale, moment_Nm=float(moment @ axis), moments_Nm=tuple(moment)
    )


def kept_case(study: Study, contact: KeptContact, name: str) -> results.KeptCase:
    """What the kept pairs carry in a further load case, without friction and solved on them
    alone."""
    try:
        load = loads.total(study, name, contact.bodies.model)
        result = solve_at_rest(study, contact.statics, load, constrain=True)
    except InputError as error:
        return results.KeptCase(refused=str(error))
    return results.KeptCase(
        sides=side_loads(contact.pairs, result.force),
        reactions={**result.reactions, **result.held},
        residual=result.residual,
    )
