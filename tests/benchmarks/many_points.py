"""Static contact of two plates with thousands of points: set-up and further load cases, in CPU
time.

    python -m tests.benchmarks.many_points [--cells 22] [--depth 8] [--friction dense | iterative]

A free plate lies on a clamped one, (cells + 1)^2 points between them with random gaps, and is
pressed down by single forces. The set-up (factors, compliance at the points) is compared with the
two Cholesky factors in the same run; a further case changes the forces, so that some points open
and close: the contact forces alone, and with the displacement of the bodies, beside one solution
with the two factors alone. With --friction the plate is pressed, then pushed along two ways, in ten
increments each. A small case before it compiles what is compiled. Numbers go to
build/benchmarks/many_points.json.
"""

import argparse
import resource
import time

import numpy as np

from tests.benchmarks.calculix_modes import block
from tests.benchmarks.record import one_thread, record
from tests.contact_tables import contact_table, frames
from tipdamp.modal.elasticity import Material, elastic_body
from tipdamp.modal.mesh import Mesh
from tipdamp.modal.solvers import petsc
from tipdamp.modal.solvers.cholesky import sparse_factor
from tipdamp.static_contact.bodies.iterative_bodies import IterativeBodies
from tipdamp.static_contact.bodies.sparse_bodies import (
    SparseBodies,
    SparseCompliance,
    pinned,
    sparse_stuck_bodies,
)
from tipdamp.static_contact.contact.frictional_preload import FrictionalContact
from tipdamp.static_contact.contact.preload import StaticContact

STEEL = Material(E=207e9, nu=0.3, density=7850.0)
SIZE, GAP, PULL = 0.07, 2e-7, 200.0  # m, m, N
ROUTES = {"dense": sparse_stuck_bodies, "iterative": IterativeBodies}
CHANGE = 0.2  # of a force, from case to case


def plates(cells: int, depth: int):
    """{name: Body} of the clamped and the free plate, and their pairs."""
    raw, made = block((cells, cells, depth)), {}
    x = raw.position / raw.position.max(axis=0) * [SIZE, SIZE, SIZE * depth / cells]
    bottom = raw.node[x[:, 2] < 1e-12]
    for name, lift in (("table", -x[:, 2].max()), ("plate", 0.0)):
        mesh = Mesh(raw.node, x + [0, 0, lift], raw.cells, {"clamp": bottom}, source="block")
        made[name] = elastic_body(
            mesh, STEEL, name, clamp="clamp" if name == "table" else None, free=name == "plate"
        )
    up = raw.node[np.abs(x[:, 2] - x[:, 2].max()) < 1e-12]
    order = (
        np.lexsort((x[up - 1, 0], x[up - 1, 1])),
        np.lexsort((x[bottom - 1, 0], x[bottom - 1, 1])),
    )
    P = len(up)
    gap = GAP * np.random.default_rng(0).uniform(0, 1, P)
    kn = 1e13 * (SIZE / cells) ** 2  # N/m of a point, 1e13 N/m3
    table = contact_table(
        frames(np.tile([0, 0, -1.0], (P, 1))),
        blade_body="table",
        damper_body="plate",
        blade_node=up[order[0]],
        damper_node=bottom[order[1]],
        gap=gap,
        kn=kn,
        position=x[bottom[order[1]] - 1],
    )
    return made, table


def loads(bodies: SparseBodies, count: int):
    """Load cases: forces on five nodes of the upper face of the plate, some of which grow and some
    of which fall."""
    on = np.flatnonzero(
        (bodies.body == "plate")
        & (bodies.direction == "z")
        & (bodies.position[:, 2] > bodies.position[:, 2].max() - 1e-12)
    )
    share = np.random.default_rng(1).uniform(0.5, 1.5, 5)
    places = np.random.default_rng(2).choice(on, 5, replace=False)
    for i in range(count):
        f = np.zeros(bodies.size)
        f[places] = -PULL / 5 * share * (1 + CHANGE * i * np.array([1, -1, 0.5, -0.5, 0]))
        yield f


def timed(work):
    start = time.process_time()
    return work(), time.process_time() - start


def peak() -> float:
    """GiB"""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def friction(bodies: SparseBodies, table, route: str) -> dict:
    """A history of 20 increments in which pairs slip and open."""
    table = table.replace(mu=np.full(len(table), 0.3), kt=0.8 * table.kn)
    press = next(loads(bodies, 1))
    nodes = np.isin(bodies.node, bodies.node[press != 0]) & (bodies.body == "plate")
    push = sum(
        share * PULL * (one := nodes & (bodies.direction == d)) / one.sum()
        for d, share in (("x", 0.2), ("y", 0.1))
    )
    contact, setup = timed(lambda: FrictionalContact(bodies, table, stuck=ROUTES[route]))
    states, history = timed(lambda: contact.solve([press, press + push], steps=10))
    return {
        "points": len(table),
        "dofs": bodies.size,
        "route": route,
        "set-up s": setup,
        "history s": history,
        "increments": len(states),
        "Newton steps": sum(one.iterations for one in states),
        "slip": int(states[-1].slips.sum()),
        "open": int((states[-1].force <= 0).sum()),
        "converged": states[-1].converged,
        "largest residual": max(one.residual for one in states),
    }


def warm_up(route: str | None) -> None:
    """Kernels are compiled or loaded outside of what is timed."""
    made, table = plates(2, 2)
    bodies = SparseBodies.of(list(made.values()))
    if route:
        friction(bodies, table, route)
        return
    for one in made.values():
        sparse_factor(pinned(one))
    statics = StaticContact(bodies, table, compliance=SparseCompliance)
    case = loads(bodies, 2)
    found = statics.solve(next(case))
    statics.forces(next(case), near=found)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cells", type=int, default=22)
    parser.add_argument("--depth", type=int, default=8)
    parser.add_argument("--friction", choices=ROUTES)
    args = parser.parse_args()
    one_thread()
    warm_up(args.friction)
    made, table = plates(args.cells, args.depth)
    bodies = SparseBodies.of(list(made.values()))
    if args.friction:
        record("many_points", friction(bodies, table, args.friction) | {"peak GiB": peak()})
        return
    both, factors = timed(lambda: [sparse_factor(pinned(one)) for one in made.values()])
    right = [np.ones((body.dofs, 1)) for body in made.values()]

    def solve_both():
        return [factor.solve(load) for factor, load in zip(both, right, strict=True)]

    floor = min(timed(solve_both)[1] for _ in range(3))
    both = ()
    petsc.start()  # frees the two factors, which are not part of the memory that is measured
    statics, setup = timed(lambda: StaticContact(bodies, table, compliance=SparseCompliance))
    case = loads(bodies, 5)
    found, first = timed(lambda: statics.solve(next(case)))
    again = []
    moved = []
    changed = []
    off = 0.0
    for f in case:
        other, seconds = timed(lambda f=f, found=found: statics.forces(f, near=found))
        again.append(seconds)
        whole, seconds = timed(lambda f=f, found=found: statics.solve(f, near=found))
        moved.append(seconds)
        off = max(off, np.abs(whole.force - other.force).max() / other.force.max(), whole.residual)
        changed.append(int(((other.force > 0) != (found.force > 0)).sum()))
        found = other
    record(
        "many_points",
        {
            "points": len(table),
            "dofs": bodies.size,
            "two factors s": factors,
            "solution with both s": floor,
            "set-up s": setup,
            "set-up over two factors": setup / factors,
            "first case s": first,
            "further cases s": again,
            "with the displacement s": moved,
            "points that change": changed,
            "closed": int((found.force > 0).sum()),
            "balance": found.balance,
            "largest difference or residual": off,
            "peak GiB": peak(),
        },
    )


if __name__ == "__main__":
    main()
