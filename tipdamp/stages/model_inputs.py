"""Inputs of the reduced model from the study: contact line, roll springs, force, outputs, damping, statics."""

import numpy as np

from hbm.contact import ContactTable
from hbm.errors import InputError, nearest
from hbm.model import ReducedModel
from static_contact.detachment import conserve_total
from static_contact.equilibrium import side_forces, side_normals
from static_contact.preload import Preload, StaticContact
from static_contact.roll_springs import RollSpring, roll_springs
from tipdamp.bodies import BLADES
from tipdamp.loads import force_at_rest
from tipdamp.study.view import Study


def equilibrium(study: Study, model: ReducedModel, pairs: ContactTable) -> dict[str, float]:
    """{side: N} that balance the load at rest without friction."""
    return side_forces(side_normals(pairs), force_at_rest(study, model))


def line_of(study: Study, pairs: ContactTable) -> ContactTable:
    """The line model: rows that the study does not keep get weight 0."""
    edge = [name for name, side in study.sides.items() if side.rows == "edge"]
    detached = np.isin(pairs.side, edge) & (pairs.row > 0)
    line = pairs.replace(weight=np.where(detached, 0.0, pairs.weight))
    return conserve_total(line, pairs) if conserves(study) else line


def conserves(study: Study) -> bool:
    """Whether the pairs that stay take over the stiffness of their whole side."""
    return study.tune.stiffness == "conserved"


def declared_springs(study: Study, pairs: ContactTable) -> list[RollSpring]:
    """Roll springs of the flat sides of which one row stands for several."""
    springs = []
    for name, side in study.sides.items():
        mine = pairs.select(pairs.side == name)
        one_row = len(np.unique(mine.row[mine.carrying])) == 1
        if side.shape != "cylinder" and side.rows == "edge" and one_row and side.roll_stiffness != 0:
            given = None if side.roll_stiffness == "from_flat" else side.roll_stiffness
            springs += roll_springs(pairs, name, side.width or 0.0, given)
    return springs


def group(model: ReducedModel, study: Study, name: str) -> np.ndarray:
    """Nodes of a group of the blades that the study names."""
    key = f"{BLADES}/{name}"
    if key not in model.groups:
        names = [k.split("/", 1)[1] for k in model.groups if k.startswith(f"{BLADES}/")]
        raise InputError(f"{study.path}: the blades have no group '{name}'; {nearest(name, names)}")
    return model.groups[key]


def excitation(study: Study, model: ReducedModel) -> np.ndarray:
    """(r,) force of 1 N, shared equally by the nodes of the excitation group."""
    nodes = group(model, study, study.respond.excitation)
    rows = [model.displacement_row(BLADES, n, study.respond.direction) for n in nodes]
    return np.mean(rows, axis=0)


def outputs(study: Study, model: ReducedModel) -> dict[str, np.ndarray]:
    """{"patch:node": (r,) row} displacement along the direction of the force."""
    return {f"{patch}:{n}": model.displacement_row(BLADES, n, study.respond.direction)
            for patch in study.respond.patches for n in group(model, study, patch)}


def ratio(values: tuple[float, ...]) -> float | np.ndarray:
    """One damping ratio for all modes, or one per mode."""
    return values[0] if len(values) == 1 else np.array(values)


def balance_error(pairs: ContactTable, load: np.ndarray) -> float:
    """|pull - sum N n| / |pull|."""
    return float(np.linalg.norm(load - np.maximum(pairs.preload, 0) @ pairs.normal) / np.linalg.norm(load))


def side_sums(pairs: ContactTable) -> dict[str, float]:
    """{side: N} of the closed pairs."""
    return {s: float(np.maximum(pairs.preload, 0)[pairs.side == s].sum()) for s in pairs.sides}


def static_contact(study: Study, model: ReducedModel, pairs: ContactTable) -> StaticContact:
    """On the springs kn, or with hard contact where the study says so."""
    hard = study.contact.normal == "hard"
    return StaticContact(model, pairs.replace(kn=np.full(len(pairs), np.inf)) if hard else pairs)


def preload_map(result: Preload, pairs: ContactTable) -> ContactTable:
    """The table with its own springs again: hard pairs that are open stand open by -preload / kn as well."""
    return pairs.replace(preload=np.where(result.force > 0, result.force, np.where(
        np.isinf(result.pairs.kn), -pairs.kn * pairs.weight * result.opening, result.pairs.preload)))
