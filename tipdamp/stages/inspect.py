"""Stage inspect: what is in the meshes or matrices, before anything is computed, and the page to
look at it."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import Any

import numpy as np

from tipdamp.bodies import BLADES, DAMPER, loads
from tipdamp.bodies.assemble import (
    ShapeCount,
    assemble_bodies,
    check_size,
    clamped_nodes,
    master_nodes,
    materials,
    shape_counts,
)
from tipdamp.bodies.gaps import check_gaps
from tipdamp.bodies.matrices import given_model, ground_warnings
from tipdamp.bodies.pair import matched, own_pairs, places_on
from tipdamp.bodies.pieces import check_pieces
from tipdamp.bodies.read import BODY_FILES, BODY_READS, read_meshes
from tipdamp.bodies.stiffness import side_materials
from tipdamp.bodies.surfaces import SurfaceContact, damper_areas
from tipdamp.bodies.table_checks import surface_angles, unknown_places
from tipdamp.checks import only_friction
from tipdamp.checks import pairs as pair_checks
from tipdamp.checks.plausibility import (
    distance_warnings,
    expectations,
    first_frequency,
    friction_warnings,
    mesh_warnings,
    unlike_materials,
)
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError, shown
from tipdamp.modal.mesh import DIMENSION, Mesh, offered
from tipdamp.modal.mesh_checks import parts
from tipdamp.modal.mesh_support import all_held, moving_mass
from tipdamp.report.inspection_page import Inspected, inspection_page
from tipdamp.report.libraries import missing
from tipdamp.report.subjects.pairs import covered
from tipdamp.results.static_results import InspectedBody, InspectResult, SideCheck
from tipdamp.stages.stage import Stage
from tipdamp.statics.model_inputs import check_shared
from tipdamp.study.view import Study


def inspect(study: Study, store: Store, tick: Tick) -> list[str]:
    """Counts, masses, boxes, groups and rigid modes of the bodies, the pairs, and inspect.html."""
    result = _matrices(study, store) if "model" in study else _meshes(study, store, tick)
    result.save(store)
    return list(result.pictures)


def _matrices(study: Study, store: Store) -> InspectResult:
    model, pairs = given_model(study)
    prefix = f"{BLADES}/"
    check_shared(study, {k.removeprefix(prefix): len(v) for k, v in model.groups.items()})
    check_gaps(study, pairs, model.position[(model.body == DAMPER) & model.moves])
    shown = Inspected({}, pairs, pair_checks.places_in(model, pairs))
    warnings = [*ground_warnings(model, pairs), *unknown_places(model, pairs)]
    warnings += _of_pairs(study, pairs)
    bodies = {b: InspectedBody(dofs=int((model.body == b).sum())) for b in (BLADES, DAMPER)}
    return _with_page(study, store, InspectResult(bodies=bodies, warnings=tuple(warnings)), shown)


def _meshes(study: Study, store: Store, tick: Tick) -> InspectResult:
    """Load cases and pairs are checked before anything is assembled; the page is also there without
    pairs."""
    meshes = read_meshes(study)
    loads.check(study, meshes)
    bodies = {
        name: _of_mesh(study, mesh, study.blades.mesh if name == BLADES else study.damper.mesh)
        for name, mesh in meshes.items()
    }
    bodies[BLADES] = bodies[BLADES].model_copy(
        update={"first_hz": first_frequency(study, meshes[BLADES])}
    )
    try:
        contact = matched(study, meshes)
    except InputError as error:
        found = _refused(study, store, meshes, bodies, str(error))
        for name in found.pictures:
            raise InputError(f"{error} (look at {store.path(name)})") from None
        raise
    pairs = contact.pairs
    check_gaps(study, pairs, meshes[DAMPER].position)
    counts = shape_counts(study, pairs, master_nodes(study, meshes, pairs))
    bodies, warnings = _weighed(study, meshes, contact, counts, bodies, tick)
    check_shared(study, {name: len(found) for name, found in meshes[BLADES].groups.items()})
    angles = surface_angles(pairs, meshes)
    result = InspectResult(
        bodies=bodies,
        warnings=(*warnings, *_of_contact(study, meshes, pairs, angles)),
        side_moduli=side_materials(study, meshes, pairs),
        columns={name: count.columns for name, count in counts.items()},
        tractions={name: count.cells for name, count in counts.items() if count.cells},
    )
    shown = Inspected(meshes, pairs, places_on(meshes, pairs), angles)
    return _with_page(study, store, result, shown, damper_areas(study, meshes))


def _of_contact(
    study: Study, meshes: dict[str, Mesh], pairs: ContactTable, angles: np.ndarray
) -> Iterator[str]:
    """Warnings of the pairs between these meshes."""
    if not study.contact.pairs:
        yield from distance_warnings(study, pairs, meshes)
    yield from _of_pairs(study, pairs, angles)
    yield from _of_place(study, meshes[DAMPER], pairs)


def _of_pairs(study: Study, pairs: ContactTable, angles: np.ndarray | None = None) -> list[str]:
    """What the pairs alone tell; angles (P,) of `surface_angles`."""
    pull = study.driver.pull_direction
    edges = [name for name, side in study.sides.items() if side.rows == "edge"]
    return [
        *friction_warnings(study),
        *pair_checks.warnings(pairs, angles),
        *pair_checks.pull_warnings(pairs, pull, loads.damper_hold(study).directions(pairs)),
        *pair_checks.axis_warnings(pairs, study.driver.axis),
        *pair_checks.row_warnings(pairs, pull, edges),
    ]


def _of_place(study: Study, mesh: Mesh, pairs: ContactTable) -> list[str]:
    """Where the pull alone turns the damper about what no contact resists, which `preload`
    refuses."""
    direction = study.driver.pull_direction
    held = loads.damper_hold(study).directions(pairs)
    if study.loads or pair_checks.pull_warnings(pairs, direction, held):
        return []
    nodes, forces = loads.pulled(study, mesh)
    place = mesh.position[mesh.index(nodes)]
    said = only_friction.loaded(pairs, study.driver.hold, place, forces)
    return [f"a pull of 1 N: {one}; `preload` refuses that" for one in said]


def _refused(
    study: Study,
    store: Store,
    meshes: dict[str, Mesh],
    bodies: dict[str, InspectedBody],
    trouble: str,
) -> InspectResult:
    """What is known without pairs, and the page with those of the user's own table that are
    refused, where it can be read."""
    shown = Inspected(meshes, trouble=trouble)
    if study.contact.pairs:
        with suppress(InputError):
            pairs = own_pairs(study)
            angles = surface_angles(pairs, meshes)
            shown = Inspected(meshes, pairs, places_on(meshes, pairs), angles, trouble)
    warnings = [w for name, mesh in meshes.items() for w in mesh_warnings(study, name, mesh)]
    return _with_page(study, store, InspectResult(bodies=bodies, warnings=tuple(warnings)), shown)


def _of_mesh(study: Study, mesh: Mesh, file: str) -> InspectedBody:
    """What a mesh alone tells, and what of it the study does not have."""
    return InspectedBody(
        file=file,
        format=mesh.format,
        nodes=len(mesh.node),
        pieces=parts(mesh)[0],
        cells={k: len(c) for k, c in mesh.cells.items()},
        box_m=tuple(tuple(map(float, end(mesh.position, axis=0))) for end in (np.min, np.max)),
        groups={k: len(v) for k, v in sorted(mesh.groups.items())},
        groups_are={k: DIMENSION[mesh.dimension.get(k, 0)] for k in sorted(mesh.groups)},
        cell_groups={k: len(v) for k, v in sorted(mesh.cell_groups.items())},
        not_read=(*mesh.unused, *unlike_materials(study, mesh)),
    )


def _weighed(
    study: Study,
    meshes: dict[str, Mesh],
    contact: SurfaceContact,
    counts: dict[str, ShapeCount],
    bodies: dict[str, InspectedBody],
    tick: Tick,
) -> tuple[dict[str, InspectedBody], list[str]]:
    """The bodies with dofs, mass and rigid modes; the warnings about each. counts : {body: what it
    will be reduced to}."""
    figures = _by_meshes(study, meshes, counts) or _by_matrices(
        study, meshes, contact, counts, tick
    )
    found = {}
    warnings = []
    for name, of_body in figures.items():
        whole = moving_mass(
            meshes[name],
            np.zeros(len(meshes[name].node), dtype=bool),
            *materials(study, meshes[name]),
        )
        found[name] = bodies[name].model_copy(update=of_body | {"mass_kg": whole})
        warnings += mesh_warnings(study, name, meshes[name], max(of_body["moving_mass_kg"]))
    return found, warnings


def _by_meshes(
    study: Study, meshes: dict[str, Mesh], counts: dict[str, ShapeCount]
) -> dict[str, dict[str, Any]] | None:
    """{body: its figures} without matrices; None where only these tell: of loads, at speed, of a
    damper in pieces, and where the support is not plainly as it should be."""
    fixed = clamped_nodes(study, meshes[BLADES])
    alone = not study.loads and ("rotation" not in study or not study.rotation.speed)
    if not alone or parts(meshes[DAMPER])[0] > 1 or not all_held(meshes[BLADES], fixed):
        return None
    check_size(meshes, counts)
    loads.pulled(study, meshes[DAMPER])
    free = np.zeros(len(meshes[DAMPER].node), dtype=bool)
    return {
        name: {
            "free_dofs": 3 * int((~held).sum()),
            "moving_mass_kg": (moving_mass(meshes[name], held, *materials(study, meshes[name])),)
            * 3,
            "rigid_modes": rigid,
        }
        for name, held, rigid in ((BLADES, fixed, 0), (DAMPER, free, 6))
    }


def _by_matrices(
    study: Study,
    meshes: dict[str, Mesh],
    contact: SurfaceContact,
    counts: dict[str, ShapeCount],
    tick: Tick,
) -> dict[str, dict[str, Any]]:
    """{body: its figures}, and whether the support is as declared."""
    from tipdamp.modal.body import check_support

    pairs, points = contact
    assembled = loads.with_loads(
        study, assemble_bodies(study, meshes, tick, counts, points), meshes
    )
    check_pieces(meshes, assembled, pairs)
    return {
        body.name: {
            "free_dofs": body.dofs,
            "moving_mass_kg": tuple(body.mass().tolist()),
            "rigid_modes": check_support(body),
        }
        for body in assembled
    }


def _with_page(
    study: Study,
    store: Store,
    result: InspectResult,
    shown: Inspected,
    areas: Mapping[str, float] = MappingProxyType({}),
) -> InspectResult:
    """The result with its pairs and the areas {side: m2} of the damper's faces where they meet as
    surfaces, and inspect.html beside it; a warning instead where a library is missing."""
    found = dict(result)
    if shown.pairs is not None and shown.places is not None:
        found |= _checked(study, shown, shown.pairs, shown.places, areas)
    if absent := missing("plotly", "jinja2"):
        found["warnings"] = (
            *result.warnings,
            f"inspect.html is left out: {absent} is not installed",
        )
        return InspectResult(**found)
    with store.writing("inspect.html") as path:
        path.write_text(inspection_page(study, InspectResult(**found), shown), encoding="utf-8")
    return InspectResult(**{**found, "pictures": ("inspect.html",)})


def _checked(
    study: Study,
    shown: Inspected,
    pairs: ContactTable,
    places: dict[str, np.ndarray],
    areas: Mapping[str, float],
) -> dict[str, Any]:
    """Fields of InspectResult on the pairs."""
    hold = loads.damper_hold(study)
    checks = pair_checks.side_checks(
        pairs,
        places,
        np.array(study.driver.pull_direction),
        shown.angles,
        hold.directions(pairs),
    )
    for side, faces in areas.items():
        area = float(pairs.area[pairs.side == side].sum())
        checks[side] = checks[side].model_copy(update={"area_m2": area, "faces_m2": faces})
    found: dict[str, Any] = {
        "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides},
        "pair_checks": checks,
    }
    if "model" not in study:  # what given matrices hold themselves is known to `preload`
        found["only_friction"] = only_friction.held_by_friction(pairs, hold.motions)
    return found


def line(store: Store) -> str:
    """Numbers of pairs, a line for each body, and what nothing but friction holds."""
    found = InspectResult.load(store)
    lines = [
        ", ".join(
            f"{n} pairs on side '{s}'{_covered(found.pair_checks.get(s))}"
            for s, n in found.pairs.items()
        )
    ]
    for name, b in found.bodies.items():
        if b.moving_mass_kg is None:  # given matrices
            lines.append(f"{name}: {b.dofs} dofs")
            continue
        size = " x ".join(f"{1e3 * (high - low):.4g}" for low, high in zip(*b.box_m, strict=True))
        cells = ", ".join(f"{n} {kind}" for kind, n in b.cells.items())
        groups = ", ".join(f"{shown(group)} ({b.groups[group]})" for group in offered(b.groups))
        pieces = f" in {b.pieces} pieces" if b.pieces and b.pieces > 1 else ""
        lines.append(
            f"{name}: {b.nodes} nodes{pieces}, {cells}, {b.free_dofs} free dofs, {size} mm, "
            f"mass {b.mass_kg:.4g} kg, {b.rigid_modes} rigid modes; groups "
            f"(nodes): {groups}"
        )
    if found.only_friction:
        lines.append(
            f"{only_friction.said(found.only_friction)}; where a curve drifts or finds no first "
            f"point, hold its mean position: {only_friction.remedy(found.only_friction)}"
        )
    lines += [f"to look at: {store.path(name)}" for name in found.pictures]
    return "\n".join([lines[0], *(" " * 21 + text for text in lines[1:])])


def _covered(check: SideCheck | None) -> str:
    return f" ({covered(check)} mm2 covered)" if check and check.area_m2 is not None else ""


def warnings(study: Study, store: Store) -> list[str]:
    """Of the meshes and pairs, and what of the study does not fit them."""
    found = InspectResult.load(store)
    return [*found.warnings, *expectations(study, found)]


STAGE = Stage(
    inspect,
    line,
    warnings=warnings,
    outputs=("inspect.json",),
    may_write=("inspect.html",),
    reads_files=BODY_FILES,
    reads=(
        "title",
        "loads",
        "contact.mu",
        "sides.gap",
        "sides.rows",
        "driver.hold",
        "respond.share_force",
        *BODY_READS,
    ),
)
