"""What each stage does: from the study and the files of the stages before it to files of its own.

Every function has the form job(study, store, tick): what it found is in its files, which the table in `stages.py`
names; it returns the names of further files whose number depends on the study. From `preload` on only reduced
matrices and contact tables are used.
"""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError, nearest
from hbm.laws import DryFriction2T
from hbm.linear import linear_response
from hbm.model import ReducedModel
from hbm.response import contact_problem, follow_band
from modal.truncation import Truncation
from static_contact.carry import carry_scaled, carry_tangential, roll_springs, spring_rows, with_springs
from static_contact.detachment import Detachment, StuckAssembly, conserve_total, detach_until, keep_stations
from static_contact.equilibrium import side_forces, side_normals
from static_contact.preload import StaticContact
from static_contact.reduction_error import stuck_error_bound
from tipdamp import bodies, friction, inspection, loads, pictures, stiffness
from tipdamp.free_modes import FreeModes, band, band_warnings, lowest_modes, named_modes

BLADES, DAMPER = bodies.BLADES, bodies.DAMPER
CHECK_BELOW_HZ = bodies.CHECK_BELOW_HZ


# ---- what the study says, in the model's terms -----------------------------------------------------------------

def pull(study) -> np.ndarray:
    """Fc as a vector, (3,) N."""
    return study.driver["pull"] * np.array(study.driver["pull_direction"])


def equilibrium(study, pairs) -> dict:
    return side_forces(side_normals(pairs), pull(study))


def line_of(study, pairs: ContactTable) -> ContactTable:
    """The line model: rows that the study does not keep get weight 0."""
    edge = [name for name, side in study.sides.items() if side["rows"] == "edge"]
    detached = np.isin(pairs.side, edge) & (pairs.row > 0)
    line = pairs.replace(weight=np.where(detached, 0.0, pairs.weight))
    return conserve_total(line, pairs) if conserves(study) else line


def conserves(study) -> bool:
    """Whether the pairs that stay take over the stiffness of their whole side."""
    return study["tune"]["stiffness"] == "conserved"


def declared_springs(study, pairs: ContactTable) -> list:
    """Roll springs of the flat sides of which one row stands for several."""
    springs = []
    for name, side in study.sides.items():
        mine = pairs.select(pairs.side == name)
        one_row = len(np.unique(mine.row[mine.carrying])) == 1
        if side["shape"] != "cylinder" and side["rows"] == "edge" and one_row and side["roll_stiffness"] != 0:
            springs += roll_springs(pairs, name, side["width"], side["roll_stiffness"])
    return springs


def group(model: ReducedModel, study, name: str) -> np.ndarray:
    """Nodes of a group of the blades that the study names."""
    key = f"{BLADES}/{name}"
    if key not in model.groups:
        names = [k.split("/", 1)[1] for k in model.groups if k.startswith(f"{BLADES}/")]
        raise InputError(f"{study.path}: the blades have no group '{name}'; {nearest(name, names)}")
    return model.groups[key]


def excitation(study, model: ReducedModel) -> np.ndarray:
    """(r,) force of 1 N, shared equally by the nodes of the excitation group."""
    nodes = group(model, study, study["respond"]["excitation"])
    rows = [model.displacement_row(BLADES, n, study["respond"]["direction"]) for n in nodes]
    return np.mean(rows, axis=0)


def outputs(study, model: ReducedModel) -> dict:
    """{"patch:node": (r,) row} displacement along the direction of the force."""
    return {f"{patch}:{n}": model.displacement_row(BLADES, n, study["respond"]["direction"])
            for patch in study["respond"]["patches"] for n in group(model, study, patch)}


def ratio(values):
    """One damping ratio for all modes, or one per mode."""
    return values[0] if len(values) == 1 else np.array(values)


# ---- the stages ------------------------------------------------------------------------------------------------

def inspect(study, store, tick):
    """What is in the meshes (or matrices), before anything is computed with it."""
    meshes = "model" not in study
    content = inspection.describe_meshes(study, store, tick) if meshes else inspection.describe_model(study, store)
    store.write_json("inspect.json", content)
    return content.get("pictures", [])


def reduce(study, store, tick):
    """Meshes to a reduced model and the contact pairs of the whole patch; free modes and linear response."""
    if "model" in study:
        model, pairs, facts = bodies.given_model(study)
        truncation = None
    else:
        model, pairs, facts, truncation = bodies.reduced_model(study, store, tick)
    blades = model.part(BLADES)
    if "respond" in study:
        free = free_modes(study, blades)
        limits = band(study["free"]["band"], free)
        found = {"free_hz": free.named, "free_modes_hz": free.hz, "free_response": free_response(study, blades, limits),
                 "warnings": [*free.warnings, *band_warnings(limits, free)]}
    else:
        found = {"free_hz": {}, "free_modes_hz": lowest_modes(blades)[0][:10], "free_response": None, "warnings": []}
    with store.writing("model.npz") as path:
        model.save(path)
    with store.writing("pairs.csv") as path:
        pairs.save(path)
    store.write_json("reduce.json", {**facts, **found})
    more = [*facts.get("pictures", ())]
    if truncation is not None:
        with store.writing("truncation.npz") as path:
            truncation.save(path)
        more.append("truncation.npz")
    return more


def free_modes(study, blades: ReducedModel) -> FreeModes:
    """Free modes of the blades by the motion of the two patches along the force."""
    direction = study["respond"]["direction"]
    rows = (np.mean([blades.displacement_row(BLADES, n, direction) for n in group(blades, study, p)], axis=0)
            for p in study["respond"]["patches"])
    return named_modes(blades, *rows)


def free_response(study, blades: ReducedModel, limits) -> dict:
    """Linear response without damper, per newton: largest over each patch.          [Zucca 2016, figure 2]"""
    hz = np.linspace(*limits, 801)
    rows = outputs(study, blades)
    x = np.abs(linear_response(blades, None, excitation(study, blades), hz,
                               ratio(study["free"]["damping_ratio"]), rows))
    names = np.array([name.rpartition(":")[0] for name in rows])
    return {"hz": hz, "m_per_N": {p: x[:, names == p].max(axis=1) for p in study["respond"]["patches"]}}


def preload(study, store, tick):
    """Unilateral static contact of the whole patch under the pull: the preload map."""
    model = ReducedModel.load(store.path("model.npz"))
    pairs = ContactTable.load(store.path("pairs.csv"))
    materials = store.read_json("reduce.json").get("side_materials", {})
    made = stiffness.facts(study, stiffness.side_stiffness(study, pairs, materials))
    pairs = stiffness.with_values(study, pairs, materials)
    forces = equilibrium(study, pairs)
    tick(0.2, f"{len(pairs)} pairs")
    statics = static_contact(study, model, pairs)
    more, files = {}, []
    if study["preload"]["friction"]:
        result, found, more, forces = preload_with_friction(study, statics, pairs, store)
        files.append("preload_friction.csv")
    else:
        result = statics.solve(study.driver["pull"] * model.loads["pull"])
        found = {"balance": result.balance, "method": result.method, "motions": result.motions}
    pulled = preload_map(result, pairs)
    with store.writing("preload.csv") as path:
        pulled.save(path)
    cases = {name: load_case(study, store, statics, pairs, name) for name in study.loads}
    store.write_json("preload.json", {
        "sides": side_figures(result.pairs, forces, found["balance"]), "residual": result.residual,
        "iterations": result.iterations, "method": found["method"], **more,
        "kn_kt_N_per_m": {s: [pairs.kn[pairs.side == s].mean(), pairs.kt[pairs.side == s].mean()] for s in pairs.sides},
        "stiffness": made,
        "free_motions": [{"name": m.name, "unit": m.unit, "load": m.load} for m in found["motions"]],
        "cases": cases})
    files += [case["file"] for case in cases.values()]
    tables = {name: ContactTable.load(store.path(case["file"])) for name, case in cases.items()}
    return [*files, *pictures.keep_preload(store, {"pull": pulled, **tables})]


def preload_with_friction(study, statics: StaticContact, pairs, store):
    """State at the end of the history, what the map's file says of it, and the side sums; writes the friction."""
    state = friction.solve(study, statics.model, statics.pairs, friction.history(study, statics.model))
    with store.writing("preload_friction.csv") as path:
        friction.save(path, pairs, state.tangential, state.slider, state.slips)
    balance = friction.balance_error(state.pairs, state.tangential, pull(study))
    facts = {"friction": {**friction.facts(state), "file": "preload_friction.csv",
                          "without_friction_N": equilibrium(study, pairs)}}
    return state, {"balance": balance, "method": "friction", "motions": ()}, facts, side_sums(state.pairs)


def side_sums(pairs: ContactTable) -> dict:
    """{side: N} of the closed pairs."""
    return {s: float(np.maximum(pairs.preload, 0)[pairs.side == s].sum()) for s in pairs.sides}


def static_contact(study, model, pairs: ContactTable) -> StaticContact:
    """On the springs kn, or with hard contact where the study says so."""
    hard = study["contact"]["normal"] == "hard"
    return StaticContact(model, pairs.replace(kn=np.full(len(pairs), np.inf)) if hard else pairs)


def preload_map(result, pairs: ContactTable) -> ContactTable:
    """The table with its own springs again: hard pairs that are open stand open by -preload / kn as well."""
    return pairs.replace(preload=np.where(result.force > 0, result.force, np.where(
        np.isinf(result.pairs.kn), -pairs.kn * pairs.weight * result.opening, result.pairs.preload)))


def load_case(study, store, statics: StaticContact, pairs: ContactTable, name: str) -> dict:
    """Preload map of one further load case, in a file of its own."""
    load = loads.total(study, name, statics.model, study.driver["pull"])
    try:
        if study["preload"]["friction"]:
            result = friction.solve(study, statics.model, statics.pairs, [load])
            balance = friction.balance_error(result.pairs, result.tangential, load_on_damper(statics.model, load))
        else:
            result = statics.solve(load)
            balance = result.balance
    except InputError as error:
        raise InputError(f"{study.path}: [loads.{name}]: {error}") from None
    with store.writing(f"loads/{name}.csv") as path:
        preload_map(result, pairs).save(path)
    sides = {s: {"sum_N": result.force[pairs.side == s].sum(), "max_N": result.force[pairs.side == s].max(),
                 "detached": int((result.force[(pairs.side == s) & pairs.carrying] <= 0).sum())} for s in pairs.sides}
    return {"file": f"loads/{name}.csv", "sides": sides, "residual": result.residual, "balance_error": balance}


def load_on_damper(model, load) -> np.ndarray:
    """(3,) N: resultant on the damper."""
    return np.array([load[(model.body == DAMPER) & (model.direction == d)].sum() for d in "xyz"])


def side_figures(pairs: ContactTable, forces: dict, balance: float) -> dict:
    """{side: sum_N of the closed pairs, min_N, max_N, detached, equilibrium_N, balance_error}."""
    figures = {}
    for side in pairs.sides:
        p = pairs.preload[(pairs.side == side) & pairs.carrying]
        figures[side] = {"sum_N": p[p > 0].sum(), "min_N": p.min(), "max_N": p.max(), "detached": int((p <= 0).sum()),
                         "equilibrium_N": forces[side], "balance_error": balance}
    return figures


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

    if study["tune"]["stations"]:
        found = keep_stations(model, line, *study["tune"]["stations"], follow, springs=rows, conserve=conserves(study))
    else:
        found = detach_until(model, line, study["tune"]["target_hz"], follow, springs=rows, progress=report,
                             conserve=conserves(study))
    assembly = StuckAssembly(model)
    sets = {"full_area": whole, "full_line": line, "tuned": found.pairs}
    stuck = {name: assembly.modes(pairs, follow, above_hz=2 * CHECK_BELOW_HZ, extra=rows(pairs))
             for name, pairs in sets.items()}
    tick(0.8, "full model")
    below = {name: modes.hz[modes.hz < CHECK_BELOW_HZ] for name, modes in stuck.items()}
    check = {} if "model" in study else bodies.full_check(
        study, {n: (p, declared_springs(study, p), below[n]) for n, p in sets.items()}, tick)
    truncation = Truncation.load(store.path("truncation.npz")) if check else None
    for name, figures in check.items():
        figures["error_bound"] = stuck_error_bound(model, truncation, sets[name], below[name], extra=rows(sets[name]))
    tangential = (friction.load(store.path("preload_friction.csv"), whole) if study["preload"]["friction"] else None)
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


def tuning_figures(found: Detachment, stuck: dict) -> dict:
    return {"target_hz": found.target_hz, "tuned_pairs": {"front": found.chosen.front, "back": found.chosen.back},
            "history": [vars(s) for s in found.history],
            "stuck_hz": {name: modes.tracked_hz for name, modes in stuck.items()},
            "likeness": {name: modes.likeness for name, modes in stuck.items()},
            "stuck_modes_hz": {name: modes.hz[modes.hz < 2 * CHECK_BELOW_HZ] for name, modes in stuck.items()}}


def kept_pairs(study, model, whole, found, tangential=None):
    """The full table with weight 0 on detached pairs and, on the kept ones, the preload that carries the pull; what
    was done; and with friction the forces T (P, 2) on them, from those of the whole map."""
    forces = equilibrium(study, whole) if tangential is None else side_sums(whole)
    held = study.driver["pull"] * model.loads["pull"]
    if study["tune"]["preload"] == "resolved":
        statics = static_contact(study, model, found.pairs)
        if tangential is None:
            result = statics.solve(held, hold=True)
            facts, balance = {"held": result.held, "residual": result.residual}, result.balance
        else:
            result = friction.solve(study, model, statics.pairs, friction.history(study, model))
            facts, tangential = friction.facts(result), result.tangential
            forces = side_sums(result.pairs)
        kept = preload_map(result, found.pairs)
    else:
        carrying = np.flatnonzero(found.pairs.carrying)
        done = carry_scaled(whole, found.pairs.select(carrying), forces, study.driver["axis"])
        preload = found.pairs.preload.copy()
        preload[carrying] = done.pairs.preload
        kept, facts = found.pairs.replace(preload=preload), {"scale": done.scale, "moment_Nm": done.moment}
        if tangential is None:
            balance = balance_error(kept.select(carrying), pull(study))
        else:
            whole_T, tangential = tangential, np.zeros_like(tangential)
            tangential[carrying] = carry_tangential(whole, whole_T, done)
    kept_only = kept.select(kept.carrying)
    if tangential is not None:
        balance = friction.balance_error(kept_only, tangential[kept.carrying], pull(study))
    return kept, {"preload_kept": side_figures(kept_only, forces, balance), "carried": facts}, tangential


def kept_case(study, model, pairs: ContactTable, name: str) -> dict:
    """What the kept pairs carry in a further load case, without friction and solved on them alone: {sides, held}, or
    {refused} with the reason."""
    try:
        result = static_contact(study, model, pairs).solve(loads.total(study, name, model, study.driver["pull"]),
                                                           hold=True)
    except InputError as error:
        return {"refused": str(error)}
    mine = {s: (pairs.side == s) & pairs.carrying for s in pairs.sides}
    return {"sides": {s: {"sum_N": result.force[m].sum(), "max_N": result.force[m].max(initial=0.0),
                          "detached": int((result.force[m] <= 0).sum())} for s, m in mine.items()},
            "held": result.held, "residual": result.residual}


def balance_error(pairs: ContactTable, load: np.ndarray) -> float:
    """|pull - sum N n| / |pull|."""
    return float(np.linalg.norm(load - np.maximum(pairs.preload, 0) @ pairs.normal) / np.linalg.norm(load))


def respond(study, store, tick):
    """Forced response of the kept pairs at every excitation level and every number of harmonics."""
    model, table = ReducedModel.load(store.path("model.npz")), ContactTable.load(store.path("kept.csv"))
    model = with_springs(model, table, declared_springs(study, table))
    settings = study["respond"]
    kept = table.select(table.carrying)
    state = {"static": None, "start": None}
    if study["preload"]["friction"]:
        state = friction.start(model, kept, friction.load(store.path("kept_friction.csv"), table)[table.carrying])
    problem, _ = contact_problem(model, kept, DryFriction2T(), static=state["static"],
                                 damping_ratio=ratio(settings["damping_ratio"]))
    force, rows = excitation(study, model), outputs(study, model)
    cases = [(H, Fe) for H in settings["harmonics"] for Fe in settings["levels"]]
    low, high = settings["band"]
    share = 0.5 if settings["both_ways"] else 1.0
    found = []
    for i, (H, Fe) in enumerate(cases):
        def report(hz, step, iterations, i=i, H=H, Fe=Fe):
            tick((i + share * (hz - low) / (high - low)) / len(cases),
                 f"Fe = {Fe:g} N, H = {H}  {hz:.1f} Hz  step {step:.2g}  {iterations} it")

        curve = follow_band(problem, Fe * force, (low, high), harmonics=H, outputs=rows, progress=report,
                            start=state["start"])
        name = f"responses/Fe_{Fe:g}N_H{H}.npz"
        with store.writing(name) as path:
            curve.save(path)
        back = None
        if settings["both_ways"]:
            def report_back(hz, step, iterations, i=i, H=H, Fe=Fe):
                tick((i + 0.5 + 0.5 * (high - hz) / (high - low)) / len(cases),
                     f"Fe = {Fe:g} N, H = {H}, downwards  {hz:.1f} Hz  step {step:.2g}  {iterations} it")

            back = follow_band(problem, Fe * force, (high, low), harmonics=H, outputs=rows, progress=report_back,
                               start=state["start"])
        found.append({"file": name, **response_figures(study, curve, back, kept, Fe, H)})
    with store.writing("stuck.npz") as path:
        hz = np.linspace(low, high, 801)
        x = linear_response(model, kept, force, hz, ratio(settings["damping_ratio"]), rows)
        np.savez(path, frequency=hz, response=x, output_names=np.array(list(rows)))
    store.write_json("respond.json", {"responses": found, "zeta": settings["damping_ratio"],
                                      "stuck_difference": stuck_difference(study, model, kept, store, found)})
    return [case["file"] for case in found]


def stuck_difference(study, model, kept, store, found) -> dict:
    """{file: largest |curve - linear stuck response| / largest response} of the curves on which no pair slips."""
    from hbm.response import ForcedResponse

    out = {}
    for case in found:
        if not case["slipping_pairs"]:
            curve = ForcedResponse.load(store.path(case["file"]))
            good = curve.converged
            x = linear_response(model, kept, case["Fe_N"] * excitation(study, model), curve.frequency[good],
                                ratio(study["respond"]["damping_ratio"]), outputs(study, model))
            out[case["file"]] = float(np.abs(curve.harmonics[good, :, 1] - x).max() / np.abs(x).max())
    return out


def response_figures(study, curve, back, kept, Fe, H) -> dict:
    """Peaks over the patches (the first blade's on top), half of peak-to-peak along the force; counts."""
    patches = {patch: patch_peak(curve, patch) for patch in study["respond"]["patches"]}
    first = study["respond"]["patches"][0]
    hz = patches[first]["peak_hz"]
    slipping = curve.slipping_pairs
    figures = {"Fe_N": Fe, "H": H, **patches[first], "patches": patches,
               "points": len(curve.frequency), "failed_points": int((~curve.converged).sum()),
               "slipping_pairs": [f"{kept.side[i]} {kept.station[i]}" for i in slipping],
               "seconds": curve.seconds, "residual_calls": curve.residual_calls, "complete": curve.complete,
               "ended": curve.ended, "origin": curve.origin, "start": curve.start,
               "peak_inside_band": bool(min(study["respond"]["band"]) < hz < max(study["respond"]["band"]))}
    if back is not None:
        figures["back"] = {**patch_peak(back, first), "complete": back.complete, "ended": back.ended,
                           "failed_points": int((~back.converged).sum()), "seconds": back.seconds}
    return figures


def patch_peak(curve, patch: str) -> dict:
    """Largest peak of the nodes of a patch with its frequency, and the smallest node's peak."""
    peaks = [curve.peak(n) for n in curve.output_names if n.rpartition(":")[0] == patch]
    hz, top = max(peaks, key=lambda p: p[1])
    return {"peak_hz": hz, "peak_m": top, "min_peak_m": min(p[1] for p in peaks)}
