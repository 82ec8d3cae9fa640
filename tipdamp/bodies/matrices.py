"""Reduced matrices from anywhere, in the place of meshes: read and checked against the pairs."""

import numpy as np

from hbm.contact import ContactTable, relative_motion
from hbm.errors import InputError
from hbm.model import ReducedModel
from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.pair import own_pairs
from tipdamp.loads import PULL
from tipdamp.stages.results import Reduction
from tipdamp.study.view import Study

_INDEFINITE = 1e-9      # of the stiffness of a dof with all others fixed


def given_model(study: Study) -> tuple[ReducedModel, ContactTable]:
    """The model and pairs that [model] and [contact] name, checked against each other."""
    matrices = study.file(study.model.matrices)
    try:
        model = ReducedModel.load(matrices)
    except InputError:
        raise
    except ValueError as error:          # numpy reads no pickled objects
        raise InputError(f"{study.path}: [model] matrices = '{matrices}': {error}") from None
    pairs = own_pairs(study)
    for name in (BLADES, DAMPER):
        if name not in model.body:
            raise InputError(f"{study.path}: the dof table of [model] matrices has no body named '{name}'")
    relative_motion(model, pairs)
    for name in (BLADES, DAMPER):
        check_stiffness(f"{study.path}: [model] matrices", model.part(name), name, free=name == DAMPER)
    if PULL not in model.loads:
        raise InputError(f"{study.path}: [model] matrices hold no load named 'pull' (1 N on the damper)")
    return model, pairs


def size_of(model: ReducedModel) -> Reduction:
    """Numbers of dofs and modes of given matrices."""
    modes = {b: int(((model.body == b) & (model.direction == "mode")).sum()) for b in (BLADES, DAMPER)}
    return Reduction(dofs=model.size, masters=model.size - sum(modes.values()), modes=modes)


def check_stiffness(where: str, model: ReducedModel, name: str, free: bool) -> None:
    """No motion of a body meets negative stiffness; the blades are supported; the damper may be free."""
    diagonal = model.K.diagonal()
    scale = np.sqrt(np.where(diagonal > 0, diagonal, np.abs(model.K).max() or 1.0))
    lam, shape = np.linalg.eigh(model.K / np.outer(scale, scale))
    dof = int(np.abs(shape[:, 0]).argmax())
    at = f"dof {dof} of the {name} (node {model.node[dof]}, {model.direction[dof]})"
    if lam[0] < -_INDEFINITE:
        raise InputError(f"{where}: K is indefinite: a motion mostly of {at} has negative stiffness ({lam[0]:.1e} of "
                         "its diagonal)")
    floating = int((lam < _INDEFINITE * np.sqrt(len(lam))).sum())
    if floating and not free:
        raise InputError(f"{where}: {floating} motions of the {name} meet no stiffness, one mostly of {at}: only the "
                         "damper may be free")
