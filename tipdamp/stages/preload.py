"""Stage preload: static contact of the whole patch under the pull and in further load cases."""

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from static_contact.preload import StaticContact
from tipdamp import friction, loads, stiffness, stresses
from tipdamp import visualization as pictures
from tipdamp.stages.model_inputs import equilibrium, load_on_damper, preload_map, pull, side_sums, static_contact


def preload(study, store, tick):
    """Unilateral static contact of the whole patch under the pull, or the case in its place: the preload map."""
    if study["preload"]["stress"] and "model" in study:
        raise InputError(f"{study.path}: [preload] stress needs meshes, and the study gives matrices ([model])")
    model = ReducedModel.load(store.path("model.npz"))
    pairs = ContactTable.load(store.path("pairs.csv"))
    materials = store.read_json("reduce.json").get("side_materials", {})
    made = stiffness.facts(study, stiffness.side_stiffness(study, pairs, materials, pull(study, model)))
    pairs = stiffness.with_values(study, pairs, materials, pull(study, model))
    forces = equilibrium(study, model, pairs)
    tick(0.2, f"{len(pairs)} pairs")
    statics = static_contact(study, model, pairs)
    more, files = {}, []
    if study["preload"]["friction"]:
        result, found, more, forces = preload_with_friction(study, statics, pairs, store)
        files.append("preload_friction.csv")
    else:
        result = statics.solve(loads.at_rest(study, model))
        found = {"balance": result.balance, "method": result.method, "motions": result.motions,
                 "held": result.reactions}
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
        "held": found["held"], "cases": cases,
        "warnings": held_warnings({"the pull": found["held"],
                                   **{f"[loads.{name}]": case["held"] for name, case in cases.items()}})})
    files += [case["file"] for case in cases.values()]
    if study["preload"]["stress"]:
        files += stresses.keep_stress(study, store, model, result.displacement, tick)
    tables = {name: ContactTable.load(store.path(case["file"])) for name, case in cases.items()}
    return [*files, *pictures.keep_preload(store, {"pull": pulled, **tables})]


def preload_with_friction(study, statics: StaticContact, pairs, store):
    """State at the end of the history, what the map's file says of it, and the side sums; writes the friction."""
    state = friction.solve(study, statics.model, statics.pairs, friction.history(study, statics.model))
    with store.writing("preload_friction.csv") as path:
        friction.save(path, pairs, state.tangential, state.slider, state.slips)
    balance = friction.balance_error(state.pairs, state.tangential, pull(study, statics.model))
    facts = {"friction": {**friction.facts(state), "file": "preload_friction.csv",
                          "without_friction_N": equilibrium(study, statics.model, pairs)}}
    return state, {"balance": balance, "method": "friction", "motions": (), "held": {}}, facts, side_sums(state.pairs)


def load_case(study, store, statics: StaticContact, pairs: ContactTable, name: str) -> dict:
    """Preload map of one further load case, in a file of its own."""
    load = loads.total(study, name, statics.model, study.driver["pull"])
    try:
        if study["preload"]["friction"]:
            result = friction.solve(study, statics.model, statics.pairs, [load])
            balance, held = friction.balance_error(result.pairs, result.tangential,
                                                   load_on_damper(statics.model, load)), {}
        else:
            result = statics.solve(load)
            balance, held = result.balance, result.reactions
    except InputError as error:
        raise InputError(f"{study.path}: [loads.{name}]: {error}") from None
    with store.writing(f"loads/{name}.csv") as path:
        preload_map(result, pairs).save(path)
    sides = {s: {"sum_N": result.force[pairs.side == s].sum(), "max_N": result.force[pairs.side == s].max(),
                 "detached": int((result.force[(pairs.side == s) & pairs.carrying] <= 0).sum())} for s in pairs.sides}
    return {"file": f"loads/{name}.csv", "sides": sides, "residual": result.residual, "balance_error": balance,
            "held": held}


def held_warnings(cases: dict) -> list[str]:
    """Sentences about what the reference state holds; cases - {load: {motion: amount in N, of rolls in N m}}."""
    return [f"{load} does {abs(amount):.2g} {'N m' if motion.startswith('roll') else 'N'} along the {motion} that no "
            "contact resists, as inexact coordinates leave it: it is taken up in the reference state"
            for load, held in cases.items() for motion, amount in held.items()]


def side_figures(pairs: ContactTable, forces: dict, balance: float) -> dict:
    """{side: sum_N of the closed pairs, min_N, max_N, detached, equilibrium_N, balance_error}."""
    figures = {}
    for side in pairs.sides:
        p = pairs.preload[(pairs.side == side) & pairs.carrying]
        figures[side] = {"sum_N": p[p > 0].sum(), "min_N": p.min(), "max_N": p.max(), "detached": int((p <= 0).sum()),
                         "equilibrium_N": forces[side], "balance_error": balance}
    return figures
