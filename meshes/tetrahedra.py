"""The two-blade rig as a mesher leaves it: unstructured tetrahedra in the blades, hexahedra in the
damper, and contact faces that do not match. Same geometry as meshes/two_blade_rig.py, whose section
is extruded.

    python -m tipdamp.meshes.tetrahedra --damper wedge --edge 0.004 --out FOLDER

writes FOLDER/tet_blades.msh and FOLDER/tet_damper.msh, and both bodies as FOLDER/tet_rig.inp
(Abaqus), metres."""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tipdamp.hbm.errors import InputError
from tipdamp.meshes import abaqus_writer, mesh_file
from tipdamp.meshes.rig import DAMPERS, SIDES, STATIONS, Cells, Contact, Rig, contact
from tipdamp.meshes.sections import blades_section
from tipdamp.meshes.structured import HexMesh, find_nodes
from tipdamp.meshes.two_blade_rig import ON_SURFACE, blade_node_sets, build, contact_points

CORNER = 3.0  # degrees; the blades' curved sides turn by less from place to place


def blades(rig: Rig, found: Contact, edge: float, contact_edge: float, axial: int = 0) -> HexMesh:
    """The blades in tetrahedra with edges of about `edge` m, and `contact_edge` m on the covers'
    faces; groups as in two_blade_rig, contact nodes with `axial` alone: so many cells of the
    damper, which end in `found.rows` across its flats, have their nodes in the covers too."""
    # places on its curved sides
    points, quads = blades_section(rig, found, replace(Cells.of_size(0.5), height=8), 2)
    loop = _polygon(rig, found, points[outline(quads)], bool(axial))
    named = np.concatenate(list(blade_node_sets(rig).values()))[:, [0, 2]]
    clamp = np.array([[-1, 1], [1, 1]]) * [rig.free_span / 2, -rig.fixture_height]  # its edges
    sharp = np.flatnonzero(
        _sharp(loop) | _at(np.vstack([named, clamp, *found.rows.values()]), loop)
    )
    corners = loop[sharp]
    on_face = np.logical_or.reduce([_on_face(rig, found, side, *corners.T) for side in SIDES])
    # a node at each station
    pieces = (STATIONS // 2) * _at(named, corners)
    if axial:
        pieces[_at(np.vstack(list(found.rows.values())), corners)] = axial
    ruled = _on_flat(found, (corners + np.roll(corners, -1, axis=0)) / 2) & bool(axial)
    nodes, cells, faces = mesh_file.extruded_tetrahedra(
        loop, sharp, rig.length, np.where(on_face, contact_edge, edge), pieces, ruled
    )
    places = blade_node_sets(rig)
    for side in SIDES if axial else ():
        places[f"contact_{side}"] = contact_points(rig, found.rows[side])
    return HexMesh(
        "blades",
        nodes,
        cells,
        {name: faces[its] for name, its in _surfaces(rig, found, nodes[faces])},
        {name: find_nodes(nodes, at) for name, at in places.items()},
    )


def _at(known: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(m,) bool: which places (m, 2) are among the known ones (n, 2)."""
    return cKDTree(known).query(places)[0] < ON_SURFACE


def _polygon(rig: Rig, found: Contact, loop: np.ndarray, matching: bool) -> np.ndarray:
    """The loop with one straight side from the lower to the upper end of each contact face; where
    the meshes match, the rows of the damper's flats are corners of it."""
    for side in SIDES:
        rows, z = found.rows[side], loop[:, 1]
        between = (z > rig.height - rig.cover_height + ON_SURFACE) & (
            z < found.turn[side] - ON_SURFACE
        )
        loop = loop[~(_on_face(rig, found, side, *loop.T) & between)]
        if matching:
            top = int(np.linalg.norm(loop - rows[-1], axis=1).argmin())
            upward = _on_face(rig, found, side, *loop[top - 1])
            loop = np.insert(
                loop, top if upward else top + 1, rows[:-1] if upward else rows[-2::-1], axis=0
            )
    return loop


def _sharp(loop: np.ndarray) -> np.ndarray:
    """(n,) bool: where the border of a section turns by more than the places along a curve do."""
    before, after = loop - np.roll(loop, 1, axis=0), np.roll(loop, -1, axis=0) - loop
    turn = np.arctan2(
        before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)
    )
    return np.abs(turn) > np.radians(CORNER)


def _on_face(
    rig: Rig, found: Contact, side: str, x: float | np.ndarray, z: float | np.ndarray
) -> np.ndarray:
    """Which places lie on the cover's face towards the damper."""
    above = (z > rig.height - rig.cover_height - ON_SURFACE) & (z < found.turn[side] + ON_SURFACE)
    return (np.abs(x - found.face_x(side, z)) < ON_SURFACE) & above


def _on_flat(found: Contact, places: np.ndarray) -> np.ndarray:
    """(m,) bool: which places (m, 2) lie where one of the damper's flats does."""
    ends = [found.rows[side][[0, -1]] for side in SIDES]
    return np.logical_or.reduce(
        [
            np.linalg.norm(places - low, axis=1) + np.linalg.norm(places - high, axis=1)
            < np.linalg.norm(high - low) + ON_SURFACE
            for low, high in ends
        ]
    )


def _surfaces(rig: Rig, found: Contact, place: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """(name, (f,) bool) of the triangles with nodes at place (f, 6, 3)."""
    x, _, z = np.moveaxis(place, 2, 0)
    bottom = np.abs(z + rig.fixture_height) < ON_SURFACE
    yield "clamp", (bottom & (np.abs(x) > rig.free_span / 2 - ON_SURFACE)).all(axis=1)
    for side in SIDES:
        yield f"cover_{side}", _on_face(rig, found, side, x, z).all(axis=1)


def outline(quads: np.ndarray) -> np.ndarray:
    """Nodes of the border of 9-node quadrilaterals (m, 3, 3), in turn, middles included."""
    edges = np.concatenate([quads[:, 0], quads[:, -1], quads[:, :, 0], quads[:, :, -1]])
    _, first, count = np.unique(
        np.sort(edges[:, [0, 2]], axis=1), axis=0, return_index=True, return_counts=True
    )
    border = edges[first[count == 1]]
    ways: dict[int, list[tuple[int, int]]] = {}
    for a, middle, b in border.tolist():
        ways.setdefault(a, []).append((middle, b))
        ways.setdefault(b, []).append((middle, a))
    loop: list[int] = []
    at = int(border[0, 0])
    while len(loop) < 2 * len(border):
        middle, following = next(way for way in ways[at] if way[0] not in loop[-1:])
        loop += [at, middle]
        at = following
    return np.array(loop)


def generate(
    rig: Rig,
    damper: str,
    folder: str | Path,
    *,
    edge: float = 6e-3,
    contact_edge: float = 1.5e-3,
    cells: tuple[int, int] = (30, 2),
    matching: bool = False,
) -> dict[str, Path]:
    """Both files and the one with both bodies -> {'blades', 'damper', 'both': path}.

    edge, contact_edge - m, of the tetrahedra in the blades and on the covers' faces; cells - of the
    damper along its axis, a multiple of 15, and across a flat; matching - the covers have the
    damper's nodes on its flats
    """
    (axial, across), folder = cells, Path(folder)
    found = contact(rig, damper, across + 1)
    if matching and set(found.shape.values()) != {"flat"}:
        raise InputError(
            f"damper = '{damper}': matching nodes are those of flat sides; damper 'wedge' has two"
        )
    folder.mkdir(parents=True, exist_ok=True)
    counts = replace(Cells.of_size(0.5), axial=axial, flat=across)
    both = (
        blades(rig, found, edge, contact_edge, axial if matching else 0),
        build(rig, damper, rows=across + 1, cells=counts)[1],
    )
    paths = {mesh.name: folder / f"tet_{mesh.name}.msh" for mesh in both}
    for mesh in both:
        mesh_file.write(paths[mesh.name], mesh)
    abaqus_writer.write(folder / "tet_rig.inp", both)
    return {**paths, "both": folder / "tet_rig.inp"}


def main(arguments: list[str] | None = None) -> int | None:
    """Command line: write the meshes; 2 after an error."""
    parser = argparse.ArgumentParser(
        prog="python -m tipdamp.meshes.tetrahedra", description="The rig with unlike meshes."
    )
    parser.add_argument("--damper", choices=DAMPERS, default="wedge")
    parser.add_argument("--edge", type=float, default=6e-3, help="m, edges of the tetrahedra")
    parser.add_argument(
        "--contact-edge", type=float, default=1.5e-3, help="m, those on the covers' faces"
    )
    parser.add_argument(
        "--axial", type=int, default=30, help="cells of the damper along its axis, a multiple of 15"
    )
    parser.add_argument("--across", type=int, default=2, help="cells of the damper across a flat")
    parser.add_argument(
        "--matching", action="store_true", help="the covers have the damper's nodes on its flats"
    )
    parser.add_argument("--out", default=".", help="folder for the three files")
    given = vars(parser.parse_args(arguments))
    try:
        cells = given.pop("axial"), given.pop("across")
        paths = generate(
            Rig.named("asymmetric"), given.pop("damper"), given.pop("out"), cells=cells, **given
        )
    except (InputError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for path in paths.values():
        print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
