"""Load cases of a study ([loads.NAME]) as forces on the reduced dofs, and the blades at speed ([rotation])."""

import numpy as np

from hbm.errors import InputError, nearest

PULL = "pull"


def rotation(study, speed):
    """Rotation about the axis of [rotation] at a speed in rad/s."""
    from modal.loads import Rotation

    if "rotation" not in study:
        raise InputError(f"{study.path}: section [rotation] is missing: a load case with speed needs its axis")
    return Rotation(speed, study["rotation"]["axis"], study["rotation"]["point"])


def at_speed(study, blades, mesh, material, others):
    """The blades with stress stiffening and spin softening where [rotation] speed asks for it."""
    speed = study["rotation"]["speed"] if "rotation" in study else 0.0
    if not speed:
        return blades
    from modal.stiffening import rotating_body

    return rotating_body(blades, mesh, material, rotation(study, speed), others)


def case_forces(study, case: str, body, mesh) -> np.ndarray:
    """Forces (d,) N of a case on one body, without the pull."""
    from modal import loads

    given = study.loads[case]
    force = loads.gravity(body, given["gravity"])
    if given["speed"]:
        force = force + loads.centrifugal(body, rotation(study, given["speed"]))
    on_group = {"forces": lambda g, v: loads.point_force(body, g, v),
                "pressure": lambda g, v: loads.pressure(body, mesh, g, v[0]),
                "traction": lambda g, v: loads.traction(body, mesh, g, v)}
    for key, function in on_group.items():
        for name, group, *value in given[key]:
            if name == body.name:
                try:
                    force = force + function(group, value)
                except InputError as error:
                    raise InputError(f"{study.path}: [loads.{case}] {key}: {error}") from None
    return force


def check(study, meshes):
    """Every body and group that a load case names exists, before anything heavy is done."""
    for case, given in study.loads.items():
        if given["speed"]:
            rotation(study, given["speed"])
        for key in ("forces", "pressure", "traction"):
            for body, group, *_ in given[key]:
                where = f"{study.path}: [loads.{case}] {key}"
                if body not in meshes:
                    raise InputError(f"{where}: no body '{body}'; {nearest(body, list(meshes))}")
                try:
                    meshes[body].group(group)
                except InputError as error:
                    raise InputError(f"{where}: {error}") from None


def total(study, case: str, model, pull: float) -> np.ndarray:
    """(r,) N: the case on the reduced dofs with its pull, or the study's own."""
    given = study.loads[case]
    own = model.loads.get(case)
    if own is None and given["pull"] is None:
        raise InputError(f"{study.path}: [loads.{case}]: the model holds no load named '{case}', and no pull is "
                         f"stated; {nearest(case, [name for name in model.loads if name != PULL])}")
    own = np.zeros(model.size) if own is None else own
    return own + (pull if given["pull"] is None else given["pull"]) * model.loads[PULL]


def at_rest(study, model) -> np.ndarray:
    """(r,) N: the load under which the damper vibrates: the pull, or the case that [preload] names."""
    case, pull = study["preload"]["case"], study.driver["pull"]
    return total(study, case, model, pull) if case else pull * model.loads[PULL]


def rest_name(study) -> str:
    """What it is called."""
    return f"the load case '{study['preload']['case']}'" if study["preload"]["case"] else "the pull"
