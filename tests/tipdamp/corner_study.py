"""The smallest whole study: a cube in the corner of two clamped cubes, pulled into it. All faces
are 3 x 3 nodes.

Blade one touches the cube's face x = A, blade two its face z = A; the pull is along x + z, the axis
is y.
"""

from dataclasses import replace

import numpy as np

from tests.modal.blocks import block
from tests.tipdamp import mesh_texts
from tipdamp.modal.mesh import Mesh

A = 0.01
TEXT = """[material]
E = 207e9
nu = 0.3
density = 7850
[blades]
mesh = "blades.inp"
clamp = ["clamp_one", "clamp_two"]
modes = 5
[damper]
mesh = "damper.inp"
modes = 3
pull = 10
pull_direction = [1, 0, 1]
load_points = "load"
[contact]
mu = 0.3
[contact.one]
blade = "touch_one"
damper = "face_x"
shape = "flat"
kn = 1e6
kt = 1e6
width = 0.01
[contact.two]
blade = "touch_two"
damper = "face_z"
shape = "flat"
kn = 1e6
kt = 1e6
width = 0.01
[respond]
excitation = "touch_one"
share_force = true
patches = ["touch_one", "touch_two"]
levels = [1]
band = [20000, 40000]
damping_ratio = 0.02
"""
TURNING = """[rotation]
axis = [0, 1, 0]
point = [-0.1, 0, -0.1]
[loads.turning]
pull = {pull}
speed = 100
"""
MATRICES = """[model]
matrices = "model.npz"
pull = 10
pull_direction = [1, 0, 1]
[contact]
pairs = "pairs.csv"
[contact.one]
shape = "flat"
width = 0.01
[contact.two]
shape = "flat"
width = 0.01
"""


def cube(kind="hexahedron", at=(0.0, 0.0, 0.0), divisions=(2, 2, 2)) -> Mesh:
    mesh = block(kind, divisions, size=(A, A, A))
    mesh = replace(mesh, position=mesh.position + np.array(at), groups={}, cell_groups={})
    return mesh


def on(mesh, axis, value):
    return mesh.node[np.abs(mesh.position[:, axis] - value) < 1e-9]


def blades(kind="hexahedron"):
    one, two = cube(kind, (A, 0, 0)), cube(kind, (0, 0, A))
    two = replace(
        two, node=two.node + one.node.max(), number={k: v + 100 for k, v in two.number.items()}
    )
    n = len(one.node)
    groups = {
        "touch_one": on(one, 0, A),
        "clamp_one": on(one, 0, 2 * A),
        "touch_two": on(two, 2, A),
        "clamp_two": on(two, 2, 2 * A),
    }
    return Mesh(
        np.concatenate([one.node, two.node]),
        np.vstack([one.position, two.position]),
        {k: np.concatenate([one.cells[k], two.cells[k] + n]) for k in one.cells},
        groups,
        number={k: np.concatenate([one.number[k], two.number[k]]) for k in one.cells},
        cell_groups={"blade two": np.concatenate(list(two.number.values()))},
    )


def with_a_third():
    """The blades with a third clamped cube far from the damper."""
    mesh, far = blades(), cube(at=(0, 0.05, 0))
    n, last = len(mesh.node), mesh.node.max()
    groups = {
        **mesh.groups,
        "clamp_two": np.concatenate([mesh.groups["clamp_two"], on(far, 1, 0.05) + last]),
    }
    [kind] = mesh.cells
    return replace(
        mesh,
        node=np.concatenate([mesh.node, far.node + last]),
        groups=groups,
        position=np.vstack([mesh.position, far.position]),
        cells={kind: np.concatenate([mesh.cells[kind], far.cells[kind] + n])},
        number={kind: np.concatenate([mesh.number[kind], far.number[kind] + 1000])},
    )


def damper(kind="hexahedron", at=(0.0, 0.0, 0.0)):
    mesh = cube(kind, at)
    groups = {
        "face_x": on(mesh, 0, A + at[0]),
        "face_z": on(mesh, 2, A + at[2]),
        "load": np.intersect1d(on(mesh, 0, at[0]), on(mesh, 2, at[2])),
    }
    return replace(mesh, groups=groups)


def unlike():
    """The cube of tetrahedra, three by two by four of them along its edges."""
    mesh = cube("tetra10", divisions=(3, 2, 4))
    groups = {
        "face_x": on(mesh, 0, A),
        "face_z": on(mesh, 2, A),
        "load": np.intersect1d(on(mesh, 0, 0.0), on(mesh, 2, 0.0)),
    }
    return replace(mesh, groups=groups)


def write(folder, blade_mesh=None, damper_mesh=None, change=()):
    """Study and meshes into a folder; change: (old, new) texts of the study. Returns the study's
    path."""
    (folder / "blades.inp").write_text(mesh_texts.plain(blade_mesh or blades()))
    (folder / "damper.inp").write_text(mesh_texts.plain(damper_mesh or damper()))
    text = TEXT
    for old, new in change:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "corner.toml"
    path.write_text(text, encoding="utf-8")
    return path
