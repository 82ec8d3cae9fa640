"""Run under mpirun: python full_route.py STUDY OUT - the preload of a study by Newton on the full model, to OUT.npz."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np  # noqa: E402

from static_contact.newton import full_preload  # noqa: E402
from static_contact.pull import pull_forces  # noqa: E402
from tipdamp import bodies  # noqa: E402
from tipdamp.study import load_study  # noqa: E402


def solve(path, gap=None):
    study = load_study(path)
    meshes = bodies.read_meshes(study)
    pairs = bodies.with_values(study, bodies.matched_pairs(study, meshes), {})
    pairs = pairs if gap is None else pairs.replace(gap=gap(pairs))
    both = bodies.assemble_bodies(study, meshes, lambda *_: None)
    damper, d = both[1], study["damper"]
    nodes, forces = pull_forces(meshes["damper"], d["load_points"], d["axis"], d["pull_direction"])
    nodal = np.zeros((len(damper.node), 3))
    nodal[meshes["damper"].index(nodes)] = d["pull"] * forces
    return full_preload(both, pairs, {"damper": nodal[damper.dof_node, damper.dof_direction]})


def crown(pairs):
    """60 um in the middle of both sides, which opens pairs there."""
    return 60e-6 * (1 - (2 * pairs.position[:, 1] / 0.07 - 1) ** 2)


if __name__ == "__main__":
    found = solve(sys.argv[1], crown)
    from mpi4py import MPI

    if MPI.COMM_WORLD.rank == 0:
        np.savez(sys.argv[2], preload=found.pairs.preload, iterations=found.iterations, ranks=MPI.COMM_WORLD.size)
