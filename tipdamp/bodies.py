"""From the study to bodies: meshes read and assembled, pairs matched, Craig-Bampton models; or given matrices.

The finite-element half of the stages `inspect`, `reduce` and `tune`.
"""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError, nearest, shown
from hbm.model import ReducedModel
from tipdamp.loads import at_speed, case_forces, check
from tipdamp.stiffness import side_materials, with_values

BLADES, DAMPER = "blades", "damper"
_INDEFINITE = 1e-9      # of the stiffness of a dof held alone
CHECK_BELOW_HZ = 5000.0  # the stuck frequencies that are checked, and that a wanted error is of


# ---- meshes ----------------------------------------------------------------------------------------------------

def read_meshes(study) -> dict:
    """{"blades": Mesh, "damper": Mesh} in metres; every group that the study names is checked."""
    from tipdamp.readers.dispatch import read_mesh

    meshes = {}
    for name in (BLADES, DAMPER):
        try:
            meshes[name] = read_mesh(study.file(study[name]["mesh"]), study.length_unit)
        except InputError as error:
            raise InputError(f"{study.path}: [{name}] mesh = '{shown(study[name]['mesh'])}': {error}") from None
    for name, section, key, dimensions in named_groups(study):
        try:
            meshes[name].group(study.group_name(section, key), dimensions)
        except InputError as error:
            raise InputError(f"{study.path}: [{section}] {key}: {error}") from None
    for name, material in study.materials.items():
        held = sorted({group for mesh in meshes.values() for group in mesh.cell_groups})
        if material["group"] not in held:
            raise InputError(f"{study.path}: [material.{name}] group: no mesh has a group of cells "
                             f"'{shown(material['group'])}'; {nearest(material['group'], held)}")
    return meshes


def named_groups(study):
    """(body, section, key, dimensions that make sense) of every key of the study that names a node group of a mesh."""
    for i in range(len(study[BLADES]["clamp"])):
        yield BLADES, BLADES, f"clamp[{i}]", (0, 1, 2, 3)
    yield DAMPER, DAMPER, "load_points", (0, 1, 2)
    if "respond" in study:
        yield BLADES, "respond", "excitation", (0, 1, 2)
        for i in range(len(study["respond"]["patches"])):
            yield BLADES, "respond", f"patches[{i}]", (0, 1, 2)
    for name in () if study["contact"]["pairs"] else study.sides:
        dimensions = (0, 1, 2) if study.sides[name]["shape"] == "cylinder" else (0, 2)
        yield BLADES, f"contact.{name}", "blade", dimensions
        yield DAMPER, f"contact.{name}", "damper", dimensions


def master_nodes(study, meshes, pairs) -> dict:
    """{"blades": node numbers, "damper": node numbers} that the bodies are reduced onto. InputError where one of them
    is clamped."""
    r = study["respond"] if "respond" in study else {"excitation": None, "patches": ()}
    groups = {f"[respond] group '{g}'": meshes[BLADES].group(g) for g in (r["excitation"], *r["patches"]) if g}
    nodes = {**{f"[contact.{s}] the pairs": pairs.blade_node[pairs.side == s] for s in pairs.sides}, **groups}
    clamps = study[BLADES]["clamp"]
    for group in [clamps] if isinstance(clamps, str) else clamps:
        held = meshes[BLADES].groups.get(group, ())          # one that is not there is refused where it is used
        for what, mine in nodes.items():
            if len(both := np.intersect1d(mine, held)):
                raise InputError(f"{study.path}: {what}: node {both[0]} of the blades is clamped by group '{group}' "
                                 f"and cannot move ({len(both)} such nodes)")
    return {BLADES: np.concatenate(list(nodes.values())), DAMPER: pairs.damper_node}


def assemble_bodies(study, meshes, tick, masters=None) -> list:
    """[blades, damper] as Body records; the support of each is checked when it is reduced, onto the `masters` that
    the forecast of the memory then counts."""
    from modal.elasticity import elastic_body
    from modal.memory import check_memory

    check_memory(*((len(mesh.node), len(np.unique(masters[name])) if masters else 0, mesh.source)
                   for name, mesh in meshes.items()))

    def body(name, **support):
        own, others = materials(study, meshes[name])
        return elastic_body(meshes[name], own, name, other_materials=others, **support)

    tick(0.02, "assembling the blades")
    blades = body(BLADES, clamp=study[BLADES]["clamp"])
    blades = at_speed(study, blades, meshes[BLADES], *materials(study, meshes[BLADES]))
    tick(0.1, "assembling the damper")
    return [blades, body(DAMPER, free=True)]


def materials(study, mesh) -> tuple:
    """The study's Material, and {group of cells: Material} of those cells of the mesh that are of another."""
    from modal.elasticity import Material

    def material(section):
        return Material(section["E"], section["nu"], section["density"])

    return material(study["material"]), {m["group"]: material(m) for m in study.materials.values()
                                         if m["group"] in mesh.cell_groups}


def matched_pairs(study, meshes) -> ContactTable:
    """All node pairs of all sides with their frames: matched between the meshes, or the person's own table."""
    from static_contact.pairing import Side, join, offsets, pair

    damper, contact = study[DAMPER], study["contact"]
    if contact["pairs"]:
        pairs = own_pairs(study)
        check_positions(study, meshes, pairs)
        return pairs
    pairs = join(*(pair(meshes[BLADES], meshes[DAMPER], Side(name, side["blade"], side["damper"], BLADES, DAMPER),
                        axis=damper["axis"], pull=damper["pull_direction"], tolerance=contact["tolerance"])
                   for name, side in study.sides.items()))
    if contact["distance"] == "gap":
        pairs = pairs.replace(gap=offsets(pairs, meshes[BLADES], meshes[DAMPER]))
    return pairs


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
    for column, bad in (("kn", ~np.isfinite(pairs.kn) | (pairs.kn <= 0)), ("kt", ~np.isfinite(pairs.kt))):
        if bad.any():
            i = int(bad.argmax())
            raise InputError(f"{study.path}: [contact] pairs, pair {i + 1}: {column} = {getattr(pairs, column)[i]:g} "
                             "must be finite" + (" and above 0; hard contact in the statics is [contact] normal = "
                                                 "\"hard\", a pair that does not carry has weight 0" if column == "kn"
                                                 else ""))
    for side in pairs.sides:
        _check_stations(f"{study.path}: [contact] pairs, side '{side}'", pairs.select(pairs.side == side),
                        np.array(study.driver["axis"]))
    return pairs


def _check_stations(where, pairs, axis):
    """Stations count from 0 along the axis without a gap, as the detachment counts them."""
    numbers = np.unique(pairs.station)
    if numbers.tolist() != list(range(len(numbers))):
        raise InputError(f"{where}: stations must count from 0 without a gap, found {numbers[0]}..{numbers[-1]} "
                         f"({len(numbers)} different ones)")
    along = pairs.position @ axis
    place = np.array([along[pairs.station == s].mean() for s in numbers])
    if (np.diff(place) <= 0).any():
        raise InputError(f"{where}: station {int(np.diff(place).argmin()) + 1} does not lie further along the axis "
                         "than the one before it")


def check_positions(study, meshes, pairs: ContactTable) -> None:
    """A table of one's own must belong to these meshes: nodes exist and lie where the table says."""
    for name, numbers in ((BLADES, pairs.blade_node), (DAMPER, pairs.damper_node)):
        mesh = meshes[name]
        off = np.linalg.norm(mesh.position[mesh.index(numbers)] - pairs.position, axis=1)
        if off.max() > study["contact"]["tolerance"]:
            i = int(off.argmax())
            raise InputError(f"{study.path}: [contact] pairs, row {i + 1}: node {numbers[i]} of the {name} lies "
                             f"{off[i]:.3g} m from where the table has it, more than [contact] tolerance")


def reduced_model(study, store, tick) -> tuple:
    """(model, pairs, facts, truncation): Craig-Bampton models of blades and damper side by side, the whole patch, what
    the reduction was and what it left out.

    Also keeps what pictures need of the meshes and of the bodies' own modes.
    """
    from modal.craig_bampton import assemble
    from modal.loads import nodal_load
    from modal.truncation import join
    from static_contact.pull import pull_forces
    from tipdamp.visualization import keep_bodies

    meshes = read_meshes(study)
    check(study, meshes)
    pairs = matched_pairs(study, meshes)
    masters = master_nodes(study, meshes, pairs)
    blades, damper = assemble_bodies(study, meshes, tick, masters)
    materials = side_materials(study, meshes, pairs)
    d = study[DAMPER]
    nodes, forces = pull_forces(meshes[DAMPER], d["load_points"], d["axis"], d["pull_direction"],
                                weights=d["shares"], positions=d["positions"])
    loads = {body.name: {case: case_forces(study, case, body, meshes[body.name]) for case in study.loads}
             for body in (blades, damper)}
    loads[DAMPER]["pull"] = nodal_load(damper, nodes, forces)
    r_blades, r_damper = reduce_bodies(study, (blades, damper), masters, loads, with_values(study, pairs, materials),
                                       tick)
    for reduction in (r_blades, r_damper):
        for case, force in loads[reduction.body.name].items():
            reduction.model.loads[case] = reduction.condense_dofs(force)
    model = assemble(r_blades.model, r_damper.model)
    masters = sum(len(r.boundary) for r in (r_blades, r_damper))
    facts = {"reduction": {"dofs": blades.dofs + damper.dofs, "masters": masters,
                           "modes": {r.body.name: len(r.omega) - r.load_modes for r in (r_blades, r_damper)},
                           "load_modes": {r.body.name: r.load_modes for r in (r_blades, r_damper)}},
             "highest_fixed_interface_hz": {
                 r.body.name: r.omega[:len(r.omega) - r.load_modes].max(initial=0) / (2 * np.pi)
                 for r in (r_blades, r_damper)},
             "rows": {s: int(pairs.row[pairs.side == s].max()) + 1 for s in pairs.sides},
             "side_materials": materials, "pictures": keep_bodies(store, meshes, (r_blades, r_damper), model),
             "pull_positions_m": sorted((meshes[DAMPER].position[meshes[DAMPER].index(nodes)]
                                         @ np.array(d["axis"])).tolist())}
    return model, pairs, facts, join(r_blades.truncation, r_damper.truncation)


def reduce_bodies(study, whole, masters, loads, pairs, tick) -> list:
    """Reductions with the modes that the study asks for: a number, all below a frequency, or enough for an error; and
    the static shapes of loads {body: {name: (d,) N}} where it asks for them."""
    from modal.craig_bampton import craig_bampton
    from static_contact.reduction_error import enough_modes, own_error

    def reduced(body, below_hz=None):
        said = study[body.name]
        shapes = list(loads[body.name].values()) if said["load_modes"] else ()
        if said["error"] or said["modes_below_hz"]:
            return craig_bampton(body, masters[body.name], below_hz=below_hz or said["modes_below_hz"], loads=shapes)
        return craig_bampton(body, masters[body.name], said["modes"], loads=shapes)

    targets = [study[body.name]["error"] for body in whole]
    parts = []
    for body, share in zip(whole, (0.15, 0.75), strict=True):
        tick(share, f"reducing the {body.name}, {body.dofs} dofs")
        parts.append(reduced(body, 4 * CHECK_BELOW_HZ if study[body.name]["error"] else None))
    def error(i):
        return own_error(parts, i, len(parts[i].omega) - parts[i].load_modes, pairs, CHECK_BELOW_HZ)

    for i, target in enumerate(targets):
        cut = 4 * CHECK_BELOW_HZ
        while target and error(i) > target and cut < 1e6:
            cut *= 2
            tick(0.85, f"{whole[i].name}: modes up to {cut:g} Hz")
            parts[i] = reduced(whole[i], cut)
    return [part.fewer(n) for part, n in zip(parts, enough_modes(parts, targets, pairs, CHECK_BELOW_HZ), strict=True)]


def full_check(study, sets: dict, tick) -> dict:
    """{set: {reduced_hz, full_hz, largest_error}} against the unreduced finite-element model.

    sets {name: (pairs, springs, reduced Hz)}; as many modes of the full model as the reduced one has below the limit.
    """
    from static_contact.full.stuck_modes import full_stuck_hz

    assembled = assemble_bodies(study, read_meshes(study), lambda *_: None)
    out = {}
    for i, (name, (pairs, springs, reduced)) in enumerate(sets.items()):
        tick(0.8 + 0.2 * i / len(sets), f"full model, {name}")
        full = full_stuck_hz(assembled, pairs, len(reduced), springs)
        error = np.abs(reduced / full - 1).max(initial=0.0)
        out[name] = {"reduced_hz": reduced, "full_hz": full, "largest_error": float(error)}
    return out


# ---- matrices from anywhere ------------------------------------------------------------------------------------

def given_model(study) -> tuple[ReducedModel, ContactTable, dict]:
    """The model and pairs that [model] names, checked against each other."""
    from hbm.contact import relative_motion

    matrices = study.file(study["model"]["matrices"])
    try:
        model = ReducedModel.load(matrices)
    except InputError:
        raise
    except ValueError as error:          # numpy reads no pickled objects
        raise InputError(f"{study.path}: [model] matrices = '{matrices}': {error}") from None
    pairs = own_pairs(study)
    for name in (BLADES, DAMPER):
        if name not in model.body:
            raise InputError(f"{study.path}: the dof table of [model] matrices has no body named '{name}'")
    relative_motion(model, pairs)
    for name in (BLADES, DAMPER):
        check_stiffness(f"{study.path}: [model] matrices", model.part(name), name, free=name == DAMPER)
    if "pull" not in model.loads:
        raise InputError(f"{study.path}: [model] matrices hold no load named 'pull' (1 N on the damper)")
    modes = {b: int(((model.body == b) & (model.direction == "mode")).sum()) for b in (BLADES, DAMPER)}
    masters = model.size - sum(modes.values())
    rows = {s: int(pairs.row[pairs.side == s].max()) + 1 for s in pairs.sides}
    return model, pairs, {"reduction": {"dofs": model.size, "masters": masters, "modes": modes}, "rows": rows}


def check_stiffness(where, model: ReducedModel, name: str, free: bool):
    """No motion of a body meets negative stiffness; the blades stand on something; the damper may float."""
    diagonal = model.K.diagonal()
    scale = np.sqrt(np.where(diagonal > 0, diagonal, np.abs(model.K).max() or 1.0))
    lam, shape = np.linalg.eigh(model.K / np.outer(scale, scale))
    dof = int(np.abs(shape[:, 0]).argmax())
    at = f"dof {dof} of the {name} (node {model.node[dof]}, {model.direction[dof]})"
    if lam[0] < -_INDEFINITE:
        raise InputError(f"{where}: K is indefinite: a motion mostly of {at} has negative stiffness ({lam[0]:.1e} of "
                         "its diagonal)")
    floating = int((lam < _INDEFINITE * np.sqrt(len(lam))).sum())
    if floating and not free:
        raise InputError(f"{where}: {floating} motions of the {name} meet no stiffness, one mostly of {at}: only the "
                         "damper may be free")
