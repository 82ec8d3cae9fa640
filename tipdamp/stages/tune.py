"""Stage tune: stations detached until the stuck frequency meets its target; the preload of the kept pairs."""

from dataclasses import dataclass

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from modal.truncation import Truncation
from static_contact.detachment import (
    Detachment,
    DetachmentOptions,
    StuckAssembly,
    StuckModes,
    detach_until,
    keep_stations,
)
from static_contact.redistribution import balancing_forces, redistribute, redistribute_friction
from static_contact.roll_springs import spring_rows
from tipdamp import friction, loads
from tipdamp.bodies import BLADES, CHECK_BELOW_HZ
from tipdamp.bodies.check import full_model_check
from tipdamp.bodies.read import BODY_FILES, BODY_READS
from tipdamp.free_modes import tracking_warnings
from tipdamp.progress import Tick
from tipdamp.stages import model_inputs as inputs
from tipdamp.stages import results
from tipdamp.stages.preload import side_forces
from tipdamp.stages.reduce import free_modes
from tipdamp.stages.stage import Stage
from tipdamp.store import Store
from tipdamp.study.view import Study
from tipdamp.visualization import keep_stuck

SHOWN_BELOW_HZ = 2 * CHECK_BELOW_HZ


@dataclass(frozen=True)
class KeptPreload:
    """pairs - the full table, weight 0 on detached pairs, with the preload of the kept ones; facts - how it came there
    forces {side: N} of equilibrium; balance - unbalanced part; tangential (P, 2) N with friction, else None."""

    pairs: ContactTable
    facts: results.Redistribution
    forces: dict[str, float]
    balance: float
    tangential: np.ndarray | None = None


def tune(study: Study, store: Store, tick: Tick) -> list[str]:
    """Detach stations from the middle until the stuck frequency meets the target; the kept pairs carry the pull."""
    model, whole = ReducedModel.load(store.path("model.npz")), ContactTable.load(store.path("preload.csv"))
    follow = np.zeros(model.size)
    follow[model.body == BLADES] = free_modes(study, model.part(BLADES)).follow[study.tune.follow]
    line, assembly = inputs.line_of(study, whole), StuckAssembly(model)
    found = _keep(study, assembly, line, follow, tick)
    sets = {"full_area": whole, "full_line": line, "tuned": found.pairs}
    stuck = {name: assembly.modes(pairs, follow, above_hz=SHOWN_BELOW_HZ,
                                  extra=spring_rows(model, pairs, inputs.declared_springs(study, pairs)))
             for name, pairs in sets.items()}
    checked = _full_model_check(study, store, model, sets, stuck, tick)
    kept = kept_preload(study, store, model, whole, found.pairs)
    files = _write_kept(store, kept)
    on_kept = kept.pairs.select(kept.pairs.carrying)
    results.TuneResult(
        **tuning_figures(found, stuck), full_model_check=checked, redistribution=kept.facts,
        preload_kept=side_forces(on_kept, kept.forces, kept.balance),
        roll_stiffness_Nm_per_rad=sum(s.k for s in inputs.declared_springs(study, found.pairs)),
        cases={name: kept_case(study, model, found.pairs, name) for name in study.loads}).save(store)
    shapes = {"kept stations stuck": stuck["tuned"], "whole area stuck": stuck["full_area"]}
    return [*files, *keep_stuck(store, model, shapes)]


def _keep(study, assembly, line, follow, tick) -> Detachment:
    """The stations of the line that are kept: those that the study gives, or by the target."""
    def rows(pairs):
        return spring_rows(assembly.model, pairs, inputs.declared_springs(study, pairs))

    def report(step, share):
        tick(0.8 * share, f"{step.front} + {step.back} stations  {step.hz:.0f} Hz")

    options = DetachmentOptions(springs=rows, conserve=inputs.conserves(study))
    if study.tune.stations:
        return keep_stations(assembly, line, ends_kept(study, line), follow, options)
    return detach_until(assembly, line, study.tune.target_hz, follow, options, report)


def ends_kept(study: Study, line: ContactTable) -> tuple[int, int]:
    """(front, back) stations that the study keeps."""
    if study.tune.stations == "all":
        stations = int(line.station.max()) + 1
        return (stations + 1) // 2, stations // 2
    front, back = study.tune.stations
    return front, back


def _full_model_check(study, store, model, sets, stuck, tick) -> dict[str, results.FullModelCheck]:
    """Nothing where matrices were given."""
    if "model" in study:
        return {}
    tick(0.8, "full model")
    truncation = Truncation.load(store.path("truncation.npz"))
    return full_model_check(study, model, truncation, {
        name: (pairs, inputs.declared_springs(study, pairs), stuck[name].hz[stuck[name].hz < CHECK_BELOW_HZ])
        for name, pairs in sets.items()}, tick)


def tuning_figures(found: Detachment, stuck: dict[str, StuckModes]) -> dict:
    """Fields of TuneResult: target, steps, and the stuck modes of each set of pairs."""
    chosen = results.Stations(front=found.chosen.front, back=found.chosen.back)
    return {"target_hz": found.target_hz, "tuned_pairs": chosen,
            "history": [results.TuneStep(front=s.front, back=s.back, hz=s.hz, mac=s.mac) for s in found.history],
            "stuck_hz": results.OfSets[float](**{name: modes.tracked_hz for name, modes in stuck.items()}),
            "mac": results.OfSets[float](**{name: modes.mac for name, modes in stuck.items()}),
            "stuck_modes_hz": {name: modes.hz[modes.hz < SHOWN_BELOW_HZ] for name, modes in stuck.items()}}


def kept_preload(study: Study, store: Store, model: ReducedModel, whole: ContactTable,
                 line: ContactTable) -> KeptPreload:
    """The preload of the kept pairs (those of `line` that carry), by the way that the study asks for."""
    tangential = friction.load(store.path("preload_friction.csv"), whole) if study.preload.friction else None
    if study.tune.preload == "resolved":
        return _resolved(study, model, whole, line)
    return _scaled(study, model, whole, line, tangential)


def _resolved(study, model, whole, line):
    """Static contact solved again on the kept pairs alone."""
    statics = inputs.static_contact(study, model, line)
    if not study.preload.friction:
        result = statics.solve(loads.at_rest(study, model), constrain=True)
        facts = results.Redistribution(reactions=result.reactions, residual=result.residual)
        forces = inputs.equilibrium(study, model, whole)
        return KeptPreload(inputs.preload_map(result, line), facts, forces, result.balance)
    state = friction.solve(study, model, statics.pairs, friction.history(study, model))
    kept = inputs.preload_map(state, line)
    facts = results.Redistribution(friction=friction.facts(state), residual=state.residual)
    balance = friction.balance_error(kept.select(kept.carrying), state.tangential[kept.carrying],
                                     loads.force_at_rest(study, model))
    return KeptPreload(kept, facts, inputs.side_sums(state.pairs), balance, state.tangential)


def _scaled(study, model, whole, line, tangential):
    """The whole map's part on the kept stations, scaled to the side forces of equilibrium."""
    carrying, load, axis = np.flatnonzero(line.carrying), loads.force_at_rest(study, model), study.driver.axis
    kept = line.select(carrying)
    if tangential is None:
        forces = inputs.equilibrium(study, model, whole)
    else:
        forces = balancing_forces(whole, kept, tangential, load, axis)
    done = redistribute(whole, kept, forces, axis)
    preload = line.preload.copy()
    preload[carrying] = done.pairs.preload
    facts = results.Redistribution(scale=done.scale, moment_Nm=done.moment)
    if tangential is None:
        return KeptPreload(line.replace(preload=preload), facts, forces, inputs.balance_error(done.pairs, load))
    moved = np.zeros_like(tangential)
    moved[carrying] = redistribute_friction(whole, tangential, done)
    return KeptPreload(line.replace(preload=preload), facts, forces,
                       friction.balance_error(done.pairs, moved[carrying], load), moved)


def _write_kept(store, kept):
    """kept.csv, and with friction kept_friction.csv; the names of what is not always written."""
    with store.writing("kept.csv") as path:
        kept.pairs.save(path)
    if kept.tangential is None:
        return []
    with store.writing("kept_friction.csv") as path:
        none = np.zeros_like(kept.tangential)
        friction.save(path, kept.pairs, kept.tangential, none, none[:, 0])
    return ["kept_friction.csv"]


def kept_case(study: Study, model: ReducedModel, pairs: ContactTable, name: str) -> results.KeptCase:
    """What the kept pairs carry in a further load case, without friction and solved on them alone."""
    try:
        result = inputs.static_contact(study, model, pairs).solve(loads.total(study, name, model), constrain=True)
    except InputError as error:
        return results.KeptCase(refused=str(error))
    forces = {s: result.force[(pairs.side == s) & pairs.carrying] for s in pairs.sides}
    sides = {s: results.SideLoad(sum_N=f.sum(), max_N=f.max(initial=0.0), detached=(f <= 0).sum())
             for s, f in forces.items()}
    return results.KeptCase(sides=sides, reactions=result.reactions, residual=result.residual)


def line(store: Store) -> str:
    """Stuck frequencies and the stations kept."""
    found = results.TuneResult.load(store)
    stuck, kept = found.stuck_hz, found.tuned_pairs
    return (f"stuck: area {stuck.full_area:.0f} Hz, line {stuck.full_line:.0f} Hz, {kept.front} + {kept.back} stations "
            f"{stuck.tuned:.0f} Hz")


def warnings(study: Study, store: Store) -> list[str]:
    """Of the tracked mode."""
    found = results.TuneResult.load(store)
    return [*found.warnings, *tracking_warnings(study, found)]


def _reads_more(study):
    return friction.READS if study.preload.friction else ()


STAGE = Stage(tune, line, warnings=warnings, reads_more=_reads_more, outputs=("kept.csv", "tune.json"),
              may_write=("kept_friction.csv", "stuck_modes.npz", "stuck_modes.vtu"),
              needs=("reduce", "preload"), requires=("tune", "respond"), reads_files=BODY_FILES,
              reads=("tune", "sides", "driver", "preload", "loads", "contact.normal", *BODY_READS))
