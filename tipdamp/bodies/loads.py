"""Loads of a study: the pull, the further load cases ([loads.NAME]), and the blades at speed
([rotation])."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tipdamp.bodies import DAMPER
from tipdamp.bodies.balance import Balance, DamperHold
from tipdamp.hbm.errors import InputError, nearest
from tipdamp.hbm.model import ReducedModel
from tipdamp.modal.body import Body
from tipdamp.modal.mesh import Mesh
from tipdamp.static_contact.bodies.sparse_bodies import SparseBodies
from tipdamp.study.view import Study

PULL = "pull"


class PointLoad(NamedTuple):
    """Forces (d,) N on the free dofs of the damper for a pull of 1 N, and where they act along the
    axis, m."""

    force: np.ndarray
    along_axis: list[float]


class RestLoad(NamedTuple):
    """Under which the damper vibrates: case - a load case, '' for the pull alone; pull - N, of the
    case or Fc."""

    case: str
    pull: float

    @property
    def name(self) -> str:
        """What it is called."""
        return f"the load case '{self.case}'" if self.case else "the pull"

    @property
    def cases(self) -> tuple[str, ...]:
        """Of the study that it takes."""
        return (self.case,) if self.case else ()

    def on(self, body: Body) -> np.ndarray:
        """(d,) N on the free dofs of a body with its loads."""
        force = body.loads[self.case] if self.case else np.zeros(body.dofs)
        return force + self.pull * body.loads[PULL] if body.name == DAMPER else force


@dataclass(frozen=True)
class Loads:
    """Of a study on the dofs of a model, (r,) N each, with their pull.

    at_rest - the load under which the damper vibrates; rest - which it is
    balance - of the damper under it; direction : (3,) - of the pull
    cases - {name: load}; history - (name, load) of those that are passed through, and at last it
    """

    at_rest: np.ndarray
    rest: RestLoad
    balance: Balance
    direction: np.ndarray
    cases: dict[str, np.ndarray]
    history: list[tuple[str, np.ndarray]]


def rest_load(study: Study) -> RestLoad:
    """The pull, or the case that [preload] names."""
    return RestLoad(study.preload.case, case_pull(study, study.preload.case))


def damper_hold(study: Study) -> DamperHold:
    """What the study holds of the damper."""
    return DamperHold("model" if "model" in study else DAMPER, study.driver.hold)


def pull_vector(study: Study) -> np.ndarray:
    """(3,) N: Fc."""
    return study.driver.pull * np.array(study.driver.pull_direction)


def unit_pull(study: Study, body: Body, mesh: Mesh) -> PointLoad:
    """The pull of 1 N on the damper's load points or positions."""
    from tipdamp.modal.loads import nodal_load

    nodes, forces = pulled(study, mesh)
    along = mesh.position[mesh.index(nodes)] @ np.array(study.damper.axis)
    return PointLoad(nodal_load(body, nodes, forces), sorted(along.tolist()))


def pulled(study: Study, mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the damper's mesh on which a pull of 1 N acts, and its forces (k, 3) N there."""
    from tipdamp.static_contact.contact.pull import pull_forces

    damper = study.damper
    return pull_forces(
        mesh,
        damper.load_points,
        damper.axis,
        damper.pull_direction,
        weights=damper.shares,
        positions=damper.positions,
    )


def case_pull(study: Study, case: str) -> float:
    """N: the pull of a load case, its own or Fc; case '' is the pull alone."""
    stated = study.loads[case].pull if case else None
    return study.driver.pull if stated is None else stated


def rotation(study: Study, speed: float) -> Any:
    """Rotation about the axis of [rotation] at a speed in rad/s."""
    from tipdamp.modal.loads import Rotation

    if "rotation" not in study:
        raise InputError(
            f"{study.path}: section [rotation] is missing: a load case with speed needs its axis"
        )
    return Rotation(speed, study.rotation.axis, study.rotation.point)


def at_speed(study: Study, blades: Body, mesh: Mesh, material: Any, others: dict) -> Body:
    """The blades with stress stiffening and spin softening where [rotation] speed asks for it."""
    speed = study.rotation.speed if "rotation" in study else 0.0
    if not speed:
        return blades
    from tipdamp.modal.stiffening import rotating_body

    return rotating_body(blades, mesh, material, rotation(study, speed), others)


def case_forces(study: Study, case: str, body: Body, mesh: Mesh) -> np.ndarray:
    """Forces (d,) N of a case on one body, without the pull."""
    from tipdamp.modal import loads

    given = study.loads[case]
    force = loads.gravity(body, given.gravity)
    if given.speed:
        force = force + loads.centrifugal(body, rotation(study, given.speed))
    for key, rows, function in (
        ("forces", given.forces, lambda g, v: loads.point_force(body, g, v)),
        ("pressure", given.pressure, lambda g, v: loads.pressure(body, mesh, g, v[0])),
        ("traction", given.traction, lambda g, v: loads.traction(body, mesh, g, v)),
    ):
        for name, group, *value in rows:
            if name == body.name:
                try:
                    force = force + function(group, value)
                except InputError as error:
                    raise InputError(f"{study.path}: [loads.{case}] {key}: {error}") from None
    return force


def with_loads(
    study: Study,
    bodies: Sequence[Body],
    meshes: Mapping[str, Mesh],
    cases: Iterable[str] | None = None,
) -> list[Body]:
    """The bodies with their part of the load cases, of all without `cases`, and of the pull of 1 N
    as `loads`, (d,) N on their free dofs."""
    wanted = list(study.loads if cases is None else cases)
    found = []
    for body in bodies:
        forces = {case: case_forces(study, case, body, meshes[body.name]) for case in wanted}
        if body.name == DAMPER:
            forces[PULL] = unit_pull(study, body, meshes[DAMPER]).force
        found.append(replace(body, loads=forces))
    return found


def check(study: Study, meshes: dict[str, Mesh]) -> None:
    """Every body and group that a load case names exists, before anything heavy is done."""
    for case, given in study.loads.items():
        if given.speed:
            rotation(study, given.speed)
        for key, rows in (
            ("forces", given.forces),
            ("pressure", given.pressure),
            ("traction", given.traction),
        ):
            for body, group, *_ in rows:
                where = f"{study.path}: [loads.{case}] {key}"
                if body not in meshes:
                    raise InputError(f"{where}: no body '{body}'; {nearest(body, list(meshes))}")
                try:
                    meshes[body].group(group)
                except InputError as error:
                    raise InputError(f"{where}: {error}") from None


def on_model(study: Study, model: ReducedModel | SparseBodies) -> Loads:
    """The loads of a study on the dofs of a model, which holds those of its bodies."""
    cases = {name: _with_pull(study, name, model) for name in study.loads}
    rest = rest_load(study)
    at_rest = cases[rest.case] if rest.case else rest.pull * model.loads[PULL]
    force = resultant(model, at_rest) if rest.case else pull_vector(study)
    return Loads(
        at_rest,
        rest,
        Balance(force, damper_hold(study)),
        np.array(study.driver.pull_direction),
        cases,
        [*((name, cases[name]) for name in study.preload.history), (rest.name, at_rest)],
    )


def _with_pull(study: Study, case: str, model: ReducedModel | SparseBodies) -> np.ndarray:
    """(r,) N: a load case on the dofs of a model with its pull."""
    own = model.loads.get(case)
    if own is None and study.loads[case].pull is None:
        raise InputError(
            f"[loads.{case}]: the model holds no load named '{case}', and no pull is "
            f"stated; {nearest(case, [name for name in model.loads if name != PULL])}"
        )
    own = np.zeros(model.size) if own is None else own
    return own + case_pull(study, case) * model.loads[PULL]


def resultant(model: ReducedModel | SparseBodies, load: np.ndarray) -> np.ndarray:
    """(3,) N: resultant on the damper of a load (r,) N."""
    return np.array([load[(model.body == DAMPER) & (model.direction == d)].sum() for d in "xyz"])
