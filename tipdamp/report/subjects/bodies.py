"""What was read and where the results come from: the meshes with their node groups and the contact
nodes without a partner; tables of bodies, stages and versions."""

from collections.abc import Collection, Iterator, Mapping

from tipdamp.bodies.read import named_groups
from tipdamp.checks import pairs as pair_checks
from tipdamp.fields.surface import OuterSurface
from tipdamp.modal.mesh import Mesh
from tipdamp.report.drawing.scene import BLADE, BODY, Item, Points, Scene, Segments, Solid, view
from tipdamp.report.drawing.table import Table
from tipdamp.report.libraries import versions
from tipdamp.report.results import Results
from tipdamp.report.subjects.surroundings import box_around
from tipdamp.report.text import MM, NOTHING, distance, listing, number
from tipdamp.results import STAGES
from tipdamp.results.static_results import InspectedBody, InspectResult
from tipdamp.study.view import Study

MAX_NODES = 2000  # of one group that are drawn
MAX_UNNAMED = 12  # groups that the study does not name, each with an entry of its own in the legend
COLORS = (
    "#D55E00",
    "#0072B2",
    "#009E73",
    "#7b3f9d",
    "#E69F00",
    "#56B4E9",
    "#a0522d",
    "#CC79A7",
    "#7f8c1f",
    "#222222",
)


def mesh_groups(
    study: Study, meshes: dict[str, Mesh], surfaces: dict[str, OuterSurface], unmatched: bool
) -> Scene:
    """All groups of nodes, those that the study does not name switched off; unmatched - also
    contact nodes without a partner."""
    named = {(group.body, group.name) for group in named_groups(study)}
    hidden: list[str] = []
    items: list[Item] = [*_bodies(surfaces)]
    for points, is_named in _groups(meshes, named):
        items.append(points)
        if not is_named:
            hidden.append(points.name)
    if unmatched:
        items += without_partner(study, meshes)
    caption = (
        "The outside of the meshes with their node groups. Groups that the study names are "
        "shown, the others can be switched on in the legend. Point at a node for its number in "
        "your mesh."
        + (" Squares are contact nodes without a partner." if unmatched else "")
        + (
            " The surface is drawn with fewer nodes than the mesh has."
            if any(s.thinned for s in surfaces.values())
            else ""
        )
    )
    box = box_around([MM * s.position for s in surfaces.values()])
    return Scene(
        "groups",
        "Meshes and their groups",
        caption,
        items,
        box,
        *view(study.driver.pull_direction, study.driver.axis),
        height=680,
        hidden=frozenset(hidden),
    )


def _bodies(surfaces: Mapping[str, OuterSurface]) -> Iterator[Solid | Segments]:
    for name, skin in surfaces.items():
        place, near = MM * skin.position, name == "damper"
        yield Solid(place, skin.triangles, name, BODY if near else BLADE, 0.9 if near else 0.3)
        yield Segments(place[skin.edges[:, 0]], place[skin.edges[:, 1]], name, "#6b7680", 1.5)


def _groups(
    meshes: Mapping[str, Mesh], named: Collection[tuple[str, str]]
) -> Iterator[tuple[Points, bool]]:
    """(points of a group, whether the study names it); named groups first, groups of cells left
    out."""
    found = [
        ((body, group) not in named, body, group)
        for body, mesh in meshes.items()
        for group, nodes in mesh.groups.items()
        if mesh.dimension.get(group, 0) != 3 and len(nodes)
    ]
    order, many = list(meshes), sum(unnamed for unnamed, *_ in found) > MAX_UNNAMED
    for k, (unnamed, body, group) in enumerate(
        sorted(found, key=lambda f: (f[0], order.index(f[1]), f[2]))
    ):
        mesh, nodes = meshes[body], meshes[body].groups[group]
        step = -(-len(nodes) // MAX_NODES)
        nodes = nodes[::step]
        title = f"{body}: {group}" + (f" (1 of {step} nodes)" if step > 1 else "")
        if unnamed and many:  # every surface of a drawing has a group in files of gmsh
            title = f"{body}: other groups"
        texts = tuple(f"{body}, group {group}\nnode {n}" for n in nodes.tolist())
        yield (
            Points(
                MM * mesh.position[mesh.index(nodes)],
                title,
                COLORS[k % len(COLORS)],
                3.5,
                hover=texts,
            ),
            not unnamed,
        )


def without_partner(study: Study, meshes: dict[str, Mesh]) -> Iterator[Points]:
    """Nodes of the contact sides that have no partner within the tolerance."""
    for name, side in study.sides.items():
        groups = [
            ("blade", meshes["blades"], meshes["blades"].groups.get(side.blade, ())),
            ("damper", meshes["damper"], meshes["damper"].groups.get(side.damper, ())),
        ]
        if not all(len(nodes) for *_, nodes in groups):
            continue
        place = [mesh.position[mesh.index(nodes)] for _, mesh, nodes in groups]
        found = pair_checks.without_partner(place[0], place[1], study.contact.tolerance)
        for k, lonely in enumerate(found):
            if lonely:
                (key, _, nodes), (other, _, others) = groups[k], groups[1 - k]
                texts = tuple(
                    f"side {name}, {key} node {nodes[i]}: no partner\nnearest {other} node "
                    f"{others[j]}, {distance(d)} µm away"
                    for i, j, d in lonely
                )
                yield Points(
                    MM * place[k][[i for i, *_ in lonely]],
                    f"side '{name}': {key} nodes without a partner",
                    ("#b00000", "#D55E00")[k],
                    7.0,
                    "square",
                    hover=texts,
                )


def provenance(results: Results) -> Iterator[Table]:
    """Bodies where the study was inspected, stages before the report, versions of what is
    installed."""
    if results.inspect is not None:
        yield bodies_table(results.inspect)
    yield Table(
        f"Stages before this report, {sum(results.seconds.values()):.1f} s in total.",
        [
            {"stage": name, "what it does": STAGES[name], "seconds": f"{seconds:.1f}"}
            for name, seconds in results.seconds.items()
        ],
        left=(0, 1),
    )
    found = [{"software": name, "version": version} for name, version in versions().items()]
    yield Table("Versions.", found, left=(0, 1))


def bodies_table(found: InspectResult) -> Table:
    """What each mesh holds, or the matrices; mass and rigid modes once the body is assembled."""
    pairs = listing(f"{n} on '{side}'" for side, n in found.pairs.items())
    return Table(
        "Bodies as read." + (f" Contact pairs of the whole patch: {pairs}." if pairs else ""),
        [_body(name, body) for name, body in found.bodies.items()],
        left=(0, 1),
    )


def _body(name: str, body: InspectedBody) -> dict[str, str]:
    matrices = body.nodes is None
    dofs = body.dofs if matrices else body.free_dofs
    return {
        "body": name,
        "file": "matrices" if matrices else f"{body.file}",
        "nodes": _count(body.nodes),
        "cells": listing(f"{n} {kind}" for kind, n in body.cells.items()) or NOTHING,
        "free dofs": _count(dofs),
        "size (mm)": " × ".join(
            f"{MM * (high - low):.4g}" for low, high in zip(*body.box_m, strict=True)
        )
        or NOTHING,
        "mass (kg)": number(body.mass_kg),
        "rigid modes": _count(body.rigid_modes),
    }


def _count(n: int | None) -> str:
    return NOTHING if n is None else f"{n}"
