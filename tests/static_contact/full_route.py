"""Run under mpirun: python full_route.py STUDY OUT - preload and stuck modes of a study on the full model."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np  # noqa: E402

from static_contact.full import full_stuck_hz  # noqa: E402
from static_contact.newton import full_preload  # noqa: E402
from static_contact.pull import pull_forces  # noqa: E402
from tipdamp import bodies  # noqa: E402
from tipdamp.study import load_study  # noqa: E402


def rig(path):
    """Bodies, meshes, pairs and study of the two-blade rig."""
    study = load_study(path)
    meshes = bodies.read_meshes(study)
    pairs = bodies.with_values(study, bodies.matched_pairs(study, meshes), {})
    return bodies.assemble_bodies(study, meshes, lambda *_: None), meshes, pairs, study


def stuck_hz(path, together=False):
    """Eight stuck modes of the whole patch on the full model."""
    both, _, pairs, _ = rig(path)
    return full_stuck_hz(both, pairs, 8, together=together)


def solve(path, gap):
    both, meshes, pairs, study = rig(path)
    pairs = pairs.replace(gap=gap(pairs))
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
    hz = stuck_hz(sys.argv[1], together=True)
    from mpi4py import MPI

    if MPI.COMM_WORLD.rank == 0:
        np.savez(sys.argv[2], preload=found.pairs.preload, iterations=found.iterations, hz=hz,
                 ranks=MPI.COMM_WORLD.size)
