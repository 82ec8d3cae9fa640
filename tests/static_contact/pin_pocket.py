"""A free pin between two blocks that touches them on some of its 31 stations
(tests/reference/pin-pocket)."""

from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.contact_tables import contact_table, frames
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.mesh import Mesh
from tipdamp.readers.dispatch import read_mesh

FILE = Path(__file__).parents[1] / "reference" / "pin-pocket" / "pinpocket.msh"
PULL, SIDE = 113.0, 113.0 / np.sqrt(2)  # N; what each side carries, whatever stations are used
RADIUS, PITCH = 4e-3, 2e-3  # m
ANGLE = {"right": np.pi / 4, "left": 3 * np.pi / 4}


@cache
def meshes():
    """{name: Mesh} of the pin and the blocks, in m."""
    whole, parts = read_mesh(FILE), {}
    for name in ("pin", "right", "left"):
        cells = whole.cells["hexahedron"][whole.members(name)["hexahedron"]]
        used = np.unique(cells)
        groups = {} if name == "pin" else {"clamp": whole.groups[f"{name}_clamp"]}
        parts[name] = Mesh(
            whole.node[used],
            whole.position[used],
            {"hexahedron": np.searchsorted(used, cells)},
            groups,
            source=FILE.name,
        )
    return parts


@cache
def bodies(turn=None, unit=1.0):
    """{name: Body}; turn : rotation vector (3,); unit : lengths of the model in a metre (1e3: mm,
    N, t)."""
    R = np.eye(3) if turn is None else Rotation.from_rotvec(turn).as_matrix()
    steel = Material(E=205e9 / unit**2, nu=0.29, density=7800.0 / unit**4)
    return {
        name: elastic_body(
            Mesh(m.node, unit * m.position @ R.T, m.cells, m.groups, source=m.source),
            steel,
            name,
            clamp=None if name == "pin" else "clamp",
            free=name == "pin",
        )
        for name, m in meshes().items()
    }


def at(mesh, x, y, station):
    """Number of the node at x, y m and the z of a station."""
    return mesh.node[np.linalg.norm(mesh.position - [x, y, PITCH * station], axis=1).argmin()]


def pulled_nodes(stations):
    """Numbers of the pin's nodes (0, -4 mm) at the z of the stations."""
    return [at(meshes()["pin"], 0.0, -RADIUS, s) for s in stations]


def nodal_pull(whole, pulled, turn=None):
    """(r,) N: half of the pull at each of two stations, on the dofs of a SparseBodies."""
    R = np.eye(3) if turn is None else Rotation.from_rotvec(turn).as_matrix()
    load = np.zeros(whole.size)
    for node in pulled_nodes(pulled):
        mine = (whole.body == "pin") & (whole.node == node)
        load[mine] += (R @ [0, PULL / 2, 0])[["xyz".index(d) for d in whole.direction[mine]]]
    return load


def pairs(stations: dict, turn=None, unit=1.0) -> ContactTable:
    """The pairs at the stations {side: numbers}; kn as the reference has it."""
    R, rows = np.eye(3) if turn is None else Rotation.from_rotvec(turn).as_matrix(), []
    for side, angle in ANGLE.items():
        n = np.array([np.cos(angle), np.sin(angle), 0.0])
        rows += [
            (
                side,
                s,
                n,
                at(meshes()[side], *(RADIUS * n[:2]), s),
                at(meshes()["pin"], *(RADIUS * n[:2]), s),
            )
            for s in stations.get(side, ())
        ]
    side, station, n, blade, damper = zip(*rows, strict=True)
    n = np.array(n)
    frame = frames(n, t1=(0.0, 0.0, 1.0)) @ R.T
    place = np.column_stack([RADIUS * n[:, :2], PITCH * np.array(station)])
    return contact_table(
        frame,
        side=np.array(side),
        station=np.array(station),
        blade_body=np.array(side),
        damper_body="pin",
        blade_node=np.array(blade),
        damper_node=np.array(damper),
        position=unit * place @ R.T,
        kn=3.32e6 / unit,
        kt=3.32e6 / unit,
        mu=0.3,
    )


def case(stations: dict, pulled=None, turn=None, unit=1.0):
    """(model, table, load): reduced onto the contact nodes alone; the pull acts on two other nodes,
    at the z of the stations `pulled` (default: the first and the last)."""
    table = pairs(stations, turn, unit)
    R = np.eye(3) if turn is None else Rotation.from_rotvec(turn).as_matrix()
    used = sorted({s for one in stations.values() for s in one})
    ends = pulled_nodes(pulled or (used[0], used[-1]))
    masters = {"pin": table.damper_node} | {
        name: table.blade_node[table.blade_body == name] for name in ANGLE
    }
    made = {
        name: craig_bampton(body, masters[name], 0, bound=False)
        for name, body in bodies(turn, unit).items()
    }
    made["pin"].model.loads["pull"] = made["pin"].condense(
        ends, np.tile(R @ [0, PULL / 2, 0], (2, 1))
    )
    model = assemble(*(one.model for one in made.values()))
    return model, table, model.loads["pull"]
