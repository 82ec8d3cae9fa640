"""Meshes of the two-blade rig with an asymmetric, cylindrical or wedge damper.

    python -m tipdamp.meshes.two_blade_rig --damper asymmetric --size 1.0 --out FOLDER [--rows 2]
    [--height 0.0735 ...]

writes FOLDER/<damper>_blades.msh and FOLDER/<damper>_damper.msh: MSH 4.1, metres, 27-node
hexahedra, matching nodes at the contacts. Groups, geometry and the origin of the lengths:
meshes/README.md.
"""

import argparse
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from tipdamp.hbm.errors import InputError
from tipdamp.meshes import mesh_file
from tipdamp.meshes.checks import MeshError, check
from tipdamp.meshes.rig import DAMPERS, RIGS, SIDES, STATIONS, Cells, Contact, Rig, contact
from tipdamp.meshes.sections import blades_section, damper_section
from tipdamp.meshes.structured import HexMesh, boundary, extrude, find_nodes, select

__all__ = ["Rig", "build", "check", "generate"]
ON_SURFACE = 1e-9  # m


def build(
    rig: Rig, damper: str, size: float = 1.0, rows: int = 2, cells: Cells | None = None
) -> tuple[HexMesh, HexMesh]:
    """The two bodies as `HexMesh` records (blades, damper), unchecked; `cells` overrides what
    `size` implies."""
    cells = cells or Cells.of_size(size)
    if cells.axial % 15:
        raise InputError(
            f"axial = {cells.axial} cells: must be a multiple of 15, for a node at each of 31 "
            "stations"
        )
    found = contact(rig, damper, rows)
    y = np.arange(2 * cells.axial + 1) * (rig.length / (2 * cells.axial))
    return (
        _blades(rig, found, *extrude(*blades_section(rig, found, cells, rows), y)),
        _damper(rig, found, *extrude(*damper_section(rig, found, cells, rows), y)),
    )


def generate(
    rig: Rig,
    damper: str,
    size: float = 1.0,
    folder: str | Path = ".",
    rows: int = 2,
    prefix: str = "",
) -> dict[str, Path]:
    """Builds both bodies, writes and reads them back, checks what was read -> {'blades': path,
    'damper': path}; leaves no files of meshes that are refused.

    prefix : of the names of the files, in place of the damper's
    """
    blades, solid = build(rig, damper, size, rows)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = {m.name: folder / f"{prefix or damper}_{m.name}.msh" for m in (blades, solid)}
    for mesh in (blades, solid):
        mesh_file.write(paths[mesh.name], mesh)
    try:
        check(rig, damper, rows, *(mesh_file.read(p) for p in paths.values()))
    except MeshError:
        for path in paths.values():  # nobody is to compute with them
            path.unlink()
        raise
    return paths


def contact_points(rig: Rig, points: np.ndarray) -> np.ndarray:
    """The (x, z) points (R, 2) of a side's rows at all stations -> (R * 31, 3), row by row."""
    y = np.tile(np.linspace(0.0, rig.length, STATIONS), len(points))
    x, z = np.repeat(points, STATIONS, axis=0).T
    return np.column_stack([x, y, z])


def _blades(rig: Rig, found: Contact, nodes: np.ndarray, cells: np.ndarray) -> HexMesh:
    x, _, z = nodes.T
    outside = boundary(cells)
    bottom = np.abs(z + rig.fixture_height) < ON_SURFACE
    surfaces = {"clamp": select(outside, bottom & (np.abs(x) > rig.free_span / 2 - ON_SURFACE))}
    sets = {}
    for side in SIDES:
        face = np.abs(x - found.face_x(side, z)) < ON_SURFACE
        above = z > rig.height - rig.cover_height - ON_SURFACE
        surfaces[f"cover_{side}"] = select(
            outside, face & above & (z < found.turn[side] + ON_SURFACE)
        )
        sets[f"contact_{side}"] = find_nodes(nodes, contact_points(rig, found.rows[side]))
    sets |= {name: find_nodes(nodes, at) for name, at in blade_node_sets(rig).items()}
    return HexMesh("blades", nodes, cells, surfaces, sets)


def blade_node_sets(rig: Rig) -> dict[str, np.ndarray]:
    """{group: (k, 3) m} of the excited node and of the patches."""
    # The outer edge of blade 1's tip at mid-length: most of the first bending, none of the torsion,
    # and the free side, where a stinger reaches it.
    tip = np.array([[-(rig.pitch + rig.tip_thickness) / 2, rig.length / 2, rig.height]])
    return {"excitation": tip, "patch_1": _patch(rig, -1.0), "patch_2": _patch(rig, 1.0)}


def _patch(rig: Rig, sign: float) -> np.ndarray:
    """Four corners in turn and the centre of the accelerometer's patch, on the outer side right
    below the cover."""
    upper, half = rig.height - rig.cover_height, rig.patch_half_length
    lower = upper - rig.patch_height
    z = np.array([lower, lower, upper, upper, (lower + upper) / 2])
    y = rig.length / 2 + np.array([-half, half, half, -half, 0.0])
    return np.column_stack([sign * (rig.pitch + rig.thickness(z)) / 2, y, z])


def _damper(rig: Rig, found: Contact, nodes: np.ndarray, cells: np.ndarray) -> HexMesh:
    outside = boundary(cells)
    arm = nodes[:, [0, 2]] - found.centre
    surfaces, sets = {}, {}
    for side in SIDES:
        n = found.normal[side]
        height, along = arm @ n, np.abs(arm @ [-n[1], n[0]])
        if found.shape[side] == "flat":
            inside = np.abs(height - rig.flat_distance) < ON_SURFACE
        else:  # the part of the cylinder that a flat would cut off
            inside = (np.abs(np.hypot(*arm.T) - rig.damper_radius) < ON_SURFACE) & (height > 0)
            inside &= along < rig.flat_width / 2 + ON_SURFACE
        surfaces[f"side_{side}"] = select(outside, inside)
        sets[f"contact_{side}"] = find_nodes(nodes, contact_points(rig, found.rows[side]))
    y = np.arange(4) * rig.length / 3
    axis = np.column_stack([np.full(4, found.centre[0]), y, np.full(4, found.centre[1])])
    sets["load_points"] = find_nodes(nodes, axis)
    return HexMesh("damper", nodes, cells, surfaces, sets)


def main(arguments: list[str] | None = None) -> int | None:
    """Command line: write the meshes; 2 after an error."""
    parser = argparse.ArgumentParser(
        prog="python -m tipdamp.meshes.two_blade_rig", description="Meshes of the two-blade rig."
    )
    parser.add_argument("--damper", choices=DAMPERS, default="asymmetric")
    parser.add_argument(
        "--size",
        type=float,
        default=1.0,
        help="cells along each edge, relative to the default mesh",
    )
    parser.add_argument("--rows", type=int, default=2, help="lines of contact pairs on a flat side")
    parser.add_argument("--out", default=".", help="folder for the two files")
    parser.add_argument(
        "--rig",
        choices=RIGS,
        default=RIGS[0],
        help="lengths of meshes/rig_<name>.toml; those of the "
        "twin are written as twin_blades.msh and twin_damper.msh",
    )
    for f in fields(Rig):
        parser.add_argument(f"--{f.name.replace('_', '-')}", type=float, metavar=f"{f.default:.6g}")
    given = parser.parse_args(arguments)
    try:
        own = {f.name: vars(given)[f.name] for f in fields(Rig) if vars(given)[f.name] is not None}
        rig = replace(Rig.named(given.rig), **own)
        prefix = "" if given.rig == RIGS[0] else given.rig
        paths = generate(rig, given.damper, given.size, given.out, given.rows, prefix)
    except (InputError, MeshError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    for path in paths.values():
        print(f"{path}: {3 * len(mesh_file.read(path).nodes)} dofs")
    return 0


if __name__ == "__main__":
    sys.exit(main())
