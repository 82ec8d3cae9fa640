"""What the stage `inspect` finds in meshes or matrices, and the page on which it can be looked at."""

import numpy as np

from hbm.errors import InputError
from tipdamp import bodies, loads, pair_checks
from tipdamp.bodies import BLADES, DAMPER
from tipdamp.sanity_checks import distance_warnings, expectations, first_frequency, mesh_warnings
from tipdamp.stiffness import side_materials


def describe_model(study, store) -> dict:
    """Dofs and pairs of given matrices; and inspect.html with the pairs, all that can be seen of them."""
    model, pairs, facts = bodies.given_model(study)
    found = {"bodies": {b: {"dofs": int((model.body == b).sum())} for b in (BLADES, DAMPER)},
             "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides}, **facts,
             "warnings": pair_checks.friction_warnings(study) + pair_checks.warnings(pairs)
             + pair_checks.pull_warnings(pairs, study.driver["pull_direction"])}
    return _with_page(study, store, found, {}, pairs, pair_checks.places_in(model, pairs))


def describe_meshes(study, store, tick) -> dict:
    """Counts, masses, boxes, groups and rigid modes of the bodies; and inspect.html, also when no pairs are found.

    Load cases and pairs are checked before anything is assembled.
    """
    meshes = bodies.read_meshes(study)
    loads.check(study, meshes)
    found = {name: _of_mesh(study, name, mesh) for name, mesh in meshes.items()}
    found[BLADES]["first_hz"] = first_frequency(study, meshes[BLADES])
    try:
        pairs = bodies.matched_pairs(study, meshes)
    except InputError as error:
        warnings = [w for name, mesh in meshes.items() for w in mesh_warnings(study, name, mesh)]
        content = {"bodies": found, "warnings": warnings + expectations(study, {"bodies": found})}
        for name in _with_page(study, store, content, meshes, trouble=str(error)).get("pictures", ()):
            raise InputError(f"{error} (look at {store.path(name)})") from None
        raise
    warnings = _assembled(study, meshes, pairs, found, tick)
    angles = pair_checks.surface_angles(pairs, meshes)
    if not study["contact"]["pairs"]:
        warnings += [*distance_warnings(study, pairs, meshes)]
    content = {"bodies": found, "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides},
               "side_moduli": side_materials(study, meshes, pairs, every=True),
               "warnings": warnings + pair_checks.friction_warnings(study) + pair_checks.warnings(pairs, angles)
               + pair_checks.pull_warnings(pairs, study.driver["pull_direction"])}
    places = {BLADES: meshes[BLADES].position[meshes[BLADES].index(pairs.blade_node)],
              DAMPER: meshes[DAMPER].position[meshes[DAMPER].index(pairs.damper_node)]}
    return _with_page(study, store, content, meshes, pairs, places, angles)


def _of_mesh(study, name, mesh) -> dict:
    """What a mesh alone tells; mass and rigid modes are None until the body is assembled."""
    from modal.mesh import DIMENSION

    return {"file": study[name]["mesh"], "format": mesh.format, "nodes": len(mesh.node),
            "cells": {k: len(c) for k, c in mesh.cells.items()}, "free_dofs": None, "moving_mass_kg": None,
            "box_m": [mesh.position.min(axis=0), mesh.position.max(axis=0)], "rigid_modes": None,
            "groups": {k: len(v) for k, v in sorted(mesh.groups.items())},
            "groups_are": {k: DIMENSION[mesh.dimension.get(k, 0)] for k in sorted(mesh.groups)},
            "cell_groups": {k: len(v) for k, v in sorted(mesh.cell_groups.items())}, "not_read": list(mesh.unused)}


def _assembled(study, meshes, pairs, found, tick) -> list:
    """Dofs, mass and rigid modes into `found`; the warnings about each body."""
    from modal.body import check_support

    warnings = []
    for body in bodies.assemble_bodies(study, meshes, tick, bodies.master_nodes(study, meshes, pairs)):
        found[body.name] |= {"free_dofs": body.dofs, "moving_mass_kg": body.mass(), "rigid_modes": check_support(body)}
        warnings += mesh_warnings(study, body.name, meshes[body.name], body.mass().max())
    return warnings


def _with_page(study, store, content, meshes, pairs=None, places=None, angles=None, trouble="") -> dict:
    """The content with the checks of the pairs, and inspect.html beside it; without plotly a warning instead."""

    if pairs is not None:
        direction = np.array(study.driver["pull_direction"])
        content["pair_checks"] = pair_checks.side_checks(pairs, places, direction, angles)
    try:
        import plotly  # noqa: F401
    except ImportError:
        return {**content, "warnings": [*content["warnings"], "inspect.html is left out: plotly is not installed"]}
    from tipdamp.report.mesh_page import mesh_page

    text = mesh_page(study, content, meshes, pairs, places, angles, trouble)
    with store.writing("inspect.html") as path:
        path.write_text(text, encoding="utf-8")
    return {**content, "pictures": ["inspect.html"]}
