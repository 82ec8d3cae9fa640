"""Stage tune: stations detached until the stuck frequency meets its target; what the kept pairs carry."""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from modal.truncation import Truncation
from static_contact.detachment import Detachment, DetachmentOptions, StuckAssembly, detach_until, keep_stations
from static_contact.redistribution import balancing_forces, redistribute, redistribute_friction
from static_contact.reduction_error import stuck_error_bound
from static_contact.roll_springs import spring_rows
from tipdamp import bodies, friction, loads
from tipdamp import visualization as pictures
from tipdamp.bodies import BLADES, CHECK_BELOW_HZ
from tipdamp.stages.model_inputs import (
    balance_error,
    conserves,
    declared_springs,
    equilibrium,
    line_of,
    preload_map,
    pull,
    side_sums,
    static_contact,
)
from tipdamp.stages.preload import side_figures
from tipdamp.stages.reduce import free_modes


def tune(study, store, tick):
    """Detach stations from the middle until the stuck frequency meets the target; the kept pairs carry the pull."""
    model, whole = ReducedModel.load(store.path("model.npz")), ContactTable.load(store.path("preload.csv"))
    blades = model.part(BLADES)
    follow = np.zeros(model.size)
    follow[model.body == BLADES] = free_modes(study, blades).follow[study["tune"]["follow"]]
    line = line_of(study, whole)

    def rows(pairs):
        return spring_rows(model, pairs, declared_springs(study, pairs))

    def report(step, share):
        tick(0.8 * share, f"{step.front} + {step.back} stations  {step.hz:.0f} Hz")

    assembly, options = StuckAssembly(model), DetachmentOptions(springs=rows, conserve=conserves(study))
    if study["tune"]["stations"]:
        found = keep_stations(assembly, line, ends_kept(study, line), follow, options)
    else:
        found = detach_until(assembly, line, study["tune"]["target_hz"], follow, options, report)
    sets = {"full_area": whole, "full_line": line, "tuned": found.pairs}
    stuck = {name: assembly.modes(pairs, follow, above_hz=2 * CHECK_BELOW_HZ, extra=rows(pairs))
             for name, pairs in sets.items()}
    check = full_model_check(study, store, model, sets, stuck, tick)
    tangential = friction.load(store.path("preload_friction.csv"), whole) if study["preload"]["friction"] else None
    kept, carried, tangential = kept_pairs(study, model, whole, found, tangential)
    with store.writing("kept.csv") as path:
        kept.save(path)
    if tangential is not None:
        with store.writing("kept_friction.csv") as path:
            friction.save(path, kept, tangential, np.zeros_like(tangential), np.zeros(len(kept)))
    store.write_json("tune.json", {
        **tuning_figures(found, stuck), "full_model_check": check, **carried,
        "roll_stiffness_Nm_per_rad": sum(s.k for s in declared_springs(study, found.pairs)),
        "cases": {name: kept_case(study, model, found.pairs, name) for name in study.loads}})
    shapes = {"kept stations stuck": stuck["tuned"], "whole area stuck": stuck["full_area"]}
    return [*(["kept_friction.csv"] if tangential is not None else []), *pictures.keep_stuck(store, model, shapes)]


def ends_kept(study, line: ContactTable) -> tuple[int, int]:
    """(front, back) stations that the study keeps."""
    stations = int(line.station.max()) + 1
    return ((stations + 1) // 2, stations // 2) if study["tune"]["stations"] == "all" else study["tune"]["stations"]


def full_model_check(study, store, model, sets, stuck, tick) -> dict:
    """{set: figures} of the stuck frequencies below the limit against the unreduced model, with the bound that the
    reduction gives of itself; nothing where matrices were given."""
    if "model" in study:
        return {}
    tick(0.8, "full model")
    below = {name: modes.hz[modes.hz < CHECK_BELOW_HZ] for name, modes in stuck.items()}
    springs = {name: declared_springs(study, p) for name, p in sets.items()}
    check = bodies.full_check(study, {n: (p, springs[n], below[n]) for n, p in sets.items()}, tick)
    truncation = Truncation.load(store.path("truncation.npz"))
    for name, figures in check.items():
        figures["error_bound"] = stuck_error_bound(model, truncation, sets[name], below[name],
                                                   extra=spring_rows(model, sets[name], springs[name]))
    return check


def tuning_figures(found: Detachment, stuck: dict) -> dict:
    return {"target_hz": found.target_hz, "tuned_pairs": {"front": found.chosen.front, "back": found.chosen.back},
            "history": [vars(s) for s in found.history],
            "stuck_hz": {name: modes.tracked_hz for name, modes in stuck.items()},
            "mac": {name: modes.mac for name, modes in stuck.items()},
            "stuck_modes_hz": {name: modes.hz[modes.hz < 2 * CHECK_BELOW_HZ] for name, modes in stuck.items()}}


def kept_pairs(study, model, whole, found, tangential=None):
    """The full table with weight 0 on detached pairs and, on the kept ones, the preload that carries the pull; what
    was done; and with friction the forces T (P, 2) on them, from those of the whole map."""
    forces = equilibrium(study, model, whole) if tangential is None else side_sums(whole)
    held = loads.at_rest(study, model)
    if study["tune"]["preload"] == "resolved":
        statics = static_contact(study, model, found.pairs)
        if tangential is None:
            result = statics.solve(held, constrain=True)
            facts, balance = {"held": result.reactions, "residual": result.residual}, result.balance
        else:
            result = friction.solve(study, model, statics.pairs, friction.history(study, model))
            facts, tangential = friction.facts(result), result.tangential
            forces = side_sums(result.pairs)
        kept = preload_map(result, found.pairs)
    else:
        carrying = np.flatnonzero(found.pairs.carrying)
        if tangential is not None:
            forces = balancing_forces(whole, found.pairs.select(carrying), tangential, pull(study, model),
                                      study.driver["axis"])
        done = redistribute(whole, found.pairs.select(carrying), forces, study.driver["axis"])
        preload = found.pairs.preload.copy()
        preload[carrying] = done.pairs.preload
        kept, facts = found.pairs.replace(preload=preload), {"scale": done.scale, "moment_Nm": done.moment}
        if tangential is None:
            balance = balance_error(kept.select(carrying), pull(study, model))
        else:
            whole_T, tangential = tangential, np.zeros_like(tangential)
            tangential[carrying] = redistribute_friction(whole, whole_T, done)
    kept_only = kept.select(kept.carrying)
    if tangential is not None:
        balance = friction.balance_error(kept_only, tangential[kept.carrying], pull(study, model))
    return kept, {"preload_kept": side_figures(kept_only, forces, balance), "carried": facts}, tangential


def kept_case(study, model, pairs: ContactTable, name: str) -> dict:
    """What the kept pairs carry in a further load case, without friction and solved on them alone: {sides, held}, or
    {refused} with the reason."""
    try:
        result = static_contact(study, model, pairs).solve(loads.total(study, name, model, study.driver["pull"]),
                                                           constrain=True)
    except InputError as error:
        return {"refused": str(error)}
    mine = {s: (pairs.side == s) & pairs.carrying for s in pairs.sides}
    return {"sides": {s: {"sum_N": result.force[m].sum(), "max_N": result.force[m].max(initial=0.0),
                          "detached": int((result.force[m] <= 0).sum())} for s, m in mine.items()},
            "held": result.reactions, "residual": result.residual}
