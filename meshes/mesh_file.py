"""A `HexMesh` to and from a gmsh file (MSH 4.1), groups included. The only file of this package
that imports gmsh."""

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from tipdamp.meshes.structured import HexMesh

POINT = 15  # gmsh's element types
FACE, CELL = {6: 9, 9: 10}, {10: 11, 27: 12}  # by the number of nodes


@contextmanager
def _gmsh() -> Iterator[tuple[Any, ModuleType]]:
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


def _add_group(
    model: Any, dimension: int, name: str, element_type: int, connectivity: np.ndarray
) -> None:
    """A discrete entity with elements of its own and a physical group around it: a node may then be
    in many groups."""
    entity = model.addDiscreteEntity(dimension)
    model.mesh.addElementsByType(entity, element_type, [], connectivity.ravel() + 1)
    model.setPhysicalName(dimension, model.addPhysicalGroup(dimension, [entity]), name)


def write(path: str | Path, mesh: HexMesh) -> None:
    """Writes `mesh` as MSH 4.1: a volume group, surface groups of faces, node sets as groups of
    dimension 0."""
    with _gmsh() as (model, gmsh):
        volume = model.addDiscreteEntity(3)
        model.mesh.addNodes(3, volume, np.arange(1, len(mesh.nodes) + 1), mesh.nodes.ravel())
        model.mesh.addElementsByType(volume, CELL[mesh.cells.shape[1]], [], mesh.cells.ravel() + 1)
        model.setPhysicalName(3, model.addPhysicalGroup(3, [volume]), mesh.name)
        for name, faces in mesh.surfaces.items():
            _add_group(model, 2, name, FACE[faces.shape[1]], faces)
        for name, nodes in mesh.node_sets.items():
            _add_group(model, 0, name, POINT, nodes)
        gmsh.write(str(path))


def read(path: str | Path) -> HexMesh:
    """The `HexMesh` in a file written by `write`; node numbers are those of the file minus one."""
    with _gmsh() as (model, gmsh):
        gmsh.merge(str(path))
        tags, xyz, _ = model.mesh.getNodes()
        nodes = np.full((int(max(tags)), 3), np.nan)
        nodes[np.asarray(tags, int) - 1] = np.asarray(xyz).reshape(-1, 3)
        groups: dict[int, dict[str, np.ndarray]] = {0: {}, 2: {}, 3: {}}
        for dimension, tag in model.getPhysicalGroups():
            entities = model.getEntitiesForPhysicalGroup(dimension, tag)
            found = [model.mesh.getElements(dimension, e)[2] for e in entities]
            numbers = np.concatenate([np.asarray(n, int) for f in found for n in f]) - 1
            groups[dimension][model.getPhysicalName(dimension, tag)] = numbers
    ((name, cells),) = groups[3].items()
    surfaces = {k: v.reshape(-1, 9) for k, v in groups[2].items()}
    return HexMesh(name, nodes, cells.reshape(-1, 27), surfaces, groups[0])


def extruded_tetrahedra(
    loop: np.ndarray,
    sharp: np.ndarray,
    length: float,
    edge: np.ndarray,
    pieces: np.ndarray,
    ruled: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unstructured mesh of a section in x, z that is extruded along y from 0 to `length`: nodes (N,
    3), straight 10-node tetrahedra (m, 10) and the 6-node triangles of its surface (f, 6).

    loop : (p, 2) m - places along the section's border; sharp : (n,) int - which of them are
        corners; the border between two corners is a spline through the places there
    edge : (n,) m - of the tetrahedra at the corners
    pieces : (n,) int - equal ones of the line along y through each corner; 0: as many as `edge`
    asks for
    ruled : (n,) bool - sides of the section, each from its corner to the next, that are cut into
        one row of rectangles, and these into two triangles each
    """
    with _gmsh() as (model, gmsh):
        base = _section(model.geo, loop, sharp, edge)
        top, volume, *sides = [tag for _, tag in model.geo.extrude([(2, base)], 0.0, length, 0.0)]
        model.geo.synchronize()
        _rule(
            model,
            loop[sharp],
            pieces,
            [side for side, one in zip(sides, ruled, strict=True) if one],
        )
        for name in ("Min", "Max"):
            gmsh.option.setNumber(
                f"Mesh.CharacteristicLength{name}", edge.max() if name == "Max" else edge.min() / 3
            )
        gmsh.option.setNumber("Mesh.Algorithm", 5)  # of its 2-D meshers the one with fewest slivers
        # of a coarse mesh curved cells may be inverted
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)
        model.mesh.generate(3)
        model.mesh.setOrder(2)
        tags, xyz, _ = model.mesh.getNodes()
        cells = np.asarray(model.mesh.getElementsByType(CELL[10], volume)[1]).reshape(-1, 10)
        faces = np.concatenate(
            [model.mesh.getElementsByType(FACE[6], s)[1] for s in (base, *sides, top)]
        )
    used, index = np.unique(cells, return_inverse=True)
    place = np.zeros((int(max(tags)) + 1, 3))
    place[np.asarray(tags, int)] = np.asarray(xyz).reshape(-1, 3)
    return place[used], index.reshape(cells.shape), np.searchsorted(used, faces.reshape(-1, 6))


def _section(geo: Any, loop: np.ndarray, sharp: np.ndarray, edge: np.ndarray) -> int:
    """The surface with the border of `extruded_tetrahedra`."""
    sizes = np.full(len(loop), edge.max())
    sizes[sharp] = edge
    points = [geo.addPoint(x, 0.0, z, e) for (x, z), e in zip(loop, sizes, strict=True)]
    around = points[sharp[0] :] + points[: sharp[0] + 1]
    lines = [
        (geo.addLine if last - first == 1 else lambda *tags: geo.addSpline(tags))(
            *around[first : last + 1]
        )
        for first, last in pairwise([*(sharp - sharp[0]), len(loop)])
    ]
    return geo.addPlaneSurface([geo.addCurveLoop(lines)])


def _rule(model: Any, loop: np.ndarray, pieces: np.ndarray, surfaces: list[int]) -> None:
    """Lines along y in equal pieces, surfaces in one row of rectangles that are each cut into two
    triangles."""
    across = {
        curve
        for surface in surfaces
        for _, curve in model.getBoundary([(2, surface)], oriented=False)
    }
    for _, curve in model.getEntities(1):
        low, high = np.reshape(model.getBoundingBox(1, curve), (2, 3))
        if np.ptp([low, high], axis=0).argmax() == 1:
            count = pieces[np.linalg.norm(loop - ((low + high) / 2)[[0, 2]], axis=1).argmin()]
            if count:
                model.mesh.setTransfiniteCurve(curve, int(count) + 1)
        elif curve in across:
            model.mesh.setTransfiniteCurve(curve, 2)
    for surface in surfaces:
        model.mesh.setTransfiniteSurface(surface)
