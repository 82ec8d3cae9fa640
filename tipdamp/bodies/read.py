"""The meshes of a study, with every group that the study names."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.split import Wanted, cut_named, named_cells, split
from tipdamp.bodies.surfaces import with_picked
from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.surfaces.pick import FacePick
from tipdamp.study.view import Study, every_key

# what every stage that works on meshes or given matrices reads of the study
# sections that name meshes, matrices or pairs
BODY_FILES = ("model", "blades", "damper", "contact")
BODY_READS = (
    "length_unit",
    "material",
    "materials",
    "rotation",
    "blades",
    *every_key(DAMPER, but=("pull", "hold")),
    *every_key("model", but=("pull", "hold")),
    "driver.axis",
    "driver.pull_direction",
    "contact.pairs",
    "contact.tolerance",
    "contact.distance",
    "contact.method",
    "contact.reduction",
    "contact.tractions",
    "sides.blade",
    "sides.damper",
    "sides.shape",
    "sides.given",
    "sides.per_node",
    "respond.excitation",
    "respond.direction",
    "respond.patches",
)


NODE = re.compile(r"node (\d{1,18})")  # a node by its number, where a group is wanted


class NamedGroup(NamedTuple):
    """A node group that the study names: of which mesh, where it is named, and the dimensions that
    make sense."""

    body: str
    where: str
    name: str
    dimensions: tuple[int, ...]


def read_meshes(study: Study) -> dict[str, Mesh]:
    """{"blades": Mesh, "damper": Mesh} in metres; every group that the study names is checked."""
    meshes = _read(study)
    for group in named_groups(study):
        try:
            meshes[group.body].group(group.name, group.dimensions)
        except InputError as error:
            raise InputError(f"{study.path}: {group.where}: {error}") from None
    held = sorted({group for mesh in meshes.values() for group in mesh.cell_groups})
    for name, material in study.materials.items():
        if material.group not in held:
            raise InputError(
                f"{study.path}: [material.{name}] group: no mesh has a group of cells "
                f"'{shown(material.group)}'; {nearest(material.group, held)}"
            )
    return with_picked(study, meshes)


def _read(study: Study) -> dict[str, Mesh]:
    """Both meshes from their files, or from the one that holds both."""
    from tipdamp.readers.dispatch import read_mesh

    files = {BLADES: study.blades.mesh, DAMPER: study.damper.mesh}
    wanted = {
        BLADES: Wanted("[blades]", study.blades.cells),
        DAMPER: Wanted("[damper]", study.damper.cells, holds=study.damper.load_points),
    }
    found: dict[str, Mesh] = {}
    for body, name in files.items():
        if body == DAMPER and study.file(name).resolve() == study.file(files[BLADES]).resolve():
            found[DAMPER] = found[BLADES]
            continue
        try:
            found[body] = _with_nodes(study, read_mesh(study.file(name), study.length_unit))
        except InputError as error:
            raise InputError(f"{study.path}: [{body}] mesh = '{shown(name)}': {error}") from None
    if found[BLADES] is found[DAMPER]:
        return dict(zip(found, split(found[BLADES], *wanted.values()), strict=True))
    return {
        body: cut_named(mesh, wanted[body], named_cells(mesh, wanted[body]))
        if wanted[body].cells
        else mesh
        for body, mesh in found.items()
    }


def _with_nodes(study: Study, mesh: Mesh) -> Mesh:
    """With a group of one node for each 'node 4711' that the study names and the mesh holds."""
    asked = {group.name for group in named_groups(study)} - set(mesh.groups)
    numbers = {name: int(found[1]) for name in sorted(asked) if (found := NODE.fullmatch(name))}
    groups = {name: np.array([n]) for name, n in numbers.items() if n in mesh.node}
    return replace(mesh, groups={**mesh.groups, **groups}) if groups else mesh


def named_groups(study: Study) -> Iterator[NamedGroup]:
    """Every node group of a mesh that the study names."""
    for i, name in enumerate(study.blades.clamp):
        yield NamedGroup(BLADES, f"[blades] clamp[{i}]", name, (0, 1, 2, 3))
    yield NamedGroup(DAMPER, "[damper] load_points", study.damper.load_points, (0, 1, 2))
    if "respond" in study:
        for name in study.respond.excitation:
            yield NamedGroup(BLADES, "[respond] excitation", name, (0, 1, 2))
        for i, name in enumerate(study.respond.patches):
            yield NamedGroup(BLADES, f"[respond] patches[{i}]", name, (0, 1, 2))
    if study.contact.pairs:
        return
    for name, side in study.sides.items():
        dimensions = (0, 1, 2) if side.shape == "cylinder" else (0, 2)
        for body, what, faces in ((BLADES, "blade", side.blade), (DAMPER, "damper", side.damper)):
            group = faces.group if isinstance(faces, FacePick) else faces
            if group:
                yield NamedGroup(body, f"[contact.{name}] {what}", group, dimensions)
