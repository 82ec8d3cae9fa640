"""The preload of the kept pairs, and what they carry in further load cases."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from static_contact.preload import StaticContact
from static_contact.redistribution import balancing_forces, redistribute, redistribute_friction
from tipdamp import friction, loads
from tipdamp.stages import model_inputs as inputs
from tipdamp.stages import results
from tipdamp.statics import StaticBodies, static_bodies, static_contact
from tipdamp.store import Store
from tipdamp.study.view import Study

UNBALANCED = 0.1        # of the load: preload that was measured is hardly known better


@dataclass(frozen=True)
class KeptPreload:
    """pairs - the full table, weight 0 on detached pairs, with the preload of the kept ones; facts - how it came there
    forces {side: N} of equilibrium; balance - unbalanced part; tangential (P, 2) N with friction, else None."""

    pairs: ContactTable
    facts: results.Redistribution
    forces: dict[str, float]
    balance: float
    tangential: np.ndarray | None = None


@dataclass(frozen=True)
class KeptContact:
    """The static problem of the kept pairs (those of `pairs` that carry), set up where it is asked for and once."""

    study: Study
    model: ReducedModel
    reduction: results.Reduction
    pairs: ContactTable

    @cached_property
    def bodies(self) -> StaticBodies:
        """What it is solved on."""
        return static_bodies(self.study, self.model, self.reduction)

    @cached_property
    def statics(self) -> StaticContact:
        """The problem without friction."""
        return static_contact(self.study, self.bodies, self.pairs)


def kept_preload(study: Study, store: Store, whole: ContactTable, contact: KeptContact) -> KeptPreload:
    """The preload of the kept pairs, by the way that the study asks for; 0 N on the others, so that the column sums to
    what the sides carry wherever it is read."""
    model = contact.model
    line = contact.pairs.replace(preload=np.where(contact.pairs.carrying, contact.pairs.preload, 0.0))
    tangential = friction.load(store.path("preload_friction.csv"), whole) if study.preload.friction else None
    if study.tune.preload == "table":
        return _of_table(study, model, whole, line)
    if study.tune.preload == "resolved":
        return _resolved(study, contact, whole)
    return _scaled(study, model, whole, line, tangential)


def _of_table(study, model, whole, line):
    """As the user's own table states it, balanced or not."""
    if study.preload.friction:
        raise InputError("[tune] preload = 'table': the table has no friction forces, and [preload] friction = true; "
                         "set [tune] preload = 'scaled' or 'resolved'")
    kept, load = line.select(line.carrying), loads.force_at_rest(study, model)
    _check_held(study, kept, load)
    return KeptPreload(line, results.Redistribution(), inputs.equilibrium(study, model, whole),
                       inputs.balance_error(study, kept, load))


def _check_held(study, kept, load):
    """InputError where no friction within its limit balances the preload of a table and the load."""
    loose, held = inputs.imbalance(study, kept, load)
    if loose > held + UNBALANCED * np.linalg.norm(load):
        raise InputError(f"{study.file(study.tune.kept)}: preload: its forces leave {loose:.4g} N beside the load of "
                         f"{np.linalg.norm(load):.4g} N on the damper, friction can hold {held:.4g} N: scale it to the "
                         "load, or leave it to [tune] preload = 'scaled' or 'resolved'")


def _resolved(study, contact, whole):
    """Static contact solved again on the kept pairs alone."""
    bodies, line = contact.bodies, contact.pairs
    if not study.preload.friction:
        result = contact.statics.solve(loads.at_rest(study, bodies.model), constrain=True)
        facts = results.Redistribution(reactions=result.reactions, residual=result.residual)
        forces = inputs.equilibrium(study, bodies.model, whole)
        return KeptPreload(inputs.preload_map(result, line), facts, forces, result.balance)
    state = friction.solve(study, bodies, contact.statics.pairs, friction.history(study, bodies.model))
    kept = inputs.preload_map(state, line)
    facts = results.Redistribution(friction=friction.facts(state), residual=state.residual)
    balance = inputs.balance_error(study, kept.select(kept.carrying), loads.force_at_rest(study, bodies.model),
                                   state.tangential[kept.carrying])
    return KeptPreload(kept, facts, inputs.side_sums(state.pairs), balance, state.tangential)


def _scaled(study, model, whole, line, tangential):
    """The whole map's part on the kept stations, scaled to the side forces of equilibrium."""
    carrying, load, axis = np.flatnonzero(line.carrying), loads.force_at_rest(study, model), study.driver.axis
    kept = line.select(carrying)
    if tangential is None:
        forces = inputs.equilibrium(study, model, whole)
    else:
        forces = balancing_forces(whole, kept, tangential, load, axis)
    done = redistribute(whole, kept, forces)
    preload = line.preload.copy()
    preload[carrying] = done.pairs.preload
    facts = results.Redistribution(scale=done.scale, moment_Nm=float(done.moment @ axis), moments_Nm=done.moment)
    if tangential is None:
        return KeptPreload(line.replace(preload=preload), facts, forces, inputs.balance_error(study, done.pairs, load))
    moved = np.zeros_like(tangential)
    moved[carrying] = redistribute_friction(whole, tangential, done)
    return KeptPreload(line.replace(preload=preload), facts, forces,
                       inputs.balance_error(study, done.pairs, load, moved[carrying]), moved)


def kept_case(study: Study, contact: KeptContact, name: str) -> results.KeptCase:
    """What the kept pairs carry in a further load case, without friction and solved on them alone."""
    try:
        load = loads.total(study, name, contact.bodies.model)
        result = contact.statics.solve(load, constrain=True)
    except InputError as error:
        return results.KeptCase(refused=str(error))
    pairs = contact.pairs
    forces = {s: result.force[(pairs.side == s) & pairs.carrying] for s in pairs.sides}
    sides = {s: results.SideLoad(sum_N=f.sum(), max_N=f.max(initial=0.0), detached=(f <= 0).sum())
             for s, f in forces.items()}
    return results.KeptCase(sides=sides, reactions={**result.reactions, **result.held}, residual=result.residual)
