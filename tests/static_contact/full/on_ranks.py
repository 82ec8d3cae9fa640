"""Run under mpirun: python on_ranks.py STUDY OUT - preload and stuck modes of a study on the full
model."""

import sys
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

import numpy as np  # noqa: E402

from tipdamp.bodies import stiffness  # noqa: E402
from tipdamp.bodies.assemble import assemble_bodies  # noqa: E402
from tipdamp.bodies.pair import matched  # noqa: E402
from tipdamp.bodies.read import read_meshes  # noqa: E402
from tipdamp.modal.elasticity import Material  # noqa: E402
from tipdamp.static_contact.contact.pull import pull_forces  # noqa: E402
from tipdamp.static_contact.full.newton import full_preload  # noqa: E402
from tipdamp.static_contact.full.ranks import Part, distributed_bodies  # noqa: E402
from tipdamp.static_contact.full.stuck_modes import full_stuck_hz  # noqa: E402
from tipdamp.study.study import load_study  # noqa: E402


@cache
def rig(path, assembled=True):
    """Bodies (None where they are not to be assembled here), meshes, pairs and study of the
    two-blade rig."""
    study = load_study(path)
    meshes = read_meshes(study)
    pairs = stiffness.with_values(study, matched(study, meshes).pairs, {})
    return (
        assemble_bodies(study, meshes, lambda *_: None) if assembled else None,
        meshes,
        pairs,
        study,
    )


def parts(meshes, study):
    """What the bodies are made of."""
    m = study.material
    steel = Material(m.E, m.nu, m.density)
    return [
        Part(meshes["blades"], steel, "blades", clamp=study.blades.clamp),
        Part(meshes["damper"], steel, "damper", free=True),
    ]


def shares(meshes, study, extra=0):
    """The same bodies with the rows of this rank only."""
    from mpi4py import MPI

    return distributed_bodies(parts(meshes, study), MPI.COMM_WORLD, extra)


def stuck_hz(path, together=False):
    """Eight stuck modes of the whole patch on the full model."""
    both, meshes, pairs, study = rig(path, assembled=not together)
    return full_stuck_hz(both or shares(meshes, study), pairs, 8, together=together)


def solve(path, gap, hard=False, together=False):
    """Preload of the rig with a gap (of pairs), on its springs or with every other pair hard."""
    both, meshes, pairs, study = rig(path, assembled=not together)
    pairs = pairs.replace(gap=gap(pairs))
    if hard:
        pairs = with_hard_pairs(pairs)
    both = both or shares(meshes, study, int(np.isinf(pairs.kn).sum()))
    damper, d = both[1], study.damper
    nodes, forces = pull_forces(meshes["damper"], d.load_points, d.axis, d.pull_direction)
    nodal = np.zeros((len(damper.node), 3))
    nodal[meshes["damper"].index(nodes)] = d.pull * forces
    return full_preload(both, pairs, {"damper": nodal[damper.dof_node, damper.dof_direction]})


def with_hard_pairs(pairs):
    """Every other pair without a spring."""
    return pairs.replace(kn=np.where(np.arange(len(pairs)) % 2, np.inf, pairs.kn))


def crown(pairs):
    """60 um in the middle of both sides, which opens pairs there."""
    return 60e-6 * (1 - (2 * pairs.position[:, 1] / 0.07 - 1) ** 2)


if __name__ == "__main__":
    found = solve(sys.argv[1], crown, together=True)
    hard = solve(sys.argv[1], crown, hard=True, together=True)
    hz = stuck_hz(sys.argv[1], together=True)
    from mpi4py import MPI

    if MPI.COMM_WORLD.rank == 0:
        np.savez(
            sys.argv[2],
            preload=found.pairs.preload,
            iterations=found.iterations,
            hz=hz,
            hard=hard.pairs.preload,
            ranks=MPI.COMM_WORLD.size,
        )
