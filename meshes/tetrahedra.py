"""The two-blade rig as a mesher leaves it: unstructured tetrahedra in the blades, hexahedra in the damper, and
contact faces that do not match. Same geometry as meshes/two_blade_rig.py, whose section is extruded.

    python -m meshes.tetrahedra --damper wedge --edge 0.004 --size 0.5 --out FOLDER

writes FOLDER/tet_blades.msh and FOLDER/tet_damper.msh, and both bodies as FOLDER/tet_rig.inp (Abaqus), metres.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from hbm.errors import InputError
from meshes import abaqus_file, mesh_file
from meshes.rig import DAMPERS, SIDES, Cells, Contact, Rig, contact
from meshes.sections import blades_section
from meshes.structured import Mesh, find_nodes
from meshes.two_blade_rig import ON_SURFACE, blade_node_sets, build


def blades(rig: Rig, found: Contact, edge: float) -> Mesh:
    """The blades in tetrahedra with edges of about `edge` m; groups as in two_blade_rig, without the contact nodes."""
    points, quads = blades_section(rig, found, replace(Cells.of_size(0.5), height=8), 2)    # chords of its curved sides
    loop = points[outline(quads)]
    half = rig.patch_half_length
    levels = np.array([0.0, rig.length / 2 - half, rig.length / 2, rig.length / 2 + half, rig.length])
    nodes, cells, faces = mesh_file.extruded_tetrahedra(loop, levels, edge)
    place = nodes[faces]
    sets = {name: find_nodes(nodes, at) for name, at in blade_node_sets(rig).items()}
    return Mesh("blades", nodes, cells, {name: faces[chosen] for name, chosen in _surfaces(rig, found, place)}, sets)


def _surfaces(rig, found, place):
    """(name, (f,) bool) of the triangles with nodes at place (f, 6, 3)."""
    x, _, z = np.moveaxis(place, 2, 0)
    bottom = np.abs(z + rig.fixture_height) < ON_SURFACE
    yield "clamp", (bottom & (np.abs(x) > rig.free_span / 2 - ON_SURFACE)).all(axis=1)
    for side in SIDES:
        above = (z > rig.height - rig.cover_height - ON_SURFACE) & (z < found.turn[side] + ON_SURFACE)
        yield f"cover_{side}", ((np.abs(x - found.face_x(side, z)) < ON_SURFACE) & above).all(axis=1)


def outline(quads: np.ndarray) -> np.ndarray:
    """Nodes of the border of 9-node quadrilaterals (m, 3, 3), in turn, middles included."""
    edges = np.concatenate([quads[:, 0], quads[:, -1], quads[:, :, 0], quads[:, :, -1]])
    _, first, count = np.unique(np.sort(edges[:, [0, 2]], axis=1), axis=0, return_index=True, return_counts=True)
    border = edges[first[count == 1]]
    ways: dict[int, list[tuple[int, int]]] = {}
    for a, middle, b in border.tolist():
        ways.setdefault(a, []).append((middle, b))
        ways.setdefault(b, []).append((middle, a))
    loop, at = [], int(border[0, 0])
    while len(loop) < 2 * len(border):
        middle, following = next(way for way in ways[at] if way[0] not in loop[-1:])
        loop += [at, middle]
        at = following
    return np.array(loop)


def generate(rig: Rig, damper: str, edge: float, size: float, folder: str | Path) -> dict[str, Path]:
    """Both files and the one with both bodies -> {'blades', 'damper', 'both': path}.

    size - of the damper's cells, as in `two_blade_rig`
    """
    found, folder = contact(rig, damper), Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    both = blades(rig, found, edge), build(rig, damper, size)[1]
    paths = {mesh.name: folder / f"tet_{mesh.name}.msh" for mesh in both}
    for mesh in both:
        mesh_file.write(paths[mesh.name], mesh)
    abaqus_file.write(folder / "tet_rig.inp", both)
    return {**paths, "both": folder / "tet_rig.inp"}


def main(arguments: list[str] | None = None) -> int | None:
    """Command line: write the meshes; 2 after an error."""
    parser = argparse.ArgumentParser(prog="python -m meshes.tetrahedra", description="The rig with unlike meshes.")
    parser.add_argument("--damper", choices=DAMPERS, default="wedge")
    parser.add_argument("--edge", type=float, default=4e-3, help="m, edges of the tetrahedra")
    parser.add_argument("--size", type=float, default=0.5, help="cells of the damper relative to the default mesh")
    parser.add_argument("--out", default=".", help="folder for the three files")
    given = parser.parse_args(arguments)
    try:
        paths = generate(Rig.named("asymmetric"), given.damper, given.edge, given.size, given.out)
    except (InputError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for path in paths.values():
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
