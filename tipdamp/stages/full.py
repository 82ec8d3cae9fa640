"""Stage full, by `tipdamp preload --full`: the preload by Newton on the unreduced bodies, alone or
over ranks.

Process 0 runs the stage; the others `share` its work and write nothing.
"""

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from tipdamp.bodies import BLADES, DAMPER, loads
from tipdamp.bodies.assemble import assemble_bodies, materials
from tipdamp.bodies.read import BODY_FILES, BODY_READS, read_meshes
from tipdamp.bodies.surfaces import surface_points
from tipdamp.engine import ranks
from tipdamp.engine.progress import Tick
from tipdamp.engine.store import Store
from tipdamp.hbm.contact import ContactTable
from tipdamp.hbm.errors import InputError
from tipdamp.modal.body import Body
from tipdamp.modal.mesh import Mesh
from tipdamp.results.static_results import FullResult, FullSide, PreloadResult
from tipdamp.stages.stage import Stage
from tipdamp.static_contact.full.newton import FullPreload, full_preload
from tipdamp.static_contact.full.ranks import Part, distributed_bodies, own_rows
from tipdamp.study.view import Study


def full(study: Study, store: Store, tick: Tick) -> list[str]:
    """The preload of the whole patch at rest on the full model, beside preload.csv."""
    if study.preload.friction:
        raise InputError(
            "[preload] friction = true: the full model is solved without friction; leave it out"
        )
    given = ContactTable.load(store.path("preload.csv"))
    gap = PreloadResult.load(store).gap_at_rest_m
    at_rest = given.replace(gap=gap) if len(gap) else given
    comm = ranks.world()
    comm.bcast(at_rest)
    with ranks.together():
        found, dofs = _solved(study, at_rest, comm, tick)
    with store.writing("preload_full.csv") as path:
        found.pairs.replace(kn=given.kn, gap=given.gap).save(path)
    force = np.maximum(given.preload, 0.0)
    FullResult(
        of=store.outputs("preload")["preload.csv"],
        ranks=comm.size,
        dofs=dofs,
        iterations=found.iterations,
        residual=found.residual,
        difference=np.abs(found.force - force).max() / force.max(),
        reactions=found.reactions,
        sides={s: _side(given.side == s, found.force, force) for s in given.sides},
    ).save(store)
    return []


def _side(mine: np.ndarray, force: np.ndarray, condensed: np.ndarray) -> FullSide:
    """Of the pairs `mine` (P,) bool, the forces of the full model and the condensed ones (P,) N."""
    return FullSide(
        sum_N=force[mine].sum(),
        condensed_N=condensed[mine].sum(),
        open=int((force[mine] <= 0).sum()),
        largest_difference_N=np.abs(force - condensed)[mine].max(),
    )


def share(study: Study) -> None:
    """Of every process but the first: its part of the work whenever the first has come to it, until
    it releases them. Errors that come to all are raised by the first."""
    with ranks.together():
        comm = ranks.world()
        while (pairs := comm.bcast(None)) is not None:
            with suppress(InputError, RuntimeError):
                _solved(study, pairs, comm, lambda *_: None)


def release() -> None:
    """Of the first process: the others may end."""
    if ranks.count() > 1:
        ranks.world().bcast(None)


def _solved(study: Study, pairs: ContactTable, comm: Any, tick: Tick) -> tuple[FullPreload, int]:
    """The solution, the same on every rank, and the dofs of the full model."""
    if study.contact.normal == "hard":
        pairs = pairs.replace(kn=np.full(len(pairs), np.inf))
    meshes = read_meshes(study)
    extra = int(np.isinf(pairs.kn[pairs.carrying]).sum())
    bodies = (
        assemble_bodies(study, meshes, tick)
        if comm.size == 1
        else _distributed(study, meshes, comm, extra)
    )
    rest = loads.rest_load(study)
    forces = [rest.on(body) for body in loads.with_loads(study, bodies, meshes, rest.cases)]
    dofs = sum(body.dofs for body in bodies)
    low, high = own_rows(comm, dofs + extra)
    f = np.zeros(dofs)  # inertia forces are whole in the rank's own rows alone
    f[low:high] = np.concatenate(forces)[low:high]
    f = comm.allreduce(f)
    tick(0.3, f"Newton on {dofs} dofs" + f", {comm.size} ranks" * (comm.size > 1))
    return full_preload(
        bodies, pairs, {BLADES: f[: bodies[0].dofs], DAMPER: f[bodies[0].dofs :]}
    ), dofs


def _distributed(study: Study, meshes: dict[str, Mesh], comm: Any, extra: int) -> list[Body]:
    """The bodies with the rows of this rank."""
    if "rotation" in study and study.rotation.speed:
        raise InputError(
            "[rotation] speed: the stress stiffening is made in one process: run it without mpirun"
        )
    parts = []
    for name, mesh in meshes.items():
        material, others = materials(study, mesh)
        clamp = study.blades.clamp if name == BLADES else ()
        parts.append(
            Part(mesh, material, name, clamp=clamp, free=name == DAMPER, other_materials=others)
        )
    bodies = distributed_bodies(parts, comm, extra)
    met = surface_points(study, meshes)
    return (
        bodies
        if met is None
        else [replace(body, points=met.points[body.name].on(body)) for body in bodies]
    )


def line(store: Store) -> str:
    """Sums of the sides and the largest difference."""
    found = FullResult.load(store)
    sides = "; ".join(f"{side}: {s.sum_N:.2f} N, {s.open} open" for side, s in found.sides.items())
    where = f" on {found.ranks} ranks" if found.ranks > 1 else ""
    return (
        f"{found.dofs} dofs{where}, {found.iterations} Newton steps: {sides}; off preload.csv by "
        f"{found.difference:.1e} of the largest force"
    )


STAGE = Stage(
    full,
    line,
    outputs=("full.json", "preload_full.csv"),
    needs=("preload",),
    reads=("loads", "preload", "driver.pull", "contact.normal", *BODY_READS),
    reads_files=BODY_FILES,
)
