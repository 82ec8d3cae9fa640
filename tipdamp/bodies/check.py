"""The reduced model against the unreduced one: stuck frequencies of both, and the bound that the reduction gives."""

import numpy as np

from hbm.contact import ContactTable
from hbm.model import ReducedModel
from modal.truncation import Truncation
from static_contact.full.stuck_modes import full_stuck_hz
from static_contact.reduction_error import stuck_error_bound
from static_contact.roll_springs import RollSpring, spring_rows
from tipdamp.bodies.assemble import assemble_bodies
from tipdamp.bodies.read import read_meshes
from tipdamp.progress import Tick
from tipdamp.stages.results import FullModelCheck
from tipdamp.study.view import Study

StuckSet = tuple[ContactTable, list[RollSpring], np.ndarray]


def full_model_check(study: Study, model: ReducedModel, truncation: Truncation, sets: dict[str, StuckSet],
                     tick: Tick) -> dict[str, FullModelCheck]:
    """{set: figures} of the stuck frequencies of the reduced model against those of the full one.

    sets {name: (pairs, roll springs, reduced Hz (m,))}: as many modes of the full model as there are reduced ones
    """
    bodies = assemble_bodies(study, read_meshes(study), lambda *_: None)
    found = {}
    for i, (name, (pairs, springs, reduced)) in enumerate(sets.items()):
        tick(0.8 + 0.2 * i / len(sets), f"full model, {name}")
        full = full_stuck_hz(bodies, pairs, len(reduced), springs)
        bound = stuck_error_bound(model, truncation, pairs, reduced, extra=spring_rows(model, pairs, springs))
        found[name] = FullModelCheck(reduced_hz=tuple(reduced), full_hz=tuple(full), error_bound=tuple(bound),
                                     largest_error=float(np.abs(reduced / full - 1).max(initial=0.0)))
    return found
