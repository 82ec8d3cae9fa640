"""Assembly, reduction and preload of two blade blocks and a pin beside the floor of their cost, in
one run.

    python -m tests.benchmarks.cost_floor [--size 1.0]

The floor: per body one factorisation of K_II, one LDL' at the shift above the top mode, the
back-solves of all master dofs at once, and the modes. The way there also assembles, checks and
makes the bound of the reduction error, one more back-solve a master dof. The numbers go to
build/benchmarks/cost_floor.json.
"""

import argparse
import os
import resource
import time

import numpy as np

from tests.benchmarks.calculix_modes import block
from tests.benchmarks.growth import timed
from tests.benchmarks.record import one_thread, record
from tipdamp.hbm.contact import ContactTable
from tipdamp.modal import craig_bampton as reduction
from tipdamp.modal.craig_bampton import assemble, craig_bampton
from tipdamp.modal.eigen import Factor
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.solvers.inertia import modes_below
from tipdamp.modal.solvers.slepc import lowest_with
from tipdamp.static_contact.contact.preload import StaticContact

STEEL = Material(E=207e9, nu=0.3, density=7850.0)
STATIONS = 31
LENGTH = 0.070
PIN = 0.008
MODES = 20
PULL = 113.0
# outward normals of the pin's upper faces, turned from z about y
TURN = {"left": np.pi / 4, "right": -np.pi / 4}


def body_meshes(size):
    """{name: Mesh}: a square pin standing on its edge, its axis along y, and a block on each of its
    upper faces."""
    across = max(2, round(8 * size) // 2 * 2)
    pin = _box(
        (across, 2 * (STATIONS - 1), across),
        (PIN, LENGTH, PIN),
        (-PIN / 2, 0, -PIN / 2),
        TURN["left"],
    )
    meshes = {"damper": pin}
    n = max(2, round(14 * size) // 2 * 2)
    for name, angle in TURN.items():
        meshes[name] = _box(
            (n, 2 * (STATIONS - 1), n),
            (0.030, LENGTH, 0.050),
            (-0.015, 0, PIN / 2),
            angle,
            clamp_top=True,
        )
    return meshes


def _box(cells, edges, corner, angle, clamp_top=False):
    mesh = block(cells)
    x = mesh.position / mesh.position.max(axis=0) * edges + corner
    turn = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )
    top = mesh.node[np.abs(x[:, 2] - x[:, 2].max()) < 1e-9]
    return Mesh(
        mesh.node, x @ turn.T, mesh.cells, {"clamp": top} if clamp_top else {}, source="box"
    )


def contact_line(mesh, side):
    """Nodes of the middle line of the face at PIN/2 from the axis on this side, along y, and its
    outward normal."""
    angle = TURN[side]
    normal = np.array([-np.sin(angle), 0, np.cos(angle)])
    across = np.array([np.cos(angle), 0, np.sin(angle)])
    on = (np.abs(mesh.position @ normal - PIN / 2) < 1e-9) & (np.abs(mesh.position @ across) < 1e-9)
    index = np.flatnonzero(on)
    index = index[np.argsort(mesh.position[index, 1])][::2]
    return mesh.node[index], mesh.position[index], normal


def pairs_of(meshes) -> ContactTable:
    lines = [
        (side, contact_line(meshes[side], side)[0], *contact_line(meshes["damper"], side))
        for side in TURN
    ]
    P = 2 * STATIONS
    t1 = np.array([0.0, 1.0, 0.0])
    frame = [np.stack([t1, np.cross(n, t1), n]) for _, _, _, _, n in lines for _ in range(STATIONS)]
    return ContactTable(
        side=np.repeat(list(TURN), STATIONS),
        station=np.tile(np.arange(STATIONS), 2),
        row=np.zeros(P),
        blade_body=np.repeat(list(TURN), STATIONS),
        blade_node=np.concatenate([line[1] for line in lines]),
        damper_body=["damper"] * P,
        damper_node=np.concatenate([line[2] for line in lines]),
        position=np.vstack([line[3] for line in lines]),
        frame=np.array(frame),
        gap=np.zeros(P),
        kn=np.full(P, 3e6),
        kt=np.full(P, 2.5e6),
        mu=np.full(P, 0.5),
        preload=np.zeros(P),
        weight=np.ones(P),
    )


def whole_way(meshes, pairs):
    """CPU seconds of assembly, of each reduction and of the preload; dofs; the bodies and masters
    for the floor."""
    clock = [time.process_time()]
    bodies = [
        elastic_body(
            mesh, STEEL, name, clamp=None if name == "damper" else "clamp", free=name == "damper"
        )
        for name, mesh in meshes.items()
    ]
    clock.append(time.process_time())
    masters = {"damper": pairs.damper_node}
    for side in TURN:  # and a node for the response, at a lower corner
        masters[side] = np.append(pairs.blade_node[pairs.side == side], meshes[side].node[0])
    parts = [craig_bampton(body, masters[body.name], MODES) for body in bodies]
    clock.append(time.process_time())
    pin, mesh = parts[0], meshes["damper"]
    ends = mesh.node[np.abs(mesh.position[:, [0, 2]]).max(axis=1) < 1e-9][[0, -1]]
    parts[0].model.loads["pull"] = pin.condense(ends, np.tile([0, 0, PULL / 2], (2, 1)))
    model = assemble(*(p.model for p in parts))
    result = StaticContact(model, pairs).solve(model.loads["pull"])
    clock.append(time.process_time())
    left = np.maximum(result.pairs.preload[pairs.side == "left"], 0).sum()
    assert abs(left / (PULL / 2 / np.cos(np.pi / 4)) - 1) < 1e-6
    return np.diff(clock), bodies, parts


def floor(bodies, parts):
    """CPU seconds of factorisations, LDL', back-solves, modes, with nothing else on the clock."""
    spent = np.zeros(4)
    for body, part in zip(bodies, parts, strict=True):
        K = body.K[part.interior][:, part.interior].tocsr()
        M = body.M[part.interior][:, part.interior].tocsr()
        right = np.asfortranarray(body.K[part.interior][:, part.boundary].toarray())
        clock = [time.process_time()]
        factor = Factor(K)
        clock.append(time.process_time())
        modes_below(K, M, part.truncation.omega[0] * 0.999)
        clock.append(time.process_time())
        for first in range(0, right.shape[1], 128):
            factor._solver.solve(right[:, first : first + 128])
        clock.append(time.process_time())
        lowest_with(factor._solver, M, MODES, MODES)
        clock.append(time.process_time())
        spent += np.diff(clock)
    return spent


def run(size):
    whole_way(*(lambda m: (m, pairs_of(m)))(body_meshes(0.3)))  # forms compiled, libraries loaded
    meshes = body_meshes(size)
    bound = {}
    timed(reduction, "_left_out", bound)
    seconds, bodies, parts = whole_way(meshes, pairs_of(meshes))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    least = floor(bodies, parts)
    way = dict(zip(("assembly", "reduction", "preload"), seconds, strict=True))
    return {
        "dofs": sum(b.dofs for b in bodies),
        "master_dofs": sum(len(p.boundary) for p in parts),
        "modes": len(parts) * MODES,
        "way": way,
        "of which bound": bound["_left_out"],
        "floor": dict(zip(("factors", "LDL'", "back-solves", "modes"), least, strict=True)),
        "ratio": seconds.sum() / least.sum(),
        "ratio_without_bound": (seconds.sum() - bound["_left_out"]) / least.sum(),
        "peak_GiB": peak,
    }


def main():
    one_thread()
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--size", type=float, default=1.0)
    found = {"load": os.getloadavg()[0], **run(parser.parse_args().size)}
    record("cost_floor", found)
    for key, value in found.items():
        print(
            key,
            ", ".join(f"{k} {t:.2f}" for k, t in value.items())
            if isinstance(value, dict)
            else value,
        )


if __name__ == "__main__":
    main()
