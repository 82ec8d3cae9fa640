"""What the stage `inspect` finds in meshes or matrices, and the page on which it can be looked at."""

import numpy as np

from hbm.errors import InputError
from tipdamp import bodies, pair_checks
from tipdamp.bodies import BLADES, DAMPER
from tipdamp.plausible import distance_warnings, first_frequency, mesh_warnings
from tipdamp.stiffness import side_materials


def describe_model(study, store) -> dict:
    """Dofs and pairs of given matrices; and inspect.html with the pairs, all that can be seen of them."""
    model, pairs, facts = bodies.given_model(study)
    found = {"bodies": {b: {"dofs": int((model.body == b).sum())} for b in (BLADES, DAMPER)},
             "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides}, **facts,
             "warnings": pair_checks.pull_warnings(pairs, study.driver["pull_direction"])}
    return _with_page(study, store, found, {}, pairs, pair_checks.places_in(model, pairs))


def describe_meshes(study, store, tick) -> dict:
    """Counts, masses, boxes, groups and rigid modes of the bodies; and inspect.html, also when no pairs are found."""
    from modal.body import check_support
    from modal.mesh import DIMENSION

    meshes = bodies.read_meshes(study)
    found, warnings = {}, []
    for body in bodies.assemble_bodies(study, meshes, tick):
        mesh = meshes[body.name]
        found[body.name] = {
            "file": study[body.name]["mesh"], "format": mesh.format, "nodes": len(mesh.node),
            "cells": {k: len(c) for k, c in mesh.cells.items()}, "free_dofs": body.dofs,
            "moving_mass_kg": body.mass(), "box_m": [mesh.position.min(axis=0), mesh.position.max(axis=0)],
            "rigid_modes": check_support(body), "groups": {k: len(v) for k, v in sorted(mesh.groups.items())},
            "groups_are": {k: DIMENSION[mesh.dimension.get(k, 0)] for k in sorted(mesh.groups)},
            "cell_groups": {k: len(v) for k, v in sorted(mesh.cell_groups.items())}, "not_read": list(mesh.unused)}
        warnings += mesh_warnings(study, body.name, mesh, body.mass().max())
    found[BLADES]["first_hz"] = first_frequency(study, meshes[BLADES])
    content = {"bodies": found, "warnings": warnings}
    try:
        pairs = bodies.matched_pairs(study, meshes)
    except InputError as error:
        for name in _with_page(study, store, content, meshes, trouble=str(error)).get("pictures", ()):
            raise InputError(f"{error} (look at {store.path(name)})") from None
        raise
    angles = pair_checks.surface_angles(pairs, meshes)
    if not study["contact"]["pairs"]:
        warnings += [*distance_warnings(study, pairs, meshes)]
    content = {"bodies": found, "pairs": {s: int((pairs.side == s).sum()) for s in pairs.sides},
               "side_moduli": side_materials(study, meshes, pairs, every=True),
               "warnings": warnings + pair_checks.warnings(pairs, angles)
               + pair_checks.pull_warnings(pairs, study.driver["pull_direction"])}
    places = {BLADES: meshes[BLADES].position[meshes[BLADES].index(pairs.blade_node)],
              DAMPER: meshes[DAMPER].position[meshes[DAMPER].index(pairs.damper_node)]}
    return _with_page(study, store, content, meshes, pairs, places, angles)


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
