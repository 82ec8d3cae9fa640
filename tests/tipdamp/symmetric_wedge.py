"""A wedge damper between two clamped blades, all of it symmetric about y = 0 but for the blades'
tetrahedra."""

from dataclasses import replace

import numpy as np

from tests.boxes import block
from tests.tipdamp import mesh_texts
from tipdamp.meshes.mesh_file import extruded_tetrahedra
from tipdamp.modal.mesh import Mesh

LENGTH, WIDTH, PULL = 0.02, 0.024, 400.0  # m of the damper and of the blades along y, N
# of the left blade in x, z: a plate with a head, whose slanted face from (-7, -1) to (-1, 5) mm
# meets the damper
OUTLINE = 1e-3 * np.array([(-13, -80), (-9, -80), (-9, -1), (-7, -1), (-1, 5), (-1, 9), (-13, 9)])
FACE = (3, 4)  # its corners
TEXT = """[units]
length = "m"
force = "N"
stress = "Pa"
density = "kg/m3"
[material]
E = 207e9
nu = 0.3
density = 7850
[blades]
mesh = "blades.inp"
clamp = "clamp"
modes = 15
[damper]
mesh = "damper.inp"
modes = 10
axis = [0, 1, 0]
pull = 400
pull_direction = [0, 0, 1]
load_points = "load"
[contact]
mu = 0.3
[contact.left]
blade = "face_left"
damper = "x0"
shape = "flat"
width = 5.66e-3
kn_per_area = 2e11
kt_per_area = 1.5e11
[contact.right]
blade = "face_right"
damper = "x1"
shape = "flat"
width = 5.66e-3
kn_per_area = 2e11
kt_per_area = 1.5e11
[tune]
by = "area"
target_hz = 580
[respond]
excitation = "tip_left"
share_force = true
direction = [1, 0, 0]
patches = ["tip_left", "tip_right"]
levels = [1]
band = [300, 900]
damping_ratio = 0.01
harmonics = 1
"""


def damper(along=10, across=3, shift=0.0) -> Mesh:
    """A trapezoid of hexahedra, 12 mm wide below and 4 mm above, 4 mm high; pulled along the middle
    of its lower face;
    shift : m - of its middle along y."""
    mesh = block(
        np.linspace(-1, 1, 7),
        LENGTH * (np.linspace(-0.5, 0.5, along + 1)) + shift,
        np.linspace(0, 4e-3, across + 1),
    )
    x, y, z = mesh.position.T
    load = mesh.node[(np.abs(x) < 1e-9) & (np.abs(z) < 1e-9)]
    return replace(
        mesh,
        position=np.column_stack([x * (6e-3 - z), y, z]),
        number={kind: np.arange(1, len(cells) + 1) for kind, cells in mesh.cells.items()},
        groups={**mesh.groups, "load": load},
    )


def blades(edge=8e-3, contact_edge=2.5e-3) -> Mesh:
    """Two plates with heads of tet10, the right one at half a turn to the left one about z."""
    on_face = np.isin(np.arange(len(OUTLINE)), FACE)
    place, cells, _ = extruded_tetrahedra(
        OUTLINE,
        np.arange(len(OUTLINE)),
        WIDTH,
        np.where(on_face, contact_edge, edge),
        np.zeros(len(OUTLINE), dtype=int),
        np.zeros(len(OUTLINE), dtype=bool),
    )
    left = place - [0, WIDTH / 2, 0]
    both = np.vstack([left, left * [-1, -1, 1]])
    node, (x, _, z) = np.arange(1, len(both) + 1), both.T
    face = np.abs(z - np.abs(x) * -1 - 6e-3) < 1e-8
    groups = {
        "clamp": node[np.abs(z + 0.08) < 1e-9],
        "face_left": node[face & (x < 0)],
        "face_right": node[face & (x > 0)],
    }
    for name, sign in (("tip_left", -1), ("tip_right", 1)):
        groups[name] = node[(np.abs(x - sign * 13e-3) < 1e-9) & (np.abs(z - 9e-3) < 1e-9)]
    all_cells = np.vstack([cells, cells + len(place)])
    return Mesh(
        node,
        both,
        {"tetra10": all_cells},
        groups,
        number={"tetra10": np.arange(1, len(all_cells) + 1)},
    )


def write(folder, *changes, **of_damper):
    """Study and meshes into a folder; changes (old, new) of the study. Returns its path."""
    (folder / "blades.inp").write_text(mesh_texts.plain(blades()))
    (folder / "damper.inp").write_text(mesh_texts.plain(damper(**of_damper)))
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "wedge.toml").write_text(text)
    return folder / "wedge.toml"
