"""Reduced matrices from anywhere, in the place of meshes: read and checked against the pairs."""

import warnings
from dataclasses import dataclass

import numpy as np

from tipdamp.bodies import BLADES, DAMPER
from tipdamp.bodies.loads import PULL
from tipdamp.bodies.pair import own_pairs
from tipdamp.bodies.table_checks import check_against_model
from tipdamp.hbm.contact import ContactTable, relative_motion
from tipdamp.hbm.errors import InputError
from tipdamp.hbm.io.dof_table import DIRECTIONS
from tipdamp.hbm.model import ReducedModel
from tipdamp.results.static_results import ReductionFacts
from tipdamp.study.view import Study


@dataclass(frozen=True)
class MatrixLimits:
    """Of given stiffness matrices."""

    # of the stiffness of single dofs: what the digits of K leave of a free motion
    rounding: float = 1e-9
    grounded: float = 1e-4  # of the contacts' stiffness: less changes no preload that is written
    indefinite: float = 1e-9  # of the stiffness of a dof with all others fixed


LIMITS = MatrixLimits()


def given_model(study: Study) -> tuple[ReducedModel, ContactTable]:
    """The model and pairs that [model] and [contact] name, checked against each other."""
    matrices = study.file(study.model.matrices)
    try:
        with warnings.catch_warnings():
            # of a K that is indefinite: `check_stiffness` refuses it
            warnings.simplefilter("ignore")
            model = ReducedModel.load(matrices)
    except InputError:
        raise
    except ValueError as error:  # numpy reads no pickled objects
        raise InputError(f"{study.path}: [model] matrices = '{matrices}': {error}") from None
    pairs = own_pairs(study)
    for name in (BLADES, DAMPER):
        if name not in model.body:
            raise InputError(
                f"{study.path}: the dof table of [model] matrices has no body named '{name}'"
            )
    relative_motion(model, pairs)
    check_against_model(study, model, pairs)
    for name in (BLADES, DAMPER):
        check_stiffness(
            f"{study.path}: [model] matrices", model.part(name), name, free=name == DAMPER
        )
    if PULL not in model.loads:
        raise InputError(
            f"{study.path}: [model] matrices hold no load named 'pull' (1 N on the damper)"
        )
    return model, pairs


def size_of(model: ReducedModel) -> ReductionFacts:
    """Numbers of dofs and modes of given matrices."""
    modes = {
        b: int(((model.body == b) & (model.direction == "mode")).sum()) for b in (BLADES, DAMPER)
    }
    return ReductionFacts(dofs=model.size, masters=model.size - sum(modes.values()), modes=modes)


def ground_warnings(model: ReducedModel, pairs: ContactTable) -> list[str]:
    """Where the damper's own K resists that it moves as a whole: it carries a part of the pull
    beside the contacts."""
    damper = model.part(DAMPER)
    ways = np.array([damper.direction == axis for axis in DIRECTIONS], dtype=float)
    own = np.einsum("ai,ij,aj->a", ways, damper.K, ways)
    rounding = LIMITS.rounding * np.abs(damper.K.diagonal()) @ ways.T
    axes = pairs.frame**2  # (P, 3, 3) of t1, t2, n along x, y, z
    contacts = np.einsum(
        "p,pca,pc->a", pairs.weight, axes, np.column_stack([pairs.kt, pairs.kt, pairs.kn])
    )
    found = [
        f"{axis} ({k:.3g} N/m, {k / (k + c):.1e} of what contacts and springs resist it with)"
        for axis, k, c, least in zip(DIRECTIONS, own, contacts, rounding, strict=True)
        if k > max(least, LIMITS.grounded * c)
    ]
    if not found:
        return []
    return [
        f"the damper's own K resists that it moves as a whole along {', '.join(found)}: springs "
        "to ground in its matrices carry what the contacts should; what holds the damper beside "
        "them belongs to [model] hold"
    ]


def check_stiffness(where: str, model: ReducedModel, name: str, free: bool) -> None:
    """No motion of a body meets negative stiffness; the blades are supported; the damper may be
    free."""
    diagonal = model.K.diagonal()
    scale = np.sqrt(np.where(diagonal > 0, diagonal, np.abs(model.K).max() or 1.0))
    lam, shape = np.linalg.eigh(model.K / np.outer(scale, scale))
    dof = int(np.abs(shape[:, 0]).argmax())
    at = f"dof {dof} of the {name} (node {model.node[dof]}, {model.direction[dof]})"
    if lam[0] < -LIMITS.indefinite:
        raise InputError(
            f"{where}: K is indefinite: a motion mostly of {at} has negative stiffness "
            f"({lam[0]:.1e} of its diagonal)"
        )
    floating = int((lam < LIMITS.indefinite * np.sqrt(len(lam))).sum())
    if floating and not free:
        raise InputError(
            f"{where}: {floating} motions of the {name} meet no stiffness, one mostly of {at}: "
            "only the damper may be free"
        )
