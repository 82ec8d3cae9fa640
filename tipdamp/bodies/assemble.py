"""The finite-element bodies of a study: materials, supports, and the nodes that they are reduced
onto."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.loads import at_speed, with_loads
from tipdamp.bodies.read import read_meshes
from tipdamp.bodies.surfaces import surface_points
from tipdamp.engine.progress import Tick
from tipdamp.hbm.contact import GROUND, ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.points import ContactPoints
from tipdamp.modal.body import Body
from tipdamp.modal.contact_shapes import traction_cells
from tipdamp.modal.elasticity import Material, fixed_nodes
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.stress_recovery import nodal_stress
from tipdamp.static_contact.surfaces.points import MeshPoints
from tipdamp.study import schema
from tipdamp.study.view import Study


@dataclass(frozen=True)
class Tractions:
    """When contact shapes are of tractions, unless the study says otherwise."""

    # of a body with shapes of their own: 1800 dense columns, 40 s for the modes of both bodies
    points: int = 600
    cells: int = 200  # of a body beyond that


TRACTIONS = Tractions()


class ShapeCount(NamedTuple):
    """masters - nodes; points - contact points that are none; cells - that stand for these, None
    where they stand for themselves."""

    masters: int
    points: int
    cells: int | None

    @property
    def columns(self) -> int:
        """Master dofs and contact shapes."""
        return 3 * (self.masters + (self.cells or self.points))


@dataclass(frozen=True)
class MeshedBody:
    """A body with its loads on its mesh; others - materials of groups of cells."""

    body: Body
    mesh: Mesh
    material: Material
    others: dict[str, Material]

    def stress(self, u: np.ndarray) -> np.ndarray:
        """Of displacements (n, 3) m of the nodes."""
        return nodal_stress(self.mesh, self.material, u, self.others)


def meshed_bodies(
    study: Study, cases: Iterable[str] | None = None, tick: Tick = lambda *_: None
) -> list[MeshedBody]:
    """[blades, damper] of the study, read and assembled, with `loads` as of `with_loads`."""
    meshes = read_meshes(study)
    bodies = with_loads(study, assemble_bodies(study, meshes, tick), meshes, cases)
    return [
        MeshedBody(body, meshes[body.name], *materials(study, meshes[body.name])) for body in bodies
    ]


def assemble_bodies(
    study: Study,
    meshes: dict[str, Mesh],
    tick: Tick,
    counts: dict[str, ShapeCount] | None = None,
    points: dict[str, MeshPoints] | None = None,
) -> list[Body]:
    """[blades, damper]; the support of each is checked when it is reduced.

    counts : {body: ...} of `shape_counts`, for the forecast of the memory
    points : of `pair.matched`, where that is known already
    """
    from tipdamp.modal.elasticity import elastic_body

    check_size(meshes, counts)
    tick(0.02, "assembling the blades")
    blades = assembled_blades(study, meshes[BLADES])
    tick(0.1, "assembling the damper")
    material, others = materials(study, meshes[DAMPER])
    damper = elastic_body(meshes[DAMPER], material, DAMPER, other_materials=others, free=True)
    if points is None:
        met = surface_points(study, meshes)
        points = met.points if met else {}
    return [
        replace(body, points=points[body.name].on(body)) if points else body
        for body in (blades, damper)
    ]


def assembled_blades(study: Study, mesh: Mesh) -> Body:
    """The blades, clamped, at the speed of the study."""
    from tipdamp.modal.elasticity import elastic_body

    material, others = materials(study, mesh)
    blades = elastic_body(mesh, material, BLADES, other_materials=others, clamp=study.blades.clamp)
    return at_speed(study, blades, mesh, material, others)


def check_size(meshes: dict[str, Mesh], counts: dict[str, ShapeCount] | None = None) -> None:
    """InputError where the memory will not hold the bodies; counts as of `assemble_bodies`."""
    from tipdamp.modal.memory import check_memory

    check_memory(
        *(
            (len(mesh.node), counts[name].columns // 3 if counts else 0, mesh.source)
            for name, mesh in meshes.items()
        )
    )


def clamped_nodes(study: Study, mesh: Mesh) -> np.ndarray:
    """(n,) bool: nodes of the mesh of the blades that its clamp fixes."""
    return fixed_nodes(mesh, study.blades.clamp)


def materials(study: Study, mesh: Mesh) -> tuple[Material, dict[str, Material]]:
    """The study's Material, and {group of cells: Material} of those cells of the mesh that are of
    another."""
    return _material(study.material), {
        m.group: _material(m) for m in study.materials.values() if m.group in mesh.cell_groups
    }


def _material(section: schema.MaterialSection | schema.OtherMaterial) -> Material:
    return Material(section.E, section.nu, section.density)


def with_points(body: Body, pairs: ContactTable, masters: np.ndarray) -> Body:
    """The body with those nodes of its pairs as contact points that are no masters."""
    nodes = np.concatenate(
        [
            numbers[(bodies == body.name) & ~pairs.on_surface]
            for bodies, numbers in (
                (pairs.blade_body, pairs.blade_node),
                (pairs.damper_body, pairs.damper_node),
            )
        ]
    )
    nodes = np.setdiff1d(nodes, masters)
    if not len(nodes):
        return body
    order = np.argsort(body.node)
    place = body.position[order[np.searchsorted(body.node, nodes, sorter=order)]]
    motion = body.motion_of(body.name, nodes)
    points = ContactPoints(nodes, place, motion)
    if (known := body.points) is not None:
        points = ContactPoints(
            np.r_[known.number, nodes],
            np.vstack([known.position, place]),
            sp.vstack([known.motion, motion]),
        )
    return replace(body, points=points)


def tractions_on(study: Study, body: Body, pairs: ContactTable) -> sp.csr_matrix | None:
    """(points, cells) shares of the contact points of a body in unit forces on cells, by area; of
    nodes, which know no area, by their number. None where every point has contact shapes of its
    own."""
    if body.points is None or (most := most_cells(study, len(body.points.number))) is None:
        return None
    numbers = np.where(pairs.blade_body == body.name, pairs.blade_node, pairs.damper_node)
    touching = (pairs.blade_body == body.name) | (pairs.damper_body == body.name)
    known, first = np.unique(numbers[touching], return_index=True)
    rows = np.flatnonzero(touching)[first[np.searchsorted(known, body.points.number)]]
    area = pairs.area[rows]
    usual = pairs.area[pairs.area > 0].mean() if (pairs.area > 0).any() else 1.0
    return traction_cells(
        body.points.position, np.where(area > 0, area, usual), pairs.side[rows], most
    )


def most_cells(study: Study, points: int) -> int | None:
    """Cells that stand for so many contact points of a body; None where each stands for itself."""
    wanted = study.contact.tractions
    if wanted == "auto":
        return TRACTIONS.cells if points > TRACTIONS.points else None
    return wanted if points > wanted else None


def shape_counts(
    study: Study, pairs: ContactTable, masters: dict[str, np.ndarray]
) -> dict[str, ShapeCount]:
    """{body: of what it is reduced to}"""
    found = {}
    for name, bodies, nodes in (
        (BLADES, pairs.blade_body, pairs.blade_node),
        (DAMPER, pairs.damper_body, pairs.damper_node),
    ):
        points = len(np.setdiff1d(nodes[bodies == name], masters[name]))
        found[name] = ShapeCount(len(np.unique(masters[name])), points, most_cells(study, points))
    return found


def master_nodes(
    study: Study, meshes: dict[str, Mesh], pairs: ContactTable
) -> dict[str, np.ndarray]:
    """{"blades": node numbers, "damper": node numbers} that the bodies are reduced onto: excitation
    and response, and pairs of nodes unless they are to be contact points. InputError where one of
    them is clamped."""
    pairs = pairs.select(~pairs.on_surface)  # contact points bring shapes of their own
    on_blades = pairs.blade_body != GROUND
    nodes = {
        f"[contact.{s}] the pairs": pairs.blade_node[on_blades & (pairs.side == s)]
        for s in pairs.sides
    }
    if "respond" in study:
        nodes |= {
            f"[respond] group '{g}'": meshes[BLADES].group(g)
            for g in (*study.respond.excitation, *study.respond.patches)
        }
    for group in study.blades.clamp:
        # one that is not there is refused where it is used
        held = meshes[BLADES].groups.get(group, ())
        for what, mine in nodes.items():
            if len(both := np.intersect1d(mine, held)):
                raise InputError(
                    f"{study.path}: {what}: node {both[0]} of the blades is clamped by group "
                    f"'{group}' and cannot move ({len(both)} such nodes)"
                )
    damper = pairs.damper_node[pairs.damper_body != GROUND]
    if study.contact.reduction == "contact_points":
        nodes, damper = (
            {what: mine for what, mine in nodes.items() if what.startswith("[respond]")},
            damper[:0],
        )
    return {BLADES: np.concatenate([np.empty(0, dtype=np.int64), *nodes.values()]), DAMPER: damper}
