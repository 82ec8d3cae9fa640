"""The preload of the kept pairs, and what they carry in further load cases."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tipdamp.bodies.balance import Balance, side_sums
from tipdamp.bodies.loads import on_model
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.model import ReducedModel
from tipdamp.results import static_results as results
from tipdamp.static_contact.contact.equilibrium import beside
from tipdamp.static_contact.tuning.redistribution import (
    MOMENT,
    balancing_forces,
    contact_length,
    redistribute,
    redistribute_friction,
)
from tipdamp.statics import friction_history
from tipdamp.statics.at_rest import ContactAtRest, damper_at_rest
from tipdamp.statics.model_inputs import preload_map
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
class WholeAtRest:
    """The whole patch as the stage preload left it, on the reduced model.

    pairs - with their preload; tangential (P, 2) N with friction, else None; balance - of the
    damper; axis (3,) - of the damper."""

    pairs: ContactTable
    tangential: np.ndarray | None
    balance: Balance
    axis: np.ndarray

    @classmethod
    def load(cls, study: Study, store: Store, model: ReducedModel) -> "WholeAtRest":
        """Of preload.csv, and with friction of preload_friction.csv."""
        pairs = ContactTable.load(store.path("preload.csv"))
        path = store.path("preload_friction.csv")
        return cls(
            pairs,
            friction_history.load(path, pairs) if study.preload.friction else None,
            on_model(study, model).balance,
            np.array(study.driver.axis),
        )

    def moment_share(self, facts: results.RedistributionFacts) -> float:
        """Of the load at rest times the length of the contact: the moment left, beside what the
        study holds."""
        if facts.moments_Nm is not None:
            held = self.balance.hold.ways[:, 3:]
            moment = beside(held[held.any(axis=1)], np.array(facts.moments_Nm))
        else:
            moment = np.array(list(_rolls(facts).values()))
        length = contact_length(self.pairs, self.axis)
        # one station has no length that a moment could be compared with
        load = np.linalg.norm(self.balance.force)
        return float(np.linalg.norm(moment) / (load * length)) if length else 0.0


@dataclass(frozen=True)
class KeptContact:
    """The static problem of the kept pairs (those of `pairs` that carry), set up where it is asked
    for and once."""

    study: Study
    model: ReducedModel
    reduction: results.ReductionFacts
    pairs: ContactTable

    @cached_property
    def at_rest(self) -> ContactAtRest:
        """On the bodies of the study."""
        damper = damper_at_rest(self.study, self.model, self.reduction)
        return ContactAtRest(damper, self.pairs)


def kept_preload(study: Study, whole: WholeAtRest, contact: KeptContact) -> KeptPreload:
    """The preload of the kept pairs, by the way that the study asks for; 0 N on the others, so that
    the column sums to what the sides carry wherever it is read."""
    line = contact.pairs.replace(
        preload=np.where(contact.pairs.carrying, contact.pairs.preload, 0.0)
    )
    if study.tune.preload == "table":
        return _of_table(study, whole, line)
    resolved = study.tune.preload == "resolved"
    kept = _resolved(contact.at_rest, whole) if resolved else _scaled(whole, line)
    share = whole.moment_share(kept.facts)
    _check_moment(study, kept.facts, share)
    facts = kept.facts.model_copy(update={"moment_share": share})
    if facts.scale and share > MOMENT.compared:
        facts = facts.model_copy(update={"resolved": _solved_again(contact, whole)})
    return replace(kept, facts=facts)


def moment_within(whole: WholeAtRest, kept: ContactTable) -> bool:
    """Whether the preload of such kept pairs (those that carry), scaled to the load, leaves no more
    than a small moment."""
    try:
        return whole.moment_share(_scaled(whole, kept).facts) <= MOMENT.refused
    except InputError:
        return False


def _rolls(facts: results.RedistributionFacts) -> dict[str, float]:
    """{roll: N m} of the constraint reactions."""
    return {name: value for name, value in facts.reactions.items() if name.startswith("roll")}


def _check_moment(study: Study, facts: results.RedistributionFacts, share: float) -> None:
    """InputError where what is kept leaves more than a small moment: the damper would stand
    otherwise."""
    if share <= MOMENT.refused:
        return
    amount = _rolls(facts) or {
        f"about {way}": value for way, value in zip("xyz", facts.moments_Nm or (), strict=False)
    }
    said = ", ".join(f"{value:.3g} N m {name}" for name, value in amount.items())
    rows = 'rows = "all" in the [contact.NAME] that keeps its edge alone, ' * any(
        side.rows == "edge" for side in study.sides.values()
    )
    even = "like parts on both sides of the middle (stations = [n, n]), " * (
        study.tune.by == "station"
    )
    other = ' or preload = "resolved"' * bool(facts.scale)
    raise InputError(
        f"[tune] what is kept of the contact leaves a moment of {said}: "
        f"{share:.1%} of the load at rest times the length of the contact, allowed "
        f"are {MOMENT.refused:.0%}; keep {rows}{even}more of it{other}"
    )


def _solved_again(contact: KeptContact, whole: WholeAtRest) -> results.KeptCase:
    """Static contact solved again on what is kept, to stand beside the scaled map."""
    try:
        found = _resolved(contact.at_rest, whole)
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


def _of_table(study: Study, whole: WholeAtRest, line: ContactTable) -> KeptPreload:
    """As the user's own table states it, balanced or not."""
    if study.preload.friction:
        raise InputError(
            "[tune] preload = 'table': the table has no friction forces, and [preload] friction "
            "= true; set [tune] preload = 'scaled' or 'resolved'"
        )
    kept = line.select(line.carrying)
    _check_held(study, kept, whole.balance)
    return KeptPreload(
        line,
        results.RedistributionFacts(),
        whole.balance.equilibrium(whole.pairs),
        whole.balance.error(kept),
    )


def _check_held(study: Study, kept: ContactTable, balance: Balance) -> None:
    """InputError where no friction within its limit balances the preload of a table and the
    load."""
    loose, held = balance.by_friction(kept)
    load = np.linalg.norm(balance.force)
    if loose > held + UNBALANCED * load:
        raise InputError(
            f"{study.file(study.tune.kept)}: preload: its forces leave {loose:.4g} N beside the "
            f"load of {load:.4g} N on the damper, friction can hold {held:.4g} N: "
            "scale it to the load, or leave it to [tune] preload = 'scaled' or 'resolved'"
        )


def _resolved(contact: ContactAtRest, whole: WholeAtRest) -> KeptPreload:
    """Static contact solved again on the kept pairs alone."""
    damper = contact.damper
    balance = damper.loads.balance
    friction = damper.friction
    if friction is None:
        result = contact.solve(damper.loads.at_rest, constrain=True)
        return KeptPreload(
            preload_map(result, contact.pairs),
            results.RedistributionFacts(reactions=result.reactions, residual=result.residual),
            balance.equilibrium(whole.pairs),
            result.balance,
        )
    state = friction_history.solve(contact, friction, damper.loads.history)
    pairs = preload_map(state, contact.pairs)
    carrying = pairs.carrying
    return KeptPreload(
        pairs,
        results.RedistributionFacts(
            friction=friction_history.figures(state), residual=state.residual
        ),
        side_sums(state.pairs),
        balance.error(pairs.select(carrying), state.tangential[carrying]),
        state.tangential,
    )


def _scaled(whole: WholeAtRest, line: ContactTable) -> KeptPreload:
    """The whole map's part on the kept stations, scaled to the side forces of equilibrium."""
    carrying = np.flatnonzero(line.carrying)
    kept = line.select(carrying)
    tangential = whole.tangential
    if tangential is None:
        forces = whole.balance.equilibrium(whole.pairs)
    else:
        load = whole.balance.force
        forces = balancing_forces(whole.pairs, kept, tangential, load, whole.axis)
    done = redistribute(whole.pairs, kept, forces)
    preload = line.preload.copy()
    preload[carrying] = done.pairs.preload
    moved = None
    along = np.zeros((len(kept), 2))
    moment = done.moment
    if tangential is not None:
        along = redistribute_friction(whole.pairs, tangential, done)
        moment = done.with_friction(whole.pairs, tangential, along)
        moved = np.zeros_like(tangential)
        moved[carrying] = along
    return KeptPreload(
        line.replace(preload=preload),
        results.RedistributionFacts(
            scale=done.scale, moment_Nm=float(moment @ whole.axis), moments_Nm=tuple(moment)
        ),
        forces,
        whole.balance.error(done.pairs, along),
        moved,
    )


def kept_case(contact: KeptContact, name: str) -> results.KeptCase:
    """What the kept pairs carry in a further load case, without friction and solved on them
    alone."""
    try:
        at_rest = contact.at_rest
        result = at_rest.solve(at_rest.damper.loads.cases[name], constrain=True)
    except InputError as error:
        return results.KeptCase(refused=str(error))
    return results.KeptCase(
        sides=side_loads(contact.pairs, result.force),
        reactions={**result.reactions, **result.held},
        residual=result.residual,
    )
