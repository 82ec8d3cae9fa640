"""inspect.html: meshes, groups and contact pairs to look at before anything is computed with them."""

import html

import numpy as np

from tipdamp import pair_checks, surface
from tipdamp.report import page, space_figures, tables
from tipdamp.report.scene import BLADE, BODY, Points, Scene, Segments, Solid, view
from tipdamp.report.text import NOTHING, distance, number, sentence

MM = 1e3
MOST = 2000              # nodes of one group that are drawn
COLORS = ("#D55E00", "#0072B2", "#009E73", "#7b3f9d", "#E69F00", "#56B4E9", "#a0522d", "#222222")


def mesh_page(study, content: dict, meshes: dict, pairs=None, places=None, angles=None, trouble: str = "") -> str:
    """The page; `content` as in inspect.json. meshes is empty for a study of matrices; without pairs, which could not
    be matched, `trouble` says why and the nodes without a partner are shown."""
    surfaces = {name: surface.skin(mesh, name) for name, mesh in meshes.items()}
    sections = []
    if pairs is not None:
        scene = space_figures.contact_pairs(pairs, places, surfaces, study.driver.axis, angles)
        sections.append(("pairs", "Contact pairs", [_pairs_table(content["pair_checks"]), scene]))
    if meshes:
        sections.append(("meshes", "Meshes and groups", [_bodies_table(content), _groups(study, meshes, surfaces,
                                                                                         pairs is None)]))
    trouble = f'<div class="warnings"><strong>Stopped</strong><ul><li>{html.escape(trouble)}</li></ul></div>'\
        if trouble else ""
    warnings = [sentence(w) for w in content["warnings"]]
    lead = ("What tipdamp has read, before anything is computed with it. Turn, zoom, and point at nodes for their "
            "numbers.")
    above = f'<p class="lead">{lead}</p>' + trouble + (page.warnings_box(warnings) if warnings or not trouble else "")
    return page.shell(study, above, sections)


def _pairs_table(checks) -> tables.Table:
    rows = []
    for side, c in checks.items():
        n = ", ".join(f"{v:+.3f}" for v in c["mean_normal"])
        low, high = (distance(v) for v in c["apart_along_n_m"])
        along = low if low == high else f"{low} to {high}"
        rows.append((side, f"{c['pairs']}", f"{c['stations']} × {c['rows']}", f"({n})",
                     f"{c['normals_within_deg']:.1f}°", _degrees(c["off_surface_deg"]), along,
                     distance(c["apart_across_m"]), number(c["force_per_pull"])))
    trouble = next((c["trouble"] for c in checks.values() if c["trouble"]), None)
    return tables.Table(
        "Contact pairs. The mean normal points from the damper into the blade; spread: largest angle of a normal to "
        "it; off the surface: largest angle of a normal to the faces of damper and blade; apart: from the damper's "
        "node to the blade's; force: on the side for each newton of pull, without friction"
        + (f" (not found: {trouble})." if trouble else "."),
        ("side", "pairs", "stations × rows", "mean normal", "spread", "off the surface", "apart along n (µm)",
         "apart across (µm)", "force (N/N)"), tuple(rows), left=(0,))


def _degrees(value) -> str:
    return NOTHING if value is None else f"{value:.1f}°"


def _bodies_table(content) -> tables.Table:
    rows = []
    for name, b in content["bodies"].items():
        cells = ", ".join(f"{n} {kind}" for kind, n in b["cells"].items())
        size = " × ".join(f"{MM * (high - low):.4g}" for low, high in zip(*np.array(b["box_m"]), strict=True))
        rows.append((name, b["file"], f"{b['nodes']}", cells, size,
                     *((NOTHING, NOTHING) if b["moving_mass_kg"] is None else (number(b["moving_mass_kg"][0]),
                                                                               f"{b['rigid_modes']}"))))
    return tables.Table("Bodies as read.", ("body", "file", "nodes", "cells", "size (mm)", "moving mass (kg)",
                                            "rigid modes"), tuple(rows), left=(0, 1))


def _groups(study, meshes, surfaces, unmatched) -> Scene:
    items = []
    for name, skin in surfaces.items():
        place, near = MM * skin.position, name == "damper"
        items.append(Solid(place, skin.triangles, name, BODY if near else BLADE, 0.9 if near else 0.3))
        items.append(Segments(place[skin.edges[:, 0]], place[skin.edges[:, 1]], name, "#6b7680", 1.5))
    named = _named(study)
    hidden, count = set(), 0
    for body, mesh in meshes.items():
        for group in sorted(mesh.groups, key=lambda g: ((body, g) not in named, g)):
            nodes = mesh.groups[group]
            if mesh.dimension.get(group, 0) == 3 or not len(nodes):
                continue
            step = -(-len(nodes) // MOST)
            nodes = nodes[::step]
            title = f"{body}: {group}" + (f" (every {step}th node)" if step > 1 else "")
            if (body, group) not in named:
                hidden.add(title)
            texts = tuple(f"{body}, group {group}\nnode {n}" for n in nodes.tolist())
            items.append(Points(MM * mesh.position[mesh.index(nodes)], title, COLORS[count % len(COLORS)], 3.5,
                                hover=texts))
            count += 1
    if unmatched:
        items += _lonely(study, meshes)
    box = space_figures.box_around([MM * s.position for s in surfaces.values()])
    caption = ("The outside of the meshes with their groups of nodes: those that the study names are shown, the others "
               "can be switched on. Point at a node for its number in your mesh."
               + (" Squares are contact nodes without a partner." if unmatched else "")
               + (" The surface is drawn with fewer nodes than it has." if any(s.thinned for s in surfaces.values())
                  else ""))
    outward = np.asarray(study.driver.pull_direction, dtype=float)
    return Scene("groups", "Meshes and their groups", caption, tuple(items), box, **view(outward, study.driver.axis),
                 height=680, hidden=frozenset(hidden))


def _named(study) -> set:
    """(body, group) of what the study names."""
    from tipdamp.bodies.read import named_groups

    return {(group.body, group.name) for group in named_groups(study)}


def _lonely(study, meshes):
    """Nodes of the contact sides that have no partner within the tolerance."""
    for name, side in study.sides.items():
        keys = ("blade", "damper")
        groups = [(body, meshes[body], meshes[body].groups.get(group, ())) for body, group
                  in (("blades", side.blade), ("damper", side.damper))]
        if not all(len(nodes) for *_, nodes in groups):
            continue
        place = [mesh.position[mesh.index(nodes)] for _, mesh, nodes in groups]
        found = pair_checks.without_partner(*place, study.contact.tolerance)
        for k, lonely in enumerate(found):
            if lonely:
                (_, _, nodes), (_, _, others), key, other = groups[k], groups[1 - k], keys[k], keys[1 - k]
                texts = tuple(f"side {name}, {key} node {nodes[i]}: no partner\nnearest {other} node {others[j]}, "
                              f"{distance(d)} µm away" for i, j, d in lonely)
                yield Points(MM * place[k][[i for i, *_ in lonely]], f"side '{name}': {key} nodes without a partner",
                             "#D55E00" if k else "#b00000", 7.0, "square", hover=texts)
