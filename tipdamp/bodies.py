"""From the study to bodies: meshes read and assembled, pairs matched, Craig-Bampton models; or given matrices.

The finite-element half of the stages `inspect`, `reduce` and `tune`.
"""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError
from hbm.model import ReducedModel
from tipdamp.loads import at_speed, case_forces, check

BLADES, DAMPER = "blades", "damper"


# ---- meshes ----------------------------------------------------------------------------------------------------

def read_meshes(study) -> dict:
    """{"blades": Mesh, "damper": Mesh} in metres; every group that the study names is checked."""
    from modal.mesh import read_mesh

    meshes = {}
    for name in (BLADES, DAMPER):
        path = study.file(study[name]["mesh"])
        if not path.is_file():
            raise InputError(f"{study.path}: [{name}] mesh = '{study[name]['mesh']}': no such file ({path})")
        meshes[name] = read_mesh(path, study.length_unit)
    for name, section, key in named_groups(study):
        try:
            meshes[name].group(study.group_name(section, key))
        except InputError as error:
            raise InputError(f"{study.path}: [{section}] {key}: {error}") from None
    return meshes


def named_groups(study):
    """(body, section, key) of every key of the study that names a node group of a mesh."""
    yield BLADES, BLADES, "clamp"
    yield DAMPER, DAMPER, "load_points"
    if "respond" in study:
        yield BLADES, "respond", "excitation"
        for i in range(len(study["respond"]["patches"])):
            yield BLADES, "respond", f"patches[{i}]"
    for name in () if study["contact"]["pairs"] else study.sides:
        yield BLADES, f"contact.{name}", "blade"
        yield DAMPER, f"contact.{name}", "damper"


def assemble_bodies(study, meshes, tick) -> list:
    """[blades, damper] as Body records; the support of each is checked when it is reduced."""
    from modal.elasticity import Material, elastic_body

    material = Material(**study["material"])
    tick(0.02, "assembling the blades")
    blades = elastic_body(meshes[BLADES], material, BLADES, clamp=study[BLADES]["clamp"])
    blades = at_speed(study, blades, meshes[BLADES], material)
    tick(0.1, "assembling the damper")
    return [blades, elastic_body(meshes[DAMPER], material, DAMPER, free=True)]


def whole_patch(study, meshes) -> ContactTable:
    """All node pairs of all sides, with their stiffness and friction."""
    from static_contact.pairing import Side, join, pair

    damper, contact = study[DAMPER], study["contact"]
    if contact["pairs"]:
        return own_pairs(study)
    tables = [pair(meshes[BLADES], meshes[DAMPER], Side(name, side["blade"], side["damper"], side["gap"]),
                   blade_body=BLADES, damper_body=DAMPER, axis=damper["axis"], pull=damper["pull_direction"],
                   tolerance=contact["tolerance"]) for name, side in study.sides.items()]
    pairs = join(*tables)
    kn, kt = node_stiffness(study, pairs)
    return pairs.replace(kn=kn, kt=kt, mu=np.full(len(pairs), contact["mu"]))


def own_pairs(study) -> ContactTable:
    """The person's own table, read and never written to."""
    pairs = ContactTable.load(study.file(study["contact"]["pairs"]))
    unknown = sorted(set(study.sides) - set(pairs.sides))
    if unknown:
        raise InputError(f"{study.path}: [contact.{unknown[0]}]: the pairs have sides {', '.join(pairs.sides)}")
    for column, body in (("blade_body", BLADES), ("damper_body", DAMPER)):
        odd = sorted(set(getattr(pairs, column).tolist()) - {body})
        if odd:
            raise InputError(f"{study.path}: [contact] pairs: {column} '{odd[0]}' must be '{body}'")
    return pairs


def node_stiffness(study, pairs: ContactTable) -> tuple[np.ndarray, np.ndarray]:
    """kn, kt (P,) N/m: as given, or from the half-space under the side's force, total / nodes of the full patch."""
    from static_contact.equilibrium import side_forces, side_normals
    from static_contact.halfspace import ContactSide, nodal_stiffness
    from static_contact.moduli import MaterialPair

    kn, kt = np.empty(len(pairs)), np.empty(len(pairs))
    damper, material = study[DAMPER], study["material"]
    forces = side_forces(side_normals(pairs), damper["pull"] * np.array(damper["pull_direction"]))
    for name, side in study.sides.items():
        mine = pairs.side == name
        if study["contact"]["stiffness"] == "given":
            kn[mine], kt[mine] = side["kn"], side["kt"]
            continue
        along = pairs.position[mine] @ np.array(damper["axis"])
        contact = ContactSide(side["shape"], float(np.ptp(along)),
                              MaterialPair(material["E"], material["nu"], material["E"], material["nu"]),
                              radius=side["radius"] if side["shape"] == "cylinder" else None,
                              width=side["width"] if side["shape"] == "flat" else None)
        found = nodal_stiffness(contact, forces[name], int(mine.sum()))
        kn[mine], kt[mine] = found.kn, found.kt
    return kn, kt


def reduced_model(study, tick) -> tuple[ReducedModel, ContactTable, dict]:
    """Craig-Bampton models of blades and damper side by side, the whole patch, and what the reduction was."""
    from modal.craig_bampton import assemble, craig_bampton
    from static_contact.pull import pull_forces

    meshes = read_meshes(study)
    check(study, meshes)
    pairs = whole_patch(study, meshes)
    blades, damper = assemble_bodies(study, meshes, tick)
    r = study["respond"] if "respond" in study else {"excitation": None, "patches": ()}
    groups = [blades.group(g) for g in (r["excitation"], *r["patches"]) if g]
    tick(0.15, f"reducing the blades, {blades.dofs} dofs")
    r_blades = craig_bampton(blades, np.concatenate([pairs.blade_node, *groups]), study[BLADES]["modes"])
    tick(0.75, f"reducing the damper, {damper.dofs} dofs")
    r_damper = craig_bampton(damper, pairs.damper_node, study[DAMPER]["modes"])
    d = study[DAMPER]
    nodes, forces = pull_forces(meshes[DAMPER], d["load_points"], d["axis"], d["pull_direction"],
                                shares=d["shares"], positions=d["positions"])
    r_damper.model.loads["pull"] = r_damper.condense(nodes, forces)
    for reduction in (r_blades, r_damper):
        for case in study.loads:
            force = case_forces(study, case, reduction.body, meshes[reduction.body.name])
            reduction.model.loads[case] = reduction.condense_dofs(force)
    model = assemble(r_blades.model, r_damper.model)
    masters = sum(len(r.boundary) for r in (r_blades, r_damper))
    facts = {"reduction": {"dofs": blades.dofs + damper.dofs, "masters": masters,
                           "modes": {BLADES: len(r_blades.omega), DAMPER: len(r_damper.omega)}},
             "highest_fixed_interface_hz": {b: r.omega.max(initial=0) / (2 * np.pi)
                                            for b, r in ((BLADES, r_blades), (DAMPER, r_damper))},
             "kn_kt_N_per_m": {s: [pairs.kn[pairs.side == s][0], pairs.kt[pairs.side == s][0]] for s in pairs.sides},
             "rows": {s: int(pairs.row[pairs.side == s].max()) + 1 for s in pairs.sides},
             "pull_positions_m": sorted((meshes[DAMPER].position[meshes[DAMPER].index(nodes)]
                                         @ np.array(d["axis"])).tolist())}
    return model, pairs, facts


def full_check(study, sets: dict, tick) -> dict:
    """{set: {reduced_hz, full_hz, largest_error}} against the unreduced finite-element model.

    sets {name: (pairs, springs, reduced Hz)}; as many modes of the full model as the reduced one has below the limit.
    """
    from static_contact.full import full_stuck_hz

    assembled = assemble_bodies(study, read_meshes(study), lambda *_: None)
    out = {}
    for i, (name, (pairs, springs, reduced)) in enumerate(sets.items()):
        tick(0.8 + 0.2 * i / len(sets), f"full model, {name}")
        full = full_stuck_hz(assembled, pairs, len(reduced), springs)
        out[name] = {"reduced_hz": reduced, "full_hz": full, "largest_error": float(np.abs(reduced / full - 1).max())}
    return out


# ---- matrices from anywhere ------------------------------------------------------------------------------------

def given_model(study) -> tuple[ReducedModel, ContactTable, dict]:
    """The model and pairs that [model] names, checked against each other."""
    from hbm.contact import relative_motion

    model = ReducedModel.load(study.file(study["model"]["matrices"]))
    pairs = own_pairs(study)
    for name in (BLADES, DAMPER):
        if name not in model.body:
            raise InputError(f"{study.path}: the dof table of [model] matrices has no body named '{name}'")
    relative_motion(model, pairs)
    modes = {b: int(((model.body == b) & (model.direction == "mode")).sum()) for b in (BLADES, DAMPER)}
    masters = model.size - sum(modes.values())
    rows = {s: int(pairs.row[pairs.side == s].max()) + 1 for s in pairs.sides}
    stiffness = {s: [pairs.kn[pairs.side == s][0], pairs.kt[pairs.side == s][0]] for s in pairs.sides}
    return model, pairs, {"reduction": {"dofs": model.size, "masters": masters, "modes": modes}, "rows": rows,
                          "kn_kt_N_per_m": stiffness}


def describe_model(study) -> dict:
    model, pairs, facts = given_model(study)
    return {"bodies": {b: {"dofs": int((model.body == b).sum())} for b in (BLADES, DAMPER)},
            "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides}, **facts}


def describe_meshes(study, tick) -> dict:
    """Counts, masses, boxes, groups and rigid modes of the bodies."""
    from modal.body import check_support

    meshes = read_meshes(study)
    found = {}
    for body in assemble_bodies(study, meshes, tick):
        mesh = meshes[body.name]
        found[body.name] = {
            "file": study[body.name]["mesh"], "nodes": len(mesh.node),
            "cells": {k: len(c) for k, c in mesh.cells.items()}, "free_dofs": body.dofs,
            "moving_mass_kg": body.mass(), "box_m": [mesh.position.min(axis=0), mesh.position.max(axis=0)],
            "rigid_modes": check_support(body), "groups": {k: len(v) for k, v in sorted(mesh.groups.items())},
            "not_read": list(mesh.unused)}
    pairs = whole_patch(study, meshes)
    return {"bodies": found, "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides}}
