"""A `Mesh` to and from a gmsh file (MSH 4.1), groups included. The only file of this package that imports gmsh."""

from contextlib import contextmanager
from pathlib import Path

import numpy as np

from meshes.structured import Mesh

POINT, QUAD9, HEX27 = 15, 10, 12  # gmsh's element types


@contextmanager
def _gmsh():
    import gmsh

    gmsh.initialize([], False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.model.add("mesh")
    try:
        yield gmsh.model, gmsh
    finally:
        gmsh.finalize()


def _add_group(model, dimension, name, element_type, connectivity):
    """A discrete entity with elements of its own and a physical group around it: a node may then be in many groups."""
    entity = model.addDiscreteEntity(dimension)
    model.mesh.addElementsByType(entity, element_type, [], connectivity.ravel() + 1)
    model.setPhysicalName(dimension, model.addPhysicalGroup(dimension, [entity]), name)


def write(path: str | Path, mesh: Mesh) -> None:
    """Writes `mesh` as MSH 4.1: a volume group, surface groups of 9-node faces, node sets as groups of dimension 0."""
    with _gmsh() as (model, gmsh):
        volume = model.addDiscreteEntity(3)
        model.mesh.addNodes(3, volume, np.arange(1, len(mesh.nodes) + 1), mesh.nodes.ravel())
        model.mesh.addElementsByType(volume, HEX27, [], mesh.cells.ravel() + 1)
        model.setPhysicalName(3, model.addPhysicalGroup(3, [volume]), mesh.name)
        for name, faces in mesh.surfaces.items():
            _add_group(model, 2, name, QUAD9, faces)
        for name, nodes in mesh.node_sets.items():
            _add_group(model, 0, name, POINT, nodes)
        gmsh.write(str(path))


def read(path: str | Path) -> Mesh:
    """The `Mesh` in a file written by `write`; node numbers are those of the file minus one."""
    with _gmsh() as (model, gmsh):
        gmsh.merge(str(path))
        tags, xyz, _ = model.mesh.getNodes()
        nodes = np.full((int(max(tags)), 3), np.nan)
        nodes[np.asarray(tags, int) - 1] = np.asarray(xyz).reshape(-1, 3)
        groups = {0: {}, 2: {}, 3: {}}
        for dimension, tag in model.getPhysicalGroups():
            entities = model.getEntitiesForPhysicalGroup(dimension, tag)
            found = [model.mesh.getElements(dimension, e)[2] for e in entities]
            numbers = np.concatenate([np.asarray(n, int) for f in found for n in f]) - 1
            groups[dimension][model.getPhysicalName(dimension, tag)] = numbers
    (name, cells), = groups[3].items()
    surfaces = {k: v.reshape(-1, 9) for k, v in groups[2].items()}
    return Mesh(name, nodes, cells.reshape(-1, 27), surfaces, groups[0])
