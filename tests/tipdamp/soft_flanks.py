"""A whole study whose damper slides far until it rests: a pin under a pull between two slender
plates, at 45 degrees to it, with faces that do not match."""

from dataclasses import replace

import numpy as np

from tests.modal.blocks import block
from tests.static_contact.test_round_sides import LENGTH, RADIUS, shell
from tests.tipdamp import mesh_texts
from tipdamp.modal.mesh import Mesh

PULL, ARM, THICK = (
    40.0,
    0.03,
    3e-3,
)  # N; m, of the plates from the clamp to the pin, and their depth
TEXT = """[material]
E = 200e9
nu = 0.3
density = 7850
[material.pin]
group = "pin"
E = 200e9
nu = 0.3
density = 7850
[blades]
mesh = "plates.inp"
clamp = "clamp"
modes = 5
[damper]
mesh = "pin.inp"
modes = 3
axis = [0, 0, 1]
pull = {pull}
pull_direction = [0, 1, 0]
load_points = "load"
[contact]
mu = 0.3
[contact.right]
blade = "right"
damper = "outer"
shape = "cylinder"
radius = 4e-3
kn_per_area = 2e12
kt_per_area = 2e12
[contact.left]
blade = "left"
damper = "outer"
shape = "cylinder"
radius = 4e-3
kn_per_area = 2e12
kt_per_area = 2e12
[preload]
[tune]
stations = "all"
preload = "resolved"
[respond]
excitation = "tip"
direction = [1, 0, 0]
patches = ["tip", "other tip"]
"""


def pin(across):
    """Half a pin of so many faces from 20 to 160 degrees, pulled through its axis."""
    mesh = shell("hexahedron", (across, 1, 2), 0.4 * RADIUS, RADIUS, (20, 160))
    inside = np.linalg.norm(mesh.position[:, :2], axis=1) < 0.5 * RADIUS
    below = mesh.node[inside & (np.abs(mesh.position[:, 0]) < 1e-6)]
    return replace(mesh, groups={"outer": mesh.groups["outer"], "load": below}, cell_groups={})


def plates():
    """Both, as one mesh: each touches the pin ARM above its clamped end."""
    reach = 2.5e-3  # m beyond the pin
    flat = block("hexahedron20", (10, 1, 2), size=(ARM + reach, THICK, LENGTH))
    t, n, z = flat.position.T
    t, n = t - ARM, n + RADIUS
    parts, groups = [], {}
    for k, (name, sign) in enumerate({"right": 1.0, "left": -1.0}.items()):
        # n out of the pin, t up the flank; a mirrored part is turned around
        z_own = z if sign > 0 else LENGTH - z
        x, y = sign * (n - t) / np.sqrt(2), (n + t) / np.sqrt(2)
        start = 10_000 * (k + 1)
        parts.append((start + np.arange(len(t)), np.column_stack([x, y, z_own])))
        at = {
            name: n < RADIUS + 1e-9,
            f"clamp {name}": t < -ARM + 1e-9,
            "other tip" if k else "tip": (t > reach - 1e-9)
            & (n > RADIUS + THICK - 1e-9)
            & (np.abs(z_own - LENGTH / 2) < 1e-9),
        }
        groups |= {key: start + np.flatnonzero(there) for key, there in at.items()}
    groups["clamp"] = np.concatenate([groups.pop("clamp right"), groups.pop("clamp left")])
    (kind,) = flat.cells
    count = len(flat.cells[kind])
    return Mesh(
        np.concatenate([node for node, _ in parts]),
        np.vstack([place for _, place in parts]),
        {kind: np.vstack([flat.cells[kind], flat.cells[kind] + len(t)])},
        groups,
        number={kind: 1 + np.arange(2 * count)},
    )


def write(folder, across=70, pull=PULL, more="", E=200e9):
    """Study and meshes; more - lines of [preload]; E - of the plates. Returns the study's path."""
    (folder / "plates.inp").write_text(mesh_texts.plain(plates()))
    mesh = pin(across)
    (kind,) = mesh.cells
    mesh = replace(mesh, cell_groups={"pin": mesh.number[kind]})
    (folder / "pin.inp").write_text(mesh_texts.plain(mesh))
    text = TEXT.format(pull=pull).replace("[preload]\n", f"[preload]\n{more}\n")
    path = folder / "soft.toml"
    path.write_text(text.replace("E = 200e9", f"E = {E:g}", 1), encoding="utf-8")
    return path
