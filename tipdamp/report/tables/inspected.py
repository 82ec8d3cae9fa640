"""Tables of the page on what was read: contact pairs of each side, and bodies."""

from tipdamp.checks import only_friction
from tipdamp.report.drawing.table import Table
from tipdamp.report.text import MM, NOTHING, distance, listing, number, sentence
from tipdamp.results.static_results import InspectedBody, InspectResult, SideCheck


def pairs_table(found: InspectResult) -> Table:
    """Geometry of the pairs of each side."""
    trouble = next((c.trouble for c in found.pair_checks.values() if c.trouble), None)
    return Table(
        "Contact pairs. The mean normal points from the damper into the blade. Spread: largest "
        "angle between a normal and their mean. Off the surface: largest angle between a normal "
        "and that of the faces of damper or blade. Apart: from the node of the damper to that of "
        "the blade. Covered: area of contact between surfaces, and of all faces of the damper "
        "there. Force: on the side per newton of pull, without friction"
        + (f" (not found: {trouble})." if trouble else ".")
        + (f" {sentence(only_friction.said(found.only_friction))}" if found.only_friction else ""),
        (
            "side",
            "pairs",
            "stations × rows",
            "mean normal",
            "spread",
            "off the surface",
            "apart along n (µm)",
            "apart across (µm)",
            "covered (mm²)",
            "force (N/N)",
        ),
        tuple(_side(name, check) for name, check in found.pair_checks.items()),
        left=(0,),
    )


def covered(check: SideCheck) -> str:
    """'143.8 of 144': mm2 of contact, and of the damper's faces on the side; none where nodes
    match."""
    if check.area_m2 is None or check.faces_m2 is None:
        return NOTHING
    return f"{MM**2 * check.area_m2:.4g} of {MM**2 * check.faces_m2:.4g}"


def _side(name, check):
    low, high = (distance(v) for v in check.apart_along_n_m)
    return (
        name,
        f"{check.pairs}",
        f"{check.stations} × {check.rows}",
        f"({', '.join(f'{v:+.3f}' for v in check.mean_normal)})",
        f"{check.normals_within_deg:.1f}°",
        NOTHING if check.off_surface_deg is None else f"{check.off_surface_deg:.1f}°",
        low if low == high else f"{low} to {high}",
        distance(check.apart_across_m),
        covered(check),
        number(check.force_per_pull),
    )


def bodies_table(found: InspectResult) -> Table:
    """What each mesh holds, or the matrices; mass and rigid modes once the body is assembled."""
    pairs = listing(f"{n} on '{side}'" for side, n in found.pairs.items())
    return Table(
        "Bodies as read." + (f" Contact pairs of the whole patch: {pairs}." if pairs else ""),
        (
            "body",
            "file",
            "nodes",
            "cells",
            "free dofs",
            "size (mm)",
            "moving mass (kg)",
            "rigid modes",
        ),
        tuple(_body(name, body) for name, body in found.bodies.items()),
        left=(0, 1),
    )


def _body(name: str, body: InspectedBody) -> tuple[str, ...]:
    if body.nodes is None:
        return name, "matrices", NOTHING, NOTHING, f"{body.dofs}", NOTHING, NOTHING, NOTHING
    cells = listing(f"{n} {kind}" for kind, n in body.cells.items())
    size = " × ".join(f"{MM * (high - low):.4g}" for low, high in zip(*body.box_m, strict=True))
    mass = NOTHING if body.moving_mass_kg is None else number(body.moving_mass_kg[0])
    dofs, rigid = (NOTHING if n is None else f"{n}" for n in (body.free_dofs, body.rigid_modes))
    return name, f"{body.file}", f"{body.nodes}", cells, dofs, size, mass, rigid
